"""A motor with a trapezoidal back-EMF, in one file: its thrust per current is flat between ramps of a given length."""

import math

import numpy as np

from linid.physics.motors.motor import Derived, Motor
from linid.physics.motors.sine import MOTOR as SINE
from linid.physics.parameter import Parameter
from linid.physics.term import term


@term
def amplitudes(out, ramp):
    """Odd harmonics of a trapezoid of height 1 whose ramps cross zero over +-ramp (electrical rad)."""
    for k in range(out.size):
        n = 2 * k + 1
        out[k] = 4.0 * math.sin(n * ramp) / (math.pi * n * n * ramp)
    return out.size


def fundamental(force_constant, ramp):
    """Force constant of the first harmonic, N/A."""
    return force_constant * 4.0 * np.sin(ramp) / (math.pi * ramp)


MOTOR = Motor(
    name="trapezoid",
    inputs=3,
    parameters=(*SINE.parameters, Parameter("ramp", "delta", "1", 0.1, 1.57, 0.5, meaning="half length of a ramp")),
    shape=(("ramp", 0.5),),
    harmonic=fundamental,
    derived=(Derived("ramp_length", "l_r", "m", lambda d, w: 2.0 * d / w, ("ramp", "electrical_wavenumber")),),
    amplitudes=amplitudes,
)
