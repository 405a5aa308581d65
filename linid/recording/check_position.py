"""Checks of the position reading: resolution against the motion, jumps left in it, units, end stops."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.recording.local_polynomial import local_derivative, local_weights, window_width
from linid.recording.noise import noise_level
from linid.recording.recording import Recording

SMOOTH = 0.015  # s over which speeds and the floor of the acceleration are taken
_JUMP = 20.0  # times the steps before and after: no axis moves so
_SAME = 0.02  # of their size by which the jumps of one wrap may differ
_REST = 0.05  # s at the end of the stroke that make a stop
_PUSH = 1.0  # times the median input while moving, with which a stop is pushed
_FEWEST = 30  # samples
_STEPS, _NOISES = 2.0, 6.0  # of the reading: what is beyond both is motion
_CLEAR = 3.0  # steps per sample: a reading that stays the same then was not updated
_ROUNDING = 1e-9  # of the stroke
_USUAL = 0.95  # quantile of the steps
_WHOLE = 10.0  # m or rad: over less a few whole numbers may be all there are
_AT_END, _AT_END_NOISES = 1e-5, 4.0  # of the stroke, of the noise: nearer the axis is at its end
_RESTING = 0.05  # of the fastest: slower the axis rests


@dataclass(frozen=True)
class Resolution:
    """How finely the position is read.

    step: smallest step in m (rotary: rad), 0 where the values lie on no lattice; noise: standard deviation of the
    reading in m; slow: share of the moving time in which the axis moves less than a step per sample; held: share of the
    samples of clear motion that repeat the one before; floor: acceleration in m/s^2 that the reading's noise leaves
    when smoothed over `SMOOTH` seconds; acceleration: RMS of the motion's, smoothed alike.
    """

    step: float
    noise: float
    slow: float
    held: float
    floor: float
    acceleration: float


@dataclass(frozen=True)
class Angle:
    """What may be wrong with the unit or the kind of the position.

    jumps: steps that no axis makes, jump: their median size in m (rotary: rad), equal: whether all are alike (a wrap);
    whole: whether all values are whole numbers of rad or m (counts?); speed: largest in m/s (rotary: rad/s); stroke: m.
    """

    jumps: int
    jump: float
    equal: bool
    whole: bool
    speed: float
    stroke: float


@dataclass(frozen=True)
class EndStop:
    """Time in s that the axis stands at the end of its stroke while the input pushes it outwards; side: -1, 1, 0."""

    seconds: float
    side: int


def resolution(recording: Recording, step: float) -> Resolution:
    """The reading's step and noise against the motion; step: m (rotary: rad), 0 unknown."""
    y, dt = recording.y, recording.duration / max(recording.y.size - 1, 1)
    nan = math.nan
    noise = noise_level(y)
    if y.size < _FEWEST:
        return Resolution(step, noise, nan, nan, nan, nan)
    width = min(window_width(SMOOTH, dt), y.size - 1 + y.size % 2)
    weights = local_weights(width, 3, 2)[width // 2] / dt**2
    floor = max(noise, step / math.sqrt(12.0)) * float(np.linalg.norm(weights))
    acceleration = float(np.sqrt(np.mean(np.correlate(y, weights, "valid") ** 2)))
    if step <= 0.0:
        return Resolution(step, noise, nan, 0.0, floor, acceleration)
    travel = np.abs(local_derivative(y, width, 3, 1, dt)) * dt
    moving = travel * width > max(_STEPS * step, _NOISES * noise)  # within the window: otherwise it may stand
    slow = float(np.mean(travel[moving] < step)) if moving.any() else 0.0
    clear = np.flatnonzero(travel[1:] > _CLEAR * step)
    held = float(np.mean(np.abs(np.diff(y))[clear] < 0.5 * step)) if clear.size >= _FEWEST else 0.0
    return Resolution(step, noise, slow, held, floor, acceleration)


def angle(recording: Recording, step: float) -> Angle:
    """Jumps left in the position, and whether its numbers look like another unit's; step: m (rotary: rad)."""
    y, dt = recording.y, recording.duration / max(recording.y.size - 1, 1)
    steps = np.abs(np.diff(y))
    beside = np.maximum(np.concatenate((steps[1:], [0.0])), np.concatenate(([0.0], steps[:-1])))
    noise = min(_NOISES * noise_level(y), float(np.quantile(steps, _USUAL)))  # jumps themselves may count as noise
    usual = np.maximum(beside, max(_STEPS * step, noise, _ROUNDING * float(np.ptp(y))))
    jumping = steps > _JUMP * usual
    # Less what the axis moves meanwhile, the mean of the steps before and after.
    signed = np.diff(y)
    moved = 0.5 * (np.concatenate((signed[1:], [0.0])) + np.concatenate(([0.0], signed[:-1])))
    found = np.abs(signed - moved)[jumping]
    size = float(np.median(found)) if found.size else 0.0
    equal = bool(found.size and np.all(np.abs(found - size) < _SAME * size))
    whole = bool(np.ptp(y) > _WHOLE and np.all(y == np.rint(y)))
    return Angle(found.size, size, equal, whole, float(steps[~jumping].max(initial=0.0)) / dt, float(np.ptp(y)))


def end_stop(recording: Recording, thrust: Array | None, step: float, sense: int) -> EndStop:
    """Whether the axis is pressed against an end: it rests at its largest or smallest position against a clear push.

    thrust: (n,) input in A (a command: its own unit), None without; sense: +1 or -1, of acceleration against input (0:
    unknown); step: m.
    """
    y = recording.y
    if thrust is None or sense == 0 or recording.kind == "free_wheel" or y.size < _FEWEST:
        return EndStop(0.0, 0)
    dt = recording.duration / (y.size - 1)
    band = max(_STEPS * step, _AT_END_NOISES * noise_level(y), _AT_END * float(np.ptp(y)))
    travel = np.abs(np.gradient(y))
    moving = travel > max(_STEPS * step, _RESTING * float(travel.max()))
    push = _PUSH * float(np.median(np.abs(thrust[moving]))) if moving.any() else math.inf
    best = EndStop(0.0, 0)
    for side, end in ((1, float(y.max())), (-1, float(y.min()))):
        pressed = (np.abs(y - end) < band) & (side * sense * thrust > push) & ~moving
        edges = np.flatnonzero(np.diff(np.concatenate(([False], pressed, [False])).astype(np.int8)))
        longest = int(np.max(np.diff(edges)[::2], initial=0)) * dt
        if longest > max(_REST, best.seconds):
            best = EndStop(longest, side)
    return best
