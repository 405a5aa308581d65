"""What the waits of a reading tell of a motor that turns behind play, whose motion is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.signal import find_peaks

from linid.recording.recording import Recording
from linid.recording.waits import ahead_of_reading, turns_of

DT = 1e-3
PLAY = 1.5e-4  # m


def read(motor: np.ndarray, play: float, side: float) -> np.ndarray:
    """What is read behind play (the play operator), from the side on which the motor begins."""
    out, reading = np.empty(motor.size), motor[0] - 0.5 * side * play
    for k, y in enumerate(motor):
        reading = min(max(reading, y - 0.5 * play), y + 0.5 * play)
        out[k] = reading
    return out


def recorded(y: np.ndarray, noise: float = 2e-7, seed: int = 5) -> Recording:
    return Recording("turns", np.arange(y.size) * DT, y + np.random.default_rng(seed).normal(0.0, noise, y.size))


def swing(amplitude: float = 2e-3, period: float = 0.8, count: int = 4000) -> np.ndarray:
    return amplitude * np.sin(2.0 * np.pi * np.arange(count) * DT / period)


@settings(deadline=None, max_examples=30)
@given(
    st.floats(2e-5, 4e-4), st.floats(1e-3, 2e-2), st.floats(0.3, 1.2), st.sampled_from([0.0, 1e-7, 5e-7]), st.integers()
)
def test_turns_tell_the_play(play: float, amplitude: float, period: float, noise: float, seed: int) -> None:
    """Of a sine about its turning points: start and end of each in closed form, speed and play in the median, whatever
    the play, size and noise, where the motor takes five samples to cross."""
    assume(np.arccos(1.0 - play / amplitude) * period / (2.0 * np.pi) > 5.0 * DT)
    motor = swing(amplitude, period)
    one = recorded(read(motor, play, 1.0), noise, seed % 2**32)
    turns = [wait for wait in one.motion.waits if wait.part == 1.0]
    assert len(turns) >= int(2.0 * 4.0 / period - 0.5)  # the last one may end beside the recording's end
    omega = 2.0 * np.pi / period
    crossing = np.arccos(1.0 - play / amplitude) / omega  # s until the motor has gone back by the play
    speed = amplitude * omega * np.sin(omega * crossing)
    hidden = np.sqrt(2.0 * noise / amplitude) / omega  # s about a turn in which noise hides the motion
    for number, wait in enumerate(turns):
        turned = (0.25 + 0.5 * number) * period / DT
        assert wait.direction == (-1.0 if number % 2 == 0 else 1.0)
        assert wait.start == pytest.approx(turned, abs=1.5 + hidden / DT)
        assert wait.end == pytest.approx(turned + crossing / DT, abs=1.0 + 3.0 * noise / (speed * DT))
    assert np.median([wait.speed for wait in turns]) == pytest.approx(speed, rel=0.15, abs=5.0 * noise / DT)
    assert np.median(one.motion.plays) == pytest.approx(play, rel=0.25)


def test_a_turn_without_play_tells_none() -> None:
    turns = recorded(swing()).motion
    assert len(turns.waits) == 10
    assert np.median(turns.plays) < 5e-6


def test_the_motors_way_behind_the_play_is_found() -> None:
    """To a twentieth of the play everywhere."""
    motor = swing()
    one = recorded(read(motor, PLAY, 1.0))
    ahead = ahead_of_reading(one.motion.waits, one.y, DT, PLAY)
    np.testing.assert_allclose(one.y + ahead.y, motor, atol=PLAY / 20.0)
    speed = np.gradient(motor, DT)
    crosses = ahead.v != 0.0
    assert 100 < np.count_nonzero(crosses) < 1000
    assert np.max(np.abs((ahead.v - speed)[crosses])) < 0.2 * np.max(np.abs(speed[crosses]))
    assert np.all(ahead.seen > 0.99)  # it never rests


def test_a_stop_hides_how_the_motor_swings_back() -> None:
    """A motor that comes to rest and swings back within the play: what is read stops at the turn, and shows no
    acceleration from there on."""
    t = np.arange(1500) * DT
    turned = 0.4
    braking = 0.5 * 2.0 * (t - turned) ** 2
    motor = np.where(t < turned, -braking, -5e-5 * (1.0 - np.exp(-(t - turned) / 0.01)))
    one = recorded(read(motor, PLAY, 1.0))
    (stop,) = one.motion.waits
    assert stop.part == 0.0 and stop.end == 1500.0
    assert stop.start == pytest.approx(turned / DT, abs=1.0)
    seen = ahead_of_reading(one.motion.waits, one.y, DT, PLAY).seen
    assert np.all(seen[:398] == 1.0) and np.all(seen[402:] == 0.0)


def test_an_axis_that_rests_sets_off_from_the_middle() -> None:
    t = np.arange(1000) * DT
    motor = np.where(t < 0.3, 0.0, 0.5 * 3.0 * (t - 0.3) ** 2)
    one = recorded(read(motor, PLAY, 0.0))
    (first,) = one.motion.waits
    assert first.part == 0.5 and first.direction == 1.0
    assert first.end * DT == pytest.approx(0.3 + np.sqrt(PLAY / 3.0), abs=DT)
    ahead = ahead_of_reading(one.motion.waits, one.y, DT, PLAY)
    np.testing.assert_allclose(one.y + ahead.y, motor, atol=PLAY / 20.0)


def test_a_rest_before_a_turn_is_left_before_the_motor_crosses() -> None:
    """It crosses as long as its speed takes at even acceleration, not as long as the reading rests."""
    t = np.arange(2000) * DT
    motor = np.where(t < 0.4, -((t - 0.4) ** 2), 0.0) - np.where(t > 1.2, 1.5 * (t - 1.2) ** 2, 0.0)
    one = recorded(read(motor, PLAY, 1.0))
    (turn,) = one.motion.waits
    assert turn.part == 1.0 and turn.end - turn.start > 700.0
    ahead = ahead_of_reading(one.motion.waits, one.y, DT, PLAY)
    np.testing.assert_allclose(one.y + ahead.y, motor, atol=PLAY / 10.0)
    assert np.all(ahead.seen[420:1180] == 0.0)


def test_no_play_hides_nothing() -> None:
    one = recorded(swing())
    ahead = ahead_of_reading(one.motion.waits, one.y, DT, 0.0)
    assert not np.any(ahead.y) and not np.any(ahead.v)


@pytest.mark.parametrize("y", [np.zeros(300), np.linspace(0.0, 0.1, 300), np.sign(np.arange(300) - 297.0) * 1e-3])
def test_short_and_dull_recordings_have_no_turns(y: np.ndarray) -> None:
    assert [wait for wait in recorded(y).motion.waits if wait.part == 1.0] == []


@settings(deadline=None, max_examples=100)
@given(st.integers(0, 2**32 - 1), st.integers(2, 600), st.floats(0.0, 3.0))
def test_turns_are_the_peaks_of_such_a_prominence(seed: int, count: int, back: float) -> None:
    """Against scipy's search for peaks, of random walks, whose samples never are alike."""
    y = np.cumsum(np.random.default_rng(seed).normal(0.0, 1.0, count))
    peaks = [(int(k), side) for side in (-1.0, 1.0) for k in find_peaks(-side * y, prominence=back)[0]]
    assert turns_of(y, back) == sorted(peaks)
