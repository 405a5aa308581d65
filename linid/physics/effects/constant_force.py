"""Constant force: gravity on an inclined linear axis or cable preload pushes the same way everywhere.

Source: none needed, a constant.
"""

from __future__ import annotations

from linid.physics.effects.effect import Effect, term
from linid.physics.parameter import Parameter


@term
def force(t, y, v, i_1, i_2, i_3, record, elapsed, constant_force):
    """The force in N, whatever time, position and speed are."""
    return constant_force


EFFECT = Effect(
    name="constant_force",
    slot="FORCE",
    physics="A force F_0 of constant size and direction acts, as gravity does on an inclined linear axis.",
    parameters=(Parameter("constant_force", "F_0", "N", -200.0, 200.0, 0.0, meaning="tilt, gravity or cable preload"),),
    amplitudes=("constant_force",),
    force=force,
    depends_on=((),),
    exposed_by="slow moves in both directions, or free wheels in both directions",
    confused_with=("asymmetric_friction", "cable_force"),
)
