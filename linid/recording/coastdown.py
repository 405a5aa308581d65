"""The coast-down inside a free-wheel recording: from the release of the hand to standstill, friction alone acting.

During a coast with Coulomb and viscous friction, m v' = -F_C sign(v) - F_v v, so the position obeys
y = a + b t + c t^2 + d Y with Y the integral of y: linear in four unknowns, without differentiation. The release is
found by walking backwards from the undisturbed part until this law, fitted to what follows, no longer predicts the
position within its noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from linid.errors import DataError
from linid.recording.recording import Array, Recording

_HALF = 0.010  # s, half-width of the differentiating window
_STANDSTILL_KEPT = 0.2  # s
_MARGIN = 0.06  # share of the coast given away after the detected release: the hand leaves gently
_MARGIN_TIME = 0.006  # s, the same for short coasts
_SHORT = 0.25  # s
_BASES = ((0.5, 1.0), (0.5, 0.75), (0.35, 0.6), (0.25, 0.5), (0.15, 0.4))  # shares of a deceleration
_BUMP = 4.0  # deceleration above this many times the coast's median is no friction


@dataclass(frozen=True)
class CoastDown:
    """Where only friction acts: times in s, speed at its start in m/s (rotary: rad/s), and why.

    candidates: (t_start, t_end) in s of every coast found, the chosen one included.
    """

    t_start: float
    t_end: float
    speed_at_release: float
    evidence: str
    candidates: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class _Motion:
    t: Array
    y: Array
    v: Array
    a: Array
    dt: float
    noise: float
    v_noise: float
    a_noise: float
    half: int


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
    motion = _differentiate(recording, place)
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


def _evidence(motion: _Motion, best: _Coast, count: int) -> str:
    t = motion.t
    begin = f"pushed until about {t[best.start]:.4g} s" if best.cut else "coasts from the first sample on, nothing cut"
    others = f"; longest of {count} coasts" if count > 1 else ""
    if best.cut and t[best.rest] - t[best.start] < _SHORT:
        others += "; so short a coast hardly shows where the push ends: check the start"
    return (
        f"{begin}; speed {abs(best.speed):.4g} there falls for {t[best.rest] - t[best.start]:.3g} s as friction "
        f"demands (position noise {motion.noise:.2g}); {best.end} at {t[best.rest]:.4g} s{others}"
    )


def _differentiate(recording: Recording, place: str) -> _Motion:
    """Speed and acceleration by local quadratic fits; their noise from the position's third differences."""
    from scipy.signal import savgol_filter

    t, y = recording.t, recording.y
    dt = recording.period
    half = max(5, round(_HALF / dt))
    if len(t) < 6 * half:
        raise DataError(place, f"found {len(t)} samples, expected at least {6 * half}", "Record longer.")
    noise = _position_noise(y)
    n = 2 * half + 1
    v = savgol_filter(y, n, 2, deriv=1, delta=dt)
    a = savgol_filter(y, n, 2, deriv=2, delta=dt)
    v_noise = noise * np.sqrt(12.0 / n**3) / dt
    a_noise = noise * np.sqrt(720.0 / n**5) / dt**2
    return _Motion(t, y, v, a, dt, noise, float(v_noise), float(a_noise), half)


def _position_noise(y: Array) -> float:
    """Standard deviation of the position's noise from its third differences, at rest and in motion."""
    third, step = np.abs(np.diff(y, 3)), np.abs(np.diff(y))[1:-1]
    moving = third[step >= np.median(step)]
    noise = 1.4826 * max(float(np.median(third)), float(np.median(moving))) / np.sqrt(20.0)
    if noise == 0:  # at rest most of the time on a coarse scale: the smallest step is one count
        noise = float(step[step > 0].min(initial=np.inf)) / np.sqrt(12.0)
    return float(np.clip(noise, 1e-9 * np.ptp(y) + 1e-15, 1e-3 * np.ptp(y) + 1e-15))


