"""Splines against known functions; resampling and trimming."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linid.errors import DataError
from linid.recording import Recording, cubic_spline_coefficients, to_uniform, trim


@given(st.lists(st.floats(-10, 10), min_size=4, max_size=4), st.floats(1e-4, 1.0), st.integers(4, 40))
@settings(max_examples=50, deadline=None)
def test_a_cubic_is_reproduced_exactly(c: list[float], dt: float, n: int) -> None:
    t = np.arange(n) * dt
    polynomial = np.polynomial.Polynomial(c)
    coefficients = cubic_spline_coefficients(dt, np.stack([polynomial(t), -polynomial(t)]))
    assert coefficients.shape == (2, n - 1, 4)
    k = np.arange(n - 1)
    s = 0.3 * dt
    value = sum(coefficients[0, :, p] * s**p for p in range(4))
    scale = 1 + np.abs(polynomial(t)).max()
    np.testing.assert_allclose(value, polynomial(k * dt + s), atol=1e-9 * scale)
    np.testing.assert_allclose(coefficients[1], -coefficients[0], atol=1e-6 * np.abs(coefficients).max())


def test_coefficients_are_continuous_and_interpolate() -> None:
    x = np.random.default_rng(0).normal(size=(3, 50))
    dt = 1e-3
    a = cubic_spline_coefficients(dt, x)
    np.testing.assert_allclose(a[:, :, 0], x[:, :-1], atol=1e-12)
    for derivative in range(3):
        left = sum(
            a[:, :-1, p] * np.prod(np.arange(p, p - derivative, -1)) * dt ** (p - derivative)
            for p in range(derivative, 4)
        )
        right = a[:, 1:, derivative] * [1, 1, 2][derivative]
        np.testing.assert_allclose(left, right, atol=1e-8 * np.abs(right).max())
    with pytest.raises(DataError):
        cubic_spline_coefficients(dt, np.zeros((1, 1)))


@pytest.mark.parametrize("n", [2, 3, 4, 5, 60])
def test_coefficients_are_those_of_an_independent_library(n: int) -> None:
    from scipy.interpolate import CubicSpline

    dt, x = 2e-3, np.random.default_rng(n).normal(size=(3, n))
    theirs = CubicSpline(np.arange(n) * dt, x, axis=1).c[::-1].transpose(2, 1, 0)
    ours = cubic_spline_coefficients(dt, x)
    for p in range(4):
        np.testing.assert_allclose(ours[:, :, p], theirs[:, :, p], rtol=0.0, atol=1e-12 * np.abs(x).max() / dt**p)


def recording(t: np.ndarray) -> Recording:
    return Recording(
        "r", t.copy(), np.sin(20 * t), phase_currents=np.stack([np.cos(20 * t)] * 3), v=20 * np.cos(20 * t)
    )


def test_regular_recording_is_returned_unchanged() -> None:
    r = recording(np.arange(100) * 1e-3)
    assert to_uniform(r) is r


@given(st.integers(0, 10**6), st.floats(0.02, 0.3))
@settings(max_examples=25, deadline=None)
def test_jitter_is_removed(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    r = to_uniform(recording(np.arange(300) * 1e-3 + 1e-3 * size * rng.uniform(-1, 1, 300)))
    assert np.ptp(np.diff(r.t)) < 1e-12
    np.testing.assert_allclose(r.y, np.sin(20 * r.t), atol=1e-5)
    assert r.phase_currents is not None and r.v is not None and any("resampled" in n for n in r.notes)
    np.testing.assert_allclose(r.phase_currents[2], np.cos(20 * r.t), atol=1e-5)


def test_late_stamps_do_not_overshoot() -> None:
    """A hold-up of the clock followed by a burst: positions between the samples stay between their values."""
    t = np.arange(400) * 1e-3
    t[200:207] = 0.2065 + np.arange(7) * 5e-5
    y = np.arange(400) * 1e-3
    r = to_uniform(Recording("r", t, y))
    assert (np.diff(r.y) >= 0).all()
    assert any("set `period: 0.001`" in n for n in r.notes)


def test_long_gap_keeps_the_longest_part() -> None:
    t = np.delete(np.arange(500) * 1e-3, np.arange(100, 130))
    r = to_uniform(recording(t))
    assert r.t[0] == pytest.approx(0.13) and len(r.t) == 370
    assert any("gap-free part" in n and "370 of 470" in n for n in r.notes)


def test_trim() -> None:
    r = recording(np.arange(100) * 1e-3)
    cut = trim(r, 0.02, 0.05)
    np.testing.assert_allclose(cut.t, np.arange(20, 51) * 1e-3)
    assert cut.phase_currents is not None and cut.phase_currents.shape == (3, 31)
    assert any("trimmed" in n and "31 of 100" in n for n in cut.notes)
    assert trim(r, -1, 1) is r
    with pytest.raises(DataError, match="0 samples"):
        trim(r, 5, 6)
