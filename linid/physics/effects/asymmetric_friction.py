"""Asymmetric friction: Coulomb or viscous friction depends on the direction.

Source: Canudas de Wit et al. 1995, IEEE Trans. Autom. Control 40, 419, where g(v) need not be symmetrical. The viscous
part is linid's own.
"""

from __future__ import annotations

from linid.physics.effects.effect import Effect, term
from linid.physics.parameter import Parameter


@term
def level(t, y, v, i_1, i_2, i_3, record, elapsed, friction_asymmetry, viscous_asymmetry):
    """Factor on the sliding friction. The bristle's stiffness has no direction: a resting axis must not chatter."""
    if v == 0.0:
        return 1.0
    return 1.0 + friction_asymmetry if v > 0.0 else 1.0 - friction_asymmetry


@term
def force(t, y, v, i_1, i_2, i_3, record, elapsed, friction_asymmetry, viscous_asymmetry):
    """The viscous part that brakes one way and pushes the other, N."""
    return -viscous_asymmetry * abs(v)


EFFECT = Effect(
    name="asymmetric_friction",
    slot="FORCE",
    physics="Friction depends on the direction: g(v) (1 + a sign v), and sigma_2 v + b |v|.",
    parameters=(
        Parameter("friction_asymmetry", "a", "1", -0.9, 0.9, 0.0, meaning="Coulomb friction more forwards, less back"),
        Parameter("viscous_asymmetry", "b", "N s/m", -1e3, 1e3, 0.0, meaning="viscous friction more forwards"),
    ),
    amplitudes=("friction_asymmetry", "viscous_asymmetry"),
    level=level,
    force=force,
    # In Coulomb friction the direction alone, in viscous friction the speed in one direction.
    depends_on=(("direction",), ("velocity",), ("velocity", "direction")),
    exposed_by="free wheels or slow moves in both directions; standstill tells it from a constant force",
    confused_with=("constant_force", "cable_force"),
)
