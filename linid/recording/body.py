"""The numeric body of a text export -> array: fast for clean files, line by line where something is wrong."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from linid.arrays import Array
from linid.errors import DataError
from linid.recording.dialect import LARGEST, NUMBER, Dialect, is_grouped, is_number, split, thousands_error, to_float
from linid.recording.pieces import texts
from linid.recording.stamps import StampClock

Integers = np.ndarray[tuple[int], np.dtype[np.int64]]
# What pandas, whose import takes as long as reading ten recordings, is not needed for; numpy takes longer per cell.
_SHORT = 2_000_000  # characters
_POINTS, _COMMAS = re.compile(r"[0-9eE+\-., \t;\n]*+"), re.compile(r"[0-9eE+\-, \t;\n]*+")
_BAD_SHARE = 0.01  # more unusable rows than this is no isolated damage


@dataclass(frozen=True)
class Body:
    """columns: per field (n,) values with nan where no number (empty: not kept); lines: (n,) line numbers from 1;
    ends: per field the rows up to its last number; bad: {(row, column): text} of the kept columns."""

    columns: tuple[Array, ...]
    lines: Integers
    ends: tuple[int, ...]
    bad: dict[tuple[int, int], str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def read_body(
    lines: Sequence[str],
    dialect: Dialect,
    place: str,
    *,
    short_rows: bool = False,
    wanted: Collection[int] | None = None,
) -> Body:
    """All data rows from `dialect.first` on, a piece of the file at a time.

    short_rows: rows may end early (a slower time group has fewer samples); wanted: the columns to keep (default: all).
    Raises DataError for a second header, too many rows with a wrong field count, or digit grouping.
    """
    end, notes = _end_of_data(lines, dialect, place)
    total = end - dialect.first
    kept = [k for k in range(dialect.fields) if wanted is None or k in wanted]
    columns = [np.full(total if k in kept else 0, np.nan) for k in range(dialect.fields)]
    clocks = {k: StampClock() for k in dialect.stamps if k in kept}
    if _all_clean(lines, dialect, end, columns, kept, clocks):
        return Body(tuple(columns), np.arange(dialect.first + 1, end + 1), (total,) * dialect.fields, {}, tuple(notes))
    # What the first pass has filled is filled again; its clocks have moved on.
    rows = _Rows(dialect, place, short_rows, kept, {k: StampClock() for k in clocks})
    return _careful(lines, end, columns, notes, rows)


def _all_clean(
    lines: Sequence[str],
    dialect: Dialect,
    end: int,
    columns: list[Array],
    kept: list[int],
    clocks: Mapping[int, StampClock],
) -> bool:
    """Fill the kept columns by the C parser; False when anything in the file is unusual."""
    lead = lines[dialect.first]  # the parser takes the number of fields from the first line that it sees
    for first, stop, text in texts(lines, dialect.first, end):
        led = int(first > dialect.first)
        numbers = _fast(f"{lead}\n{text}" if led else text, stop - first + led, dialect, '"' in lead, clocks)
        if numbers is None:
            return False
        for k in kept:
            if k in numbers:
                columns[k][first - dialect.first : stop - dialect.first] = numbers[k][led:]
    return True


def _end_of_data(lines: Sequence[str], dialect: Dialect, place: str) -> tuple[int, list[str]]:
    """Index after the last data line; what follows it is counted in a note."""
    end = len(lines)
    while end > dialect.first and not _has_number(lines[end - 1], dialect):
        end -= 1
    tail = [i for i in range(end, len(lines)) if lines[i].strip()]
    if not tail:
        return end, []
    shown = lines[tail[0]].strip()[:40]
    if len(tail) == 1 and re.fullmatch(r"\W*(?:EOF|END|ENDE)\W*", shown, re.IGNORECASE):
        return end, [f"end-of-file marker '{shown}' in line {tail[0] + 1} skipped"]
    return end, [
        f"{len(tail)} line{'s' * (len(tail) > 1)} of text after the data left out (line {tail[0] + 1}: '{shown}')"
    ]


def _has_number(line: str, dialect: Dialect) -> bool:
    return any(is_number(cell, dialect.decimal) for cell in split(line, dialect.separator))


def _plain(text: str, rows: int, dialect: Dialect) -> dict[int, Array] | None:
    """The columns of a short text of nothing but ASCII numbers, or None for any other."""
    point = dialect.decimal == "."
    if len(text) > _SHORT or not all(dialect.numeric) or not (_POINTS if point else _COMMAS).fullmatch(text):
        return None
    if not point:
        text = text.replace(",", ".")
    separator = None if dialect.separator == " " else dialect.separator
    try:
        table = np.loadtxt(text.split("\n"), delimiter=separator, comments=None, ndmin=2)
    except ValueError:
        return None
    if table.shape != (rows, dialect.fields) or not np.abs(table).max() <= LARGEST:
        return None
    return dict(enumerate(np.ascontiguousarray(table.T)))


def _fast(
    text: str, rows: int, dialect: Dialect, quoted: bool, clocks: Mapping[int, StampClock]
) -> dict[int, Array] | None:
    """The numeric columns of some rows by the C parser, or None when anything in them is unusual."""
    plain = _plain(text, rows, dialect)
    if plain is not None:
        return plain
    import pandas as pd

    # The default rounds correctly since pandas 3.1, where the argument is deprecated.
    version = tuple(int(part) for part in pd.__version__.split(".")[:2])
    exact: dict[str, Any] = {} if version >= (3, 1) else {"float_precision": "round_trip"}
    try:
        frame = pd.read_csv(
            io.StringIO(text),
            sep=r"\s+" if dialect.separator == " " else dialect.separator,
            decimal=dialect.decimal,
            header=None,
            dtype={k: np.float64 if numeric else str for k, numeric in enumerate(dialect.numeric)},
            keep_default_na=False,
            na_values=[""],
            skip_blank_lines=False,
            skipinitialspace=True,
            low_memory=False,
            quoting=csv.QUOTE_MINIMAL if quoted else csv.QUOTE_NONE,
            **exact,
        )
    except (ValueError, pd.errors.ParserError, OverflowError):
        return None
    if frame.shape != (rows, dialect.fields):
        return None
    numbers = {k: frame[k].to_numpy() for k, numeric in enumerate(dialect.numeric) if numeric}
    numbers |= {k: clock.seconds(frame[k].to_list()) for k, clock in clocks.items()}
    # A nan is neither above nor below.
    return numbers if all(x.max() <= LARGEST and x.min() >= -LARGEST for x in numbers.values()) else None


def _clean_row(dialect: Dialect) -> re.Pattern[str]:
    """Pattern of a row with nothing unusual in its numeric columns."""
    blanks = dialect.separator == " "
    # Possessive, and no blank that could also be a separator: tried in one way only.
    number = rf'"?{NUMBER[dialect.decimal]}"?' if blanks else rf' *+"?{NUMBER[dialect.decimal]}"? *+'
    sep = r"\s++" if blanks else re.escape(dialect.separator)
    anything = r"\S++" if blanks else rf"[^{re.escape(dialect.separator)}]*+"
    row = sep.join(number if numeric else anything for numeric in dialect.numeric)
    return re.compile(rf"\s*+{row}\s*" if blanks else row)


def _careful(lines: Sequence[str], end: int, columns: list[Array], notes: list[str], rows: _Rows) -> Body:
    """Fill the kept columns with what is clean by the C parser and with the rest line by line."""
    dialect = rows.dialect
    clean = _clean_row(dialect).fullmatch
    numbers = np.empty(end - dialect.first, dtype=np.int64)
    ends = [0] * dialect.fields
    quoted = '"' in lines[dialect.first]
    at = 0  # rows kept so far
    for first, _, text in texts(lines, dialect.first, end):
        body = text.split("\n")
        is_clean = np.fromiter((clean(line) is not None for line in body), dtype=bool, count=len(body))
        good = None
        if is_clean.any():
            plain = "\n".join(line for line, ok in zip(body, is_clean, strict=True) if ok)
            good = _fast(plain, int(is_clean.sum()), dialect, quoted, rows.clocks)
        if good is None:
            is_clean[:] = False
        values = np.full((len(body), dialect.fields), np.nan)
        for k, x in (good or {}).items():
            values[is_clean, k] = x
        keep = np.ones(len(body), dtype=bool)
        dropped = 0
        for i in np.flatnonzero(~is_clean).tolist():
            row = rows.read(body[i], first + i + 1, at + i - dropped)
            if row is None:
                keep[i], dropped = False, dropped + 1
            else:
                values[i] = row
        values = values[keep]
        after = at + len(values)
        for k in rows.kept:
            columns[k][at:after] = values[:, k]
        numbers[at:after] = first + 1 + np.flatnonzero(keep)
        for k in range(dialect.fields):
            filled = np.flatnonzero(np.isfinite(values[:, k]))
            if len(filled):
                ends[k] = at + int(filled[-1]) + 1
        at = after
    rows.refuse_if_too_many(len(numbers), end)
    return Body(
        tuple(column[:at] for column in columns), numbers[:at], tuple(ends), rows.bad, (*notes, *rows.notes(end))
    )


class _Rows:
    """Reads unusual rows one by one and counts what was wrong, by line number (from 1)."""

    def __init__(
        self, dialect: Dialect, place: str, short_rows: bool, kept: Collection[int], clocks: Mapping[int, StampClock]
    ) -> None:
        self.dialect, self.place, self.short_rows, self.kept = dialect, place, short_rows, kept
        self.clocks = clocks
        self.bad: dict[tuple[int, int], str] = {}
        self.blank = 0
        self.wrong: list[tuple[int, int]] = []

    def read(self, text: str, line: int, row: int) -> list[float] | None:
        """The numbers of a line that becomes row `row`, or None when it has to be left out."""
        dialect = self.dialect
        if not text.strip():
            self.blank += 1
            return None
        cells = split(text, dialect.separator)
        while len(cells) > dialect.fields and not cells[-1]:
            cells.pop()
        self._refuse_header(cells, line)
        if len(cells) < dialect.fields and self.short_rows:
            cells += [""] * (dialect.fields - len(cells))
        if len(cells) != dialect.fields:
            grouped = next((c for c in cells if is_grouped(c)), None)
            if grouped:
                raise thousands_error(self._line(line), grouped)
            self.wrong.append((line, len(cells)))
            return None
        return [
            self._value(cells[k], line, row, k)
            if dialect.numeric[k]
            else self._stamp(cells[k], row, k)
            if k in self.clocks
            else np.nan
            for k in range(dialect.fields)
        ]

    def _stamp(self, cell: str, row: int, k: int) -> float:
        value = float(self.clocks[k].seconds([cell])[0])
        if cell and not np.isfinite(value):
            self.bad[row, k] = cell
        return value

    def _value(self, cell: str, line: int, row: int, k: int) -> float:
        if is_number(cell, self.dialect.decimal):
            value = to_float(cell, self.dialect.decimal)
            if abs(value) <= LARGEST:
                return value
        elif is_grouped(cell):
            raise thousands_error(f"{self._line(line)}, column {k + 1}", cell)
        if cell and k in self.kept:
            self.bad[row, k] = cell
        return float("nan")

    def _line(self, line: int) -> str:
        return f"{self.place}, line {line}"

    def _refuse_header(self, cells: list[str], line: int) -> None:
        words = [
            c for c in cells if re.match(r"[A-Za-zÄÖÜäöü]{2}", c) and c.lower() not in ("nan", "inf", "null", "none")
        ]
        if len(words) > len(cells) / 2 and not any(is_number(c, self.dialect.decimal) for c in cells):
            raise DataError(
                self._line(line),
                f"text in the middle of the data: '{' '.join(cells)[:60]}' (a second header?)",
                "Split the file there into one recording per file.",
            )

    def refuse_if_too_many(self, total: int, last: int) -> None:
        """More than 1 % unusable rows (and more than the last one, in line `last`) means a misread or damaged file."""
        wrong = [w for w in self.wrong if w[0] != last]
        if len(wrong) > max(1, _BAD_SHARE * total):
            line, found = wrong[0]
            raise DataError(
                self._line(line),
                f"{len(wrong)} of {total} rows have a wrong number of fields; the first has {found}, "
                f"expected {self.dialect.fields}",
                "Repair or export the file again; check separator and decimal mark.",
            )

    def notes(self, last: int) -> list[str]:
        """What was left out, with the lines; last: the last line of the data."""
        notes = []
        if self.blank:
            notes.append(f"{self.blank} blank line{'s' * (self.blank > 1)} inside the data skipped")
        inside = [line for line, _ in self.wrong if line != last]
        if self.wrong and self.wrong[-1][0] == last:
            found = self.wrong[-1][1]
            notes.append(f"last row (line {last}) is cut short ({found} of {self.dialect.fields} fields) and left out")
        if inside:
            s = "s" * (len(inside) > 1)
            listed = ", ".join(str(line) for line in inside[:5])
            notes.append(f"{len(inside)} row{s} with a wrong number of fields left out (line{s} {listed})")
        return notes
