"""The time base of a recording: order, duplicates, rounding, gaps and the merging of time groups."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.errors import DataError

FEW = 0.01  # of a column: more of it unusable is no isolated damage
GAP = 1.5  # periods; a longer step lacks a sample
FEWEST_OF_SPLINE = 4  # samples that determine a cubic
ROUNDING = 1e-12  # s: a sample at the end of a window lies in it, whatever its last bit says
_FEWEST_STAMPS = 10  # of fewer the rate says little
_REGULAR, _IRREGULAR = 1e-6, 0.6  # of a period: nothing to mend below, more than rounding above
_COARSEST = 0.5  # of a period: coarser digits are no regular grid's
_DIGIT = 1e-3  # of the last printed digit, by which stamps may miss it
_ROUNDED = 0.55  # of the last digit: rounding moves a stamp by half of it at most


@dataclass(frozen=True)
class Clock:
    """Cleaned times t (n,) in s, the rows (n,) they come from, and notes.

    jitter: RMS deviation of the stamped steps from their median, as a share of it; stamp_step: s to which the stamps of
    a regular clock were rounded, else 0; left_out: rows not taken.
    """

    t: Array
    rows: np.ndarray[tuple[int], np.dtype[np.int64]]
    notes: tuple[str, ...]
    jitter: float
    stamp_step: float
    left_out: int


def clean_clock(
    t: Array, others: Sequence[Array], lines: Array | np.ndarray[tuple[int], np.dtype[np.int64]], place: str
) -> Clock:
    """Times in s -> strictly increasing times; raises DataError when time goes back or stands still too often.

    t: (n,) s with nan where unreadable; others: the group's other columns, (n,) each, in any unit (to tell repeated
    rows from a coarse clock); lines: (n,) line numbers for messages.
    """
    notes: list[str] = []
    rows = np.flatnonzero(np.isfinite(t))
    missing = len(t) - len(rows)
    if missing > max(1, FEW * len(t)):
        first = int(np.flatnonzero(~np.isfinite(t))[0])
        raise DataError(
            f"{place}, line {lines[first]}",
            f"{missing} of {len(t)} time stamps are not numbers",
            "Repair the time column, or give `period:` in the mapping.",
        )
    if missing:
        notes.append(f"{missing} row{'s' * (missing > 1)} without a readable time stamp left out")
    if len(rows) < 2:
        raise DataError(place, f"found {len(rows)} time stamps, expected at least 2", "Export the whole recording.")
    step = np.diff(t[rows])
    if (step < 0).any():
        k = int(np.flatnonzero(step < 0)[0])
        raise DataError(
            f"{place}, line {lines[rows[k + 1]]}",
            f"time goes back from {t[rows[k]]:g} s to {t[rows[k + 1]]:g} s",
            "Split the file there (two recordings in one file?), or give `period:` if the counter restarted.",
        )
    rows = _without_duplicates(t, rows, step, others, lines, place, notes)
    times, note, stamp_step = rounded_to_regular(t[rows])
    return Clock(times, rows, (*notes, *note), jitter(t[rows]), stamp_step, len(t) - len(rows))


def jitter(t: Array) -> float:
    """RMS deviation of the sampling steps from their median, as a share of it (gaps of missing samples excluded).
    t: (n,) s.
    """
    step = np.diff(t)
    period = float(np.median(step))
    near = step[step < GAP * period]
    return float(np.sqrt(np.mean((near / period - 1.0) ** 2)))


def _without_duplicates(
    t: Array,
    rows: np.ndarray[tuple[int], np.dtype[np.int64]],
    step: Array,
    others: Sequence[Array],
    lines: Array | np.ndarray[tuple[int], np.dtype[np.int64]],
    place: str,
    notes: list[str],
) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    repeated = np.flatnonzero(step == 0)
    if not len(repeated):
        return rows
    here, before = (np.column_stack([x[at] for x in others]) for at in (rows[repeated + 1], rows[repeated]))
    same = ((here == before) | (np.isnan(here) & np.isnan(before))).all(axis=1)
    different = int((~same).sum())
    if different > max(1, FEW * len(rows)):
        k = int(repeated[~same][0])
        raise DataError(
            f"{place}, line {lines[rows[k + 1]]}",
            f"{different} time stamps occur twice with different values (first: {t[rows[k]]:g} s)",
            "The time column is too coarse for the sampling rate: export more digits, or give `period:`.",
        )
    if different:
        notes.append(f"{different} row{'s' * (different > 1)} with a repeated time stamp left out")
    if same.any():
        notes.append(f"{int(same.sum())} repeated rows (same time, same values) left out")
    keep = np.ones(len(rows), dtype=bool)
    keep[repeated + 1] = False
    return rows[keep]


def rounded_to_regular(t: Array) -> tuple[Array, tuple[str, ...], float]:
    """Times t (n,) in s that are a regular grid rounded to the printed digits -> that grid (n,), a note and the last
    digit in s.

    Others stay as they are, without a note and with 0.
    """
    n = len(t)
    if n < _FEWEST_STAMPS:
        return t, (), 0.0
    grid: Array = np.arange(n, dtype=np.float64) - 0.5 * (n - 1)
    slope = float((grid * (t - t.mean())).sum() / (grid**2).sum())
    grid *= slope
    grid += t.mean()
    spread = float(np.abs(t - grid).max())
    if spread < _REGULAR * slope or spread > _IRREGULAR * slope:
        return t, (), 0.0
    for digits in range(0, 12):
        quantum = 10.0**-digits
        units = t / quantum
        if np.abs(units - np.rint(units)).max() < _DIGIT:
            break
    else:
        return t, (), 0.0
    if spread > _ROUNDED * quantum or quantum > _COARSEST * slope:
        return t, (), 0.0
    return grid, (f"time stamps rounded to {quantum:g} s: replaced by a regular grid of {slope:.6g} s",), quantum


def gaps(t: Array) -> tuple[int, int, float, float]:
    """Gaps in the times t (n,) in s: how many, samples missing in them, the longest in s and where the first begins
    (0 without).
    """
    step = np.diff(t)
    period = float(np.median(step))
    found = np.flatnonzero(step > GAP * period)
    if not len(found):
        return 0, 0, 0.0, 0.0
    missing = int(np.rint(step[found] / period - 1).sum())
    return len(found), missing, float(step[found].max()), float(t[found[0]])


def gap_notes(t: Array) -> tuple[str, ...]:
    """A note on missing samples (steps above 1.5 periods) of the times t (n,) in s."""
    count, missing, longest, first = gaps(t)
    if not count:
        return ()
    s = "s" * (count > 1)
    return (f"{count} gap{s} in time ({missing} samples missing, longest {longest:.4g} s, first at {first:.6g} s)",)


def onto(t: Array, t_group: Array, x: Array, place: str) -> Array:
    """Channel x of another time group at the times t (inside its range only) by a cubic spline, (n,) in the unit of x.

    t: (n,) s; t_group: (m,) s and x: (m,) in any unit. Raises DataError for fewer than four samples.
    """
    from scipy.interpolate import CubicSpline

    if len(t_group) < FEWEST_OF_SPLINE:
        raise DataError(
            place, f"found {len(t_group)} samples in a time group, expected at least 4", "Export all samples."
        )
    return np.asarray(CubicSpline(t_group, x, extrapolate=False)(t), dtype=np.float64)
