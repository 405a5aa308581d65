"""What MuJoCo's joint and `dcmotor` hold of a model, as a model of linid."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from linid.export.simpler import (
    fundamental_phases,
    held_values,
    left_out,
    mean_friction,
    need_mass,
    own_force,
    own_over_position,
    polynomial_drag,
    speeds_of,
    square_stribeck,
    stroke_or_usual,
)
from linid.export.target import reshaped

if TYPE_CHECKING:
    from linid.export.target import Exported
    from linid.identification.result import FitResult

NAME = "mujoco"
# Waves for own terms of position: they may miss this share of the force's range; more of them there are not.
_MISSED, _MOST_WAVES, _PLACES = 5e-3, 64, 1025
# Effects that stay what they are; each has its element.
KEPT = (
    "input_delay",
    "thermal_derating",
    "cogging",
    "constant_force",
    "gravity",
    "cable_force",
    "flexible_load",
    "quadratic_drag",
)
# Those of which another element stands for a part.
FOLDED = {
    "eddy_current_drag": "Eddy-current drag is held as damping b v + c v |v|, fitted over the speeds.",
    "asymmetric_friction": "Asymmetric friction is held in its Coulomb part, as a constant force.",
    "current_offset": "The offset of the one input is held as a constant force, and acts without the drive too.",
}


def folded(exported: Exported) -> dict[str, str]:
    """Those of `FOLDED` that this model has and that can be folded, with their sentences."""
    alone = exported.model.single
    return {
        name: words
        for name, words in FOLDED.items()
        if name in exported.model.effects and (name != "current_offset" or alone)
    }


def kept(exported: Exported) -> tuple[str, ...]:
    """Effects of the model that its MuJoCo form has too."""
    late = exported.values.get("input_delay", 0.0) >= 0.0
    held = (name for name in exported.model.effects if name in KEPT or own_over_position(name))
    return tuple(name for name in held if late or name != "input_delay")


def form(exported: Exported) -> FitResult:
    """The model that the MJCF file equals: LuGre with exponent 2, the field's first harmonic, effects with an element;
    raises UsageError for a model without mass, or with a motor that is no constant times its current.
    """
    need_mass(exported, NAME)
    values, effects = held_values(exported), list(kept(exported))
    changed = dict(values)
    changed["static_force"], changed["stribeck_velocity"] = square_stribeck(values)
    changed["stribeck_exponent"] = 2.0
    factor, more = mean_friction(exported)
    for name in ("coulomb_force", "static_force"):
        changed[name] = factor * (changed[name] + more)
    changed["bristle_damping"] = max(values["bristle_damping"], 0.0)
    if "cable_force" in effects:
        changed["cable_hysteresis"] = max(values["cable_hysteresis"], 0.0)
    b, c = polynomial_drag(values, exported.model.effects, speeds_of(exported))
    changed["viscous_friction"] = values["viscous_friction"] + b
    if c > 0.0:
        changed |= {"drag_coefficient": c, "drag_power": 2.0, "drag_speed": values.get("drag_speed", 1.0)}
        effects = [*effects, "quadratic_drag"]
    elif "quadratic_drag" in effects:
        effects.remove("quadratic_drag")
    push = constant_push(exported, values)
    if push != 0.0:
        changed["constant_force"] = values.get("constant_force", 0.0) + push
        effects = [*effects, "constant_force"]
    result = exported.result
    if exported.model.phases:
        changed |= fundamental_phases(exported)
        result = replace(result, model="sine")
    return reshaped(result, effects=tuple(dict.fromkeys(effects)), law="lugre", values=changed)


def own_waves(exported: Exported) -> tuple[tuple[float, float, float], ...]:
    """Own terms of position as waves: wavenumber in 1/m, sine and cosine in N; over the stroke least squares with as
    many waves as it takes, and mirrored beyond (Fourier's cosine series).
    """
    low, high = stroke_or_usual(exported)
    share = np.linspace(0.0, 1.0, _PLACES)
    force = own_force(exported, low + share * (high - low))
    if not force.any():
        return ()
    for count in range(4, _MOST_WAVES + 1, 4):
        columns = np.cos(np.pi * np.outer(share, np.arange(count)))
        sizes = np.linalg.lstsq(columns, force, rcond=None)[0]
        if np.max(np.abs(columns @ sizes - force)) < _MISSED * np.ptp(force):
            break
    numbers = np.pi * np.arange(count) / (high - low)
    turned = zip(numbers, sizes * np.sin(numbers * low), sizes * np.cos(numbers * low), strict=True)
    return tuple((float(k), float(sine), float(cosine)) for k, sine, cosine in turned)


def constant_push(exported: Exported, values: dict[str, float]) -> float:
    """Constant force in N that stands for what `folded` names."""
    push = 0.0
    if "asymmetric_friction" in exported.model.effects:
        push -= values["friction_asymmetry"] * values["coulomb_force"]
    if "current_offset" in exported.model.effects and exported.model.single:
        push += values["current_offset_1"] * values["force_constant"]
    return push


def lacks(exported: Exported) -> tuple[str, ...]:
    """What the MuJoCo form cannot hold of a model, a sentence each."""
    values, model = held_values(exported), exported.model
    found = []
    if model.law not in ("lugre", "coulomb"):
        found.append(f"Friction follows LuGre's law, not {model.law}.")
    if values["stribeck_exponent"] != 2.0 and values["static_force"] != values["coulomb_force"]:
        found.append("The Stribeck curve has the exponent 2, with the nearest breakaway force and Stribeck velocity.")
    if model.phases and len(model.driven_by.spectrum(values)) > 1:
        found.append("Of the motor's field the first harmonic is held.")
    if model.phases:
        found.append("The input is the q-current: the commutation is yours (run_axis.py has it).")
    if "quadratic_drag" in model.effects and not math.isclose(values["drag_power"], 2.0):
        found.append("The drag's power is 2, with the nearest coefficients.")
    if "thermal_derating" in model.effects:
        found.append("Derated thrust heats the winding less than the same current would: heat is held to first order.")
    if values.get("cable_hysteresis", 0.0) < 0.0:
        found.append("The cable's hysteresis is left out: no bristle pushes.")
    if any(map(own_over_position, model.effects)):
        found.append("Own terms of position are waves over the stroke, and mirrored beyond it.")
    words, held = folded(exported), kept(exported)
    for name in model.effects:
        if name in words:
            found.append(words[name])
        elif name not in held:
            found.append(left_out(exported, name))
    return tuple(found)
