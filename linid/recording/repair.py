"""Channel values: unreadable cells, wrapped positions, saturated and constant channels."""

from __future__ import annotations

import math

import numpy as np

from linid.arrays import Array
from linid.errors import DataError
from linid.recording.resolve import Channel
from linid.recording.timebase import FEW, FEWEST_OF_SPLINE, GAP

LONGEST_RUN = 5  # cells; across more a spline invents what the channel did
_ROUNDING = 1e-12  # of a channel's range
_JUMP = 20  # times the usual steps: no axis moves so within a sample
_USUAL = 0.95  # quantile of the steps
_FEWEST = 20  # samples that such a quantile needs
_FILLED, _BEYOND = 0.9, 1e-6  # of a counter's range that positions span when it wraps, and the digits of its bounds
_REST = 5  # samples in a row: a shorter rest is a peak
_PEAK_STEP = 2.5  # of the resolution: a smooth peak leaves its rest by one step


def bad_cell_error(
    channel: Channel, rows: np.ndarray[tuple[int], np.dtype[np.int64]], total: int, place: str
) -> DataError:
    """Too many unreadable cells in a channel. rows: (k,) those of the cells; total: of all cells."""
    first = int(rows[0])
    line = int(channel.column.lines[first])
    return DataError(
        f"{place}, line {line}, column '{channel.column.header}'",
        f"found {_shown(channel, first)}, expected a number; {len(rows)} of {total} cells are unreadable",
        f"Repair the column or cut it with `window:` (up to 1 % and {LONGEST_RUN} in a row are interpolated).",
    )


def fill(
    t: Array, x: Array, rows: np.ndarray[tuple[int], np.dtype[np.int64]], channel: Channel, place: str
) -> tuple[Array, str | None]:
    """Isolated unreadable cells (up to 1 %, up to five in a row) interpolated by a cubic spline, with a note.

    t, x, rows: (n,) times in s, raw values and their rows in the column; returns the values (n,). Raises DataError for
    more.
    """
    bad = np.flatnonzero(~np.isfinite(x))
    if not len(bad):
        return x, None
    run = max(len(part) for part in np.split(bad, np.flatnonzero(np.diff(bad) > 1) + 1))
    good = np.isfinite(x)
    if len(bad) > max(1, FEW * len(x)) or run > LONGEST_RUN or good.sum() < FEWEST_OF_SPLINE:
        raise bad_cell_error(channel, rows[bad], len(x), place)
    from scipy.interpolate import CubicSpline

    filled = np.asarray(CubicSpline(t[good], x[good])(t), dtype=np.float64)
    texts = sorted({_shown(channel, int(row)) for row in rows[bad]})[:3]
    listed = ", ".join(str(int(channel.column.lines[row])) for row in rows[bad[:5]])
    cells = f"{len(bad)} unreadable cell{'s' * (len(bad) > 1)} ({', '.join(texts)}; line {listed})"
    return np.where(good, x, filled), f"{channel.column.header}: {cells} interpolated"


def _shown(channel: Channel, row: int) -> str:
    text = channel.column.bad.get(row, "")
    return repr(text) if text else "blank"


def unwrap(
    raw: Array, channel: Channel, place: str, lines: np.ndarray[tuple[int], np.dtype[np.int64]], t: Array
) -> tuple[Array, str | None]:
    """A position that wraps at one turn or at a counter's end, made continuous.

    raw: (n,) values as in the file, in its unit; returns them continuous, (n,). Raises DataError for other jumps. A
    wrap is recognised only when every value lies inside one modulus (one turn of a rotary axis, 2^k counts) and each
    jump is more than half of it. t: (n,) s; lines: (n,) of the file; where samples are missing the axis may have gone
    anywhere.
    """
    step = np.diff(raw)
    if not len(step):
        return raw, None
    span = float(raw.max() - raw.min())
    largest = float(np.abs(step).max())
    if span == 0 or largest <= 0.5 * span:
        return raw, None
    modulus = _modulus(raw, channel, span)
    if modulus is not None and largest > 0.5 * modulus:
        jumps = np.flatnonzero(np.abs(step) > 0.5 * modulus)
        turns = np.concatenate(([0.0], np.cumsum(-np.sign(step) * (np.abs(step) > 0.5 * modulus))))
        note = f"{channel.column.header}: wrapped position made continuous "
        note += f"({len(jumps)} wraps of {modulus:g} {channel.declared})"
        return raw + modulus * turns, note
    usual = _JUMP * max(float(np.quantile(np.abs(step), _USUAL)), _ROUNDING * span)
    if largest > usual:
        clock = np.diff(t)
        step = np.where(clock < GAP * np.median(clock), step, 0.0)
        largest = float(np.abs(step).max())
    if len(raw) >= _FEWEST and largest > usual:
        k = int(np.argmax(np.abs(step)))
        raise DataError(
            f"{place}, line {lines[k + 1]}, column '{channel.column.header}'",
            f"the position jumps from {raw[k]:g} to {raw[k + 1]:g} {channel.declared} within one sample",
            "A wrapped counter, homing or a set position? Export the unwrapped position, or cut with `window:`.",
        )
    return raw, None


def _modulus(raw: Array, channel: Channel, span: float) -> float | None:
    """Size of one wrap in raw units, if all values fit into it and nearly fill it."""
    options: list[float] = []
    unit = channel.factor * channel.scale
    if channel.si == "rad" and unit:
        options.append(2 * math.pi / abs(unit))
    if np.array_equal(raw, np.rint(raw)):
        options += [2.0**k for k in range(8, 65)]
    fitting = [m for m in options if _FILLED * m < span <= m * (1 + _BEYOND)]
    return min(fitting) if fitting else None


def saturation_note(x: Array, name: str, unit: str) -> str | None:
    """A note when a measured channel rests at its extreme value for five samples or more. x: (n,) in `unit`."""
    limits = [limit for limit in (float(x.max()), float(x.min())) if limit != 0]
    if len(x) < _FEWEST or float(x.max()) == float(x.min()):
        return None
    parts = []
    steps = np.abs(np.diff(x))
    resolution = float(steps[steps > _ROUNDING * np.ptp(x)].min())
    for limit in limits:
        at = np.flatnonzero(x == limit)
        runs = [run for run in np.split(at, np.flatnonzero(np.diff(at) > 1) + 1) if len(run) >= _REST]
        # A smooth peak printed coarsely also rests, but leaves its rest by a single step of the resolution.
        edges = [abs(x[k] - limit) for run in runs for k in (run[0] - 1, run[-1] + 1) if 0 <= k < len(x)]
        stuck = sum(len(run) for run in runs) if not edges or np.median(edges) > _PEAK_STEP * resolution else 0
        if stuck:
            parts.append(f"{stuck} samples at {limit:g} {unit}")
    return f"{name}: {' and '.join(parts)} in a row: saturated, or a constant demand?" if parts else None
