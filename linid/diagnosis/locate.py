"""Where the gap lies: the share of the residual that each coordinate explains, against permuted residuals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linid.diagnosis.balance import Balance
from linid.diagnosis.report_data import Share
from linid.recording.recording import Recording

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_BINS = 24
_LEAST_ROWS = 8  # in a bin, to have a say
_PERMUTATIONS = 99


@dataclass(frozen=True)
class Coordinate:
    """One way to look at the rows: name, label, unit and value of each row (nan: has none)."""

    name: str
    label: str
    unit: str
    values: Array
    periodic: bool = False


def coordinates(balance: Balance, axis: str, field_wavenumber: float | None) -> tuple[Coordinate, ...]:
    """The coordinates of DESIGN's section 6 that the recordings have; field_wavenumber: rad/m of the motor's field."""
    rows = balance.rows
    length = "rad" if axis == "rotary" else "m"
    moving = ~rows.standstill
    top = max(float(np.quantile(np.abs(rows.v), 0.99)), 1e-12)
    regime = np.where(rows.standstill, 0.0, np.where(np.abs(rows.v) < 0.02 * top, 1.0, 2.0))
    found = [
        Coordinate("recording", "recording", "number", rows.recording.astype(np.float64) + 1.0),
        Coordinate("time", "time within the recording", "s", rows.t),
        Coordinate("position", "position", length, rows.y),
        Coordinate("velocity", "velocity", f"{length}/s", np.where(moving, rows.v, np.nan)),
        Coordinate("direction", "direction of motion", "sign", np.where(moving, np.sign(rows.v), np.nan)),
        Coordinate("acceleration", "acceleration", f"{length}/s^2", rows.a),
        Coordinate("regime", "rest (0), creeping (1), sliding (2)", "1", regime),
    ]
    if np.any(rows.current != 0.0):
        driven = np.where(rows.current != 0.0, rows.current * np.where(rows.a < 0.0, -1.0, 1.0), np.nan)
        found.append(Coordinate("current", "current, signed by the acceleration", "A", driven))
    if field_wavenumber is not None:
        phase = np.mod(field_wavenumber * rows.y, 2.0 * math.pi)
        found.append(Coordinate("pole_phase", "position within two pole pitches", "rad", phase, periodic=True))
    return tuple(found)


def locate(
    balance: Balance, residual: Array, scale: Array, masses: Array, coordinates: Sequence[Coordinate], seed: int
) -> tuple[Share, ...]:
    """Shares of the residual (n,) m/s^2 that the coordinates explain, largest first.

    A coordinate's share is that of bin means estimated on every second block and judged on the others; the null
    shifts each recording's residual in time against its motion, which keeps its own correlation.
    scale: (R,) m/s^2 in which a recording's residuals are counted; masses: (R,) kg, to show forces.
    """
    rows = balance.rows
    weighted = residual / scale[rows.recording]
    force = residual * masses[rows.recording]
    generator = np.random.default_rng(seed)
    shifted = [_shifted(weighted, rows.recording, generator) for _ in range(_PERMUTATIONS)]
    shares = []
    for coordinate in coordinates:
        bins = _bins(coordinate)
        share = _cross_validated(weighted, bins, rows.block)
        null = np.array([_cross_validated(other, bins, rows.block) for other in shifted])
        p_value = (1.0 + float(np.sum(null >= share))) / (1.0 + null.size)
        x, mean, spread = _means(coordinate, bins, force, rows.block)
        shares.append(
            Share(coordinate.name, coordinate.label, coordinate.unit, max(share, 0.0), p_value, x, mean, spread)
        )
    return tuple(sorted(shares, key=lambda s: -s.share))


def _bins(coordinate: Coordinate) -> Integers:
    """Bin of each row, -1 for rows without a value; bins of equal numbers of rows."""
    values = coordinate.values
    known = np.isfinite(values)
    out = np.full(values.size, -1, dtype=np.int64)
    different = np.unique(values[known])
    if different.size <= _BINS:
        out[known] = np.searchsorted(different, values[known])
    elif coordinate.periodic:
        out[known] = np.minimum((values[known] / (2.0 * math.pi) * _BINS).astype(np.int64), _BINS - 1)
    else:
        edges = np.quantile(values[known], np.linspace(0.0, 1.0, _BINS + 1)[1:-1])
        out[known] = np.searchsorted(edges, values[known], side="right")
    return out


def _cross_validated(x: Array, bins: Integers, block: Integers) -> float:
    """Share of the power of x (n,) that bin means predict across the two halves of the blocks."""
    size = int(bins.max()) + 2
    half = (block % 2).astype(np.int64)
    slots = (bins + 1) + half * size
    counts = np.bincount(slots, minlength=2 * size).reshape(2, size)
    sums = np.bincount(slots, x, minlength=2 * size).reshape(2, size)
    means = np.where(counts >= _LEAST_ROWS, sums / np.maximum(counts, 1), 0.0)
    means[:, 0] = 0.0
    other = means[::-1]
    # sum (x - m)^2 = sum x^2 - 2 m sum x + n m^2, with m from the other half
    gain = float(np.sum(2.0 * other * sums - counts * other**2))
    return gain / max(float(x @ x), 1e-300)


def _shifted(x: Array, recording: Integers, generator: np.random.Generator) -> Array:
    out = np.empty_like(x)
    order = generator.permutation(int(recording.max()) + 1)
    for index in range(order.size):
        mine = recording == index
        if np.any(mine):
            turned = np.roll(x[mine], int(generator.integers(1, max(int(mine.sum()), 2))))
            out[mine] = turned if generator.random() < 0.5 else -turned
    return out


def _means(coordinate: Coordinate, bins: Integers, force: Array, block: Integers) -> tuple[Array, Array, Array]:
    """Bin centres, mean residual force and its standard error from the scatter of block means."""
    centres, means, errors = [], [], []
    for number in range(int(bins.max()) + 1):
        mine = bins == number
        if int(mine.sum()) < _LEAST_ROWS:
            continue
        blocks, place = np.unique(block[mine], return_inverse=True)
        per_block = np.bincount(place, force[mine]) / np.bincount(place)
        centres.append(float(np.mean(coordinate.values[mine])))
        means.append(float(np.mean(force[mine])))
        errors.append(float(np.std(per_block)) / math.sqrt(max(blocks.size - 1, 1)))
    return np.array(centres), np.array(means), np.array(errors)


def ceiling(balance: Balance, residual: Array, scale: Array, coordinates: Sequence[Coordinate], noise: Array) -> float:
    """Largest share of the excess over the noise that a smooth function of pairs of coordinates could explain.

    Bin means over pairs of coordinates are boosted, estimated on every second block and judged on the others.
    """
    rows = balance.rows
    x = residual / scale[rows.recording]
    floor = float(np.sum((noise / scale)[rows.recording] ** 2))
    smooth = [c for c in coordinates if c.name not in ("recording", "regime")]
    grids = [_bins(c) for c in smooth]
    left = 0.0
    for half in (0, 1):
        train, test = block_halves(rows.block, half)
        fitted, other = x[train].copy(), x[test].copy()
        best = float(other @ other)
        for _ in range(12):
            gains = []
            for a in range(len(grids)):
                for b in range(a + 1):
                    slots = (grids[a] + 1) * (_BINS + 2) + (grids[b] + 1)
                    counts = np.bincount(slots[train], minlength=(_BINS + 2) ** 2)
                    sums = np.bincount(slots[train], fitted, minlength=(_BINS + 2) ** 2)
                    means = 0.5 * sums / (counts + 8.0)
                    gains.append((float(np.sum((fitted - means[slots[train]]) ** 2)), means, slots))
            _, means, slots = min(gains, key=lambda g: g[0])
            fitted = fitted - means[slots[train]]
            other = other - means[slots[test]]
            best = min(best, float(other @ other))
        left += best
    before = float(x @ x)
    return float(np.clip((before - left) / max(before - floor, 1e-300), 0.0, 1.0))


def block_halves(block: Integers, half: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Rows of every second block, and the others."""
    train = block % 2 == half
    return train, ~train


def recording_masses(recordings: Sequence[Recording], mass: float) -> Array:
    """Moving mass (R,) in kg of each recording."""
    return np.array([mass + r.added_mass for r in recordings])
