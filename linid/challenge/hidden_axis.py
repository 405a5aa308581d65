"""The axis that a challenge hides: a described one, and what generated stands do not have.

Friction after Dahl or Maxwell beside LuGre's, and drives that log their q-current only, on linear and rotary axes. A
rotary axis is a linear one seen from `radius_m`: angle = y / r, torque = F r, inertia = m r^2. The plant moves in
metres throughout; only files and the keys' base parameters are in radians.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from linid.physics.described import Positive
from linid.stand.description import AxisDescription, SineMotor
from linid.stand.generate import true_parameters

AxisKind = Literal["phase", "q_linear", "q_rotary"]
Law = Literal["lugre", "maxwell", "dahl", "elasto_plastic", "coulomb"]
AXES: tuple[AxisKind, ...] = ("phase", "q_linear", "q_rotary")
LAWS: tuple[Law, ...] = ("lugre", "maxwell", "dahl", "elasto_plastic", "coulomb")
Four = Annotated[tuple[float, ...], Field(min_length=4, max_length=4)]
# rad/s and damping ratio of a mass on the spring that stands for Coulomb friction: it bends by a few nanometres, and
# integration steps of 10 us still follow it.
_STIFF, _STIFF_DAMPING = 3e4, 0.5
# Powers of the radius by which the parameters of a linear axis become those of a rotary one.
_POWERS = {
    "mass": 2,
    "force_constant": 1,
    "coulomb_force": 1,
    "static_force": 1,
    "stribeck_velocity": -1,
    "bristle_stiffness": 2,
    "bristle_damping": 2,
    "viscous_friction": 2,
}


class HiddenAxis(AxisDescription):
    """A described axis with a friction law and a kind of drive.

    law: of friction; Dahl's takes the static force for the Coulomb force and has no bristle damping. shares: of the
    sliding force on Maxwell's four elements; stiffnesses: theirs, in shares of the bristle stiffness; bend: Dahl's
    exponent, or the share of the Coulomb force up to which an elasto-plastic bristle does not slip; Coulomb's law is
    one Maxwell element far stiffer than any encoder sees. kind: what the drive logs, and in which units; radius_m: of
    a rotary axis.
    """

    law: Law = "lugre"
    shares: Four = (0.25, 0.25, 0.25, 0.25)
    stiffnesses: Four = (0.4, 0.3, 0.2, 0.1)
    bend: Positive = 1.0
    kind: AxisKind = "phase"
    radius_m: Positive = 1.0


def thrust_per_ampere(description: AxisDescription) -> float:
    """Mean thrust in N per ampere of q-current: half the fundamental's, times 1 + 2 cos(winding spread - 120 deg)."""
    motor = description.motor
    if motor.kind == "sine":
        fundamental, spread = motor.force_constant_n_per_a, motor.winding_displacement_rad
    else:
        fundamental = 8 * motor.force_constant_n_per_a * motor.nome * math.sin(2 * motor.winding_length_rad)
        spread = 2 * motor.winding_displacement_rad
    return 0.5 * abs(fundamental) * (1 + 2 * math.cos(spread - 2 * math.pi / 3))


def truth(axis: HiddenAxis) -> dict[str, float]:
    """True base parameters under their canonical names, SI (rotary: rad, N m, kg m^2)."""
    known = true_parameters(axis)
    if axis.kind == "phase":
        return known
    radius = axis.radius_m if axis.kind == "q_rotary" else 1.0
    known["force_constant"] = thrust_per_ampere(axis)
    return {
        name: value * radius ** _POWERS.get(name, 0)
        for name, value in known.items()
        if name in (*_POWERS, "stribeck_exponent")
    }


def varied(
    axis: HiddenAxis, random: np.random.Generator, *, kind: AxisKind, law: Law, rate: float, resolution: float | None
) -> HiddenAxis:
    """The axis with another drive, friction law, logging rate (Hz) and encoder resolution (m; None: its own).

    A drive that logs one current is taken to have windings exactly 120 degrees apart in a field without harmonics: its
    thrust per ampere is then one number. On rotary axes a revolution holds a whole number of pole pairs.
    """
    changes: dict[str, object] = {"kind": kind, "law": law}
    seen: dict[str, float] = {"sample_period_s": 1 / rate}
    if resolution is not None:
        seen["position_resolution_m"] = resolution
    changes["measurement"] = axis.measurement.model_copy(update=seen)
    if kind != "phase":
        turns = axis.motor.electrical_wavenumber_per_m * (1 if axis.motor.kind == "sine" else 2)
        changes["motor"] = SineMotor(
            kind="sine",
            force_constant_n_per_a=thrust_per_ampere(axis) / 1.5,
            electrical_wavenumber_per_m=turns,
            winding_displacement_rad=2 * math.pi / 3,
            commutation_offset_rad=axis.motor.commutation_offset_rad,
        )
        if kind == "q_rotary":
            changes["radius_m"] = int(random.integers(2, 7)) / turns
    if law == "maxwell":
        parts = random.uniform(0.5, 1.5, size=4)
        stiff = random.uniform(0.35, 0.7) ** np.arange(4)
        changes["shares"] = tuple(map(float, parts / parts.sum()))
        changes["stiffnesses"] = tuple(map(float, stiff / stiff.sum()))
    elif law == "dahl":
        changes["bend"] = float(random.uniform(0.6, 1.6))
        coulomb = axis.friction.coulomb_force_n
        changes["friction"] = axis.friction.model_copy(
            update={"static_force_n": coulomb, "bristle_damping_n_s_per_m": 0.0}
        )
    elif law == "elasto_plastic":
        changes["bend"] = float(random.uniform(0.4, 0.9))
    elif law == "coulomb":
        stiffness = axis.mass_kg * _STIFF**2
        damping = 2.0 * _STIFF_DAMPING * math.sqrt(stiffness * axis.mass_kg)
        changes["friction"] = axis.friction.model_copy(
            update={"bristle_stiffness_n_per_m": stiffness, "bristle_damping_n_s_per_m": damping}
        )
        changes["shares"], changes["stiffnesses"] = (1.0, 0.0, 0.0, 0.0), (1.0, 1e-9, 1e-9, 1e-9)
    return axis.model_copy(update=changes)
