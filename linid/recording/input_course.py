"""What the drive's inputs do between the samples: smooth splines, except where they jump or the drive holds them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.recording.jump_instants import jump_instants
from linid.recording.jumps import Course, find_jumps, logged_instants, step_courses, step_sizes
from linid.recording.recording import Recording
from linid.recording.splines import cubic_spline_coefficients

_ORDER = 4  # moments of a step within its interval that the cubic in its place has too
_MOMENTS = 1.0 / (np.arange(_ORDER)[:, None] + np.arange(_ORDER) + 1.0)  # integrals of s^j s^k over 0 to 1
_POWERS = np.arange(_ORDER)
_MUTE = np.array([-1.0, 12.0, -30.0, 20.0])  # Legendre's third polynomial over 0 to 1: no moments below its own
_GAUSS = np.polynomial.legendre.leggauss(6)  # nodes and weights


@dataclass(frozen=True)
class InputCourse:
    """The inputs of a recording as functions of time.

    t_start: s; dt: period in s; coefficients: (c, n - 1, 4) as of `input_coefficients`.
    """

    t_start: float
    dt: float
    coefficients: Array

    def __call__(self, t: Array) -> Array:
        """The inputs (c, m) at times (m,) in s; beyond the ends, their outermost cubics."""
        passed = np.asarray(t) - self.t_start
        k = np.clip(np.floor(passed / self.dt), 0, self.coefficients.shape[1] - 1).astype(int)
        return np.asarray(np.sum(self.coefficients[:, k] * (passed - k * self.dt)[:, None] ** _POWERS, axis=-1))


def input_course(recording: Recording) -> InputCourse | None:
    """What currents or the one input of a driven recording do between the samples; None where nothing drives it."""
    inputs = recording.inputs
    if inputs is None or recording.kind == "free_wheel":
        return None
    dt = recording.duration / (recording.t.size - 1)
    return InputCourse(float(recording.t[0]), dt, input_coefficients(recording, np.atleast_2d(inputs)))


def input_coefficients(recording: Recording, channels: Array, *, stepping: bool = True) -> Array:
    """Coefficients of inputs between the samples, (c, n - 1, 4), as `cubic_spline_coefficients` gives them.

    channels: (c, n) inputs in their unit; stepping: whether they may step, as noise of them does not. As the recording
    states it in `between_samples`: a spline, straight lines, levels that are held, or, detected, splines that end where
    an input steps and are extended to the instant at which it does. Raises DataError for fewer than two samples.
    """
    dt = recording.duration / (recording.t.size - 1)
    stated = recording.between_samples
    powers = dt ** np.arange(_ORDER)
    if stated == "linear":
        out = np.zeros((channels.shape[0], channels.shape[1] - 1, _ORDER))
        out[:, :, 0], out[:, :, 1] = channels[:, :-1], np.diff(channels, axis=1) / dt
        return out
    if stated == "hold":  # until the next sample, where nothing else is said
        x = 1.0 if recording.jump_at is None else recording.jump_at
        moments = (channels[:, :-1, None] * x ** (_POWERS + 1) + channels[:, 1:, None] * (1.0 - x ** (_POWERS + 1))) / (
            _POWERS + 1
        )
        out = moments @ np.linalg.inv(_MOMENTS)
        out[:, 0] = _from_sample(channels[:, 0], out[:, 0])
        return np.asarray(out / powers)
    jumps = find_jumps(channels) if stepping and stated == "detected" and channels.size else ()
    if not jumps:
        return cubic_spline_coefficients(dt, channels)
    out = np.empty((channels.shape[0], channels.shape[1] - 1, _ORDER))
    starts, stops = [0, *(jump.last + 1 for jump in jumps)], [*(jump.first for jump in jumps), channels.shape[1] - 1]
    for a, b in zip(starts, stops, strict=True):
        if b > a:
            out[:, a:b] = cubic_spline_coefficients(dt, channels[:, a : b + 1]) * powers
    courses = step_courses(channels, jumps)
    sizes, logged = step_sizes(jumps, courses), logged_instants(channels, jumps, courses)
    instants = jump_instants(recording, jumps, sizes, logged)
    for jump, instant, (before, after) in zip(jumps, instants, courses, strict=True):
        for n in range(jump.first, jump.last + 1):
            out[:, n] = _stepping(before, after, n, float(np.clip(jump.first + instant - n, 0.0, 1.0)))
    out[:, 0] = _from_sample(channels[:, 0], out[:, 0])
    return np.asarray(out / powers)


def _from_sample(first: Array, cubics: Array) -> Array:
    """The first interval's cubics, (c, 4) in powers of a share of it, made to begin at the first sample (c,).

    A resting axis' bristle starts in balance with it; a cubic in the place of a step begins beyond. To the cubics is
    added what changes neither an interval's impulse nor its way, nor its next moment: a Legendre polynomial.
    """
    return np.asarray(cubics + np.outer(cubics[:, 0] - first, _MUTE))


def _stepping(before: Course, after: Course, first: float, instant: float) -> Array:
    """The cubic, (c, 4) in powers of the share of an interval, that stands for a step between two courses.

    Its first moments are theirs, so that it gives a mass the same speed and the same way. first: time in samples at
    which the interval begins; instant: share of it at which the step comes.
    """
    nodes, weights = _GAUSS
    moments: Array = np.zeros(_ORDER)
    for course, begin, end in ((before, 0.0, instant), (after, instant, 1.0)):
        s = begin + (end - begin) * (nodes + 1.0) / 2.0
        moments = moments + course(first + s) @ ((end - begin) / 2.0 * weights[:, None] * s[:, None] ** _POWERS)
    return np.asarray(np.linalg.solve(_MOMENTS, np.transpose(moments))).T
