"""Which export layout a text file has, and its reading into a Table: generic, elmo and controldesk here."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from linid.errors import DataError
from linid.recording import twincat
from linid.recording.body import Body
from linid.recording.dialect import Dialect, sniff, split
from linid.recording.mapping import ChannelMapping
from linid.recording.names import split_header
from linid.recording.table import Table, Used, make_columns, with_body
from linid.recording.text import TextFile, load_text
from linid.recording.units import find_unit

_NAME_KEYS = ("path", "name", "names", "trace", "trace_names", "signal", "signals", "variable")
_PERIOD_KEY = re.compile(r"(?i)\W*(?:sampl\w*[ _]?(?:time|period|interval)|time[ _]?(?:resolution|base|step)|ts|dt)\b")


def read_table(path: Path, mapping: ChannelMapping, used: Used | None = None) -> Table:
    """Read any supported export; the layout is recognised by its marks unless the mapping names it.

    used: numbers of the columns in use, told from the table before it has values (default: all); of a long file, only
    these are kept.
    """
    if mapping.layout == "mat" or (mapping.layout is None and path.suffix.lower() == ".mat"):
        from linid.recording.mat import read_mat

        return read_mat(path)
    file = load_text(path, mapping.encoding)
    layout = mapping.layout or recognise(file.lines)
    if layout == "twincat":
        return twincat.read(file, mapping, used)
    dialect = sniff(file.lines, str(path), separator=mapping.separator, decimal=mapping.decimal)
    if layout == "controldesk":
        return _controldesk(file, dialect, used)
    return _with_header_line(file, dialect, layout, used)


def recognise(lines: Sequence[str]) -> str:
    """Name of the layout: twincat, controldesk, elmo or generic."""
    head = [line.strip("\ufeff") for line in lines[:200]]
    if twincat.is_twincat(head):
        return "twincat"
    if any(re.search(r'(?i)(?:^|[;,\t"])\s*trace_values\b', line) for line in head):
        return "controldesk"
    if any(re.fullmatch(r"\s*\[[^\[\]]*[A-Za-z][^\[\]]*\]\s*[;,\t]*\s*", line) for line in head):
        return "elmo"
    return "generic"


def _with_header_line(file: TextFile, dialect: Dialect, layout: str, used: Used | None) -> Table:
    """generic and elmo: the names (and perhaps a line of units) stand directly above the data."""
    above = [i for i in range(dialect.first - 1, dialect.skip - 1, -1) if file.lines[i].strip()]
    if layout == "elmo":
        above = [i for i in above if not re.match(r"\s*\[[^\]]*\]\s*[;,\t]*\s*$", file.lines[i])]
    names, units, header = _header(file, dialect, above)
    period = _declared_period(file.lines[: header or dialect.first], dialect) if layout == "elmo" else None
    width = len(names)

    def table(body: Body) -> Table:
        notes = [*file.notes, *body.notes]
        if width < dialect.fields:  # trailing separators leave empty columns without a name
            notes += _drop_unnamed(file, dialect, width)
        columns = make_columns(names, body, dialect.numeric[:width], units=units)
        return Table(
            file.path, layout, columns, file.sha256, file.encoding, dialect.text, header, dialect.first + 1, period,
            tuple(notes),
        )  # fmt: skip

    return with_body(table, file, dialect, used)


def _header(file: TextFile, dialect: Dialect, above: Sequence[int]) -> tuple[list[str], list[str | None] | None, int]:
    """Column names, units of a second header line (or None), and the header's line number (0: none)."""
    if not above:
        return [f"column {k + 1}" for k in range(dialect.fields)], None, 0
    cells = _cells(file.lines[above[0]], dialect)
    units: list[str | None] | None = None
    line = above[0]
    if len(above) > 1 and _is_unit_line(cells) and len(_cells(file.lines[above[1]], dialect)) >= 2:
        units = [_unit_cell(cell) for cell in cells]
        line = above[1]
        cells = _cells(file.lines[line], dialect)
    names = _fit(cells, dialect, f"{file.path}, line {line + 1}", above[0])
    if units is not None:
        units = (units + [None] * len(names))[: len(names)]
    return names, units, line + 1


def _cells(line: str, dialect: Dialect) -> list[str]:
    text = line.lstrip("\ufeff")
    if dialect.separator == " " and re.search(r"\S {2,}|\t", text.strip()):
        return [cell.strip() for cell in re.split(r" {2,}|\t", text.strip())]
    if dialect.separator == " " and "(" in text:
        return re.findall(r"[^\s(\[]+\s*(?:[(\[][^)\]]*[)\]])?", text)
    return split(text, dialect.separator)


