"""The measured motion made ready for fitting: smoothed position and speed, standstill, noise, input jumps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from linid.recording.local_polynomial import local_derivative, local_weights
from linid.recording.noise import noise_level, noise_profile, quantum, smallest_step
from linid.recording.recording import Recording
from linid.statistics import MEDIAN_ABSOLUTE

Array = NDArray[np.float64]

_HALF_WIDTHS = (3, 5, 8, 12, 18, 27, 40)
SMOOTHING_REACH = _HALF_WIDTHS[-1]  # samples to either side that the smoothed motion may hang on
_ORDER = 3
_LEAST_STEPPED = 0.02  # of its quantum: an encoder's steps alone bring 0.29 of it as noise, less only at rest
_DOUBT = 3.0  # deviations by which the spread within a window may exceed that of noise


def retaken(recording: Recording, smooth: Array, generator: np.random.Generator) -> Recording:
    """Another measurement of the same motion: its position noise and its encoder's steps fall anew.

    smooth: (n,) the motion freed of noise, m. Noise beyond that of the steps is white, as strong as it is there.
    """
    step, level = _noise_of(_Track(recording.y, recording.duration / (recording.y.size - 1)))
    shift = step * generator.uniform(-0.5, 0.5)
    y = smooth + level * generator.standard_normal(smooth.size)
    if step > 0.0:
        y = np.round((y + shift) / step) * step - shift
    return replace(recording, y=y)


@dataclass(frozen=True)
class Motion:
    """Smoothed motion of several recordings in one flat row each: y (m), v (m/s), standstill; (samples,).

    measured: raw positions in m; position_noise, speed_noise: (R,) standard deviations.
    """

    measured: Array
    y: Array
    v: Array
    standstill: NDArray[np.bool_]
    position_noise: Array
    speed_noise: Array


def _smooth(y: Array, dt: float) -> tuple[Array, Array, float, float]:
    """Savitzky-Golay position and speed, at each sample with the widest window that leaves only noise behind.

    A stop or a reversal bends the motion within a few samples: windows across it must be narrow, or the bristle that
    is followed along the smoothed motion misses its turn (local choice of the window: Lepski 1990).
    """
    from scipy.ndimage import uniform_filter1d

    noise = noise_level(y)
    allowed = np.ones(y.size, dtype=bool)
    smooth, speed = y, local_derivative(y, 5, 4, 1, dt)  # no smoothing: the slope of five samples' quartic
    speed_noise = 0.95 * noise / dt
    for half in _HALF_WIDTHS:
        width = 2 * half + 1
        if width > y.size:
            break
        wide = local_derivative(y, width, _ORDER, 0, dt)
        spread = np.sqrt(np.maximum(uniform_filter1d((y - wide) ** 2, width), 0.0))
        allowed &= spread <= (1.0 + _DOUBT / np.sqrt(2.0 * width)) * max(noise, 1e-15)
        if not np.any(allowed):
            break
        rate = local_derivative(y, width, _ORDER, 1, dt)
        smooth, speed = np.where(allowed, wide, smooth), np.where(allowed, rate, speed)
        if np.mean(allowed) > 0.5:
            speed_noise = noise / dt * float(np.linalg.norm(local_weights(width, _ORDER, 1)[half]))
    return smooth, speed, noise, speed_noise


def _rests(y: Array, noise: float, reach: int) -> NDArray[np.bool_]:
    """Where the position stays within its noise over `reach` samples to both sides."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    width = 2 * reach + 1
    span = maximum_filter1d(y, width) - minimum_filter1d(y, width)
    return np.asarray(span <= max(6.0 * noise, 2.001 * smallest_step(y)))


