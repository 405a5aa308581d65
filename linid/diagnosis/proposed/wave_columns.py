"""Waves as columns, as rows see them that are means of what passes within a bump."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from linid.arrays import Array


def wave_columns(x: Array, wavenumbers: Sequence[float] | Array, spread: Array | float = 0.0) -> Array:
    """Cosine and sine (n, 2 W) of each of the wavenumbers (W,) in rad per unit of x (n,), where what is short fades.

    spread: (n,) in the same unit, deviation of the values that a row is the mean of; as that of a Gaussian's, whose
    spectrum is one.
    """
    k = np.asarray(wavenumbers)
    angles = np.multiply.outer(x, k)
    seen = np.exp(-0.5 * np.multiply.outer(np.broadcast_to(spread, x.shape), k) ** 2)
    return np.stack([seen * np.cos(angles), seen * np.sin(angles)], axis=2).reshape(x.size, -1)
