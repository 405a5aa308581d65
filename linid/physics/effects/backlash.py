"""Backlash: between motor and encoder there is play, so that the reading waits after each reversal.

Source: the play operator (Krasnosel'skii and Pokrovskii 1989, Systems with Hysteresis).
"""

from __future__ import annotations

from linid.physics.effects.effect import Effect, term
from linid.physics.parameter import Parameter


@term
def sensor(t, y, v, i_1, i_2, i_3, record, elapsed, s_1, backlash_gap):
    """The reading lags behind by the share s_1 of half the gap, m."""
    return -0.5 * backlash_gap * s_1


@term
def initial(t, y, v, i_1, i_2, i_3, record, elapsed, s_1, backlash_gap):
    """The state at the start (dimensionless, -1 to 1): a moving axis has taken up the play, a resting one stands in
    its middle.
    """
    if v == 0.0:
        return (0.0,)
    return (1.0 if v > 0.0 else -1.0,)


@term
def advance(h, t, y, v, a, i_1, i_2, i_3, record, elapsed, s_1, backlash_gap):
    """The play operator: s_1 (dimensionless) follows the travel from -1 to 1, exact for any path without reversal."""
    travel = 2.0 * v * h / max(backlash_gap, 1e-12)
    return (min(max(s_1 + travel, -1.0), 1.0),)


EFFECT = Effect(
    name="backlash",
    slot="SENSOR",
    physics="The reading follows the motor with a play b: it waits after each reversal until the play is taken up.",
    parameters=(Parameter("backlash_gap", "b", "m", 0.0, 0.1, 0.0, meaning="play between motor and encoder"),),
    amplitudes=("backlash_gap",),
    sensor=sensor,
    initial=initial,
    advance=advance,
    depends_on=(("travel", "direction"), ("travel",), ("acceleration",)),
    exposed_by="quick reversals with the drive on",
    confused_with=("flexible_load", "input_delay"),
    play="backlash_gap",
    told=True,
)
