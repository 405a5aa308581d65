"""Constant force: tilt, gravity or cable preload pushes the same way everywhere."""

from __future__ import annotations

from numba import njit

from linid.physics.effects.effect import Effect
from linid.physics.parameter import Parameter


@njit(cache=True)
def force(t: float, y: float, v: float, constant_force: float) -> float:
    """The force in N, whatever time, position and speed are."""
    return constant_force


EFFECT = Effect(
    name="constant_force",
    physics="A force F_0 of constant size and direction acts on the axis: m v' = F_motor - R + F_0.",
    parameters=(Parameter("constant_force", "F_0", "N", -200.0, 200.0, 0.0, meaning="tilt, gravity or cable preload"),),
    force=force,
    exposed_by="slow moves in both directions, or free wheels in both directions",
    confused_with=("asymmetric_friction", "cable_force"),
)
