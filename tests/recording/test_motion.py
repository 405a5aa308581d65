"""The motion behind a recording's positions, computed once and carried along."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np

from linid.recording.recording import Recording


def recording() -> Recording:
    t = np.arange(2000) * 1e-3
    noise = np.random.default_rng(4).normal(0.0, 1e-6, t.size)
    return Recording("sine", t, 0.05 * np.sin(2 * np.pi * t) + noise, phase_currents=np.zeros((3, t.size)))


def test_speed_and_noise_are_those_of_the_motion() -> None:
    one = recording()
    truth = 0.1 * np.pi * np.cos(2 * np.pi * one.t)
    inside = slice(50, -50)
    assert np.std((one.motion.v - truth)[inside]) < 1.3 * one.motion.speed_noise
    assert 0.8e-6 < one.motion.position_noise < 1.2e-6


def test_other_inputs_carry_the_same_motion_and_other_positions_do_not() -> None:
    one = recording()
    motion = one.motion
    assert one.motion is motion
    assert replace(one, phase_currents=np.ones((3, one.t.size))).motion is motion
    moved = replace(one, y=one.y + 1.0)
    assert moved.motion is not motion and np.allclose(moved.motion.y, motion.y + 1.0, atol=1e-9)
    faster = replace(one, t=one.t / 2.0)
    assert np.allclose(faster.motion.v, 2.0 * motion.v)


def test_a_recording_that_travels_finds_its_motion_again() -> None:
    one = recording()
    motion = one.motion
    there = pickle.loads(pickle.dumps(one))
    assert there.carried is None and np.array_equal(there.motion.v, motion.v)
