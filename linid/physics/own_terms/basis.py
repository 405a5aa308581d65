"""Cubic B-splines on equal intervals: what `spline`, `spline2` and `periodic` of a formula mean.

`spline(x, low, high, n)` has n - 3 intervals of width h = (high - low)/(n - 3). In interval j (from 0), at the share u
of it, it is the sum over i = 0 to 3 of B_i(u) c_(j+i), c being its n coefficients; below `low` and above `high` it
keeps the value there. `periodic(x, period, n)` has n intervals of width period/n from x = 0 on, and coefficient n is
coefficient 0 again. `spline2(x, low, high, n, x2, low2, high2, n2)` has coefficients c_(j n2 + k) that multiply
basis function j of x and k of x2, with B_0 = (1 - u)^3/6 and so on to B_3 = u^3/6.

Source: Eilers and Marx 1996, Stat. Sci. 11, 89; de Boor 1978, A Practical Guide to Splines.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from linid.arrays import Array


def basis_columns(kind: str, numbers: Sequence[float], x: Array, x2: Array | None = None) -> Array:
    """Design matrix (N, coefficients), dimensionless: columns times coefficients is the curve (de Boor 1978).

    kind: spline, spline2 or periodic; numbers: those of the formula in their order (low, high, n; period, n; low,
    high, n, low2, high2, n2), in the unit of x; x, x2: (N,) arguments.
    """
    if kind == "periodic":
        period, n = numbers[0], int(numbers[1])
        s = np.asarray(x, dtype=float) * (n / period)
        s = s - np.floor(s / n) * n
        s[s >= n] = 0.0
        return _columns(s, n, n)
    first = _clamped(x, numbers[0], numbers[1], int(numbers[2]))
    if kind == "spline" or x2 is None:
        return first
    second = _clamped(x2, numbers[3], numbers[4], int(numbers[5]))
    return np.asarray((first[:, :, None] * second[:, None, :]).reshape(first.shape[0], -1))


def _clamped(x: Array, low: float, high: float, n: int) -> Array:
    s = (np.asarray(x, dtype=float) - low) * ((n - 3) / (high - low))
    return _columns(np.clip(s, 0.0, n - 3.0), n, n - 3)


def _columns(s: Array, n: int, intervals: int) -> Array:
    """The four basis functions that are not zero at s (N,) intervals, in their columns (N, n); wrapped around at n."""
    inside = np.where(np.isfinite(s), s, 0.0)
    j = np.minimum(inside.astype(int), intervals - 1)
    u = inside - j
    weights = np.stack(
        [(1.0 - u) ** 3, 3.0 * u**3 - 6.0 * u**2 + 4.0, -3.0 * u**3 + 3.0 * u**2 + 3.0 * u + 1.0, u**3], axis=1
    )
    out = np.zeros((s.size, n))
    np.put_along_axis(out, (j[:, None] + np.arange(4)) % n, weights / 6.0, axis=1)
    out[~np.isfinite(s)] = np.nan
    return out
