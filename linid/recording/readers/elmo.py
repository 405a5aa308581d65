"""Elmo: sections in brackets; EAS writes names and column numbers apart (`Elmo txt chart`), older recorders a header.

Layout of the chart as the Elmo Application Studio writes it: `[Signal Names]` holds `number,name,` per line, and each
`[Signals Data Group n]` begins with a row of those numbers, then the samples; every line ends with a comma.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from linid.errors import DataError
from linid.recording.body import Body
from linid.recording.dialect import Dialect, split
from linid.recording.mapping import ChannelMapping
from linid.recording.readers.generic import filled_above, plain_table, sniffed
from linid.recording.readers.header import Header, declared_period, header_of
from linid.recording.readers.reader import Reader
from linid.recording.source import Source
from linid.recording.table import Headings, Table, Used, make_columns, with_body
from linid.recording.text import TextFile

_SECTION = re.compile(r"\s*\[[^\[\]]{0,200}[A-Za-z][^\[\]]{0,200}\]\s*[;,\t]*\s*")
_NAMES, _GROUP = "[signal names]", "[signals data group"


def _recognises(source: Source) -> bool:
    return any(len(line) < 500 and _SECTION.fullmatch(line) for line in source.text.lines[:200])


def _read(source: Source, mapping: ChannelMapping, used: Used | None = None) -> Table:
    file = source.text
    groups = [i for i, line in enumerate(file.lines) if line.lstrip().lower().startswith(_GROUP)]
    if groups:
        return _chart(source, mapping, file, groups, used)
    file, dialect = sniffed(source, mapping)
    above = [i for i in filled_above(file, dialect) if not _SECTION.fullmatch(file.lines[i][:500])]
    header = header_of(file, dialect, above)
    period = declared_period(file.lines[: header.line or dialect.first], dialect)
    return plain_table("elmo", source, file, dialect, header, period, used)


def _chart(source: Source, mapping: ChannelMapping, file: TextFile, groups: Sequence[int], used: Used | None) -> Table:
    """The chart of EAS, of one group of signals."""
    if len(groups) > 1:
        raise DataError(
            f"{source.place}, line {groups[1] + 1}",
            f"found {len(groups)} groups of signals, expected one",
            "Export the signals of one group (one sampling time) to a file of its own.",
        )
    numbers_at = next((i for i in range(groups[0] + 1, len(file.lines)) if file.lines[i].strip()), None)
    names = _signal_names(file, groups[0])
    wanted = split(file.lines[numbers_at].strip().rstrip(","), ",") if numbers_at is not None else []
    if not wanted or any(number not in names for number in wanted):
        unknown = next((number for number in wanted if number not in names), "none")
        raise DataError(
            f"{source.place}, line {(numbers_at or groups[0]) + 1}",
            f"the row of signal numbers holds {unknown!r}, which [Signal Names] does not list",
            "Export the chart again.",
        )
    fields = len(wanted) + 1  # every line ends with a comma
    first = next((i for i in range(numbers_at + 1, len(file.lines)) if file.lines[i].strip()), None)  # type: ignore[operator]
    if first is None:
        raise DataError(source.place, "a header but no rows of samples", "Export the samples, not only the header.")
    if not file.lines[first].rstrip().endswith(","):
        fields -= 1
    numeric = tuple(k < len(wanted) for k in range(fields))
    dialect = Dialect(",", mapping.decimal or ".", fields, first, numeric)
    header = Header([names[number] for number in wanted], None, (numbers_at or 0) + 1)
    period = declared_period(file.lines[: groups[0]], dialect)

    def table(body: Body) -> Table:
        columns = make_columns(Headings(header.names), body, numeric[: len(wanted)])
        return Table(
            file.path,
            "elmo",
            columns,
            source.sha256,
            file.encoding,
            dialect.text,
            header.line,
            first + 1,
            period,
            (*file.notes, *body.notes),
        )

    return with_body(table, file, dialect, used)


def _signal_names(file: TextFile, end: int) -> dict[str, str]:
    """Signal number -> name, from the section of names."""
    start = next((i for i in range(end) if file.lines[i].strip().lower().startswith(_NAMES)), None)
    names: dict[str, str] = {}
    for line in file.lines[(start + 1 if start is not None else end) : end]:
        if line.lstrip().startswith("["):
            break
        cells = split(line.strip().rstrip(","), ",")
        if len(cells) >= 2 and cells[0].isdigit():
            names[cells[0]] = ", ".join(cell for cell in cells[1:] if cell)
    return names


READER = Reader("elmo", "Elmo: bracketed sections, trailing comma; also EAS's `Elmo txt chart`", _recognises, _read)
