"""What stands above the samples of a text export: names, units, a declared sampling period."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from linid.errors import DataError
from linid.recording.dialect import Dialect, is_number, split, to_float
from linid.recording.names import split_header
from linid.recording.text import TextFile
from linid.recording.units import find_unit

_PERIOD_KEY = re.compile(
    r"(?i)\W*(?:sampl\w*[ _]?(?:time|period|interval)|time[ _]?(?:resolution|base|step|interval)|delta[ _]?[xt]|ts|dt)"
    r"(?:\b|_)"
)
_RATE_KEY = re.compile(r"(?i)\W*(?:sampl\w*[ _]?(?:rate|freq\w*)|sample rate)\b")
_UNIT_KEY = re.compile(r"(?i)\W*(?:[xy]?_?units?(?:_?labels?)?|einheit(?:en)?)\W*")
_HERTZ = {"hz": 1.0, "khz": 1e3, "1/s": 1.0, "s/s": 1.0, "samples/s": 1.0, "mhz": 1e6}
_LONGEST = 2000  # characters of a header line that are looked at for a period


@dataclass(frozen=True)
class Header:
    """names: of the columns; units: their texts from a line of units, or None; line: of the names (from 1, 0: none);
    notes: what was noticed."""

    names: list[str]
    units: list[str | None] | None
    line: int
    notes: tuple[str, ...] = ()


def header_of(file: TextFile, dialect: Dialect, above: Sequence[int]) -> Header:
    """Names and units from the filled lines above the samples, the lowest one first.

    A line with another number of names than the samples have fields names nothing: the columns then go by number, so
    that only a mapping can say what they are. Raises DataError where a header of names has another number of them.
    """
    if not above:
        return Header([f"column {k + 1}" for k in range(dialect.fields)], None, 0)
    cells = _cells(file.lines[above[0]], dialect)
    units: list[str | None] | None = None
    line = above[0]
    if len(above) > 1 and _is_unit_line(cells) and len(_cells(file.lines[above[1]], dialect)) >= 2:
        units = _units(cells, dialect)
        line = above[1]
        cells = _cells(file.lines[line], dialect)
    elif (found := _unit_row(file, dialect, above[1:8], len(cells))) is not None:
        units = found
    names = _fitting(cells, dialect)
    if names is None:
        if _is_text(cells):
            return _unnamed(file, dialect, above[0], len(cells))
        raise DataError(
            f"{file.path}, line {line + 1}",
            f"the header has {len(cells)} names, the data below have {dialect.fields - _trailing(dialect)} fields "
            f"({dialect.text})",
            "Repair the header, or check separator and decimal mark.",
        )
    if units is not None:
        units = (units + [None] * len(names))[: len(names)]
    return Header(names, units, line + 1)


def _unnamed(file: TextFile, dialect: Dialect, line: int, count: int) -> Header:
    shown = file.lines[line].strip()[:60]
    return Header(
        [f"column {k + 1}" for k in range(dialect.fields)],
        None,
        0,
        (
            f"line {line + 1} ('{shown}') has {count} name{'s' * (count != 1)}, the data below have {dialect.fields} "
            "fields: the columns go by number",
        ),
    )


def _is_text(cells: Sequence[str]) -> bool:
    """A single heading, rather than names that do not fit the fields."""
    return len([cell for cell in cells if cell]) <= 1


def declared_period(lines: Sequence[str], dialect: Dialect) -> float | None:
    """Sampling period in s from a keyed line whose unit is written in the key or after the value, or from a rate."""
    for line in lines:
        cells = [c for c in re.split(rf"[=:{re.escape(dialect.separator)}]", line[:_LONGEST]) if c.strip()]
        if len(cells) < 2:
            continue
        key = cells[0].strip().strip('"')
        period, rate = _PERIOD_KEY.match(key), _RATE_KEY.match(key)
        same = len(cells) > 2 and cells[2].strip() == cells[1].strip()  # one for each channel
        match = re.fullmatch(r'\s*"?\s*([0-9.,eE+-]+)\s*(\S*?)"?\s*', " ".join(cells[1 : 2 if same else 3]))
        if not match or not (period or rate):
            continue
        mark = "," if "," in match[1] else "."
        value = to_float(match[1], mark) if is_number(match[1], mark) else 0.0
        text = split_header(key)[1] or match[2] or ""
        unit = find_unit(text)
        if period and value > 0 and unit and unit.dimension == "time":
            return value * unit.factor
        if period and value > 0 and not text and re.match(r"(?i)\W*delta[ _]?x", key):
            return value  # LabVIEW's measurement files: seconds by definition
        if rate and value > 0 and (text.lower() in _HERTZ or not text):
            return 1.0 / (value * _HERTZ.get(text.lower(), 1.0))
    return None


def _cells(line: str, dialect: Dialect) -> list[str]:
    text = line.lstrip("\ufeff")
    if dialect.separator == " " and re.search(r"\S {2,}|\t", text.strip()):
        return [cell.strip() for cell in re.split(r" {2,}|\t", text.strip())]
    if dialect.separator == " " and "(" in text:
        return re.findall(r"[^\s(\[]+\s*(?:[(\[][^)\]]*[)\]])?", text)
    return split(text, dialect.separator)


def _fitting(cells: list[str], dialect: Dialect) -> list[str] | None:
    """Names for the data's columns, None where their number is another; empty trailing names belong to trailing
    separators."""
    while cells and not cells[-1]:
        cells.pop()
    if cells and cells[0].strip() in ("#", "%", "//"):
        cells = cells[1:]
    if len(cells) == dialect.fields + 1 and cells[-1].lower() in ("comment", "comments"):
        cells = cells[:-1]  # LabVIEW's last column, which its rows leave away
    if not dialect.fields - _trailing(dialect) <= len(cells) <= dialect.fields:
        return None
    return [cell or f"column {k + 1}" for k, cell in enumerate(cells)]


def _trailing(dialect: Dialect) -> int:
    """How many of the last columns hold nothing that can be read."""
    count = 0
    while count < dialect.fields and not dialect.readable[dialect.fields - 1 - count]:
        count += 1
    return count


def _is_unit_line(cells: Sequence[str]) -> bool:
    """Whether a line holds units: all short, most of them known."""
    filled = [cell for cell in cells if cell]
    texts = [unit_cell(cell) for cell in filled]
    known = sum(1 for text in texts if text is not None and (find_unit(text) or text in ("-", "n/a")))
    return bool(filled) and known >= 0.6 * len(filled) and all(len(cell) <= 14 for cell in filled)


def _units(cells: Sequence[str], dialect: Dialect) -> list[str | None]:
    if cells and cells[0].strip() in ("#", "%", "//"):
        cells = cells[1:]
    del dialect
    return [unit_cell(cell) for cell in cells]


def _unit_row(file: TextFile, dialect: Dialect, above: Sequence[int], width: int) -> list[str | None] | None:
    """Units from a keyed row higher up (`Unit;ms;mm`, LabVIEW's `Y_Unit_Label`), as long as the names."""
    for i in above:
        cells = _cells(file.lines[i], dialect)
        if len(cells) >= 2 and _UNIT_KEY.fullmatch(cells[0]) and _is_unit_line(cells[1:]):
            # The key stands over the column of times, or before all columns.
            texts = [unit_cell(cell) for cell in cells]
            return [None, *texts[1:]] if len(cells) <= width else texts[1:]
    return None


def unit_cell(cell: str) -> str | None:
    """The unit that a cell holds, with or without brackets around it."""
    match = re.fullmatch(r"[(\[{]?\s*([^()\[\]{}]*?)\s*[)\]}]?", cell[:60])
    return match[1] if match and match[1] else None
