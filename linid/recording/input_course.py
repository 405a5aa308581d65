"""What the drive's inputs do between the samples: smooth splines, except where they jump or the drive holds them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from linid.arrays import Array
from linid.recording.recording import Recording
from linid.recording.splines import cubic_spline_coefficients

_USUAL, _OF_RANGE = 5.0, 0.2  # fourth differences that stand out: by their usual size nearby, by the inputs' range
_NEARBY = 41  # samples: a fast motor's commutation makes them large for a while
_LONGEST = 3  # sampling intervals over which a current may take to step, rising or logged late
_ORDER = 4  # moments of a step within its interval that the cubic in its place has too
_REACHES = 6, 8, 12  # samples to either side from which the motion tells when an input stepped
_FROM_REST = 0.2  # of the sixth interval's travel: less in the first, and an axis sets off from rest
_TRIES = 21  # instants that are tried
_UNTOLD = 1.0 / 12.0  # variance of an instant that nothing tells: anywhere in an interval
_MOMENTS = 1.0 / (np.arange(_ORDER)[:, None] + np.arange(_ORDER) + 1.0)  # integrals of s^j s^k over 0 to 1
_POWERS = np.arange(_ORDER)
_GAUSS = np.polynomial.legendre.leggauss(6)  # nodes and weights
_BESIDE = 8  # samples beside a step that tell the course up to it
_ROUGH = 0.1  # of a step, at most, by which the input may scatter beside it
_KEPT = 64  # recordings whose jumps are remembered
_CLEAR = 0.2  # of the largest input: phases with less have no clear vector
_PHASES = np.exp(2j * np.pi / 3.0 * np.arange(3))  # of three equal phases


class Jump(NamedTuple):
    """An input steps within sampling intervals `first` to `last`, each by the sample before it."""

    first: int
    last: int


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
    inputs = recording.phase_currents if recording.phase_currents is not None else recording.drive_input
    if inputs is None or recording.kind == "free_wheel":
        return None
    dt = recording.duration / (recording.t.size - 1)
    return InputCourse(float(recording.t[0]), dt, input_coefficients(recording, np.atleast_2d(inputs)))


def find_jumps(channels: Array) -> tuple[Jump, ...]:
    """Where inputs step from one level to another, and splines through them would ring.

    channels: (c, n) in any unit, A or V. Fourth differences are small where an input is smooth. Those that stand out
    come four in a row, or, where the input takes more than one interval to step, so many more.
    """
    from scipy.ndimage import median_filter

    if channels.shape[1] < _NEARBY:
        return ()
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


def input_coefficients(recording: Recording, channels: Array) -> Array:
    """Coefficients of inputs between the samples, (c, n - 1, 4), as `cubic_spline_coefficients` gives them.

    channels: (c, n) inputs in their unit. As the recording states it in `between_samples`: a spline, straight lines,
    levels that are held, or, detected, splines that end where an input steps and are extended to the instant at which
    it does. Raises DataError for fewer than two samples.
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
        return np.asarray(moments @ np.linalg.inv(_MOMENTS) / powers)
    jumps = find_jumps(channels) if stated == "detected" and channels.size else ()
    if not jumps:
        return cubic_spline_coefficients(dt, channels)
    out = np.empty((channels.shape[0], channels.shape[1] - 1, _ORDER))
    starts, stops = [0, *(jump.last + 1 for jump in jumps)], [*(jump.first for jump in jumps), channels.shape[1] - 1]
    for a, b in zip(starts, stops, strict=True):
        if b > a:
            out[:, a:b] = cubic_spline_coefficients(dt, channels[:, a : b + 1]) * powers
    for k, (jump, instant) in enumerate(zip(jumps, jump_instants(recording, jumps), strict=True)):
        before, after = (_course(channels, side) for side in _sides(jumps, k, channels.shape[1]))
        for n in range(jump.first, jump.last + 1):
            out[:, n] = _stepping(before, after, n, float(np.clip(jump.first + instant - n, 0.0, 1.0)))
    return np.asarray(out / powers)


def _course(channels: Array, side: range) -> Callable[[Array], Array]:
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


def _stepping(before: Callable[[Array], Array], after: Callable[[Array], Array], first: float, instant: float) -> Array:
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


def jump_instants(recording: Recording, jumps: Sequence[Jump]) -> Array:
    """When each input stepped, (k,) in sampling intervals after the first sample of each jump.

    As the recording states it, or as its motion shows it: the speed bends where the force steps. What a single bend
    leaves open, the others tell: most drives step in time with the samples.
    """
    if recording.jump_at is not None:
        return np.full(len(jumps), recording.jump_at)
    x, variance = np.array(_bends(np.asarray(recording.y, dtype=np.float64).tobytes(), tuple(jumps))).T
    if variance.min() >= _UNTOLD:
        return np.asarray(x)
    weights = 1.0 / (variance + _UNTOLD / 100.0)  # none so sure that it outweighs all others
    centre = float(np.sum(weights * x) / np.sum(weights))
    # Scatter beyond what the bends' own uncertainty explains is real: these do not step in time.
    own = max(0.0, float(np.sum(weights * ((x - centre) ** 2 - variance)) / np.sum(weights)))
    return np.asarray((own * x + variance * centre) / (own + variance))


