"""Trajectories: end points, limits, and velocities that are the derivative of their positions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linid.stand.description import AxisDescription
from linid.stand.mode_descriptions import FreeWheel, Moves, SineCurrent, SinePosition, SlowRamp, SquareCurrent
from linid.stand.modes import command, current_command, moves, point_to_point, sine_position
from linid.stand.plant import simulate

FINE = np.arange(0, 4, 1e-4)


@settings(max_examples=60, deadline=None)
@given(
    distance=st.floats(-0.5, 0.5).filter(lambda d: abs(d) > 1e-4),
    speed=st.floats(0.05, 3),
    acceleration=st.floats(1, 50),
    jerk_time=st.sampled_from([0.0, 0.005, 0.02, 0.1]),
)
def test_a_move_arrives_at_rest_within_its_limits(
    distance: float, speed: float, acceleration: float, jerk_time: float
) -> None:
    length = point_to_point(np.zeros(1), distance, speed, acceleration, jerk_time)[2]
    t = np.linspace(-0.1, length + 0.1, 20_001)
    y, v, _ = point_to_point(t, distance, speed, acceleration, jerk_time)
    assert y[t <= 0].tolist() == [0.0] * int((t <= 0).sum())
    np.testing.assert_allclose(y[t >= length], distance, atol=1e-9)
    np.testing.assert_allclose(v[t >= length], 0, atol=1e-9)
    assert np.max(np.abs(v)) <= speed * (1 + 1e-7)
    step = t[1] - t[0]
    assert np.max(np.abs(np.diff(v))) <= acceleration * step * (1 + 1e-6)
    # The trapezoidal rule errs by at most acceleration step^2 / 2 in a step, and only where the acceleration jumps.
    travelled = np.concatenate([[0], np.cumsum((v[1:] + v[:-1]) / 2 * step)])
    np.testing.assert_allclose(y, travelled, atol=8 * acceleration * step**2 + 1e-9)
    # Time optimal for its limits: distance = acceleration x ramp x (ramp + cruise).
    ramp = min(speed / acceleration, math.sqrt(abs(distance) / acceleration))
    assert length == pytest.approx(ramp + abs(distance) / (acceleration * ramp) + jerk_time)


def test_moves_visit_their_targets_and_dwell() -> None:
    mode = Moves(
        name="m",
        mode="moves",
        duration_s=4,
        start_position_m=0.3,
        targets_m=(0.2, -0.1, -0.1, 0.0),
        speed_m_per_s=1,
        acceleration_m_per_s2=10,
        jerk_time_s=0.02,
        dwell_s=0.3,
    )
    y, v = moves(mode, FINE)
    # Trapezoids of 0.3, 0.4 and (triangle) 0.2 s, each 0.02 s longer by its averaging.
    arrive = [0.3 + 0.3 + 0.02]
    arrive.append(arrive[0] + 0.3 + 0.4 + 0.02)
    arrive.append(arrive[1] + 2 * 0.3 + 2 * 0.1 + 0.02)
    for instant, target in zip(arrive, (0.2, -0.1, 0.0), strict=True):
        resting = (instant < FINE) & (instant + 0.29 > FINE)
        np.testing.assert_allclose(y[resting], target, atol=1e-9)
        np.testing.assert_allclose(v[resting], 0, atol=1e-9)
    assert np.all(y[FINE < 0.3] == 0)


@pytest.mark.parametrize("fade", [0.0, 0.3])
def test_sine_position_velocity_is_its_derivative(fade: float) -> None:
    mode = SinePosition(
        name="s", mode="sine_position", duration_s=4, start_position_m=0, amplitude_m=0.1, frequency_hz=1.5, fade_s=fade
    )
    y, v = sine_position(mode, FINE)
    np.testing.assert_allclose(v[1:-1], (y[2:] - y[:-2]) / 2e-4, atol=2e-5)
    assert v[0] == pytest.approx(0 if fade else 0.1 * 3 * math.pi)
    late = fade <= FINE
    np.testing.assert_allclose(y[late], 0.1 * np.sin(3 * math.pi * FINE[late]), atol=1e-15)


def test_current_waves_have_their_amplitude_period_and_no_mean() -> None:
    common = {"name": "c", "duration_s": 4, "start_position_m": 0.39, "amplitude_a": 0.7, "frequency_hz": 2.0}
    t = np.arange(0, 4, 1e-4) + 0.5e-4
    sine = current_command(SineCurrent(mode="sine_current", fade_s=1.0, **common), t)
    square = current_command(SquareCurrent(mode="square_current", **common), t)
    faded = t < 1.0
    np.testing.assert_allclose(sine[~faded], 0.7 * np.sin(4 * math.pi * t[~faded]), atol=1e-12)
    assert np.all(np.abs(sine[faded]) < np.abs(0.7 * np.sin(4 * math.pi * t[faded])))
    assert sine[5000] / (0.7 * math.sin(4 * math.pi * t[5000])) == pytest.approx(0.5, abs=1e-3)
    assert set(square) == {-0.7, 0.7}
    assert np.mean(sine[10_000:]) == pytest.approx(0, abs=1e-12)
    assert np.mean(square) == pytest.approx(0, abs=1e-12)
    np.testing.assert_array_equal(square, 0.7 * np.sign(np.cos(4 * math.pi * t)))


def test_slow_ramp_grows_from_its_start_fraction_to_its_amplitude() -> None:
    mode = SlowRamp(
        name="r",
        mode="slow_ramp",
        duration_s=4,
        start_position_m=0.39,
        amplitude_a=-0.08,
        period_s=1,
        start_fraction=0.4,
    )
    current = current_command(mode, FINE)
    assert current[0] == 0
    for quarter in (0.25, 1.25, 2.25, 3.25):
        peak = -0.08 * (0.4 + 0.6 * quarter / 4)
        assert current[round(quarter / 1e-4)] == pytest.approx(peak, rel=1e-9)
        # A triangle: half the peak at an eighth of the period, but for the envelope.
        half = -0.04 * (0.4 + 0.6 * (quarter - 0.125) / 4)
        assert current[round((quarter - 0.125) / 1e-4)] == pytest.approx(half, rel=1e-9)


@pytest.mark.parametrize("speed", [0.8, -0.5])
def test_a_manual_push_releases_at_about_the_wanted_speed(stand: AxisDescription, speed: float) -> None:
    mode = FreeWheel(
        name="f",
        mode="free_wheel",
        duration_s=1,
        start_position_m=0.4,
        added_mass_kg=0.5,
        speed_m_per_s=speed,
        push_s=0.15,
    )
    run = simulate(stand, command(mode, stand), start_position=0.4, added_mass=0.5)
    assert (run.y[0], run.v[0]) == (0.4, 0.0)
    assert run.v[150] == pytest.approx(speed, rel=0.1)
    assert np.all(run.q_current == 0)
    assert abs(run.v[-1]) < 1e-3


def test_closed_loop_follows_its_references(stand: AxisDescription) -> None:
    for mode in stand.campaign:
        if isinstance(mode, SinePosition | Moves):
            told = command(mode, stand)
            run = simulate(stand, told, start_position=mode.start_position_m)
            error = run.y - told.y_reference[:: stand.loops_per_sample]
            assert np.max(np.abs(error)) < 2e-3, mode.name
            assert np.max(np.abs(run.q_current)) < stand.drive.current_limit_a