def _fit(cells: list[str], dialect: Dialect, place: str, index: int) -> list[str]:
    """Names for the data's columns; empty trailing names belong to trailing separators."""
    while cells and not cells[-1]:
        cells.pop()
    if cells and cells[0].strip() in ("#", "%", "//"):
        cells = cells[1:]
    trailing = sum(1 for _ in _trailing_blank(dialect))
    if not dialect.fields - trailing <= len(cells) <= dialect.fields:
        raise DataError(
            place,
            f"the header has {len(cells)} names, the data below have {dialect.fields - trailing} fields "
            f"({dialect.text})",
            "Repair the header, or check separator and decimal mark.",
        )
    return [cell or f"column {k + 1}" for k, cell in enumerate(cells)]


def _trailing_blank(dialect: Dialect) -> Sequence[int]:
    blank = []
    for k in range(dialect.fields - 1, -1, -1):
        if dialect.numeric[k]:
            break
        blank.append(k)
    return blank


def _drop_unnamed(file: TextFile, dialect: Dialect, width: int) -> list[str]:
    rows = [split(line, dialect.separator) for line in file.lines[dialect.first : dialect.first + 50]]
    filled = any(cell for row in rows for cell in row[width:])
    return [f"columns without a name after column {width} left out"] if filled else []


def _is_unit_line(cells: Sequence[str]) -> bool:
    units = [_unit_cell(cell) for cell in cells if cell]
    return bool(units) and all(u is not None and (find_unit(u) or u in ("", "-", "n/a")) for u in units)


def _unit_cell(cell: str) -> str | None:
    match = re.fullmatch(r"[(\[{]?\s*([^()\[\]{}]*?)\s*[)\]}]?", cell)
    return match[1] if match and match[1] else None


def _declared_period(lines: Sequence[str], dialect: Dialect) -> float | None:
    """Sampling period from a keyed line whose unit is written in the key or after the value."""
    for line in lines:
        cells = [c for c in re.split(rf"[=:{re.escape(dialect.separator)}]", line) if c.strip()]
        if len(cells) < 2 or not _PERIOD_KEY.match(cells[0]):
            continue
        match = re.fullmatch(r"\s*([0-9.,eE+-]+)\s*(\S*)\s*", " ".join(cells[1:3]))
        unit = find_unit(split_header(cells[0])[1] or (match[2] if match else "") or "")
        if match and unit and unit.dimension == "time":
            return float(match[1].replace(",", ".")) * unit.factor
    return None


def _controldesk(file: TextFile, dialect: Dialect, used: Used | None) -> Table:
    """dSPACE ControlDesk: a metadata block, a row of names, the mark `trace_values`, then the rows of samples."""
    mark = next((i for i, line in enumerate(file.lines) if "trace_values" in line.lower()), None)
    if mark is None:
        raise DataError(
            str(file.path), "no `trace_values` line found", "Remove `layout: controldesk` from the mapping."
        )
    rows = {i: split(file.lines[i], dialect.separator) for i in range(mark)}
    names_at = next((i for i in range(mark - 1, -1, -1) if _key(rows[i]) in _NAME_KEYS), None)
    if names_at is None:
        raise DataError(
            f"{file.path}, line {mark + 1}", f"no row of signal names ({' or '.join(_NAME_KEYS[:3])}) above the data",
            "Export again with signal names.",
        )  # fmt: skip
    first = dialect.numeric.index(True)
    names = _from(rows[names_at], first, dialect.fields)
    units_at = next((i for i in range(mark) if _key(rows[i]) in ("unit", "units")), None)
    units = _from(rows[units_at], first, dialect.fields) if units_at is not None else [""] * len(names)
    shown = [name or f"column {first + k + 1}" for k, name in enumerate(names)]
    header = [n.replace("\\", "/").strip("/").split("/")[-1].strip('"') or n for n in shown]

    def table(body: Body) -> Table:
        columns = make_columns(
            header, body, dialect.numeric[first:], first=first, units=[_unit_cell(u) for u in units],
            aliases=[(n,) for n in shown],
        )  # fmt: skip
        return Table(
            file.path, "controldesk", columns, file.sha256, file.encoding, dialect.text, names_at + 1,
            dialect.first + 1, None, (*file.notes, *body.notes),
        )  # fmt: skip

    return with_body(table, file, dialect, used, first=first)


def _key(row: Sequence[str]) -> str:
    return next((cell for cell in row if cell), "").strip().lower()


def _from(row: Sequence[str], first: int, fields: int) -> list[str]:
    return (list(row[first:]) + [""] * fields)[: fields - first]
