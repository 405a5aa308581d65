"""Derivatives by local polynomials against scipy.signal and against polynomials."""

import numpy as np
import pytest
from scipy.signal import savgol_filter

from linid.recording.local_polynomial import local_derivative


@pytest.mark.parametrize(
    ("width", "degree", "order", "n"), [(5, 2, 1, 5), (21, 3, 2, 300), (41, 3, 1, 41), (101, 2, 2, 900)]
)
def test_it_is_what_scipy_computes(width: int, degree: int, order: int, n: int) -> None:
    y = np.cumsum(np.random.default_rng(n).normal(size=n))
    expected = savgol_filter(y, width, degree, deriv=order, delta=1e-3)
    np.testing.assert_allclose(
        local_derivative(y, width, degree, order, 1e-3), expected, rtol=0, atol=1e-9 * np.abs(expected).max()
    )


def test_a_polynomial_is_differentiated_exactly_to_its_ends() -> None:
    t = 0.01 * np.arange(60)
    found = local_derivative(2.0 - t + 3.0 * t**2 + 5.0 * t**3, 9, 3, 2, 0.01)
    np.testing.assert_allclose(found, 6.0 + 30.0 * t, rtol=1e-8)
