"""Derivatives of what leads smoothly from a point of the unit cube to a peer's numbers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_STEP = 1e-6  # of the unit cube; leaves some 1e-9 of a derivative


def by_differences(numbers: Callable[[Array], Array], x: Array) -> Array:
    """(q, p) derivatives of the numbers (q,) by the coordinates of x (p,), one-sided at the cube's faces."""
    columns = []
    for k in range(x.size):
        up, down = x.copy(), x.copy()
        up[k], down[k] = min(x[k] + _STEP, 1.0), max(x[k] - _STEP, 0.0)
        columns.append((numbers(up) - numbers(down)) / (up[k] - down[k]))
    return np.column_stack(columns)
