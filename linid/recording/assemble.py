"""Table and channels -> arrays in SI on the position's time base, with notes on everything that was corrected."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from linid.arrays import Array
from linid.errors import DataError
from linid.recording.mapping import INPUTS, Role
from linid.recording.noise import quantum
from linid.recording.recording import Reading
from linid.recording.repair import bad_cell_error, fill, unwrap
from linid.recording.resolve import Channel, Channels
from linid.recording.table import Table
from linid.recording.timebase import FEW, FEWEST_OF_SPLINE, ROUNDING, Clock, clean_clock, gap_notes, gaps, onto

_MARGIN = 10  # samples of a slower group kept beside the window, for its spline


@dataclass(frozen=True)
class Signals:
    """SI arrays (n,) by channel (`time` always present), notes, and what was done in numbers."""

    values: dict[Role, Array]
    notes: tuple[str, ...]
    reading: Reading


def assemble(
    table: Table, channels: Channels, period: float | None, window: tuple[float, float] | None = None
) -> Signals:
    """All channels in SI at the times of the position (other time groups by cubic spline, never extrapolated).

    period: s, if given; window: (t0, t1) in s of the file's time; what lies outside is not looked at. Raises DataError
    where the window or the times that all channels share hold too few samples, channels of one clock differ in length,
    or too many cells are unreadable.
    """
    place = str(table.path)
    base = channels.base.column.group
    clock = _clock(table, channels, base, period, place)
    t, rows, notes = clock.t, clock.rows, list(clock.notes)
    reading = Reading(jitter=clock.jitter, stamp_step=clock.stamp_step, left_out=clock.left_out)
    if window is not None:
        part = _inside(t, window, place)
        notes.append(f"window [{window[0]:g}, {window[1]:g}] s: {part.stop - part.start} of {len(t)} samples used")
        t, rows = t[part], rows[part]
    values: dict[Role, Array] = {}
    keep = np.ones(len(t), dtype=bool)
    resampled: list[str] = []
    for role, channel in channels.by_role.items():
        if role == "time":
            continue
        if channel.column.group == base:
            raw, t_here, rows_here = _take(channel, rows, place), t, rows
        else:
            own = _clock(table, channels, channel.column.group, period, place)
            t_here, rows_here = own.t, own.rows
            notes += [n for n in own.notes if n not in notes]
            low, high = np.searchsorted(t_here, [t[0], t[-1]])
            around = slice(max(0, int(low) - _MARGIN), int(high) + _MARGIN)
            t_here, rows_here = t_here[around], rows_here[around]
            raw = _take(channel, rows_here, place)
        raw, t_used, rows_used = _without_bad_edges(raw, t_here, rows_here, channel, place)
        reading = _with_channel(reading, role, channel, raw)
        raw, note = fill(t_used, raw, rows_used, channel, place)
        notes += [note] if note else []
        if role == "position":
            wrapped = raw
            raw, note = unwrap(raw, channel, place, channel.column.lines[rows_used], t_used)
            notes += [note] if note else []
            reading = _with_wraps(reading, channel, raw - wrapped)
        x = channel.to_si(raw)
        if len(t_used) != len(t) or not np.array_equal(t_used, t):
            x = onto(t, t_used, x, place) if channel.column.group != base else _placed(t, t_used, x)
            keep &= np.isfinite(x)
            if channel.column.group != base:
                resampled.append(channel.column.header)
        values[role] = x
    if resampled:
        notes.append(f"{', '.join(resampled)}: another time group, put on the position's times by cubic spline")
    values["time"] = t
    return _common_part(values, keep, notes, place, reading)


def _with_channel(reading: Reading, role: Role, channel: Channel, raw: Array) -> Reading:
    """The facts with those of one channel's raw values: unreadable cells and resolution (of all inputs the finest)."""
    reading = replace(reading, filled=reading.filled + int((~np.isfinite(raw)).sum()))
    if role != "position" and role not in INPUTS:
        return reading
    step = quantum(raw) * abs(channel.scale * channel.factor)
    if role == "position":
        return replace(reading, position_step=step)
    known = [one for one in (reading.input_step, step) if one > 0.0]
    return replace(reading, input_step=min(known, default=0.0))


def _with_wraps(reading: Reading, channel: Channel, turned: Array) -> Reading:
    """The facts with the wraps, from what unwrapping added to the raw position (n,)."""
    jumps = np.abs(np.diff(turned))
    largest = float(jumps.max(initial=0.0))
    # Between the wraps the difference of two sums is not always zero to the last bit.
    count = int(np.count_nonzero(jumps > 0.5 * largest)) if largest > 0.0 else 0
    return replace(reading, wraps=count, wrap=largest * abs(channel.scale * channel.factor))


