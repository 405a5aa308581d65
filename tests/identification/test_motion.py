"""Smoothing of measured positions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import savgol_filter

from linid.recording.local_polynomial import local_derivative


@pytest.mark.parametrize(("width", "order"), [(5, 4), (7, 3), (81, 3)])
@pytest.mark.parametrize("derivative", [0, 1])
@pytest.mark.parametrize("n", [81, 82, 500])
def test_local_polynomials_are_followed_to_the_ends(width: int, order: int, derivative: int, n: int) -> None:
    """A cubic is its own nearest one; noise is smoothed as scipy does it."""
    t = np.linspace(0.0, 0.5, n)
    dt = t[1]
    cubic = np.polynomial.Polynomial([0.4, 1.3, -2.0, 0.7])
    found = local_derivative(cubic(t), width, order, derivative, dt)
    assert np.max(np.abs(found - (cubic.deriv(derivative) if derivative else cubic)(t))) < 1e-14 / dt**derivative
    noise = np.random.default_rng(n).standard_normal(n)
    expected = savgol_filter(noise, width, order, deriv=derivative, delta=dt)
    np.testing.assert_allclose(
        local_derivative(noise, width, order, derivative, dt), expected, atol=1e-9 / dt**derivative
    )
