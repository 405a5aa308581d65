"""Derivatives of evenly sampled data by local polynomials (Savitzky and Golay)."""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

Array = NDArray[np.float64]


def local_derivative(y: Array, width: int, degree: int, order: int, period: float) -> Array:
    """Derivative of the polynomial that fits `width` samples around each sample best; (n,), unit of y per s^order.

    y: (n,); width: odd, from 3 to n; period: s. In the half widths at the ends the outermost window's polynomial is
    taken. Computed here because scipy.signal takes longer to import than a friction fit.
    Source: Savitzky and Golay 1964, Anal. Chem. 36.
    """
    half, n = width // 2, y.size
    x = np.arange(-half, half + 1) / half
    coefficients = np.linalg.pinv(np.vander(x, degree + 1, increasing=True))  # of a window's polynomial
    out = np.empty(n)
    out[half : n - half] = np.convolve(y, math.factorial(order) * coefficients[order, ::-1], mode="valid")
    out[:half] = Polynomial(coefficients @ y[:width]).deriv(order)(x[:half])
    out[n - half :] = Polynomial(coefficients @ y[n - width :]).deriv(order)(x[half + 1 :])
    return out / (half * period) ** order
