"""The measured motion made ready for fitting: smoothed position and speed, standstill, noise, input jumps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array
from linid.recording.motion import MeasuredMotion
from linid.recording.noise import noise_level, white_level
from linid.recording.recording import Recording, frozen
from linid.statistics import MEDIAN_ABSOLUTE


def retaken(recording: Recording, smooth: Array, generator: np.random.Generator) -> Recording:
    """Another measurement of the same motion: its position noise and its encoder's steps fall anew.

    smooth: (n,) the motion freed of noise, m. Noise beyond that of the steps is white, as strong as it is there.
    """
    step, level = recording.motion.encoder
    shift = step * generator.uniform(-0.5, 0.5)
    y = smooth + level * generator.standard_normal(smooth.size)
    if step > 0.0:
        y = np.round((y + shift) / step) * step - shift
    return replace(recording, y=y)


@dataclass(frozen=True, eq=False)
class Motion:
    """Smoothed motion of several recordings in one flat row each.

    y, v, standstill: (samples,) in m, m/s, true or false; measured: (samples,) raw positions in m; position_noise,
    speed_noise: (R,) standard deviations in m and m/s; of_recordings: the same of each (R).
    """

    measured: Array
    y: Array
    v: Array
    standstill: NDArray[np.bool_]
    position_noise: Array
    speed_noise: Array
    of_recordings: tuple[MeasuredMotion, ...] = ()


def measure_motion(recordings: Sequence[Recording]) -> Motion:
    """The motions of recordings in flat rows; each recording carries its own."""
    motions = tuple(recording.motion for recording in recordings)
    return Motion(
        measured=np.concatenate([motion.measured for motion in motions]),
        y=np.concatenate([motion.y for motion in motions]),
        v=np.concatenate([motion.v for motion in motions]),
        standstill=np.concatenate([motion.standstill for motion in motions]),
        position_noise=np.array([motion.position_noise for motion in motions]),
        speed_noise=np.array([motion.speed_noise for motion in motions]),
        of_recordings=motions,
    )


def input_jumps(recording: Recording) -> NDArray[np.bool_]:
    """Sampling intervals (n - 1,) in which an input jumps: no spline knows when within the interval.

    A jump stands out of the third differences by ten times their usual size and a tenth of the input's range.
    """
    inputs = recording.stepping.inputs
    jumps = np.zeros(recording.y.size - 1, dtype=np.bool_)
    for channel in () if inputs is None else np.atleast_2d(inputs):
        third = np.abs(np.diff(channel, 3))
        limit = max(10.0 * float(np.median(third)) / MEDIAN_ABSOLUTE, 0.1 * float(np.ptp(channel)), 1e-300)
        for start in np.flatnonzero(third > limit):
            jumps[start : start + 3] = True
    return jumps


def current_noise(recording: Recording) -> Array:
    """Standard deviations (3,) in A of white noise in the phase currents; zeros where the recording has none or runs
    free."""
    if recording.phase_currents is None or recording.kind == "free_wheel":
        return np.zeros(3)
    return np.array([white_level(channel) for channel in recording.phase_currents])


def input_levels(recording: Recording) -> Array:
    """Standard deviations of the inputs' own white noise in their unit: (3,), or of one input (1,); (0,) where there is
    none."""
    channels = recording.inputs
    if channels is None or recording.kind == "free_wheel":
        return np.zeros(0)
    return np.array([noise_level(channel) for channel in np.atleast_2d(channels)])


def input_noise(recording: Recording, generator: np.random.Generator, levels: Array | None = None) -> Array:
    """One draw of the inputs' own white noise: (3, n) or (n,) in their unit; zeros where there is no input.

    levels: (3,) or (1,) of `input_levels` in the inputs' unit, where they are known.
    """
    channels = recording.inputs
    levels = input_levels(recording) if levels is None else levels
    if channels is None or not levels.size:
        return np.zeros(recording.y.size)
    return np.asarray(levels[:, None] * generator.standard_normal((levels.size, recording.y.size))).reshape(
        channels.shape
    )


def with_inputs_moved(recording: Recording, change: Array) -> Recording:
    """The recording with its inputs changed by what `input_noise` drew (free wheels: as it is). change: (3, n) or (n,)
    in the inputs' unit. Its inputs step where they did, whatever noise may pass for a jump.
    """
    if recording.kind == "free_wheel":
        return recording
    before = recording.before_noise or recording
    if recording.phase_currents is not None:
        return replace(recording, phase_currents=frozen(recording.phase_currents + change), before_noise=before)
    if recording.drive_input is not None:
        return replace(recording, drive_input=frozen(recording.drive_input + change), before_noise=before)
    return recording


def with_input_noise(recording: Recording, generator: np.random.Generator, levels: Array | None = None) -> Recording:
    """The recording with its inputs' own white noise added once more (free wheels: as it is).

    levels: (3,) or (1,) of `input_levels` in the inputs' unit, where they are known.
    """
    return with_inputs_moved(recording, input_noise(recording, generator, levels))
