"""What a simpler form takes over of a model: speeds that occur, friction curves of fewer parameters, folded effects."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from linid.errors import UsageError
from linid.export.over_place import term_over

if TYPE_CHECKING:
    from linid.arrays import Array
    from linid.export.target import Exported
    from linid.recording.recording import Recording

# Without recordings: speeds up to so many Stribeck velocities, where the curve has all its shape.
_STRIBECK_REACH = 10.0
_GRID = 400
# A speed counts as motion above this share of the largest one.
_STANDSTILL = 1e-3
_mean_friction: WeakKeyDictionary[Exported, tuple[float, float]] = WeakKeyDictionary()


def need_mass(exported: Exported, target: str) -> None:
    """Raises UsageError for a model whose forces are per kilogram: `target` needs the mass itself."""
    if exported.result.per_mass:
        what = "inertia" if exported.result.axis == "rotary" else "mass"
        raise UsageError(
            f"--to {target}",
            f"needs the moving {what}, and the model's forces are per unit of one that nobody knows",
            "Fit again with --mass, or with recordings of known added masses.",
        )


def speeds_of(exported: Exported) -> Array:
    """Speeds (n,) in m/s, all positive, as often as they occur: of the recordings, else evenly spread over those at
    which the model's friction bends.
    """
    moving = [np.abs(recording.motion.v) for recording in exported.recordings if recording.measured]
    if moving:
        v = np.concatenate(moving)
        v = v[v > _STANDSTILL * np.max(v)]
        if v.size:
            return np.asarray(v)
    values = exported.values
    top = _STRIBECK_REACH * values.get("stribeck_velocity", 0.1)
    top = max(top, 2.0 * values.get("drag_speed", 0.0), values.get("eddy_speed", 0.0))
    return np.linspace(top / _GRID, top, _GRID)


def held_values(exported: Exported) -> dict[str, float]:
    """All parameters in SI by name, those included that the friction law ties to others."""
    from linid.physics import friction

    model, vector = exported.model, exported.vector
    tied = {p.name: float(vector[k]) for k, p in enumerate(friction.PARAMETERS)}
    return tied | {p.name: float(vector[model.slot(p.name)]) for p in model.parameters}


# Effects of which simpler forms hold the mean over the recordings.
IN_MEAN = ("position_dependent_friction", "load_dependent_friction")


def left_out(exported: Exported, name: str) -> str:
    """What becomes of an effect that a form with Coulomb friction has no place for, in a sentence."""
    from linid.physics.effects.registry import find_effect

    if name in IN_MEAN and exported.recordings:
        return f"{name} is held in its mean over the recordings."
    effect = find_effect(name)
    return f"{effect.short} is left out: {effect.physics}"


def mean_friction(exported: Exported) -> tuple[float, float]:
    """Factor on friction and what is added to its level in N before, on average over the recordings: of friction along
    the way and of friction under load; 1 and 0 without recordings.
    """
    if exported not in _mean_friction:  # several forms ask
        _mean_friction[exported] = _mean_friction_of(exported)
    return _mean_friction[exported]


def _mean_friction_of(exported: Exported) -> tuple[float, float]:
    values, effects = held_values(exported), exported.model.effects
    factor, more = 1.0, 0.0
    if "position_dependent_friction" in effects:
        measured = [r.y[:: max(r.y.size // _GRID, 1)] for r in exported.recordings if r.measured]
        if measured:
            places = np.concatenate(measured)
            factor = float(np.mean(term_over("position_dependent_friction", "friction", values, places)))
    if "load_dependent_friction" in effects:
        pushes = [np.abs(thrust_along(exported, r)) for r in exported.recordings if r.kind != "free_wheel"]
        more = values["load_friction"] * float(np.mean(np.concatenate(pushes))) if pushes else 0.0
    return factor, more


def thrust_along(exported: Exported, recording: Recording) -> Array:
    """The motor's force (n,) in N along a recording, of the field's first harmonic (44) and without effects."""
    if recording.phase_currents is None or not exported.model.phases:
        given = np.zeros_like(recording.t) if recording.drive_input is None else recording.drive_input
        return thrust_per_current(exported) * given
    values = fundamental_phases(exported)
    turns = values["winding_displacement"] * np.array([[-1.0], [0.0], [1.0]])
    angles = values["electrical_wavenumber"] * recording.y + values["commutation_offset"] + turns
    return np.asarray(values["force_constant"] * np.sum(np.sin(angles) * recording.phase_currents, axis=0))


def stribeck_curve(values: dict[str, float], v: Array) -> Array:
    """Steady friction level g(v) in N at speeds v (n,) in m/s, without viscous friction (eq. 42)."""
    from linid.physics.friction import stribeck_levels

    names = ("coulomb_force", "static_force", "stribeck_velocity", "stribeck_exponent")
    return stribeck_levels(np.ravel(v), *(values[name] for name in names))


def smooth_drag(values: dict[str, float], effects: tuple[str, ...], v: Array) -> Array:
    """Braking force in N of all effects that hang on the speed alone, at speeds v (n,) >= 0 in m/s."""
    force = np.zeros_like(v)
    if "quadratic_drag" in effects:
        speed = values["drag_speed"]
        force += values["drag_coefficient"] * v * speed * (v / speed) ** (values["drag_power"] - 1.0)
    if "eddy_current_drag" in effects:
        force += values["eddy_damping"] * v / (1.0 + (v / values["eddy_speed"]) ** 2)
    return force


def polynomial_drag(values: dict[str, float], effects: tuple[str, ...], v: Array) -> tuple[float, float]:
    """Coefficients b in N s/m and c >= 0 in N s^2/m^2 of b v + c v |v|, which stands for all that hangs on the speed
    alone beside viscous friction; least squares over speeds v (n,) in m/s, exact where the drag is square.
    """
    drag = smooth_drag(values, effects, v)
    if not drag.any():
        return 0.0, 0.0
    from scipy.optimize import lsq_linear

    scale = float(np.max(v))
    least = [-values["viscous_friction"], 0.0]  # no damping may push
    found = lsq_linear(np.column_stack([v, v**2 / scale]), drag, (least, [np.inf, np.inf])).x
    return float(found[0]), float(found[1]) / scale


def coulomb_and_viscous(level: Array, v: Array) -> tuple[float, float]:
    """Coulomb force in N and viscous friction in N s/m, neither negative, nearest to a friction force `level` (n,) in N
    at speeds v (n,) > 0 in m/s, least squares over the speeds as often as they occur.
    """
    from scipy.optimize import nnls

    scale = float(np.max(v))
    (force, slope), _ = nnls(np.column_stack([np.ones_like(v), v / scale]), level)
    return float(force), float(slope) / scale


def square_stribeck(values: dict[str, float]) -> tuple[float, float]:
    """Breakaway force in N and Stribeck velocity in m/s with which exponent 2 comes nearest to the curve, from
    standstill up to where it is level.
    """
    excess, speed, exponent = (
        values["static_force"] - values["coulomb_force"],
        values["stribeck_velocity"],
        values["stribeck_exponent"],
    )
    if exponent == 2.0 or excess == 0.0:
        return values["static_force"], speed
    from scipy.optimize import least_squares

    x = np.linspace(0.0, _STRIBECK_REACH, _GRID)  # in Stribeck velocities
    wanted = np.exp(-(x**exponent))
    found = least_squares(lambda p: p[0] * np.exp(-((x / p[1]) ** 2)) - wanted, [1.0, 1.0], bounds=(1e-3, 10.0)).x
    return values["coulomb_force"] + excess * float(found[0]), speed * float(found[1])


def fundamental_phases(exported: Exported) -> dict[str, float]:
    """Parameters of the sine motor (31) with the first harmonic of the model's field, SI by name.

    Raises UsageError where the thrust is no periodic field times currents.
    """
    model, values = exported.model, exported.values
    motor = model.driven_by
    if not motor.periodic:
        raise UsageError(
            "--to", f"a {motor.name} motor's thrust is no constant times its current", "Choose fmu, c or python."
        )
    turns = motor.turns
    return {
        "force_constant": values["force_constant"] * motor.spectrum(values)[1],
        "electrical_wavenumber": turns * values["electrical_wavenumber"],
        "winding_displacement": turns * values["winding_displacement"],
        "commutation_offset": turns * values["commutation_offset"],
    }


def thrust_per_current(exported: Exported) -> float:
    """Force per q-current (peak of the phase current's amplitude) in N/A: that of the one input, or 3/2 of a phase's
    first harmonic (44); 0 for a model without motor.
    """
    motor = exported.model.driven_by
    if not motor.inputs:
        return 0.0
    if motor.phases:
        return 1.5 * fundamental_phases(exported)["force_constant"]
    if motor.thrust is None or motor.name != "force":
        fundamental_phases(exported)
    return exported.values["force_constant"]


def number(x: float) -> str:
    """A number in SI as every format reads it, exact: the shortest text that gives the same double."""
    return repr(float(x))


def stroke_of(exported: Exported) -> tuple[float, float] | None:
    """The lowest and the highest position in m that the recordings visit; None without recordings that move."""
    measured = [recording.y for recording in exported.recordings if recording.measured]
    if not measured:
        return None
    low, high = min(float(np.min(y)) for y in measured), max(float(np.max(y)) for y in measured)
    return (low, high) if high > low else None


def stroke_or_usual(exported: Exported) -> tuple[float, float]:
    """The stroke in m, or half a metre (rotary: half a turn) either way where no recording tells it."""
    half = math.pi if exported.result.axis == "rotary" else 0.5
    return stroke_of(exported) or (-half, half)


def own_over_position(name: str) -> bool:
    """Whether an effect is an own term, such as a learned one, whose force hangs on the position alone."""
    from linid.physics.effects.registry import find_effect
    from linid.physics.own_terms.own_term import is_own

    if not is_own(name):
        return False
    term = find_effect(name).own
    return bool(term.variables == {"y"} and term.part(True) is None)


def own_force(exported: Exported, y: Array) -> Array:
    """Force in N of all own terms of position alone, at positions y (n,) in m."""
    from linid.physics.effects.registry import find_effect
    from linid.physics.own_terms.values import formula_values

    total = np.zeros_like(y)
    for name in filter(own_over_position, exported.model.effects):
        term = find_effect(name).own
        own = {one: exported.values[f"{term.name}_{one}"] for one in term.parameters}
        total += formula_values(term.part(False), {"y": y}, own)
    return total
