"""Input delay: the force follows the logged current late, or the channels of the scope are skewed.

Source: none needed, a dead time.
"""

from __future__ import annotations

from linid.physics.effects.effect import MOTORS, Effect, term
from linid.physics.parameter import Parameter


@term
def delay(input_delay):
    """The delay itself, s."""
    return input_delay


EFFECT = Effect(
    name="input_delay",
    slot="DRIVE",
    physics="The motor pushes with the current of a moment ago: F(t) = F(y, I(t - T)).",
    parameters=(
        Parameter("input_delay", "T", "s", -2e-3, 20e-3, 0.0, meaning="time from logged current to force; < 0: skew"),
    ),
    amplitudes=("input_delay",),
    kinds=MOTORS,
    delay=delay,
    # F(t - T) - F(t): what the force was, seen as its rate, which a motion in time may stand for.
    depends_on=(("motor_force",), ("acceleration",), ("time", "motor_force")),
    exposed_by="currents that change quickly: steps, or sines of several tens of Hz",
    confused_with=("flexible_load", "thermal_derating"),
)
