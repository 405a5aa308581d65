"""Apache Parquet: numeric columns by name; units in the names, or in the columns' metadata under `unit`."""

from __future__ import annotations

from typing import Any

import numpy as np

from linid.errors import DataError
from linid.recording.mapping import ChannelMapping
from linid.recording.readers.reader import Reader, library, whole
from linid.recording.source import Source
from linid.recording.table import Column, Table, Used, array_column


def _recognises(source: Source) -> bool:
    return source.head.startswith(b"PAR1")


def _read(source: Source, mapping: ChannelMapping, used: Used | None = None) -> Table:
    del mapping, used
    types, parquet = library("pyarrow", source).types, library("pyarrow.parquet", source)
    with whole(source, "Parquet"):
        with source.opened() as stream:
            content = parquet.read_table(stream)
        found = [
            column for k, field in enumerate(content.schema) if (column := _column(types, field, content.column(k)))
        ]
    if not found:
        raise DataError(source.place, "holds no numeric column", "Save the channels as numbers.")
    skipped = [name for name in content.column_names if name not in {column.header for column in found}]
    notes = (*source.notes, *((f"no numbers, left out: {', '.join(skipped[:20])}",) if skipped else ()))
    return Table(source.path, "parquet", tuple(found), source.sha256, notes=notes)


def _column(types: Any, field: Any, values: Any) -> Column | None:
    unit = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace") or None
    if types.is_timestamp(field.type) or types.is_duration(field.type) or types.is_time(field.type):
        ticks = values.to_numpy()
        seconds = (ticks - ticks[0]) / np.timedelta64(1, "ns") * 1e-9 if ticks.dtype.kind in "mM" else None
        return None if seconds is None else array_column(field.name, seconds, unit="s", time=True)
    if not (types.is_floating(field.type) or types.is_integer(field.type) or types.is_boolean(field.type)):
        return None
    return array_column(field.name, values.to_numpy(), unit=unit)


READER = Reader(
    "parquet", "Apache Parquet; units in the names or in the columns' metadata", _recognises, _read, "formats"
)
