"""When inputs stepped between two samples, as the motion that they drive tells."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import product

import numpy as np

from linid.arrays import Array
from linid.recording.jumps import SETTING_OFF, Jump, leaves_rest
from linid.recording.noise import noise_level
from linid.recording.recording import Recording
from linid.statistics import robust_spread

_REACHES = SETTING_OFF, 8, 12  # samples to either side from which the motion tells when an input stepped
_TRIES, _FINER = 21, 2  # instants that are tried, and how often more finely: their steps must vanish beside the noise
_PUSHED = 4  # samples after a step from rest that tell it where its acceleration is known
_FINE = 200  # parts of an interval, instants that are tried then
_FEWEST_ALIKE, _ALIKE = 3, 0.1  # steps that tell how much one accelerates, if they scatter by less of it
_LEAST_NOISE = 1e-9  # m: exact positions have none
_AT_ONCE = 1e-3  # of an interval: a shorter lag is none
_UNTOLD = 1.0 / 12.0  # variance of an instant that nothing tells: anywhere in an interval
_WITHIN = 0.5  # intervals by which a step within its interval may come later than its middle
_LATE = 0.25  # from which on bends are looked for behind the jump as well, which costs some ms
_BEHIND = 2, 4, 8, 16  # intervals behind the jump, of which the lag takes at most half
_KEPT = 64  # recordings whose jumps are remembered

Columns = Callable[[Array, Array], Array]  # two of a motion (..., n, 2) at times (n,), for instants (...)


def jump_instants(recording: Recording, jumps: Sequence[Jump], sizes: Array, logged: Array) -> Array:
    """When each input stepped, (k,) in sampling intervals after the first sample of each jump.

    As the recording states it, or as its motion shows it: the speed bends where the force steps. What a single bend
    leaves open, the others tell: most drives step in time with the samples, and the acceleration grows with the step.
    Where all bend later than a step within its interval can come, what drives the axis acts late, which is for a model
    to say: then the steps are by so much earlier. sizes: (k,) of the steps, in the inputs' unit; logged: (k,) when they
    come by the inputs' own samples, in intervals.
    """
    if recording.jump_at is not None:
        return np.full(len(jumps), recording.jump_at)
    y = np.asarray(recording.y, dtype=np.float64)
    told, lag = _told(y.tobytes(), tuple(jumps), tuple(logged.tolist()))
    x, variance, bends = np.array(told).T
    if not lag and variance.min() >= _UNTOLD:
        return np.asarray(x)
    weights = _weights(variance)
    centre = float(np.average(x, weights=weights))
    # Scatter beyond what the bends' own uncertainty explains is real: these do not step in time.
    own = max(0.0, float(np.sum(weights * ((x - centre) ** 2 - variance)) / np.sum(weights)))
    x = (own * x + variance * centre) / (own + variance)
    if _from_rest(y, jumps[0], _room(jumps, 0, y.size)):
        x[0] = _pushed_off(y, jumps[0], sizes, bends, x[0])
    return np.asarray(np.maximum(x - lag, 0.0))


@lru_cache(maxsize=_KEPT)
def _told(
    positions: bytes, jumps: tuple[Jump, ...], logged: tuple[float, ...]
) -> tuple[tuple[tuple[float, float, float], ...], float]:
    """What the positions (float64, m) tell of each jump, as of `_bends`, and by how many intervals the bends come after
    the logged steps, 0 where steps within their intervals can be as late. Kept, for one recording is simulated many
    times."""
    y, at = np.frombuffer(positions), np.array(logged)
    found = _bends(y, jumps)
    if found[:, 1].min() < _UNTOLD and _lag(found, at) > _LATE:
        for behind in _BEHIND:
            later = _bends(y, jumps, behind)
            lag = _lag(later, at)
            if lag < 0.5 * behind:
                break
        if lag > _WITHIN:
            return tuple(tuple(row) for row in later.tolist()), lag
    return tuple(tuple(row) for row in found.tolist()), 0.0


def _weights(variance: Array) -> Array:
    """Of instants with a variance (k,): none so sure that it outweighs all others."""
    return np.asarray(1.0 / (variance + _UNTOLD / 100.0))


def _lag(found: Array, logged: Array) -> float:
    """By how many intervals bends of the motion, as of `_bends`, come after the steps (k,) that its inputs log."""
    return float(np.average(found[:, 0] - logged, weights=_weights(found[:, 1])))


def _pushed_off(y: Array, jump: Jump, sizes: Array, bends: Array, otherwise: float) -> float:
    """When an axis at rest was pushed off, in intervals, where later steps say how much a step accelerates it.

    Friction that builds up within milliseconds changes the acceleration nearly as an earlier step does: y (n,) in m
    alone do not tell them apart. Otherwise, as said. sizes: (k,) of the steps; bends: (k,) in m that each adds to the
    first interval's travel after it, nan where nothing tells.
    """
    gains = (bends / sizes)[1:]
    gains = gains[np.isfinite(gains)]
    if gains.size < _FEWEST_ALIKE:
        return otherwise
    gain = float(np.median(gains))
    if not robust_spread(gains - gain) < _ALIKE * gain:
        return otherwise
    s, tries = np.arange(1.0, _PUSHED + 1.0), np.linspace(0.0, jump.last + 1.0, _FINE * (jump.last + 1) + 1)
    push, *friction = np.moveaxis(_setting_off(s, tries, 4), -1, 0)
    away = y[1 : _PUSHED + 1] - y[0]
    left = away - np.copysign(gain * sizes[0], away[-1]) * push
    spans = np.linalg.qr(np.stack(friction, axis=2))[0]
    left -= (spans @ (np.swapaxes(spans, 1, 2) @ left[:, :, None]))[:, :, 0]
    costs = np.sum(left**2, axis=1)
    likely = np.exp(-0.5 * (costs - costs.min()) / max(noise_level(y), _LEAST_NOISE) ** 2)
    return float(likely @ tries / likely.sum())


def _bends(y: Array, jumps: tuple[Jump, ...], behind: int = 0) -> Array:
    """What positions y (n,) in m tell of each jump, (k, 3): where the speed bends, in intervals after the jump's first
    sample, the variance of that, and the bend: m that are travelled more within one interval after it, nan where this
    is not known.

    Of several reaches the one that tells most: a fast axis passes ripple within few samples, a slow one drowns in its
    noise. At the start of a recording an axis may set off from rest. behind: intervals after a jump in which the speed
    may bend, too.
    """
    counts = np.array([jump.last + 1 - jump.first + behind for jump in jumps])
    rooms = np.array([_room(jumps, k, y.size) for k in range(len(jumps))]) - [0, behind]
    told = np.stack([counts / 2.0, _UNTOLD * counts**2, np.full(counts.size, np.nan)], axis=1)
    rested = _from_rest(y, jumps[0], tuple(rooms[0]))
    if rested:
        s = np.arange(1.0, _REACHES[0] + 1.0)
        told[0] = _found(y[None, 1 : s.size + 1] - y[0], s, counts[0], _setting_off)[0]
        told[0, 2] = np.nan
    best = np.full(counts.size, np.inf)
    for count, reach in product(sorted(set(counts.tolist())), _REACHES):
        able = (counts == count) & (rooms.min(axis=1) >= reach)
        able[0] &= not rested
        mine = np.flatnonzero(able)
        if mine.size:
            s = np.concatenate([np.arange(-reach, 1.0), np.arange(count, count + reach + 1.0)])
            firsts = np.array([jumps[k].first for k in mine])
            found = _found(y[firsts[:, None] + s.astype(int)], s, count, _bending)
            better = found[:, 1] < best[mine]
            told[mine[better]], best[mine[better]] = found[better], found[better, 1]
    return told


def _room(jumps: Sequence[Jump], k: int, size: int) -> tuple[int, int]:
    """Samples on either side of a jump that no other jump touches."""
    begin = jumps[k - 1].last + 2 if k > 0 else 0
    end = jumps[k + 1].first - 1 if k + 1 < len(jumps) else size - 1
    return jumps[k].first - begin, end - jumps[k].last - 1


def _setting_off(s: Array, x: Array, highest: int = 3) -> Array:
    """Columns (..., n, 2) of positions at times s (n,) in samples of an axis that leaves its rest, at instants x (...).

    Its current rises from the first sample on and lags behind its command by x, as 1 - exp(-s / x). What friction makes
    of its acceleration follows with higher powers, without that exponential. highest: of them; (..., n, 3) to the
    fourth.
    """
    x = x[..., None]
    since, risen = s - x, np.exp(-s / np.maximum(x, _AT_ONCE))
    columns = [since**2 + x**2 * (1.0 - 2.0 * risen), since**3 + 3.0 * x**2 * since, since**4 + 6.0 * x**2 * since**2]
    return np.stack(columns[: highest - 1], axis=-1)


def _bending(s: Array, x: Array) -> Array:
    """Columns (..., n, 2) of positions at times s (n,) in samples whose speed bends at instants x (...).

    Beside them are those of `_level`. Its two cubics share the speed there; they need not meet, as a current that rises
    for a while lags behind a step.
    """
    late = np.maximum(s - x[..., None], 0.0) * (s > 0.0)
    return np.stack([late**2, late**3], axis=-1)


def _level(s: Array) -> Array:
    """An orthonormal basis (n, r) of the columns that hang on no instant: before a bend a cubic, after it a step more;
    none of an axis that rests before."""
    if s[0] > 0.0:
        return np.empty((s.size, 0))
    columns = np.concatenate([np.vander(s, 4, increasing=True), (s > 0.0)[:, None]], axis=1)
    return np.asarray(np.linalg.qr(columns / np.linalg.norm(columns, axis=0))[0])


def _found(windows: Array, s: Array, count: int, columns: Columns) -> Array:
    """Mean and variance of each instant, from 0 to count, that makes the columns and `_level` fit positions (k, n) in m
    at times s (n,), and the size of the first column in m: (k, 3), the last nan where nothing tells.

    Instants are tried over the whole interval first, then in turns that are finer each.
    """
    finite = np.all(np.isfinite(windows), axis=1)
    windows = np.where(finite[:, None], windows, 0.0)
    size = np.maximum(np.std(windows, axis=1), 1e-300)
    windows = (windows - windows.mean(axis=1, keepdims=True) * (s[0] < 0.0)) / size[:, None]
    level = _level(s)
    windows = _without(windows, level)
    low, high = np.zeros(1), np.full(1, float(count))
    for _ in range(1 + _FINER):
        tries = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, _TRIES)
        costs = np.sum(_left_by(windows[:, None], columns(s, tries), level)[0] ** 2, axis=-1)
        least = costs.min(axis=1, keepdims=True)
        deviation = np.maximum(least / (s.size - level.shape[1] - 3), 1e-300)
        likely = np.exp(-0.5 * (costs - least) / deviation)
        likely /= likely.sum(axis=1, keepdims=True)
        mean, step = np.sum(likely * tries, axis=1), tries[:, 1] - tries[:, 0]
        variance = np.sum(likely * (tries - mean[:, None]) ** 2, axis=1) + step**2 / 12.0
        reach = 5.0 * np.sqrt(variance)
        low, high = np.maximum(0.0, mean - reach), np.minimum(float(count), mean + reach)
    bend = size * np.abs(_left_by(windows, columns(s, mean), level)[1])
    untold = np.array([count / 2.0, _UNTOLD * count**2, np.nan])
    return np.where(finite[:, None], np.stack([mean, variance, bend], axis=1), untold)


def _without(x: Array, basis: Array) -> Array:
    """Rows x (..., n) without what an orthonormal basis (n, r) spans."""
    return np.asarray(x - (x @ basis) @ basis.T)


def _left_by(windows: Array, columns: Array, level: Array) -> tuple[Array, Array]:
    """What two columns (..., n, 2) beside a basis (n, r) leave of rows (..., n) that it leaves, and the first's size.

    The second is made orthogonal twice: after the basis it is nearly the first (Giraud et al. 2005, Numer. Math. 101).
    """
    first, second = (_without(columns[..., k], level) for k in range(2))
    norm = np.maximum(np.linalg.norm(first, axis=-1, keepdims=True), 1e-300)
    first = first / norm
    shared = np.sum(first * second, axis=-1, keepdims=True)
    second = _without(second - first * shared, level)
    second = second - first * np.sum(first * second, axis=-1, keepdims=True)
    rest = np.maximum(np.linalg.norm(second, axis=-1, keepdims=True), 1e-300)
    second = second / rest
    along = [np.sum(column * windows, axis=-1, keepdims=True) for column in (first, second)]
    left = windows - first * along[0] - second * along[1]
    return left, np.asarray(((along[0] - shared * along[1] / rest) / norm)[..., 0])


def _from_rest(y: Array, jump: Jump, room: tuple[int, int]) -> bool:
    """Whether an axis with positions y (n,) in m is pushed off by this jump; room: samples beside it."""
    return jump.first == 0 and room[1] >= _REACHES[0] and leaves_rest(y)
