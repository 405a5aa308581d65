"""ASAM MDF 3 and 4 (.mf4, .mdf, .dat of measuring tools): every channel group is a time group of its own."""

from __future__ import annotations

from typing import Any

from linid.errors import DataError
from linid.recording.mapping import ChannelMapping
from linid.recording.readers.reader import Reader, library, whole
from linid.recording.source import Source
from linid.recording.table import Column, Table, Used, array_column


def _recognises(source: Source) -> bool:
    return source.head.startswith((b"MDF     ", b"UnFinMF "))


def _read(source: Source, mapping: ChannelMapping, used: Used | None = None) -> Table:
    del mapping, used
    asammdf = library("asammdf", source)
    with whole(source, "MDF"), source.opened() as stream, asammdf.MDF(stream) as file:
        columns = _columns(file)
    if not columns:
        raise DataError(source.place, "holds no numeric channel", "Record the axis' channels.")
    return Table(source.path, "mdf", columns, source.sha256, notes=source.notes)


def _columns(file: Any) -> tuple[Column, ...]:
    columns: list[Column] = []
    groups = 0
    for group in file.iter_groups(raw=False):
        if not len(group):
            continue
        numeric = [name for name in group.columns if group[name].dtype.kind in "iufb"]
        if not numeric:
            continue
        units = {channel.name: channel.unit for number in file.virtual_groups for channel in _channels(file, number)}
        columns.append(array_column(f"Time {groups + 1}", group.index.to_numpy(), unit="s", group=groups, time=True))
        columns += [
            array_column(str(name), group[name].to_numpy(), unit=units.get(str(name)) or None, group=groups, time=False)
            for name in numeric
        ]
        groups += 1
    return tuple(columns)


def _channels(file: Any, number: int) -> list[Any]:
    return list(file.groups[number].channels)


READER = Reader("mdf", "ASAM MDF 3 and 4 (.mf4, .mdf)", _recognises, _read, "formats")
