"""Information that only the noise of the inputs feigns, and deviations known better than by the covariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linid.identification.result import Estimate
from linid.identification.uncertainty.covariance import _LEAST_SHARE, _with_deviations, _without_spurious
from linid.identification.uncertainty.identifiability import inseparable_pairs


def test_feigned_information_is_taken_off_in_every_direction() -> None:
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    information = turn @ np.diag([4.0, 2.0, 1.0]) @ turn.T
    spurious = turn @ np.diag([1.0, 0.5, 0.999]) @ turn.T
    left = turn @ np.diag([3.0, 1.5, _LEAST_SHARE]) @ turn.T
    np.testing.assert_allclose(_without_spurious(information, spurious), left, atol=1e-10)


def test_a_parameter_without_information_has_none_to_lose() -> None:
    # Noise alone moves the third one: the bristle of an axis that the clean data never show at rest.
    information = np.diag([4e14, 2.0, 0.0])
    spurious = np.diag([1e14, 0.5, 20.0])
    left = np.diag([3e14, 1.5, 0.0])
    np.testing.assert_allclose(_without_spurious(information, spurious), left, rtol=1e-9, atol=1e-9)


def test_parameters_follow_those_whose_deviations_are_known_otherwise() -> None:
    """All others are the pair times slopes, and something of their own."""
    slopes = np.array([[2.0, 0.0], [1.0, 0.5], [0.0, 0.0]])
    own = np.diag([0.01, 0.04, 1.0])

    def covariance(pair: np.ndarray) -> np.ndarray:
        return np.block([[pair, pair @ slopes.T], [slopes @ pair, slopes @ pair @ slopes.T + own]])

    before = np.array([[4e4, 100.0], [100.0, 1.0]])
    factors = np.array([1e-3, 2.0])
    after = covariance(before * np.outer(factors, factors))
    np.testing.assert_allclose(_with_deviations(covariance(before), [0, 1], factors), after, rtol=1e-9, atol=1e-9)


def test_a_parameter_found_to_be_zero_is_known_or_not_like_others() -> None:
    """Relative to zero nothing is known: its pairs are told."""
    zero = Estimate("viscous_friction", "b", "N s/m", 0.0, 0.2, -0.4, 0.4)
    other = Estimate("coulomb_force", "F_C", "N", 5.0, 0.01, 4.98, 5.02)
    names, correlation = (zero.name, other.name), np.array([[1.0, 0.999], [0.999, 1.0]])
    ((first, second, rho, _),) = inseparable_pairs((zero, other), names, correlation, False, "linear", "force")
    assert (first, second, rho) == (zero.name, other.name, 0.999)
    exact = replace(zero, std=0.0)
    assert inseparable_pairs((exact, other), names, correlation, False, "linear", "force") == ()
