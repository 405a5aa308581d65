"""The residual force of all recordings seen over position and velocity, within the pole pair, and over frequency."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from linid.arrays import Array
from linid.statistics import TINY

if TYPE_CHECKING:
    from linid.diagnosis.report_data import PairShare, ResidualTrace

Which = Literal["before", "after"]
_POSITIONS, _SPEEDS = 48, 32  # cells of the map
_PER_PAIR, _MOST_POSITIONS = 8, 240
_FEWEST = 4  # samples that make a mean worth drawing
_LONGEST_SEGMENT = 2.0  # s
_SHORTEST_SEGMENT = 0.25  # s
_FEWEST_IN_TIME = 16  # samples, of which a spectrum takes more
COLOURED = 0.98  # quantile of the cells that a colour scale holds: single cells would pale all others


@dataclass(frozen=True)
class ResidualMap:
    """Mean residual force in bins: y (m + 1,), v (k + 1,) edges in SI, mean (k, m) in N, nan where too few samples."""

    y: Array
    v: Array
    mean: Array


@dataclass(frozen=True)
class Folded:
    """Residual force over the position within the pole pair: x (b,) bin centres in m, mean and spread (b,) in N.

    spread: standard deviation within the bin.
    """

    x: Array
    mean: Array
    spread: Array


def residual_map(traces: Sequence[ResidualTrace], which: Which, field_wavenumber: float | None = None) -> ResidualMap:
    """Binned mean of the residual over position and velocity of all recordings.

    field_wavenumber: pi / pole pitch in rad/m. With it the cells are an eighth of a pole pair or whole pairs: anything
    between would show beats of cell and pole that the axis does not have.
    """
    y, v, force = (_joined([getattr(t, name) for t in traces]) for name in ("y", "v", which))
    good = np.isfinite(y) & np.isfinite(v) & np.isfinite(force)
    y, v, force = y[good], v[good], force[good]
    edges = [_position_edges(y, field_wavenumber), _edges(v, _SPEEDS)]
    count, *_ = np.histogram2d(y, v, bins=edges)
    total, *_ = np.histogram2d(y, v, bins=edges, weights=force)
    mean = np.where(count >= _FEWEST, total / np.maximum(count, 1.0), np.nan)
    return ResidualMap(edges[0], edges[1], mean.T)


def folded(traces: Sequence[ResidualTrace], which: Which, field_wavenumber: float, bins: int = 72) -> Folded:
    """Mean residual over the position modulo one pole pair, 2 pi / field_wavenumber.

    A pair, not one pitch: a force of the field's own period changes sign from one pole to the next and would average
    out. field_wavenumber: pi / pole pitch in rad/m.
    """
    period = 2.0 * math.pi / field_wavenumber
    y, force = _joined([t.y for t in traces]), _joined([getattr(t, which) for t in traces])
    good = np.isfinite(y) & np.isfinite(force)
    place = np.minimum((np.mod(y[good], period) / period * bins).astype(int), bins - 1)
    count = np.bincount(place, minlength=bins).astype(float)
    safe = np.maximum(count, 1.0)
    mean = np.bincount(place, force[good], bins) / safe
    square = np.bincount(place, (force[good] - mean[place]) ** 2, bins) / safe
    few = count < _FEWEST
    x = (np.arange(bins) + 0.5) * period / bins
    return Folded(x, np.where(few, np.nan, mean), np.where(few, np.nan, np.sqrt(square)))


def amplitude_spectrum(traces: Sequence[ResidualTrace], which: Which) -> tuple[Array, Array]:
    """Frequency (f,) in Hz and amplitude (f,) in N of the residual, all recordings together; empty if all are too
    short.

    Welch's method (P. D. Welch, IEEE Trans. Audio Electroacoust. 15, 1967) with Hann windows of one length for all
    recordings, powers averaged by duration; scaled so that a sine of 1 N shows as 1 N.
    """
    usable = [
        t for t in traces if len(t.t) > _FEWEST_IN_TIME and np.isfinite(getattr(t, which)).sum() > _FEWEST_IN_TIME
    ]
    usable = [t for t in usable if t.t[-1] - t.t[0] >= _SHORTEST_SEGMENT]
    if not usable:
        return np.zeros(0), np.zeros(0)
    segment = min(_LONGEST_SEGMENT, *(float(t.t[-1] - t.t[0]) for t in usable))
    powers, weights = [], []
    for trace in usable:
        t, force, step = _even(trace.t, getattr(trace, which))
        length = min(len(force), round(segment / step))
        powers.append(power_spectrum(force, length))
        weights.append(float(t[-1] - t[0]))
    size = max(map(len, powers))
    total, weight = np.zeros(size), np.zeros(size)
    for power, duration in zip(powers, weights, strict=True):
        total[: len(power)] += duration * power
        weight[: len(power)] += duration
    frequency = np.arange(size) / segment
    return frequency[1:], np.sqrt(2.0 * total[1:] / weight[1:])


def power_spectrum(x: Array, length: int) -> Array:
    """Power of x (n,) by frequency (length // 2 + 1,), in its unit squared: of a sine, half its squared amplitude.

    Welch's method with Hann windows of so many samples that overlap by half, each without its mean; scipy.signal has
    it too, but takes longer to load than the page to be made.
    """
    window = 0.5 - 0.5 * np.cos(2.0 * math.pi * np.arange(length) / length)
    pieces = np.lib.stride_tricks.sliding_window_view(x, length)[:: length - length // 2]
    waves = np.fft.rfft((pieces - pieces.mean(axis=1, keepdims=True)) * window, axis=1)
    power = np.mean(np.abs(waves) ** 2, axis=0) / window.sum() ** 2
    power[1 : (length + 1) // 2] *= 2.0  # what frequencies below zero hold
    return np.asarray(power)


def resolves_poles(traces: Sequence[ResidualTrace], field_wavenumber: float) -> bool:
    """Whether the map's cells are fine enough to show what repeats with the poles."""
    y = _joined([t.y for t in traces])
    return bool(_stroke(y) * field_wavenumber / (2 * math.pi) * _PER_PAIR <= _MOST_POSITIONS)


def symmetric_limit(*maps: ResidualMap) -> float:
    """Limit of a diverging colour scale: what 98 % of the filled cells of all maps stay below, in N."""
    cells = np.concatenate([m.mean[np.isfinite(m.mean)] for m in maps])
    return float(np.quantile(np.abs(cells), COLOURED)) or 1.0 if cells.size else 1.0


def worst_first(traces: Sequence[ResidualTrace]) -> tuple[ResidualTrace, ...]:
    """Held-out recordings, then the fitted, those with the largest residual over its noise first."""

    def excess(trace: ResidualTrace) -> float:
        good = trace.before[np.isfinite(trace.before)]
        noise = trace.deviation if trace.deviation > 0 else TINY
        return float(np.sqrt(np.mean(good**2))) / noise if good.size else 0.0

    return tuple(sorted(traces, key=lambda trace: (trace.split != "held_out", -excess(trace))))


def _joined(arrays: Sequence[Array]) -> Array:
    return np.concatenate(arrays) if arrays else np.zeros(0)


def _stroke(y: Array) -> float:
    good = y[np.isfinite(y)]
    return float(np.ptp(good)) if good.size else 0.0


def _position_edges(y: Array, field_wavenumber: float | None) -> Array:
    stroke = _stroke(y)
    if field_wavenumber is None or stroke == 0.0:
        return _edges(y, _POSITIONS)
    pair = 2.0 * math.pi / field_wavenumber
    fine = stroke / pair * _PER_PAIR <= _MOST_POSITIONS
    cell = pair / _PER_PAIR if fine else pair * max(1, round(stroke / pair / _POSITIONS))
    edges: Array = float(y.min()) + cell * np.arange(math.ceil(stroke / cell) + 1, dtype=np.float64)
    return edges


def _edges(values: Array, bins: int) -> Array:
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 1.0)
    if high <= low:
        low, high = low - 0.5, high + 0.5
    return np.linspace(low, high, bins + 1)


