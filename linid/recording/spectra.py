"""Averaged cross spectra of two sampled signals (Welch), and what follows from them: coherence and time shift."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array
from linid.statistics import TINY

Complex = NDArray[np.complex128]
Bools = NDArray[np.bool_]

FEWEST_SEGMENTS = 8  # coherence of unrelated signals averages 1/8 there, which is taken off
_OVERLAP = 0.95  # independent segments per segment: half-overlapping Hann windows share 3 % of their power
_DRIFT = 2  # lowest bins, left to trends and the window's main lobe
_CURVED = 0.3  # rad: RMS departure of the phase from that of a shift, above which it is no shift
_AMBIGUOUS = 0.9  # of the best agreement; another shift that agrees so well makes it ambiguous
_PERFECT = 0.999  # coherence: more would give a bin any weight
_GRID = 801  # shifts tried


@dataclass(frozen=True)
class CrossSpectra:
    """Spectra of an input u and an output a in S half-overlapping Hann windows without their straight line.

    frequency: (f,) Hz; u, a: (S, f) transforms; length: of a segment in samples; dt: s.
    """

    frequency: Array
    u: Complex
    a: Complex
    length: int
    dt: float

    def power(self, x: Complex) -> Array:
        """Mean square (f,) of the transforms over the segments, in their unit squared."""
        return np.asarray(np.mean(np.abs(x) ** 2, axis=0))

    def cross(self) -> Complex:
        """Mean of conj(u) a over the segments (f,): its phase is that of a against u."""
        return np.asarray(np.mean(np.conj(self.u) * self.a, axis=0))

    def coherence(self) -> Array:
        """Share (f,) of the power of a that follows u linearly, without what chance gives so few segments."""
        raw = np.abs(self.cross()) ** 2 / np.maximum(self.power(self.u) * self.power(self.a), TINY)
        chance = 1.0 / max(_OVERLAP * len(self.u), 1.0 + 1e-9)  # below one even for a single segment
        return np.asarray(np.clip((raw - chance) / (1.0 - chance), 0.0, 1.0))


def cross_spectra(u: Array, a: Array, dt: float, length: int) -> CrossSpectra:
    """Spectra of u and a (n,) in windows of `length` samples, dt s apart (P. D. Welch 1967, IEEE Trans. AU-15)."""
    starts = np.arange(0, u.size - length + 1, max(length // 2, 1))
    window = np.hanning(length + 1)[:-1]
    x = np.linspace(-1.0, 1.0, length)

    def transformed(signal: Array) -> Complex:
        parts = signal[starts[:, None] + np.arange(length)]
        parts = parts - parts.mean(axis=1, keepdims=True)
        parts = parts - np.outer(parts @ x / (x @ x), x)
        return np.asarray(np.fft.rfft(parts * window, axis=1))

    frequency = np.asarray(np.fft.rfftfreq(length, dt), dtype=np.float64)
    return CrossSpectra(frequency, transformed(u), transformed(a), length, dt)


def segment_lengths(samples: int, dt: float, longest: float) -> tuple[int, ...]:
    """Powers of two, from 64 samples up, of which a record holds `FEWEST_SEGMENTS`; dt, longest: s."""
    lengths = (2**k for k in range(6, 20))
    return tuple(n for n in lengths if (samples - n) // (n // 2) + 1 >= FEWEST_SEGMENTS and n * dt <= longest)


def excited(spectra: CrossSpectra, share: float) -> Bools:
    """Bins (f,) in which the input has at least `share` of its largest power."""
    power = spectra.power(spectra.u)
    least = share * max(float(power.max()), TINY)
    power[:_DRIFT] = 0.0
    return np.asarray(power > least)


def power_within(spectra: CrossSpectra, bins: Bools) -> float:
    """Mean square of the input within the bins, in its unit squared (Parseval)."""
    window = float(np.sum(np.hanning(spectra.length + 1)[:-1] ** 2))
    return 2.0 * float(np.sum(spectra.power(spectra.u)[bins])) / (window * spectra.length)


def reading_noise(spectra: CrossSpectra, deviation: float) -> Array:
    """Power (f,) that white noise of a position reading (deviation in m) gives its second difference in `power`."""
    window = float(np.sum(np.hanning(spectra.length + 1)[:-1] ** 2))
    gain = (2.0 * np.sin(math.pi * spectra.frequency * spectra.dt)) ** 4 / spectra.dt**4
    return np.asarray(deviation**2 * window * gain)


@dataclass(frozen=True)
class Shift:
    """Time in s by which a comes after u, its standard deviation, and the sign of a against u (+1, -1).

    sharp: whether the phase is that of one shift.
    """

    seconds: float
    deviation: float
    sign: int
    sharp: bool


def time_shift(spectra: CrossSpectra, bins: Bools, largest: float) -> Shift:
    """The shift that aligns a with u in the bins, from the slope of their phase, within +-largest s.

    Besides the shift the phase may lead by a constant over the frequency, as viscous friction makes it. Its weights are
    coherence/(1 - coherence), the maximum likelihood (C. H. Knapp and G. C. Carter 1976, IEEE Trans. ASSP-24). The
    deviation joins the jackknife's over the segments and what low and high frequencies disagree. At least six bins.
    """
    f = spectra.frequency[bins]
    coherence = np.minimum(spectra.coherence()[bins], _PERFECT)
    weight = coherence / (1.0 - coherence)
    products = (np.conj(spectra.u) * spectra.a)[:, bins]
    total = products.sum(axis=0)
    trials = np.linspace(-largest, largest, _GRID)
    turned = np.exp(2j * math.pi * trials[:, None] * f)
    agreement = np.real(turned @ (weight * total / np.maximum(np.abs(total), TINY))) / float(weight.sum())
    best = int(np.argmax(np.abs(agreement)))
    sign = 1 if agreement[best] >= 0.0 else -1
    lobe = np.abs(trials - trials[best]) > 0.5 / max(float(f[-1] - f[0]), TINY)
    rival = float(np.max(np.abs(agreement[lobe]), initial=0.0))
    seconds, curved = _refined(total, f, weight, trials[best], sign)
    count = len(products)
    others = np.array([_refined(total - one, f, weight, trials[best], sign)[0] for one in products])
    scatter = math.sqrt((count - 1) * float(np.mean((others - others.mean()) ** 2)))
    # What no shift explains (friction, resonances) repeats in every segment, but not at every frequency.
    middle = int(np.searchsorted(np.cumsum(weight * f**2), 0.5 * float(weight @ f**2)))
    halves = [_refined(total[part], f[part], weight[part], trials[best], sign)[0] for part in _halves(middle, f.size)]
    deviation = math.hypot(scatter, 0.5 * (halves[1] - halves[0]))
    at_end = abs(seconds) > largest
    sharp = rival < _AMBIGUOUS * abs(float(agreement[best])) and curved < _CURVED and not at_end
    return Shift(seconds, deviation, sign, bool(sharp))


def _halves(middle: int, count: int) -> tuple[slice, slice]:
    """Two parts of at least three bins (the phase has two unknowns), cut near `middle`."""
    middle = min(max(middle, 3), max(count - 3, 1))
    return slice(0, middle), slice(middle, count)


def _refined(total: Complex, f: Array, weight: Array, start: float, sign: int) -> tuple[float, float]:
    """Shift in s by least squares of the phase beside `start`, and the RMS departure from it in rad."""
    phase = np.angle(sign * total * np.exp(2j * math.pi * start * f))
    columns = np.column_stack([-2.0 * math.pi * f, 1.0 / f]) * np.sqrt(weight)[:, None]
    found = np.linalg.lstsq(columns, phase * np.sqrt(weight), rcond=None)[0]
    left = phase * np.sqrt(weight) - columns @ found
    return float(start + found[0]), math.sqrt(float(left @ left) / float(weight.sum()))
