"""Where a push ends: walking back along a coast until friction alone no longer explains the position.

During a coast with Coulomb and viscous friction, m v' = -F_C sign(v) - F_v v, so the position obeys
y = a + b t + c t^2 + d Y with Y the integral of y: linear in four unknowns, without differentiation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.errors import DataError
from linid.recording.local_polynomial import local_derivative
from linid.recording.noise import difference_gain
from linid.recording.recording import Recording
from linid.statistics import MEDIAN_ABSOLUTE

_HALF = 0.010  # s, half-width of the differentiating window
_LEAST_HALF = 5  # samples, the same
_ORDER = 3  # of the differences that show the position's noise
_LEAST_NOISE, _MOST_NOISE = 1e-9, 1e-3  # of the stroke: exact positions have none to divide by, and jumps are none
TWO_WINDOWS, THREE_WINDOWS = 4, 6  # in half-widths: within shorter stretches speed and deceleration have no course
_BLOCKS = 60  # of a deceleration, at most, that are tried one after the other
_BASE_BLOCKS = 12  # that the law is fitted to, of one that it is to predict
_NOISE_DOUBT = 1.1  # times the noise, which is only estimated
# Deviations of chi-square above its mean, and what its long tail adds where samples are few.
_CHANCE, _CHANCE_OF_FEW = 3.5, 6.0
_BASES = ((0.5, 1.0), (0.5, 0.75), (0.35, 0.6), (0.25, 0.5), (0.15, 0.4))  # shares of a deceleration


@dataclass(frozen=True)
class Derivatives:
    """Position, speed and acceleration of a recording with the standard deviations of their noise.

    t, y, v, a: (n,) in s, m, m/s, m/s^2 (rotary: rad); dt: s; noise, v_noise, a_noise: m, m/s, m/s^2; half: samples to
    each side in the local fits.
    """

    t: Array
    y: Array
    v: Array
    a: Array
    dt: float
    noise: float
    v_noise: float
    a_noise: float
    half: int


def differentiate(recording: Recording, place: str) -> Derivatives:
    """Speed and acceleration by local quadratic fits; their noise from the position's third differences. Raises
    DataError for a recording shorter than three windows.
    """
    t, y = recording.t, recording.y
    dt = recording.period
    half = max(_LEAST_HALF, round(_HALF / dt))
    if len(t) < THREE_WINDOWS * half:
        fewest = THREE_WINDOWS * half
        raise DataError(place, f"found {len(t)} samples, expected at least {fewest}", "Record longer.")
    noise = _position_noise(y)
    n = 2 * half + 1
    v = local_derivative(y, n, 2, 1, dt)
    a = local_derivative(y, n, 2, 2, dt)
    v_noise = noise * np.sqrt(12.0 / n**3) / dt
    a_noise = noise * np.sqrt(720.0 / n**5) / dt**2
    return Derivatives(t, y, v, a, dt, noise, float(v_noise), float(a_noise), half)


def _position_noise(y: Array) -> float:
    """Standard deviation of the position's noise from its third differences, at rest and in motion.

    Not `noise_level`: what matters is the noise in motion, where an encoder that interpolates has more of it than at
    rest, within bounds that hold for positions without any.
    """
    third, step = np.abs(np.diff(y, _ORDER)), np.abs(np.diff(y))[1:-1]
    moving = third[step >= np.median(step)]
    noise = max(float(np.median(third)), float(np.median(moving))) / (
        MEDIAN_ABSOLUTE * np.sqrt(difference_gain(_ORDER))
    )
    if noise == 0:  # at rest most of the time on a coarse scale: the smallest step is one count
        noise = float(step[step > 0].min(initial=np.inf)) / np.sqrt(12.0)
    return float(np.clip(noise, _LEAST_NOISE * np.ptp(y) + 1e-15, _MOST_NOISE * np.ptp(y) + 1e-15))


def find_release(motion: Derivatives, first: int, end: int) -> int:
    """Index from which on friction alone explains the position, walking back from the later part.

    first, end: sample indices of a deceleration. A chi-square test compares each earlier block of samples with what
    the law fitted to the following stretch predicts for it.
    """
    length = end - first
    begin = max(0, first - motion.half)
    if first <= 2 * motion.half:
        begin = 0  # nothing before it: a recording that may start already coasting
    start, width, terms = _base(motion, first, end)
    stop = min(end, start + width)
    noise = motion.noise * max(_NOISE_DOUBT, _misfit(motion, start, stop, terms))
    block = max(_LEAST_HALF, motion.half // 2, length // _BLOCKS)
    while start > begin:
        n = min(block, start - begin)
        if not _predicted(motion, start, min(end, start + max(width, _BASE_BLOCKS * n)), n, terms, noise):
            # A push deviates ever more further back; a chance excess of one block does not.
            further = min(3 * n, start - begin)
            if further <= n or not _predicted(
                motion, start, min(end, start + max(width, _BASE_BLOCKS * further)), further, terms, noise
            ):
                return start
        start -= n
    return start


def _base(motion: Derivatives, first: int, end: int) -> tuple[int, int, int]:
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


def _predicted(motion: Derivatives, start: int, stop: int, n: int, terms: int, noise: float) -> bool:
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
    return bool(chi2 < n + _CHANCE * np.sqrt(2.0 * n) + _CHANCE_OF_FEW)


def _misfit(motion: Derivatives, start: int, end: int, terms: int = 5) -> float:
    """RMS residual of the friction law over [start, end], in units of the noise."""
    part = slice(start, end + 1)
    design = _design(motion.t[part], motion.y[part])[:, :terms]
    residual = motion.y[part] - design @ np.linalg.lstsq(design, motion.y[part], rcond=None)[0]
    return float(np.sqrt(np.sum(residual**2) / max(1, len(residual) - terms))) / motion.noise


def _design(t: Array, y: Array) -> Array:
    """Columns 1, t, t^2, the integral of y, and t^3; t scaled to [-1, 1]."""
    s = 2.0 * (t - t[0]) / (t[-1] - t[0]) - 1.0
    scale = float(np.ptp(y)) or 1.0
    z = (y - y.mean()) / scale
    integral = np.concatenate(([0.0], np.cumsum(0.5 * (z[1:] + z[:-1])))) * (s[1] - s[0])
    return np.stack([np.ones_like(s), s, s * s, integral, s * s * s], axis=1)
