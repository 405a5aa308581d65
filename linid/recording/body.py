"""The numeric body of a text export -> array: fast for clean files, line by line where something is wrong."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from linid.errors import DataError
from linid.recording.dialect import NUMBER, Dialect, is_grouped, is_number, split, thousands_error, to_float
from linid.recording.recording import Array

_BAD_SHARE = 0.01  # more unusable rows than this is no isolated damage


@dataclass(frozen=True)
class Body:
    """values: (n, fields), nan where no number; lines: (n,) line numbers from 1; bad: {(row, column): text}."""

    values: Array
    lines: np.ndarray[tuple[int], np.dtype[np.int64]]
    bad: dict[tuple[int, int], str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def read_body(lines: Sequence[str], dialect: Dialect, place: str, *, short_rows: bool = False) -> Body:
    """All data rows from `dialect.first` on.

    short_rows: rows may end early (a slower time group has fewer samples).
    Raises DataError for a second header, too many rows with a wrong field count, or digit grouping.
    """
    end, notes = _end_of_data(lines, dialect, place)
    body = lines[dialect.first : end]
    values = _fast(body, dialect)
    if values is not None:
        numbers = np.arange(dialect.first + 1, end + 1)
        return Body(values, numbers, {}, tuple(notes))
    return _careful(body, dialect, place, notes, short_rows)


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


def _fast(body: Sequence[str], dialect: Dialect) -> Array | None:
    """The body by the C parser, or None when anything in it is unusual."""
    import pandas as pd

    has_quotes = '"' in body[0]
    # The default rounds correctly since pandas 3.1, where the argument is deprecated.
    version = tuple(int(part) for part in pd.__version__.split(".")[:2])
    exact: dict[str, Any] = {} if version >= (3, 1) else {"float_precision": "round_trip"}
    try:
        frame = pd.read_csv(
            io.StringIO("\n".join(body)),
            sep=r"\s+" if dialect.separator == " " else dialect.separator,
            decimal=dialect.decimal,
            header=None,
            dtype={k: np.float64 if numeric else str for k, numeric in enumerate(dialect.numeric)},
            keep_default_na=False,
            na_values=[""],
            skip_blank_lines=False,
            skipinitialspace=True,
            quoting=csv.QUOTE_MINIMAL if has_quotes else csv.QUOTE_NONE,
            **exact,
        )
    except (ValueError, pd.errors.ParserError, OverflowError):
        return None
    if frame.shape != (len(body), dialect.fields):
        return None
    values = np.full(frame.shape, np.nan)
    for k, numeric in enumerate(dialect.numeric):
        if numeric:
            values[:, k] = frame[k].to_numpy()
    good = values[:, list(dialect.numeric)]
    return values if bool(np.isfinite(good).all()) else None


def _clean_row(dialect: Dialect) -> re.Pattern[str]:
    """Pattern of a row with nothing unusual in its numeric columns."""
    number = rf'\s*"?{NUMBER[dialect.decimal]}"?\s*'
    sep = r"\s+" if dialect.separator == " " else re.escape(dialect.separator)
    anything = rf"[^{re.escape(dialect.separator)}]*"
    return re.compile(sep.join(number if numeric else anything for numeric in dialect.numeric))


def _careful(body: Sequence[str], dialect: Dialect, place: str, notes: list[str], short_rows: bool) -> Body:
    clean = _clean_row(dialect).fullmatch
    is_clean = np.fromiter((clean(line) is not None for line in body), dtype=bool, count=len(body))
    good = _fast([line for line, ok in zip(body, is_clean, strict=True) if ok], dialect) if is_clean.any() else None
    if good is None:
        is_clean[:] = False
    values = np.full((len(body), dialect.fields), np.nan)
    if good is not None:
        values[is_clean] = good
    keep = np.ones(len(body), dtype=bool)
    rows = _Rows(dialect, place, short_rows)
    for i in np.flatnonzero(~is_clean):
        row = rows.read(body, int(i))
        if row is None:
            keep[i] = False
        else:
            values[i] = row
    rows.refuse_if_too_many(len(body))
    new_index = np.cumsum(keep) - 1
    bad = {(int(new_index[r]), c): text for (r, c), text in rows.bad.items() if keep[r]}
    lines = np.flatnonzero(keep) + dialect.first + 1
    return Body(values[keep], lines, bad, (*notes, *rows.notes(len(body))))


class _Rows:
    """Reads unusual rows one by one and counts what was wrong."""

    def __init__(self, dialect: Dialect, place: str, short_rows: bool) -> None:
        self.dialect, self.place, self.short_rows = dialect, place, short_rows
        self.bad: dict[tuple[int, int], str] = {}
        self.blank: list[int] = []
        self.wrong: list[tuple[int, int]] = []

    def read(self, body: Sequence[str], i: int) -> list[float] | None:
        """The numbers of row i, or None when the row has to be left out."""
        dialect = self.dialect
        line = body[i]
        if not line.strip():
            self.blank.append(i)
            return None
        cells = split(line, dialect.separator)
        while len(cells) > dialect.fields and not cells[-1]:
            cells.pop()
        self._refuse_header(cells, i)
        if len(cells) < dialect.fields and self.short_rows:
            cells += [""] * (dialect.fields - len(cells))
        if len(cells) != dialect.fields:
            grouped = next((c for c in cells if is_grouped(c)), None)
            if grouped:
                raise thousands_error(self._line(i), grouped)
            self.wrong.append((i, len(cells)))
            return None
        return [self._value(cells[k], i, k) if dialect.numeric[k] else np.nan for k in range(dialect.fields)]

    def _value(self, cell: str, i: int, k: int) -> float:
        if is_number(cell, self.dialect.decimal):
            value = to_float(cell, self.dialect.decimal)
            if np.isfinite(value):
                return value
        elif is_grouped(cell):
            raise thousands_error(f"{self._line(i)}, column {k + 1}", cell)
        if cell:
            self.bad[i, k] = cell
        return float("nan")

    def _line(self, i: int) -> str:
        return f"{self.place}, line {self.dialect.first + i + 1}"

    def _refuse_header(self, cells: list[str], i: int) -> None:
        words = [
            c for c in cells if re.match(r"[A-Za-zÄÖÜäöü]{2}", c) and c.lower() not in ("nan", "inf", "null", "none")
        ]
        if len(words) > len(cells) / 2 and not any(is_number(c, self.dialect.decimal) for c in cells):
            raise DataError(
                self._line(i),
                f"text in the middle of the data: '{' '.join(cells)[:60]}' (a second header?)",
                "Split the file there into one recording per file.",
            )

    def refuse_if_too_many(self, total: int) -> None:
        """More than 1 % unusable rows (and more than the last one) means a misread or damaged file."""
        wrong = [w for w in self.wrong if w[0] != total - 1]
        if len(wrong) > max(1, _BAD_SHARE * total):
            i, found = wrong[0]
            raise DataError(
                self._line(i),
                f"{len(wrong)} of {total} rows have a wrong number of fields; the first has {found}, "
                f"expected {self.dialect.fields}",
                "Repair or export the file again; check separator and decimal mark.",
            )

    def notes(self, total: int) -> list[str]:
        """What was left out, with the lines."""
        notes = []
        if self.blank:
            notes.append(f"{len(self.blank)} blank line{'s' * (len(self.blank) > 1)} inside the data skipped")
        last = [w for w in self.wrong if w[0] == total - 1]
        inside = [w for w in self.wrong if w[0] != total - 1]
        if last:
            i, found = last[0]
            line = self.dialect.first + i + 1
            notes.append(f"last row (line {line}) is cut short ({found} of {self.dialect.fields} fields) and left out")
        if inside:
            listed = ", ".join(str(self.dialect.first + i + 1) for i, _ in inside[:5])
            s = "s" * (len(inside) > 1)
            notes.append(f"{len(inside)} row{s} with a wrong number of fields left out (line{s} {listed})")
        return notes
