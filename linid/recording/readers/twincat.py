"""TwinCAT Scope text export: keyed header rows, one time column per sampling-time group, perhaps no header but names.

Layout facts: Beckhoff's documentation of the CSV export (infosys, TE13xx Scope View: separators, time lines for each
sample time, EOF tag, full time stamps in 100 ns ticks); the key of a header row is repeated at the start of each group.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.errors import DataError
from linid.recording.body import Body
from linid.recording.dialect import Dialect, first_data_line, is_number, named, split
from linid.recording.grouping import refuse_unproven_grouping
from linid.recording.mapping import ChannelMapping
from linid.recording.readers.reader import Reader
from linid.recording.readers.twincat_blanks import with_tabs
from linid.recording.source import Source
from linid.recording.table import Headings, Table, Used, make_columns, with_body

_KEY_TEXT = (
    "Name,SymbolName,SymbolComment,NetID,NetId,Port,IndexGroup,IndexOffset,Data-Type,SampleTime[ms],SymbolBased,"
    "VariableSize,Offset,ScaleFactor,BitMask,Unit,StartTime,EndTime,Unit ScaleFactor,Unit Offset,File,"
    "Starttime of export,Endtime of export"
)
_KEYS = frozenset(_KEY_TEXT.split(","))
_SURE = ("SymbolComment", "SampleTime[ms]", "Data-Type", "SymbolName", "Starttime of export")
_SEPARATORS = ("\t", ";", ",", ":", "|", " ")


def _recognises(source: Source) -> bool:
    """Whether the first lines carry TwinCAT's header keys, or a lone `Name` row with a repeated key."""
    head = [line.strip("\ufeff") for line in source.text.lines[:200]]
    for line in head[:40]:
        if line.lstrip('"').startswith(_SURE):
            return True
    first = next((line for line in head if line.strip()), "")
    return any(split(first, sep)[0] == "Name" and len(split(first, sep)) > 1 for sep in _SEPARATORS[:3])


def _read(source: Source, mapping: ChannelMapping, used: Used | None = None) -> Table:
    """Read the export; times are in ms as the format defines (or 100 ns ticks with full time stamps)."""
    file, place = source.text, source.place
    separator = mapping.separator or _separator(file.lines, place)
    words = named(separator)
    notes_of_names: list[str] = []
    if separator == " ":
        lines, notes_of_names = with_tabs(file.lines, _KEYS, place)
        file, separator = replace(file, lines=lines), "\t"
    header = _header(file.lines, separator)
    names = header.get("Name") or header.get("SymbolName")
    if not names:
        raise DataError(place, "no row of channel names (`Name`) in the header", "Export with the header's Name row.")
    fields = len(names)
    clocks = [k for k, cell in enumerate(names) if cell in ("Name", "SymbolName")]
    dialect = _dialect(file.lines, separator, mapping.decimal, fields, header, place)
    if mapping.decimal is None:
        refuse_unproven_grouping(file.lines, dialect, place)
    groups = [int(np.searchsorted(clocks, k, side="right")) - 1 for k in range(fields)]
    units: list[str | None] = ["ms" if k in clocks else _unit(header, k) for k in range(fields)]
    symbols = header.get("SymbolName", [])
    shown = [f"Time {groups[k] + 1}" if k in clocks else name for k, name in enumerate(names)]

    def table(body: Body) -> Table:
        ticks_note = _from_ticks(body.columns, header, clocks)
        headings = Headings(
            shown,
            units=units,
            aliases=[(symbols[k],) if k < len(symbols) and symbols[k] else () for k in range(fields)],
            groups=groups,
            times=[k in clocks for k in range(fields)],
        )
        columns = make_columns(headings, body, dialect.numeric)
        notes = [*file.notes, *notes_of_names, *body.notes, *ticks_note, *_scale_notes(header, names, clocks)]
        return Table(
            file.path,
            "twincat",
            columns,
            source.sha256,
            file.encoding,
            dialect.text.replace(named(dialect.separator), words),
            1,
            dialect.first + 1,
            None,
            tuple(notes),
        )

    return with_body(table, file, dialect, used, short_rows=len(clocks) > 1)