def measure_motion(recordings: Sequence[Recording]) -> Motion:
    """Smooth the positions of recordings on uniform grids and find where the axis rests.

    The speed is only a start value for short predictions; it is never fitted.
    """
    rows = [_motion_of(_Track(recording.y, recording.duration / (recording.y.size - 1))) for recording in recordings]
    return Motion(
        measured=np.concatenate([recording.y for recording in recordings]),
        y=np.concatenate([row[0] for row in rows]),
        v=np.concatenate([row[1] for row in rows]),
        standstill=np.concatenate([row[2] for row in rows]),
        position_noise=np.array([row[3] for row in rows]),
        speed_noise=np.array([row[4] for row in rows]),
    )


@dataclass(frozen=True, eq=False)
class _Track:
    """Positions y (n,) in m, dt s apart; the same array is the same track, whatever inputs go with it."""

    y: Array
    dt: float

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Track) and self.y is other.y and self.dt == other.dt

    def __hash__(self) -> int:
        return hash((id(self.y), self.dt))


@lru_cache(maxsize=128)  # many objectives look at the same recordings
def _motion_of(track: _Track) -> tuple[Array, Array, NDArray[np.bool_], float, float]:
    """Position, speed, standstill (n,) each, and the noise of position and speed of one recording."""
    y, dt = track.y, track.dt
    smooth, speed, noise, speed_noise = _smooth(y, dt)
    rests = _rests(y, noise, max(2, round(0.01 / dt)))
    speed[rests] = 0.0
    return smooth, speed, rests, noise, speed_noise


@lru_cache(maxsize=128)
def _noise_of(track: _Track) -> tuple[float, Array]:
    """Quantum of a track's positions (0: none), and the standard deviation (n,) of their white noise beyond it."""
    step = quantum(track.y)
    level = noise_profile(track.y)
    if noise_level(track.y) < _LEAST_STEPPED * step:  # samples of a fast motion may lie on a lattice by chance
        step = 0.0
    return step, np.sqrt(np.maximum(level**2 - step**2 / 12.0, 0.0))


def input_jumps(recording: Recording) -> NDArray[np.bool_]:
    """Sampling intervals (n - 1,) in which an input jumps: no spline knows when within the interval.

    A jump stands out of the third differences by ten times their usual size and a tenth of the input's range.
    """
    n = recording.y.size
    jumps = np.zeros(n - 1, dtype=np.bool_)
    channels = recording.phase_currents
    if channels is None:
        channels = np.zeros((0, n)) if recording.drive_input is None else recording.drive_input[None, :]
    for channel in channels:
        third = np.abs(np.diff(channel, 3))
        limit = max(10.0 * float(np.median(third)) / MEDIAN_ABSOLUTE, 0.1 * float(np.ptp(channel)), 1e-300)
        for start in np.flatnonzero(third > limit):
            jumps[start : start + 3] = True
    return jumps


def input_noise(recording: Recording, generator: np.random.Generator) -> Array:
    """One draw of the inputs' own white noise: (3, n) or (n,) in their unit; zeros where there is no input."""
    channels = recording.phase_currents if recording.phase_currents is not None else recording.drive_input
    if channels is None or recording.kind == "free_wheel":
        return np.zeros(recording.y.size)
    levels = np.array([noise_level(channel) for channel in np.atleast_2d(channels)])
    return np.asarray(levels[:, None] * generator.standard_normal((levels.size, recording.y.size))).reshape(
        channels.shape
    )


def with_inputs_moved(recording: Recording, change: Array) -> Recording:
    """The recording with its inputs changed by what `input_noise` drew (free wheels: as it is)."""
    if recording.kind == "free_wheel":
        return recording
    if recording.phase_currents is not None:
        return replace(recording, phase_currents=recording.phase_currents + change)
    if recording.drive_input is not None:
        return replace(recording, drive_input=recording.drive_input + change)
    return recording


def with_input_noise(recording: Recording, generator: np.random.Generator) -> Recording:
    """The recording with its inputs' own white noise added once more (free wheels: as it is)."""
    return with_inputs_moved(recording, input_noise(recording, generator))
