"""Cubic B-splines on equal intervals as columns, compiled."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array
from linid.kernel_cache import kept


@kept(error_model="numpy", nogil=True)
def uniform_splines(place: Array, pieces: int, size: int) -> Array:
    """Cubic B-splines (n, size) at places (n,) counted in intervals from the first one's beginning, 0 ... pieces.

    With as many splines as pieces these close a circle; else the last of them end beyond the last interval. Where there
    is no place (nan), there is no value.
    """
    out = np.zeros((place.size, size))
    for n in range(place.size):
        if not 0.0 <= place[n] <= pieces:
            out[n] = np.nan
            continue
        left = min(int(place[n]), pieces - 1)
        u = place[n] - left
        out[n, left] += (1.0 - u) ** 3 / 6.0
        out[n, (left + 1) % size] += (3.0 * u**3 - 6.0 * u**2 + 4.0) / 6.0
        out[n, (left + 2) % size] += (-3.0 * u**3 + 3.0 * u**2 + 3.0 * u + 1.0) / 6.0
        out[n, (left + 3) % size] += u**3 / 6.0
    return out
