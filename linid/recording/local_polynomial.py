"""Evenly sampled data smoothed or differentiated by local polynomials (Savitzky and Golay)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from linid.arrays import Array

_LEAST_WIDTH = 5  # samples: a cubic passes through four, and would smooth nothing


def window_width(seconds: float, dt: float) -> int:
    """Samples of a window of about `seconds` for a local cubic, odd; dt: s."""
    return max(_LEAST_WIDTH, 2 * round(0.5 * seconds / dt) + 1)


def local_derivative(y: Array, width: int, degree: int, order: int, period: float) -> Array:
    """Derivative of the polynomial that fits `width` samples around each sample best; (n,), unit of y per s^order.

    y: (n,); width: odd, from 3 to n; order: 0 smooths; period: s. In the half widths at the ends the outermost window's
    polynomial is taken. scipy's `savgol_filter` gives the same, but its ends take longer than all the rest, and
    scipy.signal takes long to import. Source: Savitzky and Golay 1964, Anal. Chem. 36.
    """
    weights = local_weights(width, degree, order) / period**order
    half = width // 2
    out = np.empty_like(y)
    out[half : y.size - half] = np.correlate(y, weights[half], "valid")
    out[:half] = weights[:half] @ y[:width]
    out[y.size - half :] = ((-1.0) ** order * weights[:half] @ y[-width:][::-1])[::-1]
    return out


@lru_cache(maxsize=64)
def local_weights(width: int, degree: int, order: int) -> Array:
    """Weights (m, width), m = width // 2 + 1, of the first samples of a window that give the polynomial nearest to all
    of it at sample 0, 1 ... up to the middle, per step of one.
    """
    x = np.linspace(-1.0, 1.0, width)
    basis = [np.polynomial.Legendre.basis(n) for n in range(degree + 1)]
    values = np.column_stack([b(x) for b in basis])
    wanted = np.column_stack([b.deriv(order)(x) if order else b(x) for b in basis])
    return np.asarray((x[1] - x[0]) ** order * wanted[: width // 2 + 1] @ np.linalg.pinv(values))
