"""Periods of a reading error that are worth a trial: peaks of the residual's spectrum, and those about the best one."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.acceleration import Acceleration
from linid.identification.signals.reading_spectrum import likely_periods
from linid.physics.effects.effect import Outlook

_PERIODS = 16  # periods of a reading error that are tried, with their doubles
_SHORTEST_PERIOD = 0.3e-3  # m (rotary: rad)
_BESIDE_PEAK = 4  # periods to either side of a peak, over half its width


def peaking_periods(part: Acceleration, rest: Array, weights: Array, outlook: Outlook) -> tuple[float, ...]:
    """Periods in m (rotary: rad) that could explain a residual; a strong second harmonic has half the period.

    part: the rows of the balance; rest, weights: (N,) weighted residual and the weights in it.
    """
    longest = 0.2 * outlook.stroke
    # Shorter ones pass too fast for the sampling at any speed above a tenth of the highest.
    shortest = max(_SHORTEST_PERIOD, 0.2 * outlook.top_speed * outlook.period)
    found = likely_periods(part, rest, weights, longest, shortest, _PERIODS)
    return (*found, *(2.0 * period for period in found))


def near_periods(period: float, stroke: float) -> tuple[float, ...]:
    """Periods within a peak of this one and of its half, all in m (rotary: rad).

    The second harmonic turns twice as fast from one end of the stroke to the other: off the peak's top it is lost, and
    twice the period, which has the same wave as its own second harmonic, explains no less by chance.
    """
    shifts = np.arange(-_BESIDE_PEAK, _BESIDE_PEAK + 1) / (2.0 * _BESIDE_PEAK)
    per_length = np.add.outer([1.0 / period, 2.0 / period], shifts / stroke)
    return tuple((1.0 / per_length[per_length > 0.0]).tolist())
