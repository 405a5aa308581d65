"""A model that is there already as the base of a diagnosis, and the changes of its parameters that are candidates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from linid.diagnosis.balance import Balance
from linid.diagnosis.base import Base
from linid.diagnosis.descent import THOROUGH
from linid.diagnosis.judge import Judge, judge_of
from linid.diagnosis.means import Means
from linid.diagnosis.report_data import Entry, ParameterChange
from linid.diagnosis.select import Selection
from linid.diagnosis.shares import LEAST_GAP, judged_rows
from linid.diagnosis.unknowns import RATIOS
from linid.errors import UsageError
from linid.identification.result import Estimate, FitResult
from linid.identification.unit_mass import comparable
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.physics.motors.registry import MOTORS
from linid.recording.recording import Recording

_HELD = ("mass", "stribeck_exponent")  # the size of all forces, and what fits hold as well
_HELD_WITHIN = 1e-6  # of its value
_LEVEL, _CURVE = "friction_level_change", "position_dependent_friction"
# Of the logarithm of the largest factor on friction: a smooth curve through eleven places is no closer to a tight place
# than a tenth of its height.
_AS_BEFORE = 0.1
_SHARES = ("coulomb_force", "force_constant")  # whose change is a share of them


def comparable_recordings(model: FitResult, recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Recordings as a given model can be asked for them; raises UsageError for those of another kind of axis, DataError
    for masses that cannot be compared."""
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
    coulomb = values["coulomb_force"]  # the slope by it is what friction does along the motion, held or not
    out.setdefault("coulomb_force", (coulomb * (1.0 - _HELD_WITHIN), coulomb * (1.0 + _HELD_WITHIN)))
    for name in RATIOS:
        if name in out:
            out[name] = _as_ratio(name, values, *out[name])
    if "force_constant" in out:  # searched as that of the field's fundamental
        low, high = (MOTORS[model.model].fundamental(x, values) for x in out["force_constant"])
        out["force_constant"] = min(low, high), max(low, high)
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


def has_a_gap(judge: Judge, found: Selection) -> bool:
    """Whether a given model leaves a gap of which shares can be told: what is named of less is its own fit's noise."""
    return judge.excess(found.base.residual, judged_rows(judge, found.best)) >= LEAST_GAP


def parameter_changes(
    since: FitResult | None, after: FitResult, recordings: Sequence[Recording]
) -> tuple[ParameterChange, ...]:
    """The parameters that are others than in a given model: what effects that act in all recordings stand for.

    since: the given model (None: there is none); after: the model with the effects found.
    """
    out = []
    for effect in map(find_effect, after.effects if since is not None else ()):
        assert since is not None
        estimates = {e.name: e for e in after.estimates if e.name in {p.name for p in effect.parameters}}
        values = {name: e.value for name, e in estimates.items()}
        if not effect.changes or not all(effect.acts_in(values, r.number) for r in recordings):
            continue
        (estimate,) = (estimates[name] for name in effect.amplitudes)
        before = next(e for e in since.estimates if e.name == effect.changes)
        # Within its interval the given value moves too: what the model has now is the sum of both.
        own = after.value(effect.changes)
        relative = effect.changes in _SHARES
        size, factor = (own, 1.0 + estimate.value) if relative else (1.0, 1.0)
        if effect.changes == "commutation_offset":  # told as a displacement
            size = after.value("electrical_wavenumber")
        value = own + size * estimate.value
        # No better known than what has changed.
        half = math.hypot(size * _half(estimate), factor * _half(before))
        low, high = value - half, value + half
        out.append(ParameterChange(effect.changes, before.unit, effect.name, before.value, value, low, high))
    return tuple(out)


def of_one_curve(
    entries: tuple[Entry, ...], changes: tuple[ParameterChange, ...]
) -> tuple[tuple[Entry, ...], tuple[ParameterChange, ...]]:
    """The budget's lines and changed parameters, with a level of friction as part of a curve over the place where some
    place has the friction that it had.

    The curve is one in the middle of the stroke: what is tight there shows as a level beside a given model.
    """
    lines = {entry.effect: entry for entry in entries}
    if _CURVE not in lines or not any(change.effect == _LEVEL for change in changes):
        return entries, changes
    level, curve = lines[_LEVEL], lines[_CURVE]
    values = {e.name: e.value for e in (*level.parameters, *curve.parameters)}
    places = [0.0, *(values[name] for name in find_effect(_CURVE).amplitudes)]
    factors = [abs(math.log((1.0 + values["friction_change"]) * max(1.0 + f, 1e-9))) for f in places]
    if min(factors) > _AS_BEFORE * max(factors):
        return entries, changes
    share, half = level.share + curve.share, 0.5 * math.hypot(level.high - level.low, curve.high - curve.low)
    larger = max(level, curve, key=lambda entry: entry.share)
    joined = replace(
        larger,
        effect=_CURVE,
        rivals=(),
        share=share,
        low=share - half,
        high=share + half,
        first_in=math.nan,
        last_in=math.nan,
        parameters=(*level.parameters, *curve.parameters),
        combinations=curve.combinations,
    )
    others = (entry for entry in entries if entry.effect not in (_LEVEL, _CURVE))
    kept = tuple(change for change in changes if change.effect != _LEVEL)
    return tuple(sorted((joined, *others), key=lambda entry: -entry.share)), kept


def _half(estimate: Estimate) -> float:
    """Half the width of an interval; 0 where there is none."""
    half = 0.5 * (estimate.high - estimate.low)
    return half if math.isfinite(half) else 0.0
