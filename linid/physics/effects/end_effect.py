"""End effect: near the ends of the magnet track the thrust falls.

Source: linid's own form, a logistic curve at either end.
"""

from __future__ import annotations

import math

from linid.physics.effects.effect import MOTORS, Effect, Outlook, Values, term
from linid.physics.effects.shapes import bounded
from linid.physics.parameter import Parameter

_FURTHEST = 500.0  # lengths, where the exponential is held
_REACH = 1.5  # of the lengths' first values
_MOST_REACH = 0.4  # of the stroke: what is between has the whole thrust, or nothing tells that from the force constant


@term
def thrust(t, y, v, i_1, i_2, i_3, record, elapsed, loss_low, loss_high, reach_low, reach_high, length, low, high):
    """Factor on the thrust."""
    below = 1.0 / (1.0 + math.exp(min(max((y - low - reach_low) / length, -_FURTHEST), _FURTHEST)))
    above = 1.0 / (1.0 + math.exp(min(max((high - reach_high - y) / length, -_FURTHEST), _FURTHEST)))
    return bounded(1.0 - loss_low * below - loss_high * above)


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Reaches and lengths of the loss as shares of the stroke, from the stroke's ends (the track may end elsewhere)."""
    ends = {"end_low": outlook.stroke_low, "end_high": outlook.stroke_high}
    shares = [(reach, length) for reach in (0.03, 0.1, 0.2, 0.3) for length in (0.03, 0.08)]
    stroke = outlook.stroke
    return tuple(
        {"end_reach_low": r * stroke, "end_reach_high": r * stroke, "end_length": w * stroke, **ends} for r, w in shares
    )


def most(values: Values) -> Values:
    """What reaches the middle is no longer an end: two that meet take from the thrust everywhere."""
    reach = _MOST_REACH * (values["end_high"] - values["end_low"])
    return {"end_reach_low": reach, "end_reach_high": reach}


EFFECT = Effect(
    name="end_effect",
    slot="FORCE",
    physics="Thrust falls near an end: factor 1 - a / (1 + exp((d - r)/L)), d the distance from that end.",
    parameters=(
        Parameter("end_loss_low", "a_1", "1", -0.6, 0.6, 0.0, meaning="share of the thrust lost at the lower end"),
        Parameter("end_loss_high", "a_2", "1", -0.6, 0.6, 0.0, meaning="share of the thrust lost at the upper end"),
        Parameter(
            "end_reach_low", "r_1", "m", 1e-4, 1e2, 0.03, log=True, meaning="lower end to half its loss", reach=_REACH
        ),
        Parameter(
            "end_reach_high", "r_2", "m", 1e-4, 1e2, 0.03, log=True, meaning="upper end to half its loss", reach=_REACH
        ),
        Parameter(
            "end_length", "L_e", "m", 1e-4, 1e2, 0.03, log=True, meaning="distance over which it fades", reach=_REACH
        ),
        Parameter("end_low", "y_1", "m", -1e3, 1e3, 0.0, meaning="lower end of the stroke"),
        Parameter("end_high", "y_2", "m", -1e3, 1e3, 1.0, meaning="upper end of the stroke"),
    ),
    amplitudes=("end_loss_low", "end_loss_high"),
    preset=("end_low", "end_high"),
    kinds=MOTORS,
    grid=grid,
    most=most,
    thrust=thrust,
    depends_on=(("position", "motor_force"),),
    exposed_by="accelerations near both ends of the stroke and in its middle",
    confused_with=("cable_force", "pole_pitch_error"),
)
