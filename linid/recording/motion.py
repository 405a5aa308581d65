"""The motion behind a recording's positions: smoothed position and speed, standstill, and the noise of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array
from linid.recording.local_polynomial import local_derivative, local_weights
from linid.recording.noise import noise_level, noise_profile, quantum, smallest_step
from linid.recording.waits import Wait, waits_in

_HALF_WIDTHS = (3, 5, 8, 12, 18, 27, 40)
SMOOTHING_REACH = _HALF_WIDTHS[-1]  # samples to either side that the smoothed motion may hang on
_ORDER = 3
_LEAST_STEPPED = 0.02  # of its quantum: an encoder's steps alone bring 0.29 of it as noise, less only at rest
_REST = 0.01  # s to either side within which a resting axis stays
_REST_NOISES = 6.0  # deviations that the range of so few samples at rest stays within
_REST_STEPS = 2.001  # of the encoder, and the rounding of their difference
_LEAST_NOISE = 1e-15  # m: exact positions have none
_QUARTIC_SLOPE = 0.95  # norm of its weights (1, -8, 0, 8, -1) / 12
_MAJORITY = 0.5  # of the samples: the widest window that more of them have tells the speed's noise
# Deviations of the noise: where the median turn tells of less play, noise about a turn looks like it.
# `python -m tests.benchmarks.plays --seed 22931` tells what turns with play, with other effects and with none tell.
VISIBLE_PLAY = 50.0
_DOUBT = 3.0  # deviations by which the spread within a window may exceed that of noise


@dataclass(frozen=True, eq=False)
class MeasuredMotion:
    """The motion of one recording, its positions measured (n,) in m every dt s.

    y, v: (n,) smoothed, m and m/s; standstill: (n,); position_noise, speed_noise: standard deviations, m and m/s.
    """

    measured: Array
    dt: float
    y: Array
    v: Array
    standstill: NDArray[np.bool_]
    position_noise: float
    speed_noise: float

    @cached_property
    def encoder(self) -> tuple[float, Array]:
        """Quantum of the positions (0: none), and the standard deviation (n,) of their white noise beyond it, m."""
        step = quantum(self.measured)
        level = noise_profile(self.measured)
        if self.position_noise < _LEAST_STEPPED * step:  # samples of a fast motion may lie on a lattice by chance
            step = 0.0
        return step, np.sqrt(np.maximum(level**2 - step**2 / 12.0, 0.0))

    @cached_property
    def waits(self) -> tuple[Wait, ...]:
        """Its turns, where play would hide the motor's motion."""
        return waits_in(self.measured, self.dt, self.position_noise, quantum(self.measured), self.standstill)

    @property
    def plays(self) -> list[float]:
        """What each turn tells of play by itself, m: the way of a motor that crosses it at even acceleration."""
        return [0.5 * w.speed * (w.end - w.start) * self.dt for w in self.waits if w.part == 1.0]


def plays_told(motions: Sequence[MeasuredMotion]) -> list[float]:
    """What each turn of some motions tells of play by itself, m; none where their median is no more than noise."""
    told = [play for motion in motions for play in motion.plays]
    visible = bool(told) and np.median(told) > VISIBLE_PLAY * max(motion.position_noise for motion in motions)
    return told if visible else []


def motion_behind(y: Array, dt: float, *, sets_off: bool = False) -> MeasuredMotion:
    """Smooth positions y (n,) in m on a uniform grid of dt s, and find where the axis rests.

    The speed is only a start value for short predictions; it is never fitted. sets_off: the axis rests at the first
    sample and moves from then on, a bend that no window around it tells.
    """
    smooth, speed, noise, speed_noise = _smooth(y, dt)
    rests = _rests(y, noise, max(2, round(_REST / dt)))
    rests[0] |= sets_off
    speed[rests] = 0.0
    return MeasuredMotion(y, dt, smooth, speed, rests, noise, speed_noise)


def _smooth(y: Array, dt: float) -> tuple[Array, Array, float, float]:
    """Savitzky-Golay position and speed, at each sample with the widest window that leaves only noise behind.

    A stop or a reversal bends the motion within a few samples: windows across it must be narrow, or the bristle that
    is followed along the smoothed motion misses its turn (local choice of the window: Lepski 1990).
    """
    from scipy.ndimage import uniform_filter1d

    noise = noise_level(y)
    allowed = np.ones(y.size, dtype=bool)
    smooth, speed = y, local_derivative(y, 5, 4, 1, dt)  # no smoothing: the slope of five samples' quartic
    speed_noise = _QUARTIC_SLOPE * noise / dt
    for half in _HALF_WIDTHS:
        width = 2 * half + 1
        if width > y.size:
            break
        wide = local_derivative(y, width, _ORDER, 0, dt)
        spread = np.sqrt(np.maximum(uniform_filter1d((y - wide) ** 2, width), 0.0))
        allowed &= spread <= (1.0 + _DOUBT / np.sqrt(2.0 * width)) * max(noise, _LEAST_NOISE)
        if not np.any(allowed):
            break
        rate = local_derivative(y, width, _ORDER, 1, dt)
        smooth, speed = np.where(allowed, wide, smooth), np.where(allowed, rate, speed)
        if np.mean(allowed) > _MAJORITY:
            speed_noise = noise / dt * float(np.linalg.norm(local_weights(width, _ORDER, 1)[half]))
    return smooth, speed, noise, speed_noise


def _rests(y: Array, noise: float, reach: int) -> NDArray[np.bool_]:
    """Where the position stays within its noise over `reach` samples to both sides."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    width = 2 * reach + 1
    span = maximum_filter1d(y, width) - minimum_filter1d(y, width)
    return np.asarray(span <= max(_REST_NOISES * noise, _REST_STEPS * smallest_step(y)))