def _decelerations(motion: _Motion) -> list[tuple[int, int, int]]:
    """Intervals (first, last, rest) in one direction in which the speed falls; split where it rises again."""
    speed = np.abs(motion.v)
    moving = speed > max(8.0 * motion.v_noise, 2e-3 * float(speed.max()))
    parts: list[tuple[int, int, int]] = []
    labels = np.where(moving, np.sign(motion.v), 0.0)
    edges = np.concatenate(([0], np.flatnonzero(np.diff(labels)) + 1, [len(labels)]))
    for i, j in pairwise(edges):
        if labels[i] == 0 or speed[i:j].max() < 0.02 * speed.max():
            continue
        falling = -labels[i] * motion.a[i:j] > 2.0 * motion.a_noise
        falling = _bridged(falling, motion.half)
        inner = np.concatenate(([0], np.flatnonzero(np.diff(falling.astype(int))) + 1, [j - i]))
        for p, q in pairwise(inner):
            if falling[p] and q - p > 4 * motion.half and speed[i + p] > 20 * motion.v_noise:
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


def _refine(motion: _Motion, first: int, last: int, rest: int) -> _Coast | None:
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
    if fit_end - first < 6 * motion.half:
        return None
    release = _release(motion, first, fit_end)
    at_beginning = first <= motion.half and (release <= motion.half or _already_coasting(motion, slowing, first, end))
    margin = int(np.ceil(_MARGIN * (end - release) + _MARGIN_TIME / motion.dt))
    start = 0 if at_beginning else release + margin
    if end - start < 4 * motion.half:
        return None
    stop = end
    if reason == "standstill":
        stop = _end_of_rest(motion, end)
    return _Coast(start, end, stop, _speed(motion, start), not at_beginning, reason)


def _already_coasting(motion: _Motion, slowing: Array, first: int, end: int) -> bool:
    """A recording that starts at its top speed and brakes at once as hard as later: no hand pushes any more.

    Friction that varies along the way may still defy the simple law there; that is no reason to cut.
    """
    early = slowing[first : first + 3 * motion.half]
    speed = np.abs(motion.v[first : end + 1])
    return bool(speed[0] > 0.98 * speed.max() and np.median(early) > 0.8 * np.median(slowing[first : end + 1]))


def _speed(motion: _Motion, start: int) -> float:
    """Speed at `start`, from a quadratic that looks only forward."""
    n = min(4 * motion.half, len(motion.t) - start)
    s = motion.t[start : start + n] - motion.t[start]
    c = np.polynomial.polynomial.polyfit(s, motion.y[start : start + n], 2)
    return float(c[1])


