"""The base model of a diagnosis, identified by the force balance, and the judge of all models that follow."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from linid.diagnosis.balance import Balance
from linid.diagnosis.descent import SETTLING, THOROUGH
from linid.diagnosis.joint import Fitted, JointFit
from linid.diagnosis.judge import Judge, judge_of
from linid.diagnosis.masses import at_the_masses
from linid.diagnosis.means import Means
from linid.diagnosis.verdict import LEAST_EXCESS
from linid.identification.guess.first_values import first_values, mass_known
from linid.identification.guess.regression import force_guess
from linid.identification.guess.scales import typical_acceleration
from linid.identification.result import ModelKind
from linid.identification.signals.motion import measure_motion
from linid.identification.space.bounds import travel_between_reversals
from linid.identification.unit_mass import on_same_mass
from linid.physics.model import Model
from linid.physics.motors.registry import MOTORS
from linid.recording.recording import Recording

# First values of friction: breakaway over Coulomb force, Stribeck velocity as a share of the highest speed, presliding
# as a share of the travel between reversals (all tried, the best of them fitted), damping ratio of the bristle.
_BREAKAWAY, _STRIBECK, _PRESLIDING, _RATIO = (1.1, 1.6, 2.4), (1e-3, 5e-3, 2.5e-2), (1e-4, 1e-3, 1e-2), 0.3
_TRIED = 2
_SHIFTS = tuple(math.radians(side * k) for k in (15, 30, 45, 60, 75) for side in (-1, 1))  # of the field's phase
_EXPLAINED = math.log1p(LEAST_EXCESS / 2.0)  # level of a base that leaves nothing
_UNBALANCED = 0.05  # of the currents' RMS: a sum below that is noise of the sensors
_DISAGREEING = 2.0  # factor between a base and a regression beside a free force, from which on the base is biased
_FORCES = ("N", "N m", "Nm")  # units of an input that is a force
_LEAST_FRICTION = 1e-2  # of the inertial force


@dataclass(frozen=True)
class Base:
    """fitted: the model without effects; judge: of it and of all that follow; rivals: other first values of the base,
    from which fits with an effect start too; held: SI values that these recordings do not tell."""

    fitted: Fitted
    judge: Judge
    rivals: tuple[dict[str, float], ...]
    held: dict[str, float]


def numbered(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Recordings that know their number (bare files have none)."""
    if all(r.number for r in recordings):
        return tuple(recordings)
    return tuple(replace(r, number=k) for k, r in enumerate(recordings, 1))


def fit_base_model(
    recordings: Sequence[Recording], kind: ModelKind, known: dict[str, float], means: Means, assumptions: list[str]
) -> Base:
    """The base model by the force balance of the fitted recordings; what they do not tell is held in all later fits."""
    fitted = [r for r in recordings if r.split == "fit"]
    places = tuple(k for k, r in enumerate(recordings) if r.split == "fit")
    wheels = [r for r in fitted if r.kind == "free_wheel"]
    driven = [r for r in fitted if r.kind != "free_wheel"]
    model = Model(kind)
    held = dict(known)
    means.watch("base", 0, 3)
    if wheels:
        assumptions.append(f"friction starts from {len(wheels)} free wheels")
    elif kind != "friction":
        assumptions.append("no free wheels: friction comes from the driven recordings")
    if "force_constant" not in held and _input_is_force(model, fitted):
        held["force_constant"] = 1.0
        assumptions.append(f"the input is a force as it stands ({driven[0].input_unit}): the moving mass is identified")
    if not any(mass_known(fitted, held, model)):
        held["mass"] = 1.0
        assumptions.append("no recording tells the mass: all forces are per kilogram (rotary: per kg m^2)")
    starts = _starts(model, fitted, held)
    shape = MOTORS[kind].shape
    if shape and _balanced(driven):
        for name, _ in shape:
            held.setdefault(name, starts[0][name])
        assumptions.append("the phase currents sum to zero: they tell no more of the field than its first harmonic")
    balance = Balance(model, recordings, means.jobs, means.seed, means.memory)
    with balance.measured_once():
        judge = judge_of(balance, model, starts[0], held, {}, means.seed)
        means.watch("base", 1, 3)
        settled = []
        for start in starts:
            best = _lowest(judge.fits, model, _friction_rivals(start, fitted, held), places, _TRIED)
            settled += [judge.fits.fit(model, values, {}, places, SETTLING) for values in best]
        found = at_the_masses(judge.fits, min(settled, key=lambda one: one.level))
        found = _at_the_phase(judge.fits, found)
        limits = _limits(found, starts, held, assumptions)
        means.watch("base", 2, 3)
        # The noise that the inputs bring hangs on the model, and the criterion on the noise.
        judge = judge_of(balance, model, found.values, held, limits, means.seed)
    found = judge.fits.fit(model, found.values, {}, places, THOROUGH)
    means.watch("base", 3, 3)
    return Base(found, judge, tuple(starts[1:]), held)


def _input_is_force(model: Model, fitted: Sequence[Recording]) -> bool:
    return model.single and all(r.input_unit in _FORCES for r in fitted if r.kind != "free_wheel")


def on_comparable_masses(
    kind: ModelKind, recordings: Sequence[Recording], known: Mapping[str, float]
) -> tuple[Recording, ...]:
    """All recordings as the fitted ones can be compared with them: per unit of what moved in these where they tell no
    mass. known: SI values that are not identified.

    Raises DataError where something else was on the mover of a held-out one, and nobody knows what part that is.
    """
    model, fitted = Model(kind), [r for r in recordings if r.split == "fit"]
    force = {"force_constant": 1.0} if _input_is_force(model, fitted) else {}
    if not fitted or any(mass_known(fitted, {**force, **known}, model)):
        return tuple(recordings)
    return tuple(on_same_mass(r, fitted[0].added_mass) for r in recordings)


