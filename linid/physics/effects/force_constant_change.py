"""Changed force constant: the motor pushes harder or softer than the given model says, as where magnets have aged.

Source: linid's own form, a factor.
"""

from __future__ import annotations

from linid.physics.effects.effect import MOTORS, Effect, term
from linid.physics.parameter import Parameter


@term
def thrust(t, y, v, i_1, i_2, i_3, record, elapsed, constant_change):
    """Factor on the motor's force."""
    return 1.0 + constant_change


EFFECT = Effect(
    name="force_constant_change",
    slot="FORCE",
    physics="The motor's force is another one by a factor: F (1 + c). Sought beside a given model only.",
    parameters=(
        Parameter("constant_change", "c_K", "1", -0.9, 3.0, 0.0, meaning="relative change of the force constant"),
    ),
    amplitudes=("constant_change",),
    kinds=MOTORS,
    changes="force_constant",
    thrust=thrust,
    depends_on=(("motor_force",),),
    exposed_by="strong accelerations with known added masses",
    confused_with=("force_saturation", "thermal_derating", "payload_change"),
)
