"""Where the gap lies: the share of the residual that each coordinate explains, against permuted residuals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array, Integers
from linid.diagnosis.balance import Balance, Rows
from linid.diagnosis.report_data import Share
from linid.diagnosis.roll_null import Draws, p_value, slot_sums, with_rolled
from linid.recording.check_field import space_vector
from linid.recording.recording import Recording

_BINS = 24
LEAST_ROWS = 8  # in a bin, to have a say
_COMMUTATED = 0.5  # of the currents' power that turns with the field; less, and what pushes is not known


@dataclass(frozen=True)
class Coordinate:
    """One way to look at the rows: name, label, unit and values (n,), one of each row (nan: has none)."""

    name: str
    label: str
    unit: str
    values: Array
    periodic: bool = False


def coordinates(balance: Balance, axis: str, field_wavenumber: float | None) -> tuple[Coordinate, ...]:
    """What a missing force may depend on in these recordings; field_wavenumber: rad/m of the motor's field.

    Not among them: the measured acceleration. It is a part of the residual, and its noise would explain itself.
    """
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
        Coordinate("regime", "rest (0), creeping (1), sliding (2)", "1", regime),
    ]
    if np.any(rows.current != 0.0):
        signed = pushing_input(rows, balance.recordings, field_wavenumber)
        driven = np.where(rows.current != 0.0, signed, np.nan)
        label = "size of the current" if np.all(signed >= 0.0) else "input, with the sign of its push"
        found.append(Coordinate("current", label, "A", driven))
    if field_wavenumber is not None:
        phase = np.mod(field_wavenumber * rows.y, 2.0 * math.pi)
        found.append(Coordinate("pole_phase", "position within two pole pitches", "rad", phase, periodic=True))
    return tuple(found)


def pushing_input(rows: Rows, recordings: Sequence[Recording], field_wavenumber: float | None) -> Array:
    """Signed input (n,) at the rows: q-current or command as it is, of phase currents the part along the field.

    The direction that turns with the field is the one for which the squared currents of all recordings add up most, so
    that its sign is the same in all. Where the currents do not turn with the position, their size.
    """
    vector = np.zeros(rows.t.size, dtype=np.complex128)
    for index, recording in enumerate(recordings):
        mine = np.flatnonzero(rows.recording == index)
        if recording.phase_currents is not None and recording.kind != "free_wheel" and mine.size:
            samples = np.clip(np.searchsorted(recording.t, rows.t[mine] - 1e-9), 0, recording.t.size - 1)
            vector[mine] = space_vector(recording.phase_currents[:, samples])
    power = float(np.sum(np.abs(vector) ** 2))
    if field_wavenumber is None or power == 0.0:
        return rows.current
    turns = [np.exp(-1j * sense * field_wavenumber * rows.y) for sense in (1.0, -1.0)]
    sums = [complex(np.sum((vector * turn) ** 2)) for turn in turns]
    best = int(np.argmax(np.abs(sums)))
    if abs(sums[best]) < _COMMUTATED * power:
        return rows.current
    return np.asarray(np.real(vector * turns[best] * np.exp(-0.5j * np.angle(sums[best]))))


def locate(
    balance: Balance, residual: Array, scale: Array, masses: Array, coordinates: Sequence[Coordinate], seed: int
) -> tuple[Share, ...]:
    """Shares of the residual (n,) m/s^2 that the coordinates explain, largest first.

    A coordinate's share is that of bin means estimated on every second block and judged on the others; the null
    shifts each recording's residual in time against its motion, which keeps its own correlation.
    scale: (R,) m/s^2 in which a recording's residuals are counted; masses: (R,) kg, to show forces.
    """
    rows = balance.rows
    force = residual * masses[rows.recording]
    draws = with_rolled(residual / scale[rows.recording], rows.recording, seed)
    shares = []
    for coordinate in coordinates:
        bins = bins_of(coordinate, _BINS)
        found = _cross_validated(draws, bins, rows.block)
        x, mean, spread = _means(coordinate, bins, force, rows.block)
        shares.append(
            Share(
                coordinate.name,
                coordinate.label,
                coordinate.unit,
                max(float(found[0]), 0.0),
                p_value(float(found[0]), found[1:]),
                x,
                mean,
                spread,
            )
        )
    return tuple(sorted(shares, key=lambda s: -s.share))


def bins_of(coordinate: Coordinate, most: int) -> Integers:
    """Bin of each row (n,), -1 for rows without a value; at most `most` bins, of equal numbers of rows."""
    known = np.isfinite(coordinate.values)
    out = np.full(coordinate.values.size, -1, dtype=np.int64)
    inner = bin_edges(coordinate, most)[1:-1]
    out[known] = np.searchsorted(inner, coordinate.values[known], side="right")
    return out


def bin_edges(coordinate: Coordinate, most: int) -> Array:
    """Edges (b + 1,) of the bins in the coordinate's unit: between few different values, of a period, or quantiles."""
    if coordinate.periodic:
        return np.linspace(0.0, 2.0 * math.pi, most + 1)
    values = coordinate.values[np.isfinite(coordinate.values)]
    different = np.unique(values)
    if not different.size:
        return np.array([0.0, 1.0])
    if different.size <= most:
        inner = 0.5 * (different[1:] + different[:-1])
        half = 0.5 * float(np.min(np.diff(different), initial=1.0))
        return np.concatenate(([different[0] - half], inner, [different[-1] + half]))
    return np.unique(np.quantile(values, np.linspace(0.0, 1.0, most + 1)))


