"""Numbers of the normal and the chi-squared distribution that intervals and noise estimates rest on."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array

NORMAL_97_5 = 1.959964  # normal quantile of 97.5 %: half-width of parameters' 95 % intervals, in deviations
MEDIAN_ABSOLUTE = 0.6745  # median of the absolute values of a standard normal: a spread that outliers do not touch
CHI_SQUARED_95 = 3.841459  # 95 % quantile with one degree of freedom
TINY = 1e-300  # keeps a divisor from zero where what it divides is zero, too


def robust_spread(values: Array) -> float:
    """Standard deviation of normal values (n,) about zero in their unit, whatever a few others are.

    Source: the median absolute deviation (Hampel 1974, J. Am. Stat. Assoc. 69, 383).
    """
    return float(np.median(np.abs(values))) / MEDIAN_ABSOLUTE
