"""Sensor noise and quantisation have the statistics that the description promises."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from linid.stand.description import Measurement
from linid.stand.measurement import measure, quantise

N = 200_000


@given(
    x=st.lists(st.floats(-1, 1), min_size=1, max_size=20).map(np.array),
    resolution=st.sampled_from([1e-7, 1e-6, 2.5e-7, 1e-3, 0.3]),
)
def test_quantised_values_are_the_nearest_multiples(x: np.ndarray, resolution: float) -> None:
    logged = quantise(x, resolution)
    assert np.max(np.abs(logged - x)) <= resolution / 2 * (1 + 1e-6)
    np.testing.assert_allclose(logged / resolution, np.round(logged / resolution), atol=1e-6)
    np.testing.assert_array_equal(quantise(logged, resolution), logged)


def test_quantised_values_are_the_doubles_of_their_decimals() -> None:
    assert quantise(np.array([0.39000003]), 1e-7)[0] == 0.39
    assert quantise(np.array([0.1234]), 1e-3)[0] == 0.123


def test_zero_resolution_leaves_values_alone() -> None:
    x = np.array([0.1234567890123])
    np.testing.assert_array_equal(quantise(x, 0), x)


def errors(measurement: Measurement, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    # An irrational slope sweeps the quantiser's whole step.
    y = 0.2 + math.sqrt(2) * 1e-6 * np.arange(N)
    currents = np.stack([math.sqrt(k) * 1e-5 * np.arange(N) for k in (2, 3, 5)])
    logged_y, logged_i = measure(y, currents, measurement, seed=seed, index=4, powered=True)
    return logged_y - y, logged_i - currents


def test_noise_and_quantisation_add_their_variances() -> None:
    measurement = Measurement()
    y_error, i_error = errors(measurement)
    y_rms = math.hypot(measurement.position_noise_rms_m, measurement.position_resolution_m / math.sqrt(12))
    i_rms = math.hypot(measurement.current_noise_rms_a, measurement.current_resolution_a / math.sqrt(12))
    # The standard error of an rms from N values is rms / sqrt(2 N) = 0.16 %; five of them.
    assert np.std(y_error) == pytest.approx(y_rms, rel=0.008)
    for phase in i_error:
        assert np.std(phase) == pytest.approx(i_rms, rel=0.008)
    assert abs(np.mean(y_error)) < 5 * y_rms / math.sqrt(N)
    lagged = np.corrcoef(y_error[1:], y_error[:-1])[0, 1]
    assert abs(lagged) < 5 / math.sqrt(N)


def test_channels_have_independent_noise() -> None:
    y_error, i_error = errors(Measurement())
    correlation = np.corrcoef(np.vstack([y_error, i_error])) - np.eye(4)
    assert np.max(np.abs(correlation)) < 5 / math.sqrt(N)


def test_without_noise_and_resolution_the_motion_is_logged_exactly() -> None:
    silent = Measurement(position_resolution_m=0, position_noise_rms_m=0, current_resolution_a=0, current_noise_rms_a=0)
    y_error, i_error = errors(silent)
    assert not y_error.any()
    assert not i_error.any()


def test_an_unpowered_stage_logs_zero_current_and_the_same_position() -> None:
    y, currents = np.linspace(0, 0.1, 100), np.ones((3, 100))
    off = measure(y, currents, Measurement(), seed=1, index=0, powered=False)
    on = measure(y, currents, Measurement(), seed=1, index=0, powered=True)
    assert not off[1].any()
    np.testing.assert_array_equal(off[0], on[0])


def test_seed_and_place_fix_the_noise() -> None:
    y, currents = np.zeros(50), np.zeros((3, 50))

    def log(seed: int, index: int) -> bytes:
        logged = measure(y, currents, Measurement(), seed=seed, index=index, powered=True)
        return logged[0].tobytes() + logged[1].tobytes()

    assert log(1, 0) == log(1, 0)
    assert len({log(1, 0), log(2, 0), log(1, 1), log(0, 1)}) == 4
