"""A motor whose iron saturates, in one file: one current, and a force that stays behind where the current is high."""

from linid.physics.motors.motor import Motor
from linid.physics.parameter import Parameter
from linid.physics.term import term


@term
def thrust(y, i_1, i_2, i_3, force_constant, knee):
    """Force in N that falls behind in proportion by half at the knee (A)."""
    return force_constant * i_1 / (1.0 + abs(i_1) / knee)


MOTOR = Motor(
    name="saturating",
    inputs=1,
    parameters=(
        Parameter("force_constant", "K", "N/A", 1e-3, 1e3, 1.0, log=True, meaning="force per small current"),
        Parameter("knee", "i_k", "A", 0.1, 1e3, 10.0, log=True, meaning="current at which half the force is lost"),
    ),
    thrust=thrust,
)
