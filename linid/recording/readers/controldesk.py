"""dSPACE ControlDesk: a metadata block, a row of names, the mark `trace_values`, then the rows of samples."""

from __future__ import annotations

import re
from collections.abc import Sequence

from linid.errors import DataError
from linid.recording.body import Body
from linid.recording.dialect import split
from linid.recording.mapping import ChannelMapping
from linid.recording.readers.generic import sniffed
from linid.recording.readers.header import unit_cell
from linid.recording.readers.reader import Reader
from linid.recording.source import Source
from linid.recording.table import Headings, Table, Used, make_columns, with_body

_NAME_KEYS = ("path", "name", "names", "trace", "trace_names", "signal", "signals", "variable")
_MARK = re.compile(r'(?i)(?:^|[;,\t"])\s*trace_values\b')


def _recognises(source: Source) -> bool:
    return any(_MARK.search(line) for line in source.text.lines[:200])


def _read(source: Source, mapping: ChannelMapping, used: Used | None = None) -> Table:
    file, dialect = sniffed(source, mapping)
    mark = next((i for i, line in enumerate(file.lines) if "trace_values" in line.lower()), None)
    if mark is None:
        raise DataError(source.place, "no `trace_values` line found", "Remove `layout: controldesk` from the mapping.")
    rows = {i: split(file.lines[i], dialect.separator) for i in range(mark)}
    names_at = next((i for i in range(mark - 1, -1, -1) if _key(rows[i]) in _NAME_KEYS), None)
    if names_at is None:
        raise DataError(
            f"{source.place}, line {mark + 1}",
            f"no row of signal names ({' or '.join(_NAME_KEYS[:3])}) above the data",
            "Export again with signal names.",
        )
    first = dialect.numeric.index(True)
    names = _from(rows[names_at], first, dialect.fields)
    units_at = next((i for i in range(mark) if _key(rows[i]) in ("unit", "units")), None)
    units = _from(rows[units_at], first, dialect.fields) if units_at is not None else [""] * len(names)
    shown = [name or f"column {first + k + 1}" for k, name in enumerate(names)]
    header = [n.replace("\\", "/").strip("/").split("/")[-1].strip('"') or n for n in shown]

    def table(body: Body) -> Table:
        headings = Headings(header, units=[unit_cell(u) for u in units], aliases=[(n,) for n in shown])
        columns = make_columns(headings, body, dialect.numeric[first:], first=first)
        return Table(
            file.path,
            "controldesk",
            columns,
            source.sha256,
            file.encoding,
            dialect.text,
            names_at + 1,
            dialect.first + 1,
            None,
            (*file.notes, *body.notes),
        )

    return with_body(table, file, dialect, used, first=first)


def _key(row: Sequence[str]) -> str:
    return next((cell for cell in row if cell), "").strip().lower()


def _from(row: Sequence[str], first: int, fields: int) -> list[str]:
    return (list(row[first:]) + [""] * fields)[: fields - first]


READER = Reader(
    "controldesk", "dSPACE ControlDesk: labelled rows, `trace_values` before the samples", _recognises, _read
)