def _at_the_phase(fits: JointFit, found: Fitted) -> Fitted:
    """The base where the field's first phase is one of those that commutated currents hardly tell from it.

    While the currents keep with the field, a phase that is wrong by d and a force constant that is too large by 1/cos d
    give the same thrust: a fit may settle there, with the current across the thrust in the place of other forces.
    """
    known = {"force_constant", "commutation_offset"} & found.held.keys()
    if known or "commutation_offset" not in found.values or found.level < _EXPLAINED:
        return found
    turns = found.model.turns
    trials = [
        {
            **found.values,
            "commutation_offset": found.values["commutation_offset"] + shift / turns,
            "force_constant": found.values["force_constant"] * math.cos(shift),
        }
        for shift in _SHIFTS
    ]
    (best,) = _lowest(fits, found.model, trials, found.recordings, 1)
    other = at_the_masses(fits, fits.fit(found.model, best, {}, found.recordings, SETTLING))
    return other if other.level < found.level else found


def _lowest(
    fits: JointFit, model: Model, trials: Sequence[dict[str, float]], places: Sequence[int], count: int
) -> list[dict[str, float]]:
    """The first values with the lowest criterion before any fit to some recordings (places), the lowest first."""
    vectors = np.array([model.vector(values) for values in trials])
    residuals, rows = fits.balance.residuals(model, vectors, tuple(places)), fits.rows_of(places)
    levels = [fits.level(one, fits.floor_of(model, v), rows) for one, v in zip(residuals, vectors, strict=True)]
    return [trials[k] for k in np.argsort(levels)[:count]]


def _balanced(driven: Sequence[Recording]) -> bool:
    """Whether the phase currents sum to zero but for some per cent, so that the field's third harmonic is invisible."""
    sums = [float(np.sum(r.phase_currents.sum(axis=0) ** 2)) for r in driven if r.phase_currents is not None]
    whole = [float(np.sum(r.phase_currents**2)) for r in driven if r.phase_currents is not None]
    return sum(sums) < _UNBALANCED**2 * sum(whole)


def _starts(model: Model, fitted: Sequence[Recording], held: dict[str, float]) -> list[dict[str, float]]:
    """First values: by regression, and for an axis with one input also by one beside a free periodic force."""
    first, _ = first_values(model, fitted, held, None)
    starts = [first]
    driven = [r for r in fitted if r.kind != "free_wheel"]
    if model.single and driven:
        constant, mass = held.get("force_constant"), held.get("mass")
        starts = [{**first, **force_guess(driven, constant, mass, waves=waves)} for waves in (False, True)]
    return [_with_friction({**start, **held}, model, fitted) for start in starts]


def _limits(
    found: Fitted, starts: Sequence[dict[str, float]], held: dict[str, float], assumptions: list[str]
) -> dict[str, tuple[float, float]]:
    """Bounds of the acceleration per input where the base puts it far below a regression beside a free periodic force.

    A loop that holds the axis against what is missing makes the input look as if it pushed nowhere, in every fit that
    lacks it (closed-loop bias); a model in which it does push there again can explain what the loop did.
    """
    if len(starts) < 2 or ("force_constant" in held and "mass" in held):
        return {}
    alone, free = (values["force_constant"] / values["mass"] for values in (found.values, starts[1]))
    if alone > free / _DISAGREEING:
        return {}
    name = "mass" if "force_constant" in held else "force_constant"
    assumptions.append(
        f"a loop cancels what the base lacks: alone the base would put force constant over mass at {alone:.3g}, beside "
        f"a free periodic force it is {free:.3g}; no fit leaves {free / _DISAGREEING:.3g} to {free * _DISAGREEING:.3g}"
    )
    value = starts[1][name]
    return {name: (value / _DISAGREEING, value * _DISAGREEING)}


def _with_friction(values: dict[str, float], model: Model, fitted: Sequence[Recording]) -> dict[str, float]:
    """First values of all parameters, friction from a regression's Coulomb force."""
    mass = values.get("mass", 1.0)
    speed = float(np.quantile(np.abs(measure_motion(fitted).v), 0.99))
    coulomb = max(values.get("coulomb_force", 0.0), _LEAST_FRICTION * mass * typical_acceleration(fitted))
    out = {
        **values,
        "coulomb_force": coulomb,
        "mass": mass,
        "stribeck_exponent": 2.0,
        "viscous_friction": max(values.get("viscous_friction", 0.0), 1e-3 * coulomb / speed),
    }
    if "force_constant" in out:
        out["force_constant"] = max(out["force_constant"], 1e-9 * coulomb)
    own = {p.name for p in model.parameters}
    rivals = _friction_rivals({k: x for k, x in out.items() if k in own}, fitted, values)
    return rivals[len(rivals) // 2]


def _friction_rivals(
    values: dict[str, float], fitted: Sequence[Recording], held: dict[str, float]
) -> list[dict[str, float]]:
    """The values with breakaway, Stribeck velocity and presliding of several sizes; what is held stays."""
    speed = float(np.quantile(np.abs(measure_motion(fitted).v), 0.99))
    travel = travel_between_reversals(fitted)
    out = []
    for breakaway, stribeck, presliding in itertools.product(_BREAKAWAY, _STRIBECK, _PRESLIDING):
        stiffness = values["coulomb_force"] / (presliding * travel)
        friction = {
            "static_force": breakaway * values["coulomb_force"],
            "stribeck_velocity": stribeck * speed,
            "bristle_stiffness": stiffness,
            "bristle_damping": 2.0 * _RATIO * (stiffness * values["mass"]) ** 0.5,
        }
        out.append({**values, **friction, **{k: x for k, x in held.items() if k in friction}})
    return out