@lru_cache(maxsize=_KEPT)
def _bends(positions: bytes, jumps: tuple[Jump, ...]) -> tuple[tuple[float, float], ...]:
    """What the positions (float64, m) tell of each jump's instant; kept, for one recording is simulated many times."""
    y = np.frombuffer(positions)
    return tuple(_bend(y, jump, _room(jumps, k, y.size)) for k, jump in enumerate(jumps))


def _room(jumps: Sequence[Jump], k: int, size: int) -> tuple[int, int]:
    """Samples on either side of a jump that no other jump touches."""
    begin = jumps[k - 1].last + 2 if k > 0 else 0
    end = jumps[k + 1].first - 1 if k + 1 < len(jumps) else size - 1
    return jumps[k].first - begin, end - jumps[k].last - 1


def _bend(y: Array, jump: Jump, room: tuple[int, int]) -> tuple[float, float]:
    """Where the speed of positions y (n,) in m bends, in intervals after the jump's first sample, and its variance.

    Of several reaches the one that tells most: a fast axis passes ripple within few samples, a slow one drowns in its
    noise. At the start of a recording an axis may set off from rest.
    """
    count, least = jump.last + 1 - jump.first, _REACHES[0]
    if jump.first == 0 and room[1] >= least and abs(y[1] - y[0]) < _FROM_REST * abs(y[least] - y[least - 1]):
        s = np.arange(1.0, least + 1.0)
        return _instant(y[1 : least + 1] - y[0], s, count, _setting_off)
    found = []
    for reach in _REACHES:
        if reach <= min(room):
            s = np.concatenate([np.arange(-reach, 1.0), np.arange(count, count + reach + 1.0)])
            found.append(_instant(y[jump.first + s.astype(int)], s, count, _bending))
    return min(found, key=lambda one: one[1], default=(count / 2.0, _UNTOLD * count**2))


def _setting_off(s: Array, x: Array) -> Array:
    """Columns (m, n, 2) of positions at times s (n,) in samples of an axis that leaves its rest, at instants x (m,).

    Its current rises from the first sample on and lags behind its command by x.
    """
    x = x[:, None]
    return np.stack([(s - x) ** 2 + x**2, (s - x) ** 3 + 3.0 * x**2 * (s - x)], axis=2)


def _bending(s: Array, x: Array) -> Array:
    """Columns (m, n, 7) of positions at times s (n,) in samples whose speed bends at instants x (m,).

    Their two cubics share the speed there; they need not meet, as a current that rises for a while lags behind a step.
    """
    out = np.empty((x.size, s.size, 7))
    out[:, :, :4] = np.vander(s, 4, increasing=True)
    out[:, :, 4] = s > 0.0
    late = np.where(s > 0.0, s - x[:, None], 0.0)
    out[:, :, 5], out[:, :, 6] = late**2, late**3
    return out


def _instant(window: Array, s: Array, count: int, columns: Callable[[Array, Array], Array]) -> tuple[float, float]:
    """Mean and variance of the instant, from 0 to count, that makes columns fit positions (n,) at times s (n,)."""
    if not np.all(np.isfinite(window)):
        return count / 2.0, _UNTOLD * count**2
    window = (window - window.mean() * (s[0] < 0.0)) / max(float(np.std(window)), 1e-300)
    low, high = 0.0, float(count)
    for turn in range(2):  # the second time only where it may be
        tries = np.linspace(low, high, _TRIES)
        bases = _spans(columns, s, tries) if turn else _first_spans(columns, tuple(s.tolist()), high)
        shares = np.swapaxes(bases, 1, 2) @ window
        costs = np.sum((window - (bases @ shares[:, :, None])[:, :, 0]) ** 2, axis=1)
        deviation = max(float(costs.min()) / (s.size - bases.shape[2] - 1), 1e-300)
        likely = np.exp(-0.5 * (costs - costs.min()) / deviation)
        likely /= likely.sum()
        mean, step = float(likely @ tries), float(tries[1] - tries[0])
        variance = float(likely @ (tries - mean) ** 2) + step**2 / 12.0
        low, high = max(low, mean - 5.0 * variance**0.5), min(high, mean + 5.0 * variance**0.5)
    return mean, variance


@lru_cache(maxsize=_KEPT)
def _first_spans(columns: Callable[[Array, Array], Array], s: tuple[float, ...], high: float) -> Array:
    """What the columns span where nothing is known of the instant yet: the same for all steps of a length."""
    return _spans(columns, np.array(s), np.linspace(0.0, high, _TRIES))


def _spans(columns: Callable[[Array, Array], Array], s: Array, tries: Array) -> Array:
    """Orthonormal bases (m, n, r) of the columns at times s (n,) in samples for each of m instants that are tried."""
    bases = columns(s, tries)
    return np.linalg.qr(bases / np.linalg.norm(bases, axis=1, keepdims=True))[0]
