"""Types of arrays, as they are named in all signatures, and how long ones are joined."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]


def joined(parts: Sequence[Array], axis: int) -> Array:
    """Arrays one after the other; a single one as it is, for it may be long.

    parts: (n, ...) each, or with n at another axis. Returns (n, ...), as many as all together.
    """
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=axis)
