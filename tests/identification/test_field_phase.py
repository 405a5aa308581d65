"""Intervals where the first derivative vanishes, and why the field is read at the measured position."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from linid.identification.uncertainty.field_phase import profile_intervals, second_differences


def thrust_lost(d: float, e: float, x: np.ndarray) -> np.ndarray:
    """Share of thrust that a phase error d x + e costs, to second order."""
    return -0.5 * (d * x + e) ** 2


@pytest.mark.parametrize("truth", [(0.0, 0.0), (0.004, -0.02)])
def test_intervals_cover_where_the_first_derivative_vanishes(truth: tuple[float, float]) -> None:
    """Thrust (1 - phase^2/2) k with white noise: the interval covers in 95 % of the draws, whatever the estimate."""
    random = np.random.default_rng(3)
    x = np.linspace(-1.0, 1.0, 400)
    noise = 2e-3
    room = np.array([[-1.0, 1.0], [-1.0, 1.0]])
    hits = 0
    draws = 100
    for _ in range(draws):
        estimate = truth + 0.05 * random.standard_normal(2)  # wherever a search may have ended in the flat valley
        d, e = estimate - truth
        rest = thrust_lost(d, e, x) + noise * random.standard_normal(x.size)
        phase = d * x + e
        # The gain k is the third parameter; its estimate is at the truth.
        jacobian = np.column_stack([-phase * x, -phase, np.ones(x.size), -(x**2), -x, -np.ones(x.size)])
        information = jacobian.T @ jacobian / noise**2
        ends = profile_intervals(jacobian.T @ rest / noise**2, information, information, (0, 1), room)
        assert all(low <= 0.0 <= high for low, high in ends)  # no estimate outside its own interval
        inside = [low <= t - p <= high for (low, high), t, p in zip(ends, truth, estimate, strict=True)]
        hits += inside[0]
    low, high = binom.ppf([0.0005, 0.9995], draws, 0.95) / draws
    assert low <= hits / draws <= max(high, 1.0)


def test_second_differences_are_exact_for_quadratics() -> None:
    random = np.random.default_rng(1)
    a, b, c = random.standard_normal((3, 20))

    def residuals(point: np.ndarray) -> np.ndarray:
        d, e = point[:, 2:3], point[:, 0:1]
        return 0.5 * a * d**2 + b * d * e + 0.5 * c * e**2 + 3.0 * d - e

    found = second_differences(residuals, np.array([0.3, 0.9, 0.4]), (2, 0), np.array([0.01, 0.02]))
    assert np.allclose(found, np.column_stack([a, b, c]), atol=1e-9)
