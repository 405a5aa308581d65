"""Where a reading waits: behind play, the motor turns and crosses the play while what is read stands still."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from linid.arrays import Array, Flags, Integers

_STILL = 5.0  # deviations of the noise, or so many steps of the encoder, within which a reading stands still
_STILL_STEPS = 1.5
_TURN = 3.0  # of that: what a reading goes back by is a turn
_FIT = 5  # samples that tell how a motion comes to a turn or leaves it, more where noise hides it
_MOST_FITTED = 20
_SKIPPED = 2  # samples after a contact, which gives way before it carries the reading along
_CLEAR = 200.0  # deviations of the noise by which these must differ
_CHUNK = 64  # samples that are looked through at first
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
    still = max(_STILL * noise, _STILL_STEPS * step)
    found = [_set_off(y, dt, still, noise), *(_turn(y, dt, still, noise, *one) for one in turns_of(y, _TURN * still))]
    waits: list[Wait] = []
    for wait in found:
        if wait is not None and not (waits and wait.direction == waits[-1].direction):  # of one rest, the first turn
            waits.append(wait)
    return tuple(sorted([*waits, *_stops(y, still, noise, _rests_beside(rests, waits))]))


def turns_of(y: Array, back: float) -> list[tuple[int, float]]:
    """The extreme samples of positions y (n,) in m, in order, from which these go back by more than `back` m on both
    sides, each with the sign of the motion after it (scipy.signal finds such peaks too, but takes long to load)."""
    begins = [(begin, side) for side in (1.0, -1.0) if (begin := _gone_back(y, 0, back, side)) is not None]
    if not begins:
        return []
    (_, at), side = min(begins, key=lambda begin: begin[0][1])
    turns: list[tuple[int, float]] = []
    while (turn := _gone_back(y, at, back, -side)) is not None:
        turns.append((turn[0], side))
        at, side = turn[1], -side
    return turns


def _gone_back(y: Array, first: int, back: float, side: float) -> tuple[int, int] | None:
    """The highest (1) or lowest (-1) of samples y (n,) from one on before they go back from it by more than `back`, and
    the first that has; None where they do not. Most have soon."""
    top = first
    for stretch in _stretches(first, y.size):
        way = side * (y[stretch] - y[top])
        gone = np.flatnonzero(np.maximum.accumulate(np.maximum(way, 0.0)) - way > back)
        seen = way if not gone.size else way[: gone[0] + 1]
        highest = int(np.argmax(seen))
        top = stretch.start + highest if seen[highest] > 0.0 else top
        if gone.size:
            return top, int(stretch.start + gone[0])
    return None


def _stretches(first: int, count: int) -> Iterator[slice]:
    """Stretches of so many samples from one on, each twice as long as the one before: what is sought is mostly near."""
    size = _CHUNK
    while first < count:
        yield slice(first, first + size)
        first, size = first + size, 2 * size


def _rests_beside(rests: Flags, turns: Sequence[Wait]) -> list[tuple[int, int]]:
    """First and last sample of each rest in which nothing turns; not of that with which a recording begins."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], rests.astype(int), [0]]))).reshape(-1, 2)
    begins, ends = np.array([(turn.start, turn.end) for turn in turns]).reshape(-1, 2).T
    inside = [bool(np.any((begins < last) & (ends > first - 1))) for first, last in edges]
    return [(int(a), int(b) - 1) for (a, b), turned in zip(edges, inside, strict=True) if a > 0 and not turned]


def _stops(y: Array, still: float, noise: float, rests: Sequence[tuple[int, int]]) -> list[Wait]:
    """The stops of an axis that rests from one sample to another and goes on as before, or stays."""
    stops: list[Wait] = []
    for first, last in rests:
        if any(stop.start <= last and stop.end > first - 1 for stop in stops[-1:]):
            continue
        level = float(np.median(y[first : first + _FIT]))
        off = _off_at(y[first - 1 :: -1], level, still)
        if off is None:
            continue
        came_from = first - 1 - off
        direction = float(np.sign(level - y[came_from]))
        came = _foot(direction * (level - _back(y, came_from)), noise)
        after = _off_at(y[last:], float(y[last]), still)
        if came is None:
            continue
        start, end = min(came_from - came, float(first)), float(y.size if after is None else last + after)
        if stops and start < stops[-1].end:
            stops[-1] = stops[-1]._replace(end=end)  # one rest, which noise has broken
        else:
            stops.append(Wait(start, end, direction, 0.0, 0.0))
    return stops


def _set_off(y: Array, dt: float, still: float, noise: float) -> Wait | None:
    """How an axis that rests at first sets off; None where it moves from the first sample or never."""
    gone = _off_at(y, float(np.median(y[:_FIT])), still)
    if gone is None or gone < _FIT:
        return None
    level = float(np.median(y[:gone]))
    direction, begin = float(np.sign(y[gone] - level)), gone + _SKIPPED
    left = _left(direction * (y[begin : begin + _MOST_FITTED] - level), noise)
    return None if left is None else Wait(0.0, max(begin + left[0], 1.0), direction, left[1] / dt, 0.5)


def _turn(y: Array, dt: float, still: float, noise: float, peak: int, direction: float) -> Wait | None:
    """The turn about an extreme sample; None where the recording begins or ends beside it."""
    level, reach = float(y[peak]), 2.0 * still  # an extreme sample lies beside the level by its noise
    for _ in range(2):
        before = _off_at(y[peak::-1], level, reach, direction)
        after = _off_at(y[peak:], level, reach, direction)
        if before is None or after is None:
            return None
        first, last = peak - before, peak + after  # that lie off the level on either side
        level, reach = float(np.median(y[first + 1 : last])), still
    begin = last + _SKIPPED
    came = _foot(direction * (_back(y, first) - level), noise)
    left = _left(direction * (y[begin : begin + _MOST_FITTED] - level), noise)
    if came is None or left is None:
        return None
    start = min(first - came, last - 1.0)
    return Wait(start, max(begin + left[0], start + 1.0), direction, left[1] / dt, 1.0)