def _even(t: Array, force: Array) -> tuple[Array, Array, float]:
    """On an even clock of the median step, gaps bridged by straight lines."""
    good = np.isfinite(force)
    step = float(np.median(np.diff(t)))
    even = t[0] + step * np.arange(round((t[-1] - t[0]) / step) + 1)
    return even, np.interp(even, t[good], force[good]), step


def centres(edges: Array) -> Array:
    """Middles of cells with (b + 1,) edges."""
    return np.asarray(0.5 * (edges[1:] + edges[:-1]), dtype=np.float64)


def pair_slopes(pair: PairShare) -> Array:
    """(a,) slopes of the mean residual in y for each x, N per unit of y, weighted by rows; nan where y has one bin."""
    y = centres(pair.y_edges)[:, None]
    rows = np.where(np.isfinite(pair.mean), pair.rows, 0).astype(float)
    mean = np.where(rows > 0, pair.mean, 0.0)
    count = np.maximum(np.sum(rows, axis=0), TINY)
    about = y - np.sum(rows * y, axis=0) / count
    spread = np.sum(rows * about**2, axis=0)
    filled = np.count_nonzero(rows, axis=0) > 1
    return np.where(filled, np.sum(rows * about * mean, axis=0) / np.where(filled, spread, 1.0), np.nan)
