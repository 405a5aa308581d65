"""Information that only the noise of the inputs feigns."""

from __future__ import annotations

import numpy as np

from linid.identification.uncertainty import _LEAST_SHARE, _without_spurious


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