def _off_at(y: Array, level: float, reach: float, direction: float = 0.0) -> int | None:
    """The first of positions y (n,) in m that lies off a level by more than `reach` m, in one direction or in either
    (0); None without."""
    for stretch in _stretches(0, y.size):
        way = y[stretch] - level
        off = np.flatnonzero((direction * way if direction else np.abs(way)) > reach)
        if off.size:
            return int(stretch.start + off[0])
    return None


def _back(y: Array, first: int) -> Array:
    """So many samples as are fitted, from one on backwards (m)."""
    return y[max(first - _MOST_FITTED + 1, 0) : first + 1][::-1]


def _left(way: Array, noise: float) -> tuple[float, float] | None:
    """When a way (n,) in m from a level on, which is off it from its first sample on, left it, in samples from there
    (0 or less), and at which speed (m per sample), by a parabola; None at the end of a recording."""
    count = _enough(way, noise)
    if count == 0:
        return None
    bend, rate, rest = (float(c) for c in _parabola(count) @ way[:count])
    square = rate * rate - 4.0 * bend * rest
    if square <= 0.0 or rate + square**0.5 <= 0.0:
        return min(-rate / (2.0 * bend), 0.0) if bend > 0.0 else 0.0, 0.0
    return min(-2.0 * rest / (rate + square**0.5), 0.0), square**0.5


def _foot(way: Array, noise: float) -> float | None:
    """Where a way (n,) in m that is off a level from its first sample on began at rest, in samples from there (0 or
    less): the foot of a parabola that stands on the level, whose root is a straight line."""
    count = _enough(way, noise)
    if count == 0:
        return None
    k, far = np.arange(float(count)), np.maximum(way[:count], 0.0)
    root, middle = np.sqrt(far), float(np.average(k, weights=far))  # noise moves a root by less the farther it is
    level = float(np.average(root, weights=far))
    rise, spread = float(np.sum(far * (k - middle) * root)), float(np.sum(far * (k - middle) ** 2))
    return min(middle - level * spread / rise, 0.0) if rise > 0.0 else 0.0


def _enough(way: Array, noise: float) -> int:
    """How many samples tell how a way (n,) in m goes on from its first one; 0 at the end of a recording."""
    if way.size < _FIT:
        return 0
    most = min(_MOST_FITTED, way.size)
    clear = np.flatnonzero(np.abs(way[_FIT - 1 : most] - way[0]) >= _CLEAR * noise)
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
    found = Ahead(0.5 * play * _sides(waits, y), np.zeros(y.size), np.ones(y.size))
    if not waits:
        return found
    start, end, direction, speed, part = np.array(waits).T
    travel, time = part * play, (end - start) * dt
    crosses = travel > 0.0
    with np.errstate(divide="ignore", invalid="ignore"):  # of those that cross nothing
        shape = speed * time / travel
        rested = crosses & (shape > _FLATTEST)
        time = np.where(rested, _EVEN * travel / speed, time)
        shape = np.maximum(np.where(rested, _EVEN, shape), _STEEPEST)
    begin = np.where(crosses, np.maximum(end - time / dt, 0.0), end)
    first = np.ceil(begin).astype(np.int64)
    last = np.where(crosses, np.minimum(np.ceil(end).astype(np.int64), y.size), first)
    of, k = _ranges(first, last)
    gone = 1.0 - (end[of] - k) * dt / time[of]
    way = (3.0 - shape[of]) * gone**2 + (shape[of] - 2.0) * gone**3
    rate = (2.0 * (3.0 - shape[of]) * gone + 3.0 * (shape[of] - 2.0) * gone**2) / time[of]
    found.y[k] = direction[of] * play * (0.5 - part[of] * (1.0 - way))
    found.v[k] = direction[of] * travel[of] * rate
    # All samples that are not near show it whole.
    of, k = _ranges(np.maximum(start.astype(np.int64), 0), np.minimum(begin.astype(np.int64) + 2, y.size))
    unseen = np.minimum(k + 0.5, begin[of]) - np.maximum(k - 0.5, start[of])
    np.minimum.at(found.seen, k, 1.0 - np.clip(unseen, 0.0, 1.0))
    return found


def _ranges(first: Integers, last: Integers) -> tuple[Integers, Integers]:
    """All whole numbers from each first one (W,) to before each last one, (n,), and whose they are, (n,)."""
    sizes = np.maximum(last - first, 0)
    of = np.repeat(np.arange(first.size), sizes)
    return of, np.arange(of.size) + (first - np.cumsum(sizes) + sizes)[of]


def _sides(waits: Sequence[Wait], y: Array) -> Array:
    """The side of the play on which the motor leans at each sample (n,), -1 or 1, before it crosses and once it has; 0
    before the first of all. waits: of positions y (n,) in m."""
    crossed = [wait for wait in waits if wait.part > 0.0]
    first = float(np.sign(y[-1] - y[0]))
    if waits:
        # It goes on after a stop, back after a turn, and from the middle after a rest.
        first = waits[0].direction * (1.0 - 2.0 * waits[0].part)
    ends = np.minimum(np.maximum.accumulate([0, *(int(np.ceil(wait.end)) for wait in crossed)]), y.size)
    return np.repeat([first, *(wait.direction for wait in crossed)], np.diff(ends, append=y.size))
