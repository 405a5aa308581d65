"""Any text export with one line of names above its samples; units in the names, or in a line of their own."""

from __future__ import annotations

import re
from collections.abc import Sequence

from linid.recording.body import Body
from linid.recording.dialect import Dialect, sniff, split
from linid.recording.grouping import refuse_unproven_grouping
from linid.recording.mapping import ChannelMapping
from linid.recording.readers.header import Header, declared_period, header_of
from linid.recording.readers.reader import Reader
from linid.recording.source import Source
from linid.recording.table import Headings, Table, Used, make_columns, with_body
from linid.recording.text import TextFile


def _read(source: Source, mapping: ChannelMapping, used: Used | None = None) -> Table:
    file, dialect = sniffed(source, mapping)
    above = filled_above(file, dialect)
    period = declared_period(
        [file.lines[i] for i in above if i < dialect.first - 1 or _is_keyed(file.lines[i])], dialect
    )
    return plain_table("generic", source, file, dialect, header_of(file, dialect, above), period, used)


def sniffed(source: Source, mapping: ChannelMapping) -> tuple[TextFile, Dialect]:
    """The lines of a source and the dialect that they are written in."""
    file = source.text
    dialect = sniff(file.lines, source.place, separator=mapping.separator, decimal=mapping.decimal)
    if mapping.decimal is None:
        refuse_unproven_grouping(file.lines, dialect, source.place)
    return file, dialect


def filled_above(file: TextFile, dialect: Dialect) -> list[int]:
    """Indices of the filled lines above the samples, the lowest one first."""
    return [i for i in range(dialect.first - 1, dialect.skip - 1, -1) if file.lines[i].strip()]


def plain_table(
    name: str, source: Source, file: TextFile, dialect: Dialect, header: Header, period: float | None, used: Used | None
) -> Table:
    """The table of an export with one line of names. period: s, if the header gives it."""
    width = len(header.names)

    def table(body: Body) -> Table:
        notes = [*file.notes, *header.notes, *body.notes]
        if width < dialect.fields:  # trailing separators leave empty columns without a name
            notes += _drop_unnamed(file, dialect, width)
        headings = Headings(header.names, header.units, stamps=dialect.stamps)
        columns = make_columns(headings, body, dialect.readable[:width])
        return Table(
            file.path,
            name,
            columns,
            source.sha256,
            file.encoding,
            dialect.text,
            header.line,
            dialect.first + 1,
            period,
            tuple(notes),
        )

    return with_body(table, file, dialect, used)


def _is_keyed(line: str) -> bool:
    return bool(re.search(r"[=:]", line))


def _drop_unnamed(file: TextFile, dialect: Dialect, width: int) -> Sequence[str]:
    rows = [split(line, dialect.separator) for line in file.lines[dialect.first : dialect.first + 50]]
    filled = any(cell for row in rows for cell in row[width:])
    return [f"columns without a name after column {width} left out"] if filled else []


READER = Reader(
    "generic",
    "one line of names, units in it or in a line of their own; tab, comma, semicolon, bar or blanks",
    lambda source: True,
    _read,
)
