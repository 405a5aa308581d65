"""The sine model: the thrust of each phase is a sine of the position (31, 44)."""

from __future__ import annotations

import math

from linid.physics.motors.motor import Motor
from linid.physics.parameter import Parameter
from linid.physics.term import term

_TURN = 2.0 * math.pi


@term
def amplitudes(out):
    """One harmonic of amplitude 1, dimensionless (31)."""
    out[0] = 1.0
    return 1


MOTOR = Motor(
    name="sine",
    inputs=3,
    parameters=(
        Parameter("force_constant", "K_f", "N/A", 1e-1, 1e3, 30.0, log=True, meaning="force per phase current"),
        Parameter("electrical_wavenumber", "omega_g", "1/m", 20.0, 1500.0, 200.0, log=True, meaning="pi / pole pitch"),
        Parameter("winding_displacement", "alpha_p", "1", 0.05, _TURN, 2.094, meaning="phase between windings"),
        Parameter("commutation_offset", "alpha_S", "1", -_TURN, _TURN, 0.0, meaning="field phase at position zero"),
    ),
    amplitudes=amplitudes,
)
