"""CODESYS sampling trace as ASCII text: a title, the project's path, a line of names, then samples between blanks.

Layout as documented for the command `Trace in ASCII-File`: the first column counts task cycles, or, where a sampling
interval was set, gives the time in ms.
"""

from __future__ import annotations

import re

from linid.errors import DataError
from linid.recording.body import Body
from linid.recording.dialect import sniff
from linid.recording.mapping import ChannelMapping
from linid.recording.readers.reader import Reader
from linid.recording.source import Source
from linid.recording.table import Headings, Table, Used, make_columns, with_body

_TITLE = re.compile(r"(?i)[^;,\t]{0,80}\btrace\b[^;,\t]{0,80}")
_PROJECT = re.compile(r"(?i).{0,400}\.(?:pro|project)\s*")
_FIRST_COLUMN = ("cycle", "zyklus", "time", "zeit", "t")


def _recognises(source: Source) -> bool:
    head = [line.strip() for line in source.text.lines[:12] if line.strip()][:3]
    return (
        len(head) == 3
        and bool(_TITLE.fullmatch(head[0]))
        and bool(_PROJECT.fullmatch(head[1]))
        and head[2].split()[0].lower() in _FIRST_COLUMN
    )


def _read(source: Source, mapping: ChannelMapping, used: Used | None = None) -> Table:
    file = source.text
    dialect = sniff(file.lines, source.place, separator=mapping.separator or " ", decimal=mapping.decimal)
    at = next((i for i in range(dialect.first - 1, -1, -1) if file.lines[i].strip()), None)
    names = file.lines[at].split() if at is not None else []
    if at is None or len(names) != dialect.fields:
        raise DataError(
            f"{source.place}, line {(at or 0) + 1}",
            f"the line of names has {len(names)}, the samples below have {dialect.fields} fields",
            "Export the trace again.",
        )
    counted = names[0].lower() in ("cycle", "zyklus")

    def table(body: Body) -> Table:
        headings = Headings(
            names,
            units=[None if counted else "ms", *[None] * (len(names) - 1)],
            times=[not counted, *[False] * (len(names) - 1)],
        )
        columns = make_columns(headings, body, dialect.numeric)
        notes = [*file.notes, *body.notes]
        if counted:
            notes.append("the first column counts task cycles: give the cycle time as `period:` in the mapping")
        return Table(
            file.path,
            "codesys",
            columns,
            source.sha256,
            file.encoding,
            dialect.text,
            at + 1,
            dialect.first + 1,
            None,
            tuple(notes),
        )

    return with_body(table, file, dialect, used)


READER = Reader("codesys", "CODESYS sampling trace as ASCII text: title, project, names, samples", _recognises, _read)
