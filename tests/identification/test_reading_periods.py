"""Periods of a reading error that are tried beside the best one."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from linid.identification.guess.reading_periods import near_periods


@given(st.floats(3e-4, 2e-2), st.floats(0.2, 2.0), st.floats(-0.5, 0.5), st.sampled_from([1.0, 2.0]))
def test_one_of_them_keeps_the_second_harmonic_in_step_over_the_stroke(
    period: float, stroke: float, shift: float, harmonic: float
) -> None:
    # The true error has this period or half of it, but for half the width of a peak.
    true = harmonic / period + shift / stroke
    turns = [2.0 * abs(1.0 / one - true) * stroke for one in near_periods(period, stroke)]
    assert min(turns) < 0.13


def test_half_of_a_period_that_is_doubled_is_found_with_its_second_harmonic() -> None:
    y, stroke, true = np.linspace(0.0, 0.43, 4000), 0.43, 1.3534e-3
    error = np.sin(2.0 * math.pi * y / true + 0.3) + 0.15 * np.sin(4.0 * math.pi * y / true + 1.0)

    def left(period: float) -> float:
        angle = 2.0 * math.pi * y / period
        columns = np.stack([wave(n * angle) for n in (1, 2) for wave in (np.sin, np.cos)], axis=1)
        return float(np.sum((error - columns @ np.linalg.lstsq(columns, error, rcond=None)[0]) ** 2))

    doubled = 2.0 / (1.0 / true + 0.25 / stroke)  # off the peak's top, as a spectrum gives it
    best = min(near_periods(doubled, stroke), key=left)
    assert abs(best / true - 1.0) < true / stroke / 8.0
    assert left(best) < 0.3 * left(doubled)
