"""The views of the residual against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linid.diagnosis.report_data import ResidualTrace
from linid.report.residual_views import (
    amplitude_spectrum,
    folded,
    power_spectrum,
    residual_map,
    resolves_poles,
    symmetric_limit,
    worst_first,
)

FIELD = 222.0


def trace(before: np.ndarray, t: np.ndarray, y: np.ndarray, name: str = "a", split: str = "fit") -> ResidualTrace:
    return ResidualTrace(name, "motor", split, t, y, np.gradient(y, t), before, 0 * before, 0.1)


def sine(n: int = 8000, step: float = 1e-3, amplitude: float = 0.7, hertz: float = 40.0) -> ResidualTrace:
    t = np.arange(n) * step
    return trace(amplitude * np.sin(2 * np.pi * hertz * t + 0.3), t, 0.3 * np.sin(t))


def test_spectrum_shows_a_sine_with_its_amplitude() -> None:
    frequency, amplitude = amplitude_spectrum([sine()], "before")
    assert frequency[np.argmax(amplitude)] == pytest.approx(40.0)
    assert amplitude.max() == pytest.approx(0.7, rel=1e-3)
    assert amplitude_spectrum([sine()], "after")[1].max() < 1e-12


@pytest.mark.parametrize("length", [64, 65, 999, 1000])
def test_power_is_that_of_another_library(length: int) -> None:
    from scipy.signal import welch

    x = np.random.default_rng(3).standard_normal(1000) + 5.0
    _, power = welch(x, 1.0, "hann", length, detrend="constant", scaling="spectrum")
    np.testing.assert_allclose(power_spectrum(x, length), power, rtol=1e-9, atol=1e-15)


def test_spectrum_averages_power_by_duration_over_different_clocks() -> None:
    both = [sine(4000), sine(6000, 2e-3, amplitude=0.0)]  # 4 s of 0.7 N, 12 s of nothing at half the rate
    frequency, amplitude = amplitude_spectrum(both, "before")
    assert amplitude[np.argmin(np.abs(frequency - 40))] == pytest.approx(0.7 * np.sqrt(4 / 16), rel=1e-2)
    assert frequency[-1] == pytest.approx(500.0)


def test_spectrum_bridges_gaps_and_refuses_what_is_too_short() -> None:
    whole = sine()
    holes = whole.before.copy()
    holes[[100, 2000, 5001]] = np.nan
    amplitude = amplitude_spectrum([replace(whole, before=holes)], "before")[1]
    assert amplitude.max() == pytest.approx(0.7, rel=1e-2)
    assert all(part.size == 0 for part in amplitude_spectrum([sine(100)], "before"))


@pytest.mark.parametrize("order", [1, 2, 4])
def test_folding_over_a_pole_pair_keeps_every_order(order: int) -> None:
    t = np.linspace(0, 9, 90001)
    y = 0.1 * t - 0.4  # steady, so that a bin is filled evenly; crosses zero: the angle is negative as well
    one = folded([trace(np.sin(order * FIELD * y + 0.2), t, y)], "before", FIELD)
    # A mean over a bin is the sine at its centre times the bin's sinc.
    bin_mean = np.sin(order * FIELD * one.x + 0.2) * np.sinc(order / len(one.x))
    np.testing.assert_allclose(one.mean, bin_mean, atol=0.01)
    assert one.x[0] > 0 and one.x[-1] < 2 * np.pi / FIELD


@given(force=st.floats(-50, 50), stroke=st.floats(1e-3, 5.0), wavenumber=st.none() | st.floats(10.0, 900.0))
@settings(max_examples=30, deadline=None)
def test_a_constant_force_is_constant_in_every_view(force: float, stroke: float, wavenumber: float | None) -> None:
    t = np.arange(3000) * 1e-3
    one = trace(np.full(3000, force), t, stroke * np.sin(3 * t))
    cells = residual_map([one], "before", wavenumber).mean
    np.testing.assert_allclose(cells[np.isfinite(cells)], force, rtol=1e-9, atol=1e-12)
    if wavenumber is not None:
        mean = folded([one], "before", wavenumber).mean
        np.testing.assert_allclose(mean[np.isfinite(mean)], force, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("stroke", [0.05, 0.3, 1.5])
def test_the_map_has_no_beats_of_cell_and_pole(stroke: float) -> None:
    t = np.arange(60000) * 1e-3
    y = stroke * np.abs(2 * (0.0371 * t % 1) - 1)
    one = trace(np.sin(FIELD * y), t, y)
    seen = residual_map([one], "before", FIELD)
    largest = np.nanmax(np.abs(seen.mean[:, 1:-2]))
    assert largest > 0.9 if resolves_poles([one], FIELD) else largest < 0.1
    assert resolves_poles([one], FIELD) == (stroke < 1.0)


def test_the_map_has_position_across_and_velocity_up() -> None:
    t = np.linspace(0, 20, 20001)
    y = np.sin(t)
    one = trace(np.where((y > 0.2) & (np.cos(t) < -0.2), 1.0, 0.0), t, y)
    seen = residual_map([one], "before")
    assert seen.mean.shape == (len(seen.v) - 1, len(seen.y) - 1)
    up, across = np.nonzero(np.nan_to_num(seen.mean) > 0.99)
    assert seen.y[across].min() >= 0.1 and seen.v[up + 1].max() <= -0.1
    assert symmetric_limit(seen) == pytest.approx(1.0)


def test_worst_held_out_recording_comes_first() -> None:
    t = np.arange(100) * 1e-3
    made = [
        trace(np.full(100, size), t, t, name, split)
        for size, name, split in ((9.0, "a", "fit"), (1.0, "b", "held_out"), (2.0, "c", "held_out"))
    ]
    assert [one.recording for one in worst_first(made)] == ["c", "b", "a"]
