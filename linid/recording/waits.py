"""Where a reading waits: behind play, the motor turns and crosses the play while what is read stands still."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from linid.arrays import Array, Flags

_STILL = 5.0  # deviations of the noise, or so many steps of the encoder, within which a reading stands still
_STILL_STEPS = 1.5
_TURN = 3.0  # of that: what a reading goes back by is a turn
_FIT = 5  # samples that tell how a motion comes to a turn or leaves it, more where noise hides it
_MOST_FITTED = 20
_SKIPPED = 2  # samples after a contact, which gives way before it carries the reading along
_CLEAR = 200.0  # deviations of the noise by which these must differ
# Of travel over speed times time: a crossing at even acceleration takes half; one that lasts longer began with a rest.
_STEEPEST, _FLATTEST, _EVEN = 1.0, 3.0, 2.0


class Wait(NamedTuple):
    """A turn or a stop of what is read. start, end: samples between which the motor may move unseen, broken; direction:
    sign of the motion afterwards, dimensionless; speed: at which the reading goes on, m/s; part: share of the play that
    is crossed, a half where an axis sets off from a rest that nothing tells of, 0 where it goes on as before or stays.
    """

    start: float
    end: float
    direction: float
    speed: float
    part: float


def waits_in(y: Array, dt: float, noise: float, step: float, rests: Flags) -> tuple[Wait, ...]:
    """The waits of positions y (n,) in m, every dt s, with noise (deviation, m) and a quantum step in m, in order;
    rests: (n,) true where they stay within their noise."""
    from scipy.signal import find_peaks

    still = max(_STILL * noise, _STILL_STEPS * step)
    turns = [(k, -1.0) for k in find_peaks(y, prominence=_TURN * still)[0]]
    turns += [(k, 1.0) for k in find_peaks(-y, prominence=_TURN * still)[0]]
    found = [_set_off(y, dt, still, noise), *(_turn(y, dt, still, noise, k, side) for k, side in sorted(turns))]
    waits: list[Wait] = []
    for wait in found:
        if wait is not None and not (waits and wait.direction == waits[-1].direction):  # of one rest, the first turn
            waits.append(wait)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], rests.astype(int), [0]]))).reshape(-1, 2)
    for first, last in edges:
        if first == 0 or any(wait.start < last and wait.end > first - 1 for wait in waits):
            continue
        stop = _stop(y, still, noise, int(first), int(last) - 1)
        if stop is not None and waits and waits[-1].part == 0.0 and stop.start < waits[-1].end:
            waits[-1] = waits[-1]._replace(end=stop.end)  # one rest, which noise has broken
        elif stop is not None:
            waits.append(stop)
    return tuple(sorted(waits))


def _stop(y: Array, still: float, noise: float, first: int, last: int) -> Wait | None:
    """The stop of an axis that rests from one sample to another and goes on as before, or stays; None where nothing
    tells how it came to rest."""
    level = float(np.median(y[first : first + _FIT]))
    before = np.flatnonzero(np.abs(y[:first] - level) > still)
    after = np.flatnonzero(np.abs(y[last:] - y[last]) > still)
    if not before.size:
        return None
    off = int(before[-1])
    direction = float(np.sign(level - y[off]))
    came = _foot(-direction * (y[::-1] - level), y.size - 1 - off, noise)
    if came is None:
        return None
    return Wait(
        min(y.size - 1.0 - came, float(first)),
        float(last + after[0]) if after.size else float(y.size),
        direction,
        0.0,
        0.0,
    )


def _set_off(y: Array, dt: float, still: float, noise: float) -> Wait | None:
    """How an axis that rests at first sets off; None where it moves from the first sample or never."""
    level = float(np.median(y[:_FIT]))
    gone = np.flatnonzero(np.abs(y - level) > still)
    if not gone.size or gone[0] < _FIT:
        return None
    level = float(np.median(y[: gone[0]]))
    direction = float(np.sign(y[gone[0]] - level))
    left = _left(direction * (y - level), int(gone[0]) + _SKIPPED, noise)
    return None if left is None else Wait(0.0, max(left[0], 1.0), direction, left[1] / dt, 0.5)


def _turn(y: Array, dt: float, still: float, noise: float, peak: int, direction: float) -> Wait | None:
    """The turn about an extreme sample; None where the recording begins or ends beside it."""
    level, reach = float(y[peak]), 2.0 * still  # an extreme sample lies beside the level by its noise
    for _ in range(2):
        off = direction * (y - level) > reach
        before, after = np.flatnonzero(off[: peak + 1]), np.flatnonzero(off[peak:])
        if not after.size or not before.size:
            return None
        first, last = int(before[-1]), int(peak + after[0])  # that lie off the level on either side
        level, reach = float(np.median(y[first + 1 : last])), still
    way = direction * (y - level)
    came, left = _foot(way[::-1], y.size - 1 - first, noise), _left(way, last + _SKIPPED, noise)
    if came is None or left is None:
        return None
    start = min(y.size - 1.0 - came, last - 1.0)
    return Wait(start, max(left[0], start + 1.0), direction, left[1] / dt, 1.0)


def _left(way: Array, first: int, noise: float) -> tuple[float, float] | None:
    """When a way (n,) in m from the level on, of which the samples from `first` on are off it, leaves 0, in samples,
    and at which speed (m per sample), by a parabola; None at the end of a recording."""
    count = _enough(way, first, noise)
    if count == 0:
        return None
    bend, rate, rest = (float(c) for c in _parabola(count) @ way[first : first + count])
    square = rate * rate - 4.0 * bend * rest
    if square <= 0.0 or rate + square**0.5 <= 0.0:
        return first + min(-rate / (2.0 * bend), 0.0) if bend > 0.0 else float(first), 0.0
    return first + min(-2.0 * rest / (rate + square**0.5), 0.0), square**0.5


def _foot(way: Array, first: int, noise: float) -> float | None:
    """Where a way (n,) in m that is off the level from sample `first` on begins at rest, in samples: the foot of a
    parabola that stands on the level, whose root is a straight line."""
    count = _enough(way, first, noise)
    if count == 0:
        return None
    k, far = np.arange(float(count)), np.maximum(way[first : first + count], 0.0)
    root, middle = np.sqrt(far), float(np.average(k, weights=far))  # noise moves a root by less the farther it is
    level = float(np.average(root, weights=far))
    rise, spread = float(np.sum(far * (k - middle) * root)), float(np.sum(far * (k - middle) ** 2))
    return first + min(middle - level * spread / rise, 0.0) if rise > 0.0 else float(first)


def _enough(way: Array, first: int, noise: float) -> int:
    """How many samples from `first` on tell how a way (n,) goes on from the level; 0 at the end of a recording."""
    if first + _FIT > way.size:
        return 0
    most = min(_MOST_FITTED, way.size - first)
    clear = np.flatnonzero(np.abs(way[first + _FIT - 1 : first + most] - way[first]) >= _CLEAR * noise)
    return _FIT + int(clear[0]) if clear.size else most


@cache
def _parabola(count: int) -> Array:
    """What tells the coefficients (3,) of a parabola from its samples (count,), highest power first."""
    return np.linalg.pinv(np.vander(np.arange(float(count)), 3))


class Ahead(NamedTuple):
    """How far a motor is before its reading. y: (n,) of its position, m; v: (n,) of its speed, m/s; seen: (n,) share of
    its acceleration that the reading shows, 0 while it rests unseen."""

    y: Array
    v: Array
    seen: Array


def ahead_of_reading(waits: Sequence[Wait], y: Array, dt: float, play: float) -> Ahead:
    """How far the motor is before its reading behind some play in m: a half of it to the side of the motion, and
    between two sides by a cubic that begins at rest and ends with the speed at which the reading goes on.

    waits: of positions y (n,) in m, every dt s. What forces do in between is left to whoever judges the acceleration.
    """
    side = -waits[0].direction * (2.0 * waits[0].part - 1.0) if waits else float(np.sign(y[-1] - y[0]))
    if waits and waits[0].part == 0.0:
        side = waits[0].direction
    samples = np.arange(y.size)
    found = Ahead(np.full(y.size, 0.5 * side * play), np.zeros(y.size), np.ones(y.size))
    for wait in waits:
        travel, begin = wait.part * play, wait.end
        if travel > 0.0:
            last = int(np.ceil(wait.end))
            found.y[last:] = 0.5 * wait.direction * play
            time = (wait.end - wait.start) * dt
            shape = wait.speed * time / travel
            if shape > _FLATTEST:
                time, shape = _EVEN * travel / wait.speed, _EVEN
            shape = max(shape, _STEEPEST)
            begin = max(wait.end - time / dt, 0.0)
            first = int(np.ceil(begin))
            part = 1.0 - (wait.end - samples[first:last]) * dt / time
            way = (3.0 - shape) * part**2 + (shape - 2.0) * part**3
            rate = (2.0 * (3.0 - shape) * part + 3.0 * (shape - 2.0) * part**2) / time
            found.y[first:last] = wait.direction * play * (0.5 - wait.part * (1.0 - way))
            found.v[first:last] = wait.direction * travel * rate
        near = slice(max(int(wait.start), 0), min(int(begin) + 2, y.size))  # all others show it whole
        unseen = np.minimum(samples[near] + 0.5, begin) - np.maximum(samples[near] - 0.5, wait.start)
        np.minimum(found.seen[near], 1.0 - np.clip(unseen, 0.0, 1.0), out=found.seen[near])
    return found
