"""Periods of a reading error that are worth a trial: peaks of the residual's spectrum."""

from __future__ import annotations

from linid.arrays import Array
from linid.identification.objectives.acceleration import Acceleration
from linid.identification.signals.reading_spectrum import likely_periods
from linid.physics.effects.effect import Outlook

_PERIODS = 6  # of a reading error that are tried
_SHORTEST_PERIOD = 0.3e-3  # m (rotary: rad)


def peaking_periods(part: Acceleration, rest: Array, weights: Array, outlook: Outlook) -> tuple[float, ...]:
    """Periods in m (rotary: rad) that could explain a residual.

    part: the rows of the balance; rest, weights: (N,) weighted residual and the weights in it.
    """
    longest = 0.2 * outlook.stroke
    # Shorter ones pass too fast for the sampling at any speed above a tenth of the highest.
    shortest = max(_SHORTEST_PERIOD, 0.2 * outlook.top_speed * outlook.period)
    return likely_periods(part, rest, weights, longest, shortest, _PERIODS)
