"""The coast-down inside a free-wheel recording: from the release of the hand to standstill, friction alone acting.

Every stretch in one direction whose speed falls is a candidate; a bump is cut from its end and the push from its
beginning (see release.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from linid.arrays import Array
from linid.errors import DataError
from linid.recording.recording import Recording
from linid.recording.release import THREE_WINDOWS, TWO_WINDOWS, Derivatives, differentiate, find_release

_STANDSTILL_KEPT = 0.2  # s
_MARGIN = 0.06  # share of the coast given away after the detected release: the hand leaves gently
_MARGIN_TIME = 0.006  # s, the same for short coasts
_SHORT = 0.25  # s
_BUMP = 4.0  # deceleration above this many times the coast's median is no friction
_BUMP_NOISE = 8.0  # deviations of the acceleration's noise that it must exceed besides
_MOVING, _CLEARLY_MOVING = 8.0, 20.0  # deviations of the speed's noise
_STILL = 2e-3  # of the top speed: slower is standstill, however little noise there is
_SLIGHT = 0.02  # of the top speed: a motion that never exceeds it is no push
_FALLING = 2.0  # deviations of the acceleration's noise; what it misses is bridged
_AT_TOP, _AS_HARD = 0.98, 0.8  # of the top speed, of the usual deceleration: already coasting
_STICKING = 0.1  # of the top speed: friction may rise below


@dataclass(frozen=True)
class CoastDown:
    """Where only friction acts, and why.

    t_start, t_end: s; speed_at_release: m/s (rotary: rad/s); candidates: (t_start, t_end) in s of every coast found,
    the chosen one included.
    """

    t_start: float
    t_end: float
    speed_at_release: float
    evidence: str
    candidates: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class _Coast:
    """Sample indices: start (release and margin), stop (last sample used), rest (standstill or end of the motion)."""

    start: int
    rest: int
    stop: int
    speed: float
    cut: bool
    end: str


def find_coast_down(recording: Recording) -> CoastDown:
    """The longest interval in which only friction acts (manual push, bumps and later pushes cut away).

    recording: free-wheel, regular time grid. A recording that starts already coasting is cut nowhere at its start.
    Raises DataError when nothing in it coasts.
    """
    place = str(recording.source or recording.name)
    motion = differentiate(recording, place)
    coasts = [coast for part in _decelerations(motion) if (coast := _refine(motion, *part)) is not None]
    if not coasts:
        raise DataError(
            place,
            "no coast-down found: nowhere does the motion slow down freely for long enough",
            "Record a push by hand with the drive off, released well before the end stop.",
        )
    best = max(coasts, key=lambda c: motion.t[c.rest] - motion.t[c.start])
    candidates = tuple((float(motion.t[c.start]), float(motion.t[c.stop])) for c in coasts)
    return CoastDown(
        float(motion.t[best.start]),
        float(motion.t[best.stop]),
        best.speed,
        _evidence(motion, best, len(coasts)),
        candidates,
    )


def _evidence(motion: Derivatives, best: _Coast, count: int) -> str:
    t = motion.t
    begin = f"pushed until about {t[best.start]:.4g} s" if best.cut else "coasts from the first sample on, nothing cut"
    others = f"; longest of {count} coasts" if count > 1 else ""
    if best.cut and t[best.rest] - t[best.start] < _SHORT:
        others += "; so short a coast hardly shows where the push ends: check the start"
    return (
        f"{begin}; speed {abs(best.speed):.4g} there falls for {t[best.rest] - t[best.start]:.3g} s as friction "
        f"demands (position noise {motion.noise:.2g}); {best.end} at {t[best.rest]:.4g} s{others}"
    )


def _decelerations(motion: Derivatives) -> list[tuple[int, int, int]]:
    """Intervals (first, last, rest) in one direction in which the speed falls; split where it rises again."""
    speed = np.abs(motion.v)
    moving = speed > max(_MOVING * motion.v_noise, _STILL * float(speed.max()))
    parts: list[tuple[int, int, int]] = []
    labels = np.where(moving, np.sign(motion.v), 0.0)
    edges = np.concatenate(([0], np.flatnonzero(np.diff(labels)) + 1, [len(labels)]))
    for i, j in pairwise(edges):
        if labels[i] == 0 or speed[i:j].max() < _SLIGHT * speed.max():
            continue
        falling = -labels[i] * motion.a[i:j] > _FALLING * motion.a_noise
        falling = _bridged(falling, motion.half)
        inner = np.concatenate(([0], np.flatnonzero(np.diff(falling.astype(int))) + 1, [j - i]))
        for p, q in pairwise(inner):
            if falling[p] and q - p > TWO_WINDOWS * motion.half and speed[i + p] > _CLEARLY_MOVING * motion.v_noise:
                parts.append((int(i + p), int(i + q - 1), int(j - 1)))
    return parts


def _bridged(
    mask: np.ndarray[tuple[int], np.dtype[np.bool_]], length: int
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Short false runs between true ones become true (noise), longer ones stay."""
    out = mask.copy()
    edges = np.concatenate(([0], np.flatnonzero(np.diff(mask.astype(int))) + 1, [len(mask)]))
    for p, q in pairwise(edges):
        if not mask[p] and p > 0 and q < len(mask) and q - p <= length // 2:
            out[p:q] = True
    return out


