"""Waves as the rows see them: beside the very means that a bump takes of them."""

from __future__ import annotations

import numpy as np
import pytest

from linid.diagnosis.proposed.wave_columns import wave_columns
from linid.identification.objectives.acceleration import bump


@pytest.mark.parametrize("seen", [0.95, 0.6, 0.3])
def test_what_is_short_fades_as_in_the_mean_of_a_bump(seen: float) -> None:
    """At a constant speed, and at a wavenumber at which so much of the wave is left."""
    dt, speed, kernel = 1e-3, 6.0, bump(7)
    t = np.arange(4000) * dt
    place = (np.arange(kernel.size) - (kernel.size - 1) / 2.0) * dt
    blur = float(np.sqrt(kernel @ place**2 / kernel.sum()))
    k = np.sqrt(-2.0 * np.log(seen)) / (speed * blur)
    y = speed * t
    mean = np.convolve(np.cos(k * y), kernel / kernel.sum(), "same")
    column = wave_columns(y, (k,), np.full(t.size, speed * blur))[:, 0]
    inner = slice(20, -20)
    assert np.max(np.abs(column - mean)[inner]) < 0.05
    assert np.max(np.abs(column[inner])) == pytest.approx(seen, abs=1e-3)


def test_without_a_spread_waves_are_waves() -> None:
    y = np.linspace(0.0, 1.0, 7)
    assert wave_columns(y, (3.0, 5.0)) == pytest.approx(
        np.stack([np.cos(3.0 * y), np.sin(3.0 * y), np.cos(5.0 * y), np.sin(5.0 * y)], axis=1)
    )
