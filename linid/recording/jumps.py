"""Where inputs step from one level to another between two samples, and their smooth courses on either side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from linid.arrays import Array

SETTING_OFF = 6  # samples over which an axis that sets off from rest is seen to
_FROM_REST = 0.2  # of the sixth interval's travel: less in the first, and an axis sets off from rest
_USUAL, _OF_RANGE = 5.0, 0.2  # fourth differences that stand out: by their usual size nearby, by the inputs' range
_NEARBY = 41  # samples: a fast motor's commutation makes them large for a while
_LONGEST = 3  # sampling intervals over which a current may take to step, rising or logged late
_BESIDE = 8  # samples beside a step that tell the course up to it
_ROUGH = 0.1  # of a step, at most, by which the input may scatter beside it
_KEPT = 64  # lengths of courses whose fits are remembered, and inputs whose jumps are
_LONGEST_REMEMBERED = 100_000  # values of inputs that are: 51 MB in all
_CLEAR = 0.2  # of the largest input: phases with less have no clear vector
_PHASES = np.exp(2j * np.pi / 3.0 * np.arange(3))  # of three equal phases

Course = Callable[[Array], Array]  # inputs (c, m) at times (m,) in samples


class Jump(NamedTuple):
    """An input steps within sampling intervals `first` to `last`, each by the sample before it."""

    first: int
    last: int


def sets_off(y: Array, inputs: Array | None) -> bool:
    """Whether an axis that rests at the first sample moves from then on, as an input steps right after it.

    y: (n,) positions in m; inputs: (c, n) or (n,) in any unit, None where there are none.
    """
    if inputs is None or not leaves_rest(y):
        return False
    return any(jump.first == 0 for jump in find_jumps(np.atleast_2d(inputs)))


def leaves_rest(y: Array) -> bool:
    """Whether positions y (n,) in m look like those of an axis that sets off from rest after the first one."""
    return y.size > SETTING_OFF and bool(abs(y[1] - y[0]) < _FROM_REST * abs(y[SETTING_OFF] - y[SETTING_OFF - 1]))


def find_jumps(channels: Array) -> tuple[Jump, ...]:
    """Where inputs step from one level to another, and splines through them would ring.

    channels: (c, n) in any unit, A or V. Fourth differences are small where an input is smooth. Those that stand out
    come four in a row, or, where the input takes more than one interval to step, so many more.
    """
    if channels.shape[1] < _NEARBY:
        return ()
    if channels.size > _LONGEST_REMEMBERED:
        return _jumps_of(channels)
    return _remembered(np.asarray(channels, dtype=np.float64).tobytes(), channels.shape)


@lru_cache(maxsize=_KEPT)
def _remembered(values: bytes, shape: tuple[int, int]) -> tuple[Jump, ...]:
    """The jumps of inputs (float64); kept, for other measurements of a motion have the same inputs."""
    return _jumps_of(np.frombuffer(values).reshape(shape))


def _jumps_of(channels: Array) -> tuple[Jump, ...]:
    """`find_jumps` of inputs (c, n) that are long enough."""
    from scipy.ndimage import median_filter

    size = np.linalg.norm(np.diff(channels, 4, axis=1), axis=0)
    limit = np.maximum(_USUAL * median_filter(size, _NEARBY), _OF_RANGE * np.ptp(channels, axis=1).max())
    stands_out = size > np.maximum(limit, 1e-300)
    stands_out[1:-1] |= stands_out[:-2] & stands_out[2:]  # of two equal parts of a step, the middle one vanishes
    edges = np.flatnonzero(np.diff(stands_out.astype(np.int8), prepend=0, append=0))
    found = []
    samples = channels.shape[1]
    for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        # At the ends of the recording fewer differences touch a step.
        first = begin + 3 if begin > 0 else end - 1
        last = end - 1 if end < size.size else first
        if first > last:
            first = last = (begin + end + 2) // 2
        if last - first < _LONGEST:
            found.append(Jump(first, min(last + 1, samples - 2)))
    sides = [_sides(found, k, samples) for k in range(len(found))]
    return tuple(jump for jump, (before, after) in zip(found, sides, strict=True) if _is_step(channels, before, after))


def _sides(jumps: Sequence[Jump], k: int, samples: int) -> tuple[range, range]:
    """The samples that tell the course before a jump and after it."""
    jump = jumps[k]
    begin = jumps[k - 1].last + 1 if k > 0 else 0
    end = jumps[k + 1].first + 1 if k + 1 < len(jumps) else samples
    return (
        range(max(begin, jump.first + 1 - _BESIDE), jump.first + 1),
        range(jump.last + 1, min(end, jump.last + 1 + _BESIDE)),
    )


def _is_step(channels: Array, before: range, after: range) -> bool:
    """Whether an input steps between smooth courses, rather than being rough on both sides too."""
    if not before or not after:
        return False
    rough = 0.0
    middle = np.array([(before[-1] + after[0]) / 2.0])
    ends = []
    for side in (before, after):
        course = _course(channels, side)
        rough += float(np.sum((channels[:, side.start : side.stop] - course(np.array(side))) ** 2)) / len(side)
        ends.append(course(middle))
    return bool(rough**0.5 < _ROUGH * np.linalg.norm(ends[1] - ends[0]))


def step_courses(channels: Array, jumps: Sequence[Jump]) -> list[tuple[Course, Course]]:
    """The smooth courses of inputs before and after each jump. channels: (c, n) in any unit, A or V."""
    sides = [_sides(jumps, k, channels.shape[1]) for k in range(len(jumps))]
    return [(_course(channels, before), _course(channels, after)) for before, after in sides]


def step_sizes(jumps: Sequence[Jump], courses: Sequence[tuple[Course, Course]]) -> Array:
    """By how much inputs step at each jump between its courses, all inputs together, (k,) in their unit."""
    middles = [np.array([(jump.first + jump.last + 1) / 2.0]) for jump in jumps]
    steps = [after(middle) - before(middle) for middle, (before, after) in zip(middles, courses, strict=True)]
    return np.array([np.linalg.norm(step) for step in steps])


def logged_instants(channels: Array, jumps: Sequence[Jump], courses: Sequence[tuple[Course, Course]]) -> Array:
    """When inputs step by their own samples, (k,) in intervals after the first sample of each jump, to half a one.

    Samples between the courses before and after say how much of the step was done. channels: (c, n) in their unit.
    """
    out = np.empty(len(jumps))
    for k, (jump, (before, after)) in enumerate(zip(jumps, courses, strict=True)):
        inner = np.arange(jump.first + 1, jump.last + 1)
        low, high = (course(inner.astype(float)) for course in (before, after))
        steps = high - low
        done = np.sum((channels[:, inner] - low) * steps, axis=0) / np.maximum(np.sum(steps**2, axis=0), 1e-300)
        out[k] = 0.5 + np.sum(1.0 - np.clip(done, 0.0, 1.0))
    return out


def _course(channels: Array, side: range) -> Course:
    """The smooth course of inputs (c, n) at and beside some samples, as a function of the time in samples (m,).

    Three phases turn with the field: their space vector's angle is a parabola, its length a line. Others, and phases
    without a clear vector, are lines.
    """
    part, middle, count = channels[:, side.start : side.stop], (side[0] + side[-1]) / 2.0, len(side)
    vector = _PHASES @ part if part.shape[0] == _PHASES.size else np.zeros(count)
    length = np.abs(vector)
    if length.min() > _CLEAR * np.abs(channels).max() and count > 2:
        angle = _fitting(count, 2) @ np.unwrap(np.angle(vector))
        growth = _fitting(count, 1) @ length
        mean = float(part.mean())

        def turning(t: Array) -> Array:
            s = t - middle
            turned = (growth[0] + growth[1] * s) * np.exp(1j * (angle[0] + (angle[1] + angle[2] * s) * s))
            return np.asarray(mean + np.real(np.conj(_PHASES)[:, None] * turned) / 1.5)

        return turning
    line = part @ _fitting(count, min(1, count - 1)).T
    return lambda t: np.asarray(line @ np.vander(t - middle, line.shape[1], increasing=True).T)


@lru_cache(maxsize=_KEPT)
def _fitting(count: int, degree: int) -> Array:
    """What makes samples at unit distances the least-squares polynomial's coefficients, (degree + 1, count).

    Its time runs from the middle of the samples.
    """
    s = np.arange(count) - (count - 1) / 2.0
    return np.asarray(np.linalg.pinv(np.vander(s, degree + 1, increasing=True)))
