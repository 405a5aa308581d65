"""End effect: near the ends of the magnet track the thrust falls."""

from __future__ import annotations

import math

from linid.physics.effects.effect import MOTORS, Effect, Outlook, Values, term
from linid.physics.effects.shapes import bounded
from linid.physics.parameter import Parameter

_FURTHEST = 2.0  # lengths beyond an end, where the exponential is held


@term
def thrust(t, y, v, i_1, i_2, i_3, record, elapsed, s_1, s_2, loss_low, loss_high, length, low, high):
    """Factor on the thrust."""
    below = math.exp(min(max((low - y) / length, -700.0), _FURTHEST))
    above = math.exp(min(max((y - high) / length, -700.0), _FURTHEST))
    return bounded(1.0 - loss_low * below - loss_high * above)


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Lengths of the loss as shares of the stroke; the ends of the stroke."""
    ends = {"end_low": outlook.stroke_low, "end_high": outlook.stroke_high}
    return tuple({"end_length": share * outlook.stroke, **ends} for share in (0.08, 0.03, 0.2))


EFFECT = Effect(
    name="end_effect",
    slot="FORCE",
    physics="Thrust falls near the ends: factor 1 - a_1 exp(-(y - y_1)/L) - a_2 exp(-(y_2 - y)/L).",
    parameters=(
        Parameter("end_loss_low", "a_1", "1", -0.9, 0.9, 0.0, meaning="loss of thrust at the lower end of the stroke"),
        Parameter("end_loss_high", "a_2", "1", -0.9, 0.9, 0.0, meaning="loss of thrust at the upper end of the stroke"),
        Parameter("end_length", "L_e", "m", 1e-4, 1e2, 0.03, log=True, meaning="distance over which the loss fades"),
        Parameter("end_low", "y_1", "m", -1e3, 1e3, 0.0, meaning="lower end of the stroke"),
        Parameter("end_high", "y_2", "m", -1e3, 1e3, 1.0, meaning="upper end of the stroke"),
    ),
    amplitudes=("end_loss_low", "end_loss_high"),
    structural=("end_low", "end_high"),
    kinds=MOTORS,
    grid=grid,
    thrust=thrust,
    exposed_by="accelerations near both ends of the stroke and in its middle",
    confused_with=("cable_force", "pole_pitch_error"),
)
