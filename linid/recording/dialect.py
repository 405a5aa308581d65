"""The dialect of a text export, voted on its numeric body: separator, decimal mark, where the data begin."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from linid.errors import DataError
from linid.recording.stamps import is_stamp

# Possessive: a row with a blank or cut cell must not be tried in exponentially many ways.
NUMBER = {
    ".": r"[+-]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][+-]?\d++)?",
    ",": r"[+-]?(?:\d++(?:,\d*+)?|,\d++)(?:[eE][+-]?\d++)?",
}
_SUPPORT = 0.5  # of the rows that fit the best reading, which another one must fit too
_AGREEING = 0.9  # of the sampled rows that must have one number of fields
_SHORT = 2000  # lines: of a longer file four places are looked at
_FEW_LINES = 8  # of more, the first quarter may be header and is not sampled
_MOST_SAMPLED = 400  # lines: more cost time and say nothing new
_LONGEST_CELL = 400  # characters; what is longer is no number
LARGEST = 1e30  # of either sign: no channel of a drive holds more, and its square still is a number
_IS_NUMBER = {mark: re.compile(pattern) for mark, pattern in NUMBER.items()}
# Cells that stand for a number that is not there.
_PLACEHOLDER = re.compile(r"|[+-]?(?:nan|inf|infinity)|n/?a|null|none|-+|#.*|\ufffd.*|[+-]?\d[\w.,'+-]*", re.IGNORECASE)
_DATE = re.compile(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}(?:[T ]\d{1,2}:\d{2}\S*)?|\d{1,2}:\d{2}(?::\d{2}\S*)?")
_NAMES = {";": "semicolon", "\t": "tab", ",": "comma", " ": "blanks", ":": "colon", "|": "bar"}
SEPARATORS = (";", "\t", ",", "|")
_SEPARATED = re.compile(r"\d *+[;\t]|[;\t] *+\d")
_GROUPED = re.compile(r"[+-]?\d{1,3}(?:([.,' \u00a0\u202f])\d{3})+(?:[.,]\d+)?")


@dataclass(frozen=True)
class Dialect:
    """How the body is written: fields per row, index (from 0) of the first data line, numeric columns; stamps: columns
    of clock times or dates."""

    separator: str
    decimal: str
    fields: int
    first: int
    numeric: tuple[bool, ...]
    skip: int = 0
    stamps: tuple[int, ...] = ()

    @property
    def readable(self) -> tuple[bool, ...]:
        """Which columns hold numbers, or times that become numbers."""
        return tuple(is_numeric or k in self.stamps for k, is_numeric in enumerate(self.numeric))

    @property
    def text(self) -> str:
        """In words."""
        mark = "comma" if self.decimal == "," else "point"
        return f"separator {named(self.separator)}, decimal {mark}"


def named(separator: str) -> str:
    """A separator in words."""
    return _NAMES.get(separator, repr(separator))


def split(line: str, separator: str) -> list[str]:
    """Cells of a line, stripped and without quotes."""
    if '"' in line:
        try:
            cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
        except csv.Error:
            cells = line.split(separator)
        if separator == " ":
            cells = [cell for cell in cells if cell]
    elif separator == " ":
        cells = line.split()
    else:
        cells = line.split(separator)
    return [cell.strip() for cell in cells]


def is_number(cell: str, decimal: str) -> bool:
    """Whether the whole cell is one number written with this decimal mark."""
    return len(cell) <= _LONGEST_CELL and bool(_IS_NUMBER[decimal].fullmatch(cell))


def to_float(cell: str, decimal: str) -> float:
    """The number in a cell, or nan."""
    return float(cell.replace(",", ".")) if is_number(cell, decimal) else float("nan")


def sniff(lines: Sequence[str], place: str, *, separator: str | None = None, decimal: str | None = None) -> Dialect:
    """Vote for the dialect of a text export; raises DataError when there is no numeric body or two readings are
    possible.

    separator, decimal: given by the mapping instead of sniffed.
    """
    skip = 0
    hint = re.fullmatch(r'\ufeff?"?sep=(.)"?', lines[0].strip("\r\n ")) if lines else None
    if lines and lines[0].strip().lower() in ("sep=", '"sep='):
        hint = re.fullmatch(r"(?i)sep=(\t)", lines[0])
    if hint:
        skip, separator = 1, separator or (hint[1] if hint[1] in _NAMES else None)
    sample = [lines[i] for i in _sample(lines, skip)]
    marks = [decimal] if decimal else [".", ","]
    found = _readings(lines, sample, [separator] if separator else SEPARATORS, marks, skip)
    if not found and separator is None:
        found = _readings(lines, sample, [" "], marks, skip)
    several = [d for d in found if d.fields > 1]
    found = several or found
    if not found:
        raise _no_body(lines, place, skip)
    separators = {d.separator for d in found if d.fields > 1}
    if len(separators) > 1:
        names = " or ".join(named(s) for s in separators)
        raise DataError(place, f"ambiguous separator: {names} both fit the data", "Give `separator:` in the mapping.")
    best = found[0]  # point before comma: with whole numbers only, both marks fit and mean the same
    _refuse_comma_comma(lines, best, place)
    return best


def _readings(
    lines: Sequence[str], sample: Sequence[str], separators: Sequence[str], marks: Sequence[str], skip: int
) -> list[Dialect]:
    """The dialects that fit, without those that fit a small part of the rows that another one does."""
    found = []
    data: dict[tuple[str, str], list[list[str]]] = {}  # rows by separator and mark; absent separators give the same
    for sep in separators:
        present = sep if any(sep in line for line in sample) else ""
        for mark in marks:
            if (present, mark) not in data:
                rows = (split(line, sep) for line in sample)
                data[present, mark] = [row for row in rows if _looks_like_data(row, mark)]
            if one := _try(lines, data[present, mark], sep, mark, skip):
                found.append(one)
    most = max((votes for _, votes in found), default=0)
    return [dialect for dialect, votes in found if votes >= _SUPPORT * most]


def _try(
    lines: Sequence[str], rows: Sequence[list[str]], separator: str, decimal: str, skip: int
) -> tuple[Dialect, int] | None:
    """The dialect with this separator and mark and how many of the sampled rows of data it fits, if at least 90 % of
    them agree on the field count."""
    if not rows:
        return None
    count, votes = Counter(len(row) for row in rows).most_common(1)[0]
    if votes < _AGREEING * len(rows) and len(rows) - votes > 1:
        return None
    # The top rows too: a slower time group fills its columns only there.
    top = [split(line, separator) for line in lines[skip : skip + 60]]
    rows = [row for row in [*rows, *(r for r in top if _looks_like_data(r, decimal))] if len(row) == count]
    numeric = tuple(_is_numeric([row[k] for row in rows], decimal) for k in range(count))
    if not any(numeric):
        return None
    first = first_data_line(lines, separator, decimal, numeric, skip)
    stamps = tuple(k for k in range(count) if not numeric[k] and _is_stamped([row[k] for row in rows]))
    return None if first is None else (Dialect(separator, decimal, count, first, numeric, skip, stamps), votes)


def _is_numeric(cells: Sequence[str], decimal: str) -> bool:
    filled = [cell for cell in cells if cell]
    return sum(is_number(cell, decimal) for cell in filled) > 0.5 * len(filled)


def _is_stamped(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell]
    return sum(map(is_stamp, filled)) > 0.5 * len(filled)


def _sample(lines: Sequence[str], skip: int) -> list[int]:
    filled = [i for i in range(skip, len(lines)) if lines[i].strip()] if len(lines) < _SHORT else None
    if filled is not None:
        filled = filled[len(filled) // 4 :] if len(filled) > _FEW_LINES else filled
        return (
            filled if len(filled) <= _MOST_SAMPLED else filled[:100] + filled[len(filled) // 2 :][:200] + filled[-100:]
        )
    middle = [len(lines) * part // 8 for part in (1, 2, 4, 6)]
    return [i for start in middle for i in range(start, start + 75) if lines[i].strip()]


def _looks_like_data(row: Sequence[str], decimal: str) -> bool:
    """More numbers than words, and no cell that shows another separator or decimal mark."""
    rest = [cell for cell in row if not is_number(cell, decimal)]
    if not rest or len(rest) == len(row):  # as nearly all rows are: all numbers, or none
        return len(rest) < len(row)
    holes = sum(1 for cell in rest if _PLACEHOLDER.fullmatch(cell) or _DATE.fullmatch(cell))
    return len(row) - len(rest) > len(rest) - holes and not any(_broken(cell, decimal) for cell in rest)


def _broken(cell: str, decimal: str) -> bool:
    # A number with the other decimal mark, or another separator inside a cell, shows that this reading is wrong.
    other = "," if decimal == "." else "."
    if is_grouped(cell):
        return True
    return (is_number(cell, other) and not is_number(cell, decimal)) or bool(_SEPARATED.search(cell))


def first_data_line(
    lines: Sequence[str], separator: str, decimal: str, numeric: Sequence[bool], skip: int = 0
) -> int | None:
    """Index of the first line whose cells are numbers (or placeholders) in the numeric columns."""
    wanted = [k for k, is_numeric in enumerate(numeric) if is_numeric]
    for i in range(skip, len(lines)):
        row = split(lines[i], separator)
        if len(row) < len(numeric) - 1:
            continue
        cells = [row[k] for k in wanted if k < len(row)]
        good = sum(is_number(cell, decimal) for cell in cells)
        if good >= max(1, len(wanted) / 2) and all(_PLACEHOLDER.fullmatch(c) or is_number(c, decimal) for c in cells):
            return i
    return None


def _refuse_comma_comma(lines: Sequence[str], dialect: Dialect, place: str) -> None:
    """A comma that may separate fields or mark decimals shows in a header with fewer names than the data."""
    if dialect.separator != "," or dialect.first == 0 or '"' in lines[dialect.first]:
        return
    header = next((lines[i] for i in range(dialect.first - 1, -1, -1) if lines[i].strip()), "")
    names = [cell for cell in split(header, ",") if cell]
    row = split(lines[dialect.first], ",")
    row = row[:-1] if row and not row[-1] else row
    if names and len(names) < len(row) <= 2 * len(names) and not any(re.search(r"[.eE]", cell) for cell in row):
        raise DataError(
            f"{place}, line {dialect.first + 1}",
            f"ambiguous commas: the header has {len(names)} fields, the data {len(row)}; the comma seems to be both "
            "separator and decimal mark",
            "Export with semicolon or tab as separator, or with a decimal point.",
        )


def _no_body(lines: Sequence[str], place: str, skip: int) -> DataError:
    """Why no dialect fits: no numbers at all, mixed decimal marks, grouped thousands or changing field counts."""
    with_digits = [i for i in range(skip, len(lines)) if re.match(r'\s*"?[+-]?[.,]?\d', lines[i])]
    if not with_digits:
        filled = sum(1 for line in lines if line.strip())
        return DataError(
            place,
            f"found {filled} line{'s' * (filled != 1)} of text but no line of numbers",
            "Export the samples, not only the header.",
        )
    where = f"{place}, line {with_digits[0] + 1}"
    best = max((";", "\t", ","), key=lambda s: sum(lines[i].count(s) for i in with_digits[:50]))
    cells = [cell for i in with_digits[:200] for cell in split(lines[i], best)]
    grouped = next((c for c in cells if is_grouped(c)), None)
    if grouped:
        return thousands_error(where, grouped)
    points = next((c for c in cells if _broken(c, ",")), None)
    commas = next((c for c in cells if _broken(c, ".")), None)
    if points and commas:
        return DataError(
            where, f"mixed decimal marks: '{points}' and '{commas}'", "Export again with one decimal mark."
        )
    counts = Counter(len(split(lines[i], best)) for i in with_digits)
    listed = ", ".join(f"{n} fields in {times} lines" for n, times in counts.most_common(4))
    return DataError(
        where,
        f"no separator gives a constant number of fields (with {named(best)}: {listed})",
        "If the comma is the decimal mark, export with semicolon or tab as separator.",
    )


def is_grouped(cell: str) -> bool:
    """Whether a cell is a number with digit grouping that cannot be read otherwise (1.234,5; 1,234,567; 1'234)."""
    match = _GROUPED.fullmatch(cell) if len(cell) <= _LONGEST_CELL else None
    return bool(match) and not is_number(cell, ".") and not is_number(cell, ",")


def thousands_error(place: str, cell: str) -> DataError:
    """The refusal of digit grouping."""
    return DataError(place, f"number with thousands separators: '{cell}'", "Switch off digit grouping in the export.")
