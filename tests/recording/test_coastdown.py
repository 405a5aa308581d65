"""The coast-down finder on simulated pushes (Coulomb and viscous friction), with bumps, several pushes and noise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shared_data import shared

from linid.errors import DataError
from linid.recording import Recording, find_coast_down, read_campaign, trim

DT = 1e-3
SUB = 10


def slide(
    push: Callable[[float], float], coulomb: float, viscous: float, duration: float, v0: float = 0.0
) -> np.ndarray:
    """Positions at 1 kHz of a unit mass with friction, pushed by push(t) in N; midpoint steps of 0.1 ms."""
    h = DT / SUB
    v, y, out = v0, 0.0, []
    for i in range(round(duration / h)):
        if i % SUB == 0:
            out.append(y)
        force = push((i + 0.5) * h)
        if v <= 0 and force <= coulomb:
            v = 0.0
            continue
        a = force - coulomb - viscous * v
        a = force - coulomb - viscous * (v + 0.5 * h * a)
        if v + h * a < 0:
            a = -v / h
        y += h * v + 0.5 * h * h * a
        v += h * a
    return np.array(out)


def hand(rng: np.random.Generator, start: float, length: float, strength: float) -> Callable[[float], float]:
    """An irregular push that begins and ends gently (the last 10 to 30 % fade out)."""
    amplitudes, phases = rng.uniform(0.2, 1, 4), rng.uniform(0, 2 * np.pi, 4)
    fade = rng.uniform(0.1, 0.3)

    def force(t: float) -> float:
        x = (t - start) / length
        if not 0 < x < 1:
            return 0.0
        shape = 1 + 0.15 * sum(
            a * np.sin(2 * np.pi * (k + 1) * x + p) for k, (a, p) in enumerate(zip(amplitudes, phases, strict=True))
        )
        return float(strength * max(shape, 0.0) * np.sin(np.pi / 2 * min(1.0, x / 0.1, (1 - x) / fade)) ** 2)

    return force


def measured(y: np.ndarray, noise: float, seed: int, sign: float = 1.0, resolution: float = 1e-7) -> Recording:
    noisy = sign * y + np.random.default_rng(seed).normal(0, noise, len(y))
    return Recording("push", np.arange(len(y)) * DT, np.round(noisy / resolution) * resolution, kind="free_wheel")


def standstill(y: np.ndarray) -> float:
    return float(np.flatnonzero(np.diff(y) > 0)[-1] * DT)


@given(
    seed=st.integers(0, 10**6),
    noise=st.floats(1e-7, 1e-6),
    length=st.floats(0.1, 1.0),
    speed=st.floats(0.4, 2.0),
    coulomb=st.floats(0.5, 3.0),
    viscous=st.floats(0.0, 1.5),
    start=st.floats(0.05, 0.4),
    sign=st.sampled_from([-1.0, 1.0]),
)
@settings(max_examples=40, deadline=None, derandomize=True)
def test_release_is_found(
    seed: int, noise: float, length: float, speed: float, coulomb: float, viscous: float, start: float, sign: float
) -> None:
    """Never before the hand lets go, and at most a tenth of the coast (and the fade's few ms) after it."""
    rng = np.random.default_rng(seed)
    strength = (speed / length + coulomb + 0.5 * viscous * speed) / 0.8
    y = slide(hand(rng, start, length, strength), coulomb, viscous, start + length + 1.2 * speed / coulomb + 0.5)
    release, rest = start + length, standstill(y)
    assume(rest - release > 0.35)
    found = find_coast_down(measured(y, noise, seed, sign))
    # A push that fades over much of a short coast leaves less than the encoder's noise in its last few ms.
    blind = 0.006 if rest - release < 0.6 else 0.002
    assert found.t_start >= release - blind
    assert found.t_start <= release + 0.1 * (rest - release) + 0.006
    assert rest - 0.03 <= found.t_end <= rest + 0.3
    true_speed = sign * np.interp(found.t_start, np.arange(len(y)) * DT, np.gradient(y, DT))
    assert found.speed_at_release == pytest.approx(true_speed, abs=0.005 * abs(true_speed) + 0.003)


@given(seed=st.integers(0, 10**6), v0=st.floats(0.1, 2.0), coulomb=st.floats(0.4, 3.0), viscous=st.floats(0.0, 1.5))
@settings(max_examples=30, deadline=None, derandomize=True)
def test_a_recording_that_starts_coasting_is_not_cut(seed: int, v0: float, coulomb: float, viscous: float) -> None:
    assume(v0 / coulomb > 0.25)
    y = slide(lambda t: 0.0, coulomb, viscous, v0 / coulomb + 0.4, v0)
    found = find_coast_down(measured(y, 3e-7, seed))
    assert found.t_start == 0.0
    assert "nothing cut" in found.evidence and len(found.candidates) == 1
    assert abs(found.speed_at_release) == pytest.approx(v0, rel=0.01)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_bump_at_the_end_stop_is_cut(sign: float) -> None:
    y = slide(lambda t: 0.0, 1.0, 0.3, 1.5, 1.0)
    wall = int(0.4 / DT)
    gone = y[wall + 1] - y[wall]
    tail = y[wall] + gone * 5 * np.sin(np.arange(len(y) - wall) / 5) * np.exp(-np.arange(len(y) - wall) / 12.0)
    found = find_coast_down(measured(np.r_[y[:wall], tail], 3e-7, 1, sign))
    assert found.t_start == 0.0 and 0.3 < found.t_end <= 0.4
    assert "bump" in found.evidence


def test_longest_of_several_pushes_is_taken() -> None:
    rng = np.random.default_rng(5)
    pushes = [hand(rng, 0.1, 0.2, 5.0), hand(rng, 1.5, 0.3, 8.0), hand(rng, 4.5, 0.2, 4.0)]
    y = slide(lambda t: sum(p(t) for p in pushes), 1.0, 0.2, 6.5)
    found = find_coast_down(measured(y, 5e-7, 3))
    assert 1.8 <= found.t_start <= 2.05 and found.t_end < 4.5
    assert len(found.candidates) == 3 and (found.t_start, found.t_end) in found.candidates
    assert "longest of 3" in found.evidence


def test_second_push_while_still_moving() -> None:
    rng = np.random.default_rng(6)
    first, second = hand(rng, 0.1, 0.3, 6.0), hand(rng, 0.9, 0.2, 8.0)
    y = slide(lambda t: first(t) + second(t), 1.0, 0.2, 4.0)
    found = find_coast_down(measured(y, 5e-7, 3))
    assert found.t_start >= 1.1 and found.t_end == pytest.approx(standstill(y), abs=0.3)
    assert any(a >= 0.4 and b <= 0.92 for a, b in found.candidates)


def test_recording_that_ends_before_standstill() -> None:
    y = slide(lambda t: 0.0, 0.5, 0.1, 0.8, 1.5)
    found = find_coast_down(measured(y, 5e-7, 3))
    assert found.t_start == 0.0 and found.t_end > 0.75 and "ends" in found.evidence


def test_steady_motion_or_rest_is_no_coast() -> None:
    t = np.arange(2000) * DT
    for y in (np.zeros(2000) + 0.1, 0.2 * t, 0.1 * t**2):
        with pytest.raises(DataError, match="no coast-down"):
            find_coast_down(measured(y, 5e-7, 1))
    with pytest.raises(DataError, match="samples"):
        find_coast_down(measured(t[:20], 5e-7, 1))


def test_found_interval_can_be_cut_out() -> None:
    y = slide(hand(np.random.default_rng(1), 0.2, 0.3, 6.0), 1.0, 0.2, 3.0)
    recording = measured(y, 5e-7, 2)
    found = find_coast_down(recording)
    cut = trim(recording, found.t_start, found.t_end)
    assert cut.t[0] == pytest.approx(found.t_start) and cut.t[-1] == pytest.approx(found.t_end)


@pytest.mark.parametrize("number", range(1, 15))
def test_reference_recordings_start_coasting(number: int) -> None:
    """Released by construction at their first sample, with all kinds of extra forces."""
    campaign = read_campaign(shared("blind", f"axis_{number:02d}", "campaign.yaml"))
    for recording in campaign.of(kind="free_wheel"):
        assert find_coast_down(recording).t_start == recording.t[0]