def _before_bump(motion: _Motion, slowing: Array, first: int, last: int) -> tuple[int, str]:
    """Last sample before the deceleration leaves what friction can do (end stop, a catching hand)."""
    usual = float(np.median(slowing[first : last + 1]))
    limit = _BUMP * usual + 8.0 * motion.a_noise
    late = np.arange(first, last + 1)
    hard = late[slowing[first : last + 1] > limit]
    hard = hard[hard > first + (last - first) // 3]
    if not len(hard):
        return last, ""
    return max(first, int(hard[0]) - motion.half - 1), "a bump"


def _above_stribeck(motion: _Motion, first: int, end: int) -> int:
    """Last sample used for fitting: the slowest tenth is left out, where friction rises as it sticks."""
    peak = float(np.abs(motion.v[first : end + 1]).max())
    fast = np.flatnonzero(np.abs(motion.v[first : end + 1]) > max(0.1 * peak, 20 * motion.v_noise))
    return first + int(fast[-1]) if len(fast) else first


def _release(motion: _Motion, first: int, end: int) -> int:
    """Index from which on friction alone explains the position, walking back from the later part."""
    length = end - first
    begin = max(0, first - motion.half)
    if first <= 2 * motion.half:
        begin = 0  # nothing before it: a recording that may start already coasting
    start, width, terms = _base(motion, first, end)
    stop = min(end, start + width)
    noise = motion.noise * max(1.1, _misfit(motion, start, stop, terms))
    block = max(5, motion.half // 2, length // 60)
    while start > begin:
        n = min(block, start - begin)
        if not _predicted(motion, start, min(end, start + max(width, 12 * n)), n, terms, noise):
            # A push deviates ever more further back; a chance excess of one block does not.
            further = min(3 * n, start - begin)
            if further <= n or not _predicted(
                motion, start, min(end, start + max(width, 12 * further)), further, terms, noise
            ):
                return start
        start -= n
    return start


def _base(motion: _Motion, first: int, end: int) -> tuple[int, int, int]:
    """Start, width and number of terms of a stretch that obeys the friction law, to walk back from.

    As late as possible; faster stretches where friction rises towards standstill (Stribeck). The cubic fourth term is
    for friction that is not quite Coulomb plus viscous; without need it would hide a gentle release.
    """
    length = end - first
    stretches = [(first + int(low * length), first + int(high * length)) for low, high in _BASES]
    stretches = [(start, stop) for start, stop in stretches if stop - start >= 3 * motion.half] or [
        (first + length // 2, end)
    ]
    misfits = {(terms, part): _misfit(motion, *part, terms) for terms in (4, 5) for part in stretches}
    # The first that fits as well as the best, within the scatter of an RMS value over so many samples.
    best = min(misfits, key=lambda key: misfits[key])
    scatter = {key: 1.0 + np.sqrt(2.0 / (key[1][1] - key[1][0])) for key in misfits}
    terms, (start, stop) = next(k for k in misfits if misfits[k] <= misfits[best] * scatter[k] * scatter[best])
    return start, stop - start, terms


def _design(t: Array, y: Array) -> Array:
    """Columns 1, t, t^2, the integral of y, and t^3; t scaled to [-1, 1]."""
    s = 2.0 * (t - t[0]) / (t[-1] - t[0]) - 1.0
    scale = float(np.ptp(y)) or 1.0
    z = (y - y.mean()) / scale
    integral = np.concatenate(([0.0], np.cumsum(0.5 * (z[1:] + z[:-1])))) * (s[1] - s[0])
    return np.stack([np.ones_like(s), s, s * s, integral, s * s * s], axis=1)


def _misfit(motion: _Motion, start: int, end: int, terms: int = 5) -> float:
    """RMS residual of the friction law over [start, end], in units of the noise."""
    part = slice(start, end + 1)
    design = _design(motion.t[part], motion.y[part])[:, :terms]
    residual = motion.y[part] - design @ np.linalg.lstsq(design, motion.y[part], rcond=None)[0]
    return float(np.sqrt(np.sum(residual**2) / max(1, len(residual) - terms))) / motion.noise


def _predicted(motion: _Motion, start: int, stop: int, n: int, terms: int, noise: float) -> bool:
    """Whether the law fitted on [start, stop] predicts the n samples before it within noise (chi-square test)."""
    part = slice(start - n, stop + 1)
    y = motion.y[part]
    design = _design(motion.t[part], y)[:, :terms]
    later, before = design[n:], design[:n]
    q, r = np.linalg.qr(later)
    coefficients = np.linalg.solve(r, q.T @ y[n:])
    fitted = y[n:] - later @ coefficients
    noise = max(noise, float(np.sqrt(np.sum(fitted**2) / max(1, len(fitted) - terms))))
    spread = np.linalg.solve(r.T, before.T)
    covariance = np.eye(n) + spread.T @ spread
    deviation = y[:n] - before @ coefficients
    chi2 = float(deviation @ np.linalg.solve(covariance, deviation)) / noise**2
    return bool(chi2 < n + 3.5 * np.sqrt(2.0 * n) + 6.0)


def _end_of_rest(motion: _Motion, rest: int) -> int:
    """Some standstill after the coast, at most 0.2 s and not into the next motion."""
    n = len(motion.t)
    wanted = min(n - 1, rest + motion.half + round(_STANDSTILL_KEPT / motion.dt))
    after = np.abs(motion.v[rest + 2 * motion.half : wanted + 1])
    again = np.flatnonzero(after > 20 * motion.v_noise)
    return wanted if not len(again) else max(rest, rest + int(again[0]))
