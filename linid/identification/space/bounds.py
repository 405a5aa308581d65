"""The search box: bounds from the physics and from the size of the axis at hand."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from linid.errors import UsageError
from linid.identification.guess.scales import effect_range, force_scale, look_out, typical_acceleration
from linid.identification.signals.motion import measure_motion
from linid.identification.space.search_space import SearchParameter, SearchSpace
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.physics.motors.registry import MOTORS
from linid.physics.parameter import Parameter
from linid.recording.recording import Recording

_MOVING = 0.01  # of the highest speed, from which on the axis clearly moves one way


def build_space(
    model: Model,
    recordings: Sequence[Recording],
    first: dict[str, float],
    fixed: dict[str, float],
    bounds: dict[str, tuple[float, float]],
    free_exponent: bool,
    densities: tuple[float, ...] = (),
    stribeck: bool = True,
) -> SearchSpace:
    """Search coordinates for all parameters that are not fixed, with bounds that scale with the axis.

    stribeck: False ties F_S to F_C; first: first guesses in SI; bounds: the user's own bounds by name (SI).
    Raises UsageError for a name that the model has not, or bounds that are not in order.
    """
    names = {parameter.name for parameter in model.parameters}
    for name in [*bounds, *fixed]:
        if name not in names:
            raise UsageError(
                name, f"the {model.kind} model has no parameter {name!r}", f"Known: {', '.join(sorted(names))}"
            )
    box = _friction_box(recordings, first)
    for name in ("mass", "force_constant", "phase_resistance", "phase_inductance"):
        if name in first:
            box[name] = (abs(first[name]) / 8.0, abs(first[name]) * 8.0)
    if "mutual_inductance" in first:
        box["mutual_inductance"] = (-0.5 * first["phase_inductance"], first["phase_inductance"])
    if densities:
        box["electrical_wavenumber"] = (0.9 * min(densities), 1.1 * max(densities))
    if "commutation_offset" in first:
        half = math.pi / model.turns
        box["commutation_offset"] = (first["commutation_offset"] - half, first["commutation_offset"] + half)
    motor = MOTORS[model.kind]
    fundamental = bool(motor.shape) and "force_constant" in box and "force_constant" not in bounds
    if fundamental:
        share = motor.fundamental(1.0, {**first, **fixed})
        box["force_constant"] = (share * box["force_constant"][0], share * box["force_constant"][1])
    box |= _effect_box(model, recordings, first, fixed)
    searched = []
    held = dict(fixed)
    for parameter in model.parameters:
        if parameter.name in fixed:
            continue
        if parameter.name == "stribeck_exponent" and not free_exponent and parameter.name not in bounds:
            held[parameter.name] = parameter.default
            continue
        if not stribeck and parameter.name in ("static_force", "stribeck_velocity"):
            continue
        searched.append(_search_parameter(parameter, box, bounds))
    return SearchSpace(model, tuple(searched), held, stribeck, fundamental)


def _friction_box(recordings: Sequence[Recording], first: dict[str, float]) -> dict[str, tuple[float, float]]:
    """Bounds of the friction parameters by the forces, speeds, travel and noise of these recordings."""
    motion = measure_motion(recordings)
    noise = max(float(np.min(motion.position_noise)), 1e-12)
    travel = travel_between_reversals(recordings)
    speed = max(float(np.quantile(np.abs(motion.v), 0.99)), 10.0 * noise)
    inertia = first.get("mass", 1.0) * typical_acceleration(recordings)
    force = max(abs(first.get("coulomb_force", 0.0)), 1e-3 * inertia, 1e-15)
    return {
        "coulomb_force": (force / 30.0, force * 10.0),
        "static_force": (1.0, 8.0),
        "stribeck_velocity": (1e-4 * speed, 0.1 * speed),
        "bristle_stiffness": (force / (0.03 * travel), force / (0.03 * noise)),
        "bristle_damping": (3e-3, 30.0),
        "viscous_friction": (1e-4 * force / speed, 30.0 * force / speed),
    }


def travel_between_reversals(recordings: Sequence[Recording]) -> float:
    """Median travel in m (rotary: rad, a revolution at most) from one reversal of the motion to the next.

    A bristle that bends farther than that before it slides would be a spring, and no recording could tell.
    """
    motion = measure_motion(recordings)
    top = float(np.quantile(np.abs(motion.v), 0.99))
    legs: list[float] = []
    at = 0
    for recording in recordings:
        v, y = motion.v[at : at + recording.y.size], motion.y[at : at + recording.y.size]
        at += recording.y.size
        moving = np.flatnonzero(np.abs(v) > _MOVING * top)
        if moving.size:
            turns = np.flatnonzero(np.diff(np.sign(v[moving])))
            legs += np.abs(np.diff(y[moving[[0, *turns, -1]]])).tolist()
    legs = [leg for leg in legs if leg > 0.0]
    whole = max(float(np.ptp(r.y)) for r in recordings)
    travel = float(np.median(legs)) if legs else whole
    return min(travel, 2.0 * math.pi) if recordings[0].axis == "rotary" else travel


def _effect_box(
    model: Model, recordings: Sequence[Recording], first: dict[str, float], fixed: dict[str, float]
) -> dict[str, tuple[float, float]]:
    """Ranges of the effects' parameters: amplitudes by the size of the axis, periods near their first value."""
    if not model.effects:
        return {}
    values = {"mass": 1.0, **first, **fixed}
    outlook = look_out(model, recordings, values)
    force = force_scale(recordings, values)
    box = {}
    for name in model.effects:
        effect = find_effect(name)
        for parameter in effect.parameters_of(model.kind):
            if parameter.name in effect.amplitudes:
                box[parameter.name] = effect_range(effect, parameter, outlook, force, values["mass"])
            elif parameter.name in first and parameter.name not in effect.preset:
                box[parameter.name] = effect.range_about(parameter, first[parameter.name], values)
    return box


def _search_parameter(
    parameter: Parameter, box: dict[str, tuple[float, float]], bounds: dict[str, tuple[float, float]]
) -> SearchParameter:
    lower, upper = box.get(parameter.name, (parameter.lower, parameter.upper))
    if parameter.name in bounds and parameter.name not in ("static_force", "bristle_damping"):
        lower, upper = bounds[parameter.name]
    if not lower < upper or (parameter.log and lower <= 0.0):
        raise UsageError(
            f"bounds of {parameter.name}",
            f"{lower:g} to {upper:g} is not a search range",
            "Give the lower bound first" + (", and above zero" if parameter.log else ""),
        )
    return SearchParameter(parameter.name, lower, upper, parameter.log)