def _inside(t: Array, window: tuple[float, float], place: str) -> slice:
    """The samples inside the window."""
    start, end = window
    inside = np.flatnonzero((t >= start - ROUNDING) & (t <= end + ROUNDING))
    if not start < end or len(inside) < FEWEST_OF_SPLINE:
        raise DataError(
            place,
            f"window [{start:g}, {end:g}] s holds {len(inside)} samples; the file runs from {t[0]:g} to {t[-1]:g} s",
            "Choose a window inside the recording.",
        )
    return slice(int(inside[0]), int(inside[-1]) + 1)


def _common_part(
    values: dict[Role, Array],
    keep: np.ndarray[tuple[int], np.dtype[np.bool_]],
    notes: list[str],
    place: str,
    reading: Reading,
) -> Signals:
    """The time range in which every channel has values."""
    covered = np.flatnonzero(keep)
    if len(covered) < FEWEST_OF_SPLINE:
        raise DataError(
            place, f"the channels overlap in only {len(covered)} samples", "Export all channels over the same time."
        )
    if len(covered) < len(keep):
        lost = len(keep) - len(covered)
        notes.append(f"{lost} sample{'s' * (lost > 1)} at the ends left out: not every channel has values there")
    part = slice(int(covered[0]), int(covered[-1]) + 1)
    notes += gap_notes(values["time"][part])
    count, missing, longest, _ = gaps(values["time"][part])
    cut = len(keep) - (part.stop - part.start)
    reading = replace(reading, gaps=count, missing=missing, longest_gap=longest, cut=cut)
    whole = len(covered) == len(keep)
    return Signals({role: x if whole else x[part].copy() for role, x in values.items()}, tuple(notes), reading)


def _clock(table: Table, channels: Channels, group: int, period: float | None, place: str) -> Clock:
    """Times in s and rows of one time group."""
    time = channels.by_role.get("time")
    used = [c.column for role, c in channels.by_role.items() if role != "time" and c.column.group == group]
    period = period if period is not None or time is not None else table.period_s
    if period is not None:
        n = len(used[0].values)
        if group != channels.base.column.group and n != len(channels.base.column.values):
            raise DataError(
                f"{place}, column '{used[0].header}'",
                f"found {n} samples, the position has {len(channels.by_role['position'].column.values)}: another rate, "
                "but one sampling period is given",
                "Leave `period:` out so that the time columns are used.",
            )
        return Clock(np.arange(n, dtype=np.float64) * period, np.arange(n, dtype=np.int64), (), math.nan, 0.0, 0)
    assert time is not None  # resolve() refuses a table with neither time nor period
    column = time.column
    if column.group != group:
        found = [c for c in table.columns if c.group == group and c.time]
        if not found:
            raise DataError(place, f"time group {group + 1} has no time column", "Export a time column for each group.")
        column = found[0]
    if len({len(column.values), *(len(c.values) for c in used)}) > 1:
        raise DataError(
            f"{place}, column '{column.header}'",
            f"found {len(column.values)} time stamps but {', '.join(str(len(c.values)) for c in used)} samples",
            "Save vectors of equal length.",
        )
    return clean_clock(time.to_si(column.values), [c.values for c in used], column.lines, place)


def _take(channel: Channel, rows: np.ndarray[tuple[int], np.dtype[np.int64]], place: str) -> Array:
    raw = channel.column.values
    if not np.isfinite(raw).any():
        raise bad_cell_error(channel, np.arange(len(raw)), len(raw), place)
    if len(raw) <= rows.max(initial=-1):
        raise DataError(
            f"{place}, column '{channel.column.header}'",
            f"found {len(raw)} samples, expected {int(rows.max()) + 1}",
            "Save vectors of equal length.",
        )
    return raw[rows]


def _without_bad_edges(
    raw: Array, t: Array, rows: np.ndarray[tuple[int], np.dtype[np.int64]], channel: Channel, place: str
) -> tuple[Array, Array, np.ndarray[tuple[int], np.dtype[np.int64]]]:
    """Unreadable cells at the ends cannot be interpolated: cut (up to 1 %), else an error."""
    good = np.flatnonzero(np.isfinite(raw))
    if not len(good):
        raise bad_cell_error(channel, np.arange(len(raw)), len(raw), place)
    lost = len(raw) - (int(good[-1]) - int(good[0]) + 1)
    if lost > max(1, FEW * len(raw)):
        raise bad_cell_error(channel, rows[~np.isfinite(raw)], len(raw), place)
    part = slice(int(good[0]), int(good[-1]) + 1)
    return raw[part], t[part], rows[part]


def _placed(t: Array, t_used: Array, x: Array) -> Array:
    """x at its own times among t, nan elsewhere."""
    full = np.full(len(t), np.nan)
    full[np.searchsorted(t, t_used)] = x
    return full
