"""The scope of the sine model: k_N, its limit, the paper's fit, and the cost of a sine."""

from __future__ import annotations

import math

import numpy as np
import pytest

from linid.physics.field.guideway import gaussian_guideway
from linid.physics.field.sine_scope import PAPER_FIT, best_k, delta, fit_of_best_k, limit_k, sine_cost


@pytest.mark.parametrize(
    ("pairs", "k"), [(1, 0.35692), (2, 0.36974), (5, 0.38954), (10, 0.40547), (100, 0.44892), (1000, 0.46072)]
)
def test_best_k_of_a_finite_guideway(pairs: int, k: float) -> None:
    assert best_k(pairs) == pytest.approx(k, abs=5e-6)


@pytest.mark.parametrize("k", [0.3, 0.4, 0.5])
def test_delta_is_the_derivative_of_the_squared_error(k: float) -> None:
    """(24) against the sums of Gaussian integrals that it comes from, differentiated numerically."""
    pairs = 3

    def error(k: float) -> float:
        index = np.arange(-pairs, pairs + 1)
        apart = index[:, None] - index[None, :]
        own = np.sum((-1.0) ** apart * k * math.sqrt(0.5 * math.pi) * np.exp(-(apart**2) / (2.0 * k * k)))
        crossed = index.size * k * math.sqrt(math.pi) * math.exp(-0.25 * (math.pi * k) ** 2)
        return float(own - 2.0 * crossed)

    step = 1e-5
    slope = (error(k + step) - error(k - step)) / (2.0 * step)
    assert delta(k, pairs) == pytest.approx(slope, rel=1e-8)


def test_the_limit_is_the_minimum_over_an_infinite_guideway() -> None:
    """0.46223, by least squares of the sampled field against a cosine; the paper's 0.4594 is its fit's constant."""
    limit = limit_k()
    assert limit == pytest.approx(0.46223, abs=5e-6)
    y = np.linspace(0.0, 2.0, 400, endpoint=False)

    def error(k: float) -> float:
        return float(np.mean((gaussian_guideway(y, k) - np.cos(np.pi * y)) ** 2))

    least = error(limit)
    for k in (limit - 0.001, limit + 0.001, PAPER_FIT[0]):
        assert error(k) > least
    assert best_k(10**6) == pytest.approx(limit, abs=1e-5)


def test_the_papers_fit_is_that_of_the_first_hundred() -> None:
    """Its constant is no limit: k_1000 lies above it already."""
    found = fit_of_best_k(range(1, 101))
    assert found == pytest.approx(PAPER_FIT, abs=1e-4)
    assert best_k(1000) > found[0]


def test_the_cost_of_a_sine_is_what_its_field_misses() -> None:
    y = np.linspace(0.0, 2.0, 4000, endpoint=False)
    for k in (0.2, 0.4, 0.46223, 0.7):
        field, cosine = gaussian_guideway(y, k), np.cos(np.pi * y)
        cost = sine_cost(k)
        size = math.sqrt(np.mean(cosine**2))
        assert cost.of_cosine == pytest.approx(math.sqrt(np.mean((field - cosine) ** 2)) / size, rel=1e-9)
        best = 2.0 * np.mean(field * cosine)
        assert cost.fundamental == pytest.approx(best, rel=1e-9)
        rest = math.sqrt(np.mean((field - best * cosine) ** 2)) / (abs(best) * size)
        assert cost.of_field == pytest.approx(rest, rel=1e-6, abs=1e-12)
        # Thrust of three windings 120 degrees apart under currents that sum to zero: orders divisible by 3 cancel.
        spectrum = 2.0 / y.size * np.abs(np.fft.rfft(field))  # y covers one period
        felt = [spectrum[n] for n in range(3, 60, 2) if n % 3]
        assert cost.in_star == pytest.approx(math.sqrt(np.sum(np.square(felt))) / abs(best), rel=1e-6, abs=1e-12)


def test_the_advice_knows_that_a_star_cancels_the_third_harmonic() -> None:
    assert sine_cost(0.6).advice.startswith("sine will do:")
    assert sine_cost(0.46).of_field > 0.01 and sine_cost(0.46).advice.startswith("sine will do in a star")
    assert sine_cost(0.15).advice.startswith("take theta:")


def test_a_ratio_is_above_zero() -> None:
    with pytest.raises(ValueError, match="above zero"):
        sine_cost(0.0)