def _refine(motion: Derivatives, first: int, last: int, rest: int) -> _Coast | None:
    """Cut bumps from the end of a deceleration and the push from its beginning."""
    sign = float(np.sign(motion.v[first]))
    slowing = -sign * motion.a
    end, reason = _before_bump(motion, slowing, first, last)
    if reason == "":
        stopped = rest < len(motion.t) - 1 - motion.half and last >= rest - 2 * motion.half
        reason = (
            "standstill"
            if stopped
            else ("the recording ends" if rest >= len(motion.t) - 1 - motion.half else "pushed again")
        )
    fit_end = _above_stribeck(motion, first, end)
    if fit_end - first < THREE_WINDOWS * motion.half:
        return None
    release = find_release(motion, first, fit_end)
    at_beginning = first <= motion.half and (release <= motion.half or _already_coasting(motion, slowing, first, end))
    margin = int(np.ceil(_MARGIN * (end - release) + _MARGIN_TIME / motion.dt))
    start = 0 if at_beginning else release + margin
    if end - start < TWO_WINDOWS * motion.half:
        return None
    stop = end
    if reason == "standstill":
        stop = _end_of_rest(motion, end)
    return _Coast(start, end, stop, _speed(motion, start), not at_beginning, reason)


def _already_coasting(motion: Derivatives, slowing: Array, first: int, end: int) -> bool:
    """A recording that starts at its top speed and brakes at once as hard as later: no hand pushes any more.

    Friction that varies along the way may still defy the simple law there; that is no reason to cut.
    """
    early = slowing[first : first + 3 * motion.half]
    speed = np.abs(motion.v[first : end + 1])
    as_hard = np.median(early) > _AS_HARD * np.median(slowing[first : end + 1])
    return bool(speed[0] > _AT_TOP * speed.max() and as_hard)


def _speed(motion: Derivatives, start: int) -> float:
    """Speed at `start`, from a quadratic that looks only forward."""
    n = min(TWO_WINDOWS * motion.half, len(motion.t) - start)
    s = motion.t[start : start + n] - motion.t[start]
    c = np.polynomial.polynomial.polyfit(s, motion.y[start : start + n], 2)
    return float(c[1])


def _before_bump(motion: Derivatives, slowing: Array, first: int, last: int) -> tuple[int, str]:
    """Last sample before the deceleration leaves what friction can do (end stop, a catching hand)."""
    usual = float(np.median(slowing[first : last + 1]))
    limit = _BUMP * usual + _BUMP_NOISE * motion.a_noise
    late = np.arange(first, last + 1)
    hard = late[slowing[first : last + 1] > limit]
    hard = hard[hard > first + (last - first) // 3]
    if not len(hard):
        return last, ""
    return max(first, int(hard[0]) - motion.half - 1), "a bump"


def _above_stribeck(motion: Derivatives, first: int, end: int) -> int:
    """Last sample used for fitting: the slowest tenth is left out, where friction rises as it sticks."""
    peak = float(np.abs(motion.v[first : end + 1]).max())
    fast = np.flatnonzero(np.abs(motion.v[first : end + 1]) > max(_STICKING * peak, _CLEARLY_MOVING * motion.v_noise))
    return first + int(fast[-1]) if len(fast) else first


def _end_of_rest(motion: Derivatives, rest: int) -> int:
    """Some standstill after the coast, at most 0.2 s and not into the next motion."""
    n = len(motion.t)
    wanted = min(n - 1, rest + motion.half + round(_STANDSTILL_KEPT / motion.dt))
    after = np.abs(motion.v[rest + 2 * motion.half : wanted + 1])
    again = np.flatnonzero(after > _CLEARLY_MOVING * motion.v_noise)
    return wanted if not len(again) else max(rest, rest + int(again[0]))
