"""Load-dependent friction: bearings and gears rub the more, the more force they transmit.

Source: Coulomb's law, friction in proportion to the load.
"""

from __future__ import annotations

from linid.physics.effects.effect import MOTORS, Effect, term
from linid.physics.parameter import Parameter


@term
def load(push, t, y, v, i_1, i_2, i_3, record, elapsed, load_friction):
    """Sliding and breakaway friction in N that the motor's force `push` adds, whichever way it pushes."""
    return load_friction * abs(push)


EFFECT = Effect(
    name="load_dependent_friction",
    slot="FORCE",
    physics="Sliding and breakaway friction grow with the motor's force: g(v) + mu |F_motor|.",
    parameters=(
        Parameter("load_friction", "mu", "1", 0.0, 0.9, 0.0, meaning="friction per force that the motor transmits"),
    ),
    amplitudes=("load_friction",),
    kinds=MOTORS,
    load=load,
    depends_on=(("motor_force", "direction"),),
    exposed_by="the same speeds with strong and weak accelerations, and with strong braking",
    confused_with=("force_saturation", "asymmetric_friction"),
)
