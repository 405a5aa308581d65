"""Force saturation: iron and magnets saturate, so that thrust per ampere falls at high current.

Source: linid's own form: a power law with a knee.
"""

from __future__ import annotations

import math

from linid.arrays import Array
from linid.kernel_cache import kept
from linid.physics.effects.effect import MOTORS, Effect, Outlook, Values, term
from linid.physics.parameter import Parameter


@term
def squared_amplitude(i_1: float, i_2: float, i_3: float) -> float:
    """Square of the current's space-vector amplitude in A^2; of i_1 where it is the only input. i_1, i_2, i_3: A."""
    if i_2 == 0.0 and i_3 == 0.0:
        return i_1 * i_1
    along = (2.0 * i_1 - i_2 - i_3) / 3.0
    across = (i_2 - i_3) / math.sqrt(3.0)
    return along * along + across * across


@kept(error_model="numpy", nogil=True)
def largest_square(i_1: Array, i_2: Array, i_3: Array) -> float:
    """The largest `squared_amplitude` of many samples in A^2. i_1, i_2, i_3: (n,) A.

    Source: Clarke 1943, Circuit Analysis of A-C Power Systems, for the space vector's components.
    """
    largest = 0.0
    for k in range(i_1.size):
        largest = max(largest, squared_amplitude(i_1[k], i_2[k], i_3[k]))
    return largest


@term
def drive(t, y, v, i_1, i_2, i_3, record, elapsed, saturation, knee):
    """The currents that an unsaturated motor would need for the same force, A."""
    factor = (1.0 + max(saturation, 0.0) * squared_amplitude(i_1, i_2, i_3) / knee) ** -knee
    return i_1 * factor, i_2 * factor, i_3 * factor


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Thrust that levels off (one half), or falls again (one and more)."""
    return tuple({"saturation_knee": knee} for knee in (0.5, 1.0))


EFFECT = Effect(
    name="force_saturation",
    slot="DRIVE",
    physics="Thrust per ampere falls with the current's amplitude A: F = F_motor / (1 + s A^2 / k)^k.",
    parameters=(
        Parameter("saturation", "s", "1/A^2", 0.0, 10.0, 0.0, meaning="loss of thrust per squared ampere"),
        Parameter("saturation_knee", "k", "1", 0.25, 4.0, 1.0, log=True, meaning="how the loss goes on"),
    ),
    amplitudes=("saturation",),
    kinds=MOTORS,
    grid=grid,
    drive=drive,
    depends_on=(("motor_force",),),
    exposed_by="strong accelerations beside gentle ones: moves of several peak currents",
    confused_with=("thermal_derating", "quadratic_drag"),
)
