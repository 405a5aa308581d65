"""What forces on the mass, and levels of friction, give the rows of a force balance, row by row, compiled."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array, Flags, Integers
from linid.kernel_cache import kept as kept_on_disk


@kept_on_disk(error_model="numpy", nogil=True)
def pushed_rows(forces: Array, place: Integers, kept: Array, mass: Array) -> Array:
    """Accelerations (n, k) in m/s^2 by forces (n, k) in N.

    place: (n,) row of the last rest; kept: (n,) share of the force there that the bristle still holds; mass: (n,) kg.
    """
    out = np.empty_like(forces)
    for n in range(forces.shape[0]):
        rest = place[n]
        for k in range(forces.shape[1]):
            out[n, k] = (forces[n, k] - kept[n] * forces[rest, k]) / mass[n]
    return out


@kept_on_disk(error_model="numpy", nogil=True)
def rates_of(values: Array, t: Array, inner: Flags) -> Array:
    """How fast values (n, k) change, (n, k) per second, by the rows on either side; 0 where `inner` (n,) is not.

    t: (n,) s.
    """
    out = np.zeros_like(values)
    for n in range(1, values.shape[0] - 1):
        if inner[n]:
            between = t[n + 1] - t[n - 1]
            for k in range(values.shape[1]):
                out[n, k] = (values[n + 1, k] - values[n - 1, k]) / between
    return out


@kept_on_disk(error_model="numpy", nogil=True)
def resisted_rows(rising: Array, share: Array, kept: Array, mass: Array) -> Array:
    """Accelerations (n, k) in m/s^2 by levels of friction.

    rising: (n, k) levels in N, and what their rise damps; share: (n,) of the level that the bristle takes on up to
    a row; kept: (n,) of what it had at the row before; mass: (n,) kg.
    """
    out = np.empty_like(rising)
    bent = np.zeros(rising.shape[1])
    for n in range(rising.shape[0]):
        for k in range(bent.size):
            bent[k] = share[n] * rising[n, k] + kept[n] * bent[k]
            out[n, k] = bent[k] / mass[n]
    return out
