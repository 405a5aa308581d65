"""inspect --plot: a picture of what was understood of a recording, channel by channel."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from linid.recording import Array, Axis, Recording
    from linid.recording.mapping import ChannelMapping
    from linid.recording.resolve import Channel, Channels
    from linid.recording.table import Column
    from linid.report.figures.inspection import Marks, Panel


def write_plot(
    path: Path, file: Path, channels: ChannelMapping | None, axis: Axis, recording: Recording | None
) -> Path:
    """Draw every column of a file; recording: the same file as it is used, None where it cannot be used yet."""
    from linid.errors import LinidError
    from linid.recording.mapping import ChannelMapping as Mapping
    from linid.recording.readers.registry import read_table
    from linid.recording.resolve import Channels as Found
    from linid.recording.resolve import resolve
    from linid.report.figures.inspection import inspection_figure
    from linid.report.style import save

    mapping = channels or Mapping()
    table = read_table(file, mapping)
    try:
        found = resolve(table, mapping, axis, mapping.period_s)
    except LinidError:
        found = Found({}, ())
    roles = {id(channel.column): channel for channel in found.by_role.values()}
    clock = found.by_role.get("time")
    panels: list[Panel] = []
    for column in table.columns:
        channel = roles.get(id(column))
        if not column.numeric or not column.values.size or (channel is not None and channel.role == "time"):
            continue
        x, timed = _times(table.columns, column, clock, mapping.period_s or table.period_s)
        if column.time and timed:
            continue
        y = channel.to_si(column.values) if channel is not None else column.values
        unit = channel.si if channel is not None else (column.unit or "no unit")
        role = f"{channel.role}: " if channel is not None else ""
        panels.append(_panel(f"{role}{column.name}, {unit}"[:110], x, y, channel is not None))
    timed = bool(clock) or bool(mapping.period_s or table.period_s)
    figure = inspection_figure(
        file.name, panels, _marks(table.columns, found, recording), "time (s)" if timed else "row"
    )
    stem = path.with_suffix("") if path.suffix.lower() == ".png" else path
    return save(figure, stem, ("png",), title="linid inspect")[0]


def _panel(label: str, x: Array, y: Array, read: bool) -> Panel:
    from linid.report.figures.inspection import Panel

    n = min(x.size, y.size)
    return Panel(label, x[:n], y[:n], read)


def _times(
    columns: Sequence[Column], column: Column, clock: Channel | None, period: float | None
) -> tuple[Array, bool]:
    """Times in s of a column's samples and True, or its rows and False."""
    if period is not None:
        return period * np.arange(column.values.size, dtype=np.float64), True
    own = next((c for c in columns if c.time and c.group == column.group and c.numeric), None)
    if own is None or clock is None:
        return np.arange(column.values.size, dtype=np.float64), False
    return clock.to_si(own.values), True


def _marks(columns: Sequence[Column], found: Channels, recording: Recording | None) -> Marks:
    """Gaps and unreadable cells of the position, and what of it is used."""
    from linid.recording.timebase import GAP
    from linid.report.figures.inspection import Marks

    position, clock = found.by_role.get("position"), found.by_role.get("time")
    if position is None or clock is None:
        return Marks()
    t, timed = _times(columns, position.column, clock, None)
    good = np.isfinite(t)
    if not timed or good.sum() < 3:
        return Marks()
    known = t[good]
    step = np.diff(known)
    wide = np.flatnonzero(step > GAP * np.median(step))[:200]
    gaps = tuple((float(known[k]), float(known[k + 1])) for k in wide)
    n = min(t.size, position.column.values.size)
    bad = t[:n][~np.isfinite(position.column.values[:n]) & good[:n]]
    kept = None
    if recording is not None and recording.reading is not None and recording.reading.cut:
        kept = (float(recording.t[0]), float(recording.t[-1]))
    return Marks(gaps, kept, tuple(float(x) for x in bad))
