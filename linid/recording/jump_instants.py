"""When inputs stepped between two samples, as the motion that they drive tells."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

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
_KEPT = 64  # recordings whose jumps are remembered

Columns = Callable[[Array, Array], Array]  # of a motion (m, n, r) at times (n,), for each of m instants


def jump_instants(recording: Recording, jumps: Sequence[Jump], sizes: Array) -> Array:
    """When each input stepped, (k,) in sampling intervals after the first sample of each jump.

    As the recording states it, or as its motion shows it: the speed bends where the force steps. What a single bend
    leaves open, the others tell: most drives step in time with the samples, and the acceleration grows with the step.
    sizes: (k,) of the steps, in the inputs' unit.
    """
    if recording.jump_at is not None:
        return np.full(len(jumps), recording.jump_at)
    y = np.asarray(recording.y, dtype=np.float64)
    x, variance, bends = np.array(_bends(y.tobytes(), tuple(jumps))).T
    if variance.min() >= _UNTOLD:
        return np.asarray(x)
    weights = 1.0 / (variance + _UNTOLD / 100.0)  # none so sure that it outweighs all others
    centre = float(np.sum(weights * x) / np.sum(weights))
    # Scatter beyond what the bends' own uncertainty explains is real: these do not step in time.
    own = max(0.0, float(np.sum(weights * ((x - centre) ** 2 - variance)) / np.sum(weights)))
    x = (own * x + variance * centre) / (own + variance)
    if _from_rest(y, jumps[0], _room(jumps, 0, y.size)):
        x[0] = _pushed_off(y, jumps[0], sizes, bends, x[0])
    return np.asarray(x)


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
    push, *friction = np.moveaxis(_setting_off(s, tries, 4), 2, 0)
    away = y[1 : _PUSHED + 1] - y[0]
    left = away - np.copysign(gain * sizes[0], away[-1]) * push
    spans = np.linalg.qr(np.stack(friction, axis=2))[0]
    left -= (spans @ (np.swapaxes(spans, 1, 2) @ left[:, :, None]))[:, :, 0]
    costs = np.sum(left**2, axis=1)
    likely = np.exp(-0.5 * (costs - costs.min()) / max(noise_level(y), _LEAST_NOISE) ** 2)
    return float(likely @ tries / likely.sum())


@lru_cache(maxsize=_KEPT)
def _bends(positions: bytes, jumps: tuple[Jump, ...]) -> tuple[tuple[float, float, float], ...]:
    """What the positions (float64, m) tell of each jump's instant; kept, for one recording is simulated many times."""
    y = np.frombuffer(positions)
    return tuple(_bend(y, jump, _room(jumps, k, y.size)) for k, jump in enumerate(jumps))


def _room(jumps: Sequence[Jump], k: int, size: int) -> tuple[int, int]:
    """Samples on either side of a jump that no other jump touches."""
    begin = jumps[k - 1].last + 2 if k > 0 else 0
    end = jumps[k + 1].first - 1 if k + 1 < len(jumps) else size - 1
    return jumps[k].first - begin, end - jumps[k].last - 1


def _bend(y: Array, jump: Jump, room: tuple[int, int]) -> tuple[float, float, float]:
    """Where the speed of positions y (n,) in m bends, in intervals after the jump's first sample, its variance, and the
    bend: m that are travelled more within one interval after it, nan where this is not known.

    Of several reaches the one that tells most: a fast axis passes ripple within few samples, a slow one drowns in its
    noise. At the start of a recording an axis may set off from rest.
    """
    count, least = jump.last + 1 - jump.first, _REACHES[0]
    if _from_rest(y, jump, room):
        s, window = np.arange(1.0, least + 1.0), y[1 : least + 1] - y[0]
        return *_found(window, s, count, _setting_off), np.nan
    told = []
    for reach in _REACHES:
        if reach <= min(room):
            s = np.concatenate([np.arange(-reach, 1.0), np.arange(count, count + reach + 1.0)])
            window = y[jump.first + s.astype(int)]
            told.append((_found(window, s, count, _bending), s, window))
    if not told:
        return count / 2.0, _UNTOLD * count**2, np.nan
    (mean, variance), s, window = min(told, key=lambda one: one[0][1])
    if not np.all(np.isfinite(window)):
        return mean, variance, np.nan
    bend = np.linalg.lstsq(_bending(s, np.array([mean]))[0], window - window.mean(), rcond=None)[0][5]
    return mean, variance, abs(float(bend))


