"""The motor behind one logged input: a q-current, a force or torque command; its thrust is in proportion."""

from __future__ import annotations

from linid.physics.motors.motor import Motor
from linid.physics.parameter import Parameter
from linid.physics.term import term


@term
def thrust(y, i_1, i_2, i_3, force_constant):
    """Force in N in proportion to the input, as (44) for currents that turn with the field."""
    return force_constant * i_1


MOTOR = Motor(
    name="force",
    inputs=1,
    parameters=(Parameter("force_constant", "K", "N/A", 1e-3, 1e3, 1.0, log=True, meaning="force per input"),),
    thrust=thrust,
)
