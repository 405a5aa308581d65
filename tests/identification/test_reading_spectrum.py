"""The periodogram of reading errors against the exact second differences and against planted errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.identification.objectives.acceleration import Acceleration
from linid.identification.signals.reading_spectrum import _lengths, likely_periods
from linid.physics.model import Model
from linid.recording.recording import Recording
from tests.identification.stand import stand


def recordings() -> list[Recording]:
    return [r for r in stand().recordings if r.split == "fit" and r.name[:5] in ("sine_", "moves", "freew")]


def balance(chosen: list[Recording]) -> Acceleration:
    return Acceleration(Model("theta"), tuple(chosen), 1, stride=5)


def likely(period: float, second: float) -> tuple[float, tuple[float, ...]]:
    """The stroke, and periods found of an error up to 3 um whose second harmonic is `second` times as large, m."""

    def error(y: np.ndarray) -> np.ndarray:
        angle = 2.0 * np.pi * y / period
        size = 3e-6 / max(1.0, second)
        return np.asarray(size * (np.sin(angle + 0.7) + second * np.sin(2.0 * angle + 0.2)))

    part = balance([replace(r, y=r.y + error(r.y)) for r in recordings()])
    truth = Model("theta").vector(stand().truth)[None, :]
    rest = -part.residuals(truth, np.zeros((1, 0)))[0]
    stroke = float(np.ptp(part.motion.y))
    return stroke, likely_periods(part, rest, np.ones(rest.size), 0.2 * stroke, 0.3e-3, 5)


@pytest.mark.parametrize("second", [0.0, 0.3, 0.6])
@pytest.mark.parametrize("period", [0.73e-3, 2.33e-3, 4.9e-3, 11e-3])
def test_a_planted_period_is_the_likeliest(period: float, second: float) -> None:
    stroke, found = likely(period, second)
    # Periods are told apart if they differ by one wave over the stroke; the second harmonic turns twice as fast.
    assert abs(stroke / found[0] - stroke / period) < 0.13


@pytest.mark.parametrize("period", [0.73e-3, 4.9e-3])
def test_an_error_that_is_nearly_all_second_harmonic_is_found_by_that(period: float) -> None:
    stroke, found = likely(period, 20.0)
    assert abs(stroke / found[0] - 2.0 * stroke / period) < 0.13


def test_moments_by_the_adjoint_are_those_of_the_second_differences() -> None:
    part = balance(recordings()[:3])
    random = np.random.default_rng(4)
    residual, error = random.standard_normal(part.rows.size), random.standard_normal(part.motion.y.size)
    seen, inputs = np.zeros(error.size), part.simulator.inputs
    for index, kernel in enumerate(part.kernels):
        mine = slice(inputs.sample_offsets[index], inputs.sample_offsets[index + 1])
        second = np.pad(np.diff(error[mine], 2), 1) / inputs.dts[index] ** 2
        seen[mine] = np.convolve(second, kernel, mode="same")
    assert part.stencils.second(error[None, :])[0] == pytest.approx(seen[part.rows], rel=1e-9, abs=1e-6)
    back = part.stencils.sent_back(residual, error.size)
    assert float(seen[part.rows] @ residual) == pytest.approx(float(error @ back), rel=1e-9)


def test_lengths_are_near_enough_to_the_exact_ones_for_a_ranking() -> None:
    part = balance(recordings())
    wavenumbers = 2.0 * np.pi / np.array([20e-3, 6e-3, 2e-3, 0.8e-3])
    exact = []
    for k in wavenumbers:
        pair = [part.stencils.second(f(k * part.motion.y)[None, :])[0] for f in (np.sin, np.cos)]
        exact.append(0.5 * sum(float(column @ column) for column in pair))
    ratio = _lengths(part, np.ones(part.rows.size), wavenumbers) / np.array(exact)
    assert np.all((ratio > 0.6) & (ratio < 1.7)) and np.all(np.abs(ratio[:2] - 1.0) < 0.1)
