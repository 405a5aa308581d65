"""A model that is there already as the base of a diagnosis, and the changes of its parameters that are candidates."""

from __future__ import annotations

import math
from collections.abc import Sequence

from linid.diagnosis.balance import Balance
from linid.diagnosis.base import Base
from linid.diagnosis.descent import THOROUGH
from linid.diagnosis.judge import judge_of
from linid.diagnosis.means import Means
from linid.diagnosis.unknowns import RATIOS
from linid.errors import UsageError
from linid.identification.result import Estimate, FitResult
from linid.identification.unit_mass import comparable
from linid.physics.effects.registry import canonical, find_effect
from linid.physics.model import Model
from linid.recording.recording import Recording

# Changes that no effect of the library stands for, as terms: of the force constant, as a share, and of viscous friction
FORCE_CONSTANT_CHANGE = "force_constant_change: c * F; c in [-0.9, 3]"
VISCOUS_FRICTION_CHANGE = "viscous_friction_change: -c * v"
# What stands for a change of each parameter, where it acts in all recordings: the effect's amplitude, and whether it is
# a share of the parameter.
CHANGES: dict[str, tuple[str, bool]] = {
    "coulomb_force": ("friction_change", True),
    "force_constant": ("force_constant_change_c", True),
    "viscous_friction": ("viscous_friction_change_c", False),
    "mass": ("payload_mass", False),
}
_HELD = ("mass", "stribeck_exponent")  # the size of all forces, and what fits hold as well


def own_changes(kind: str) -> tuple[str, ...]:
    """The changes of parameters that are own terms, of a model of this kind."""
    able = (FORCE_CONSTANT_CHANGE, VISCOUS_FRICTION_CHANGE)
    return canonical(text for text in able if kind in find_effect(text).kinds)


def comparable_recordings(model: FitResult, recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Recordings as a model can be asked for them; raises UsageError for those of another kind of axis, DataError for
    masses that cannot be compared."""
    for one in recordings:
        if one.axis != model.axis:
            raise UsageError(
                one.name, f"is of a {one.axis} axis, the model of a {model.axis} one", "Give recordings of one machine."
            )
    return tuple(comparable(model, one) for one in recordings)


def commissioned_base(model: FitResult, recordings: Sequence[Recording], means: Means, assumptions: list[str]) -> Base:
    """A model as a base that fits may move no further than its own intervals; what it does not tell is held.

    assumptions: gains what is taken as given.
    """
    means.watch("base", 0, 1)
    places = tuple(k for k, r in enumerate(recordings) if r.split == "fit")
    one = Model(model.model, model.effects, law=model.law)
    values = {p.name: model.value(p.name) for p in one.parameters}
    told = _told(model, values)
    held = {name: x for name, x in values.items() if name not in told}
    assumptions.append("the base is the given model: no fit moves it further than its own intervals")
    balance = Balance(one, recordings, means.jobs, means.seed, means.memory)
    judge = judge_of(balance, one, values, held, {}, means.seed, told)
    found = judge.fits.fit(one, values, {}, places, THOROUGH)
    means.watch("base", 1, 1)
    return Base(found, judge, (), held)


def _told(model: FitResult, values: dict[str, float]) -> dict[str, tuple[float, float]]:
    """The intervals of what a model tells of its base parameters, of friction's shape as the ratios that are
    searched."""
    own = {p.name for p in Model(model.model, law=model.law).parameters}
    out = {}
    for estimate in model.estimates:
        if estimate.name in own and estimate.name not in _HELD and _is_told(estimate):
            out[estimate.name] = (estimate.low, estimate.high)
    for name in RATIOS:
        if name in out:
            out[name] = _as_ratio(name, values, *out[name])
    return out


def _is_told(estimate: Estimate) -> bool:
    return estimate.status == "fitted" and math.isfinite(estimate.low) and estimate.low < estimate.high


def _as_ratio(name: str, values: dict[str, float], low: float, high: float) -> tuple[float, float]:
    """Bounds of breakaway over Coulomb force, presliding deflection in m, and damping ratio."""
    coulomb, mass, stiffness = values["coulomb_force"], values["mass"], values["bristle_stiffness"]
    if name == "static_force":
        return max(low / coulomb, 1.0), max(high / coulomb, 1.0 + 1e-9)
    if name == "bristle_stiffness":
        return coulomb / high, coulomb / max(low, 1e-3 * stiffness)
    critical = 2.0 * math.sqrt(stiffness * mass)
    return max(low / critical, 1e-4), high / critical
