"""Rates with 95 % Wilson score intervals."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Rate:
    """`count` of `total` (count may hold halves) with the 95 % Wilson interval; nan without any."""

    count: float
    total: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """The rate itself."""
        return self.count / self.total if self.total else math.nan


def rate(values: Iterable[float]) -> Rate:
    """Mean of values in [0, 1] with its 95 % Wilson score interval."""
    from scipy.stats import norm

    listed = list(values)
    n, k = len(listed), float(sum(listed))
    if n == 0:
        return Rate(0.0, 0, math.nan, math.nan)
    z = float(norm.ppf(0.975))
    p = k / n
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return Rate(k, n, max(0.0, middle - half), min(1.0, middle + half))