def _separator(lines: Sequence[str], place: str) -> str:
    """The separator under which the header rows start with known keys."""
    best, votes = "", 0
    for sep in _SEPARATORS:
        count = sum(1 for line in lines[:40] if len(cells := split(line, sep)) > 1 and cells[0] in _KEYS)
        if count > votes:
            best, votes = sep, count
    if not best:
        raise DataError(place, "no TwinCAT header rows found", "Remove `layout: twincat` from the mapping.")
    return best


def _header(lines: Sequence[str], separator: str) -> dict[str, list[str]]:
    """Header rows by key; the project's own `Name` line (one value) gives way to the channels' row."""
    rows: dict[str, list[str]] = {}
    for line in lines[:60]:
        cells = split(line.lstrip("\ufeff"), separator)
        if cells[0] in _KEYS:
            while len(cells) > 1 and not cells[-1]:
                cells.pop()
            if len(cells) >= len(rows.get(cells[0], [])) or cells[0] != "Name":
                rows[cells[0]] = cells
    width = len(rows.get("Name") or rows.get("SymbolName") or [])
    return {key: cells + [""] * (width - len(cells)) for key, cells in rows.items()}


def _dialect(
    lines: Sequence[str], separator: str, decimal: str | None, fields: int, header: dict[str, list[str]], place: str
) -> Dialect:
    last_key = max((i for i, line in enumerate(lines[:60]) if split(line, separator)[0] in _KEYS), default=-1)
    sample = [split(line, separator) for line in lines[last_key + 1 : last_key + 400] if line.strip()]
    marks = [decimal] if decimal else ([".", ","] if separator != "," else ["."])
    if separator == "," and decimal is None and any('"' in line for line in lines[last_key + 1 : last_key + 20]):
        marks = [".", ","]
    found = {mark: sum(is_number(cell, mark) for row in sample for cell in row) for mark in marks}
    mark = max(marks, key=lambda m: found[m])
    widths = [len([c for c in row if c]) for row in sample[:50]]
    if not sample or not found[mark]:
        raise DataError(place, "a header but no rows of samples", "Export the samples, not only the header.")
    if max(widths) > fields:
        raise DataError(
            f"{place}, line {last_key + 2}",
            f"the rows have {max(widths)} fields, the header names {fields}: the separator seems to be "
            "the decimal mark too",
            "Export with tab or semicolon as separator.",
        )
    first = first_data_line(lines, separator, mark, [True] * min(fields, max(widths)), last_key + 1)
    if first is None:
        raise DataError(place, "a header but no rows of samples", "Export the samples, not only the header.")
    return Dialect(separator, mark, fields, first, tuple([True] * fields))


def _unit(header: dict[str, list[str]], k: int) -> str | None:
    """`mm (Length)` -> mm; `(None)` -> None."""
    cell = header.get("Unit", [""] * (k + 1))[k] if k < len(header.get("Unit", [])) else ""
    text = re.sub(r"\s*\([^)]*\)\s*$", "", cell).strip()
    return text or None


def _from_ticks(columns: Sequence[Array], header: dict[str, list[str]], clocks: Sequence[int]) -> list[str]:
    """Times in ms in place of 100 ns ticks, which they are when the first one equals the header's start of the export;
    a note if so."""
    times = columns[clocks[0]]
    start = header.get("Starttime of export", ["", ""])[1]
    if is_number(start, ".") and len(times) and float(start) > 1e12 and abs(times[0] / float(start) - 1) < 1e-3:
        begin = times[0]
        for k in clocks:
            columns[k][:] = (columns[k] - begin) * 1e-4
        return ["full time stamps (100 ns ticks): time counted from the first sample"]
    return []


def _scale_notes(header: dict[str, list[str]], names: Sequence[str], clocks: Sequence[int]) -> list[str]:
    """The header's scale may or may not have been applied by the export: it is only mentioned."""
    changed = []
    for key, neutral in (("ScaleFactor", 1.0), ("Offset", 0.0), ("Unit ScaleFactor", 1.0), ("Unit Offset", 0.0)):
        for k, cell in enumerate(header.get(key, [])):
            text = cell.replace(",", ".")
            if k not in clocks and is_number(text, ".") and float(text) != neutral:
                changed.append(f"{names[k]}: {key} {text}")
    if not changed:
        return []
    return [
        f"the header declares scaling ({'; '.join(changed[:4])}); the values are used as they stand in the file "
        "(give `scale` in the mapping if the export was unscaled)"
    ]


READER = Reader(
    "twincat", "TwinCAT Scope: header block of keys, a time column per group; any of its separators", _recognises, _read
)