def _cross_validated(draws: Draws, bins: Integers, block: Integers) -> Array:
    """Share (p,) of the power of each draw (n, p) that bin means predict across the two halves of the blocks."""
    size = int(bins.max(initial=0)) + 1
    slots = np.where(bins >= 0, bins + (block % 2) * size, -1)
    counts = np.bincount(slots[slots >= 0], minlength=2 * size).reshape(2, size, 1)
    sums = slot_sums(slots, 2 * size, draws).reshape(2, size, -1)
    other = np.where(counts >= LEAST_ROWS, sums / np.maximum(counts, 1), 0.0)[::-1]
    # sum (x - m)^2 = sum x^2 - 2 m sum x + n m^2, with m from the other half
    gain = np.sum(2.0 * other * sums - counts * other**2, axis=(0, 1))
    return np.asarray(gain / max(float(draws[:, 0] @ draws[:, 0]), 1e-30))  # rolled draws have the same power


def _means(coordinate: Coordinate, bins: Integers, force: Array, block: Integers) -> tuple[Array, Array, Array]:
    """Bin centres, mean residual force and its standard error from the scatter of block means."""
    known = np.flatnonzero(bins >= 0)
    size = int(bins.max(initial=0)) + 1
    counts = np.bincount(bins[known], minlength=size)
    # Mean of each bin's rows in each block: bins and blocks that meet, in order of the bins.
    meet, place = np.unique(bins[known] * (int(block.max()) + 1) + block[known], return_inverse=True)
    per_block = np.bincount(place, force[known]) / np.bincount(place)
    of_bin = meet // (int(block.max()) + 1)
    blocks = np.maximum(np.bincount(of_bin, minlength=size), 1)
    middle = np.bincount(of_bin, per_block, size) / blocks
    variance = np.bincount(of_bin, (per_block - middle[of_bin]) ** 2, size) / blocks
    some = counts >= LEAST_ROWS
    centres = np.bincount(bins[known], coordinate.values[known], size)[some] / counts[some]
    means = np.bincount(bins[known], force[known], size)[some] / counts[some]
    return centres, means, np.sqrt(variance[some] / np.maximum(blocks[some] - 1, 1))


def ceiling(balance: Balance, residual: Array, scale: Array, coordinates: Sequence[Coordinate], noise: Array) -> float:
    """Share of the excess over the noise that smooth functions of pairs of these coordinates reach.

    residual: (n,) m/s^2; scale, noise: (R,) m/s^2. Bin means over pairs of coordinates are boosted, estimated on every
    second block and judged on the others. No upper bound, whatever its name: waves finer than a bin, memory
    (hysteresis, heat, a swinging load), errors of the reading and what comes and goes with the campaign explain more
    than any function of the present state.
    """
    rows = balance.rows
    x = residual / scale[rows.recording]
    floor = float(np.sum((noise / scale)[rows.recording] ** 2))
    smooth = [c for c in coordinates if c.name not in ("recording", "regime")]
    grids = [bins_of(c, _BINS) for c in smooth]
    slots = [(grids[a] + 1) * (_BINS + 2) + grids[b] + 1 for a in range(len(grids)) for b in range(a + 1)]
    size = (_BINS + 2) ** 2
    left = 0.0
    for half in (0, 1):
        train, test = block_halves(rows.block, half)
        fitted, other = x[train].copy(), x[test].copy()
        best = float(other @ other)
        inside = [slot[train] for slot in slots]
        counts = [np.bincount(slot, minlength=size) for slot in inside]
        for _ in range(12):
            gains = []
            for slot, count in zip(inside, counts, strict=True):
                sums = np.bincount(slot, fitted, size)
                means = 0.5 * sums / (count + 8.0)
                gains.append((float(2.0 * means @ sums - count @ means**2), means))
            chosen = int(np.argmax([gain for gain, _ in gains]))
            means = gains[chosen][1]
            fitted = fitted - means[inside[chosen]]
            other = other - means[slots[chosen][test]]
            best = min(best, float(other @ other))
        left += best
    before = float(x @ x)
    return float(np.clip((before - left) / max(before - floor, 1e-300), 0.0, 1.0))


def block_halves(block: Integers, half: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Rows (n,) of every second block, and the others, (n,); block: (n,) of each row."""
    train = block % 2 == half
    return train, ~train


def recording_masses(recordings: Sequence[Recording], mass: float) -> Array:
    """Moving mass (R,) in kg of each recording."""
    return np.array([mass + r.added_mass for r in recordings])
