"""National Instruments TDMS: each group of channels with its waveform's increment, or with a channel of times."""

from __future__ import annotations

from typing import Any

import numpy as np

from linid.errors import DataError
from linid.recording.mapping import ChannelMapping
from linid.recording.names import is_time, split_header
from linid.recording.readers.reader import Reader, library, whole
from linid.recording.source import Source
from linid.recording.table import Column, Table, Used, array_column


def _recognises(source: Source) -> bool:
    return source.head.startswith(b"TDSm")


def _read(source: Source, mapping: ChannelMapping, used: Used | None = None) -> Table:
    del mapping, used
    nptdms = library("nptdms", source)
    with whole(source, "TDMS"), source.opened() as stream:
        file = nptdms.TdmsFile.read(stream)
        columns = _columns(file)
    if not columns:
        raise DataError(source.place, "holds no numeric channel", "Record the axis' channels.")
    return Table(source.path, "tdms", columns, source.sha256, notes=source.notes)


def _columns(file: Any) -> tuple[Column, ...]:
    columns: list[Column] = []
    number = 0
    for group in file.groups():
        channels = [c for c in group.channels() if len(c) and getattr(c.dtype, "kind", "O") in "iufbM"]
        clocks = [c for c in channels if c.dtype.kind == "M" or is_time(split_header(c.name)[0])]
        others = [c for c in channels if c not in clocks]
        if not others:
            continue
        if clocks:
            columns.append(_clock(clocks[0], number))
        elif (step := float(others[0].properties.get("wf_increment", 0.0) or 0.0)) > 0.0:
            start = float(others[0].properties.get("wf_start_offset", 0.0) or 0.0)
            t = start + step * np.arange(len(others[0]))
            columns.append(array_column(f"Time {number + 1}", t, unit="s", group=number, time=True))
        for channel in others:
            unit = str(channel.properties.get("unit_string", "") or "") or None
            columns.append(array_column(channel.name, channel[:], unit=unit, group=number, time=False))
        number += 1
    return tuple(columns)


def _clock(channel: Any, group: int) -> Column:
    values = channel[:]
    if channel.dtype.kind == "M":
        seconds = (values - values[0]) / np.timedelta64(1, "ns") * 1e-9
        return array_column(channel.name, seconds, unit="s", group=group, time=True)
    unit = str(channel.properties.get("unit_string", "") or "") or None
    return array_column(channel.name, values, unit=unit, group=group, time=True)


READER = Reader("tdms", "National Instruments TDMS", _recognises, _read, "formats")