def _setting_off(s: Array, x: Array, highest: int = 3) -> Array:
    """Columns (m, n, 2) of positions at times s (n,) in samples of an axis that leaves its rest, at instants x (m,).

    Its current rises from the first sample on and lags behind its command by x, as 1 - exp(-s / x). What friction makes
    of its acceleration follows with higher powers, without that exponential. highest: of them; (m, n, 3) to the fourth.
    """
    x = x[:, None]
    since, risen = s - x, np.exp(-s / np.maximum(x, _AT_ONCE))
    columns = [since**2 + x**2 * (1.0 - 2.0 * risen), since**3 + 3.0 * x**2 * since, since**4 + 6.0 * x**2 * since**2]
    return np.stack(columns[: highest - 1], axis=2)


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


def _found(window: Array, s: Array, count: int, columns: Columns) -> tuple[float, float]:
    """Mean and variance of the instant, by turns that are finer each, as in `_instant`."""
    found = _instant(window, s, count, columns)
    for _ in range(_FINER):
        found = _instant(window, s, count, columns, found)
    return found


def _instant(
    window: Array, s: Array, count: int, columns: Columns, found: tuple[float, float] | None = None
) -> tuple[float, float]:
    """Mean and variance of the instant, from 0 to count, that makes columns fit positions (n,) at times s (n,).

    found: both, of an earlier turn; now instants are tried only where it may be.
    """
    if not np.all(np.isfinite(window)):
        return count / 2.0, _UNTOLD * count**2
    window = (window - window.mean() * (s[0] < 0.0)) / max(float(np.std(window)), 1e-300)
    low, high = 0.0, float(count)
    if found is not None:
        reach = 5.0 * found[1] ** 0.5
        low, high = max(low, found[0] - reach), min(high, found[0] + reach)
    tries = np.linspace(low, high, _TRIES)
    bases = _first_spans(columns, tuple(s.tolist()), high) if found is None else _spans(columns, s, tries)
    shares = np.swapaxes(bases, 1, 2) @ window
    costs = np.sum((window - (bases @ shares[:, :, None])[:, :, 0]) ** 2, axis=1)
    deviation = max(float(costs.min()) / (s.size - bases.shape[2] - 1), 1e-300)
    likely = np.exp(-0.5 * (costs - costs.min()) / deviation)
    likely /= likely.sum()
    mean, step = float(likely @ tries), float(tries[1] - tries[0])
    return mean, float(likely @ (tries - mean) ** 2) + step**2 / 12.0


@lru_cache(maxsize=_KEPT)
def _first_spans(columns: Columns, s: tuple[float, ...], high: float) -> Array:
    """What the columns span where nothing is known of the instant yet: the same for all steps of a length."""
    return _spans(columns, np.array(s), np.linspace(0.0, high, _TRIES))


def _spans(columns: Columns, s: Array, tries: Array) -> Array:
    """Orthonormal bases (m, n, r) of the columns at times s (n,) in samples for each of m instants that are tried."""
    bases = columns(s, tries)
    return np.linalg.qr(bases / np.linalg.norm(bases, axis=1, keepdims=True))[0]


def _from_rest(y: Array, jump: Jump, room: tuple[int, int]) -> bool:
    """Whether an axis with positions y (n,) in m is pushed off by this jump; room: samples beside it."""
    return jump.first == 0 and room[1] >= _REACHES[0] and leaves_rest(y)
