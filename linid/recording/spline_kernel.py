"""Cubic splines through samples on a regular grid, compiled, so that several threads can be at them."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array
from linid.kernel_cache import kept


@kept(error_model="numpy", nogil=True)
def fill_not_a_knot(dt: float, samples: Array, out: Array) -> None:
    """Fill `out` (c, n - 1, 4) with coefficients of powers of the time since a sample, in s.

    dt: period in s; samples: (c, n), n >= 4. Source: de Boor 1978, A Practical Guide to Splines, ch. IV; the equations
    for the slopes at the samples are solved by elimination, which all channels share.
    """
    count = samples.shape[1]
    upper, inverse, slope = np.empty(count), np.empty(count), np.empty(count)
    upper[0] = 2.0
    for n in range(1, count - 1):
        inverse[n] = 1.0 / (4.0 - upper[n - 1])
        upper[n] = inverse[n]
    last = 1.0 / (1.0 - 2.0 * upper[count - 2])
    for c in range(samples.shape[0]):
        y = samples[c]
        slope[0] = (5.0 * (y[1] - y[0]) + (y[2] - y[1])) / (2.0 * dt)
        for n in range(1, count - 1):
            slope[n] = (3.0 * (y[n + 1] - y[n - 1]) / dt - slope[n - 1]) * inverse[n]
        end = ((y[count - 2] - y[count - 3]) + 5.0 * (y[count - 1] - y[count - 2])) / (2.0 * dt)
        slope[count - 1] = (end - 2.0 * slope[count - 2]) * last
        for n in range(count - 2, -1, -1):
            slope[n] -= upper[n] * slope[n + 1]
        for n in range(count - 1):
            chord = (y[n + 1] - y[n]) / dt
            cubic = (slope[n] + slope[n + 1] - 2.0 * chord) / dt
            out[c, n, 0], out[c, n, 1] = y[n], slope[n]
            out[c, n, 2], out[c, n, 3] = (chord - slope[n]) / dt - cubic, cubic / dt
