"""Digit grouping: numbers such as 250,000 that are a quarter of a million or two hundred and fifty."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from linid.errors import DataError
from linid.recording.dialect import Dialect, is_number, split

_LOOKS_GROUPED = {mark: re.compile(rf"[+-]?[1-9]\d{{0,2}}{re.escape(mark)}\d{{3}}") for mark in ".,"}
_MARKS = {".": "point", ",": "comma"}
_FIRST = 500  # rows that settle it in nearly every file


def refuse_unproven_grouping(lines: Sequence[str], dialect: Dialect, place: str) -> None:
    """Raises DataError where every number with the decimal mark has exactly three digits after it and nothing else in
    the file tells whether it groups thousands.

    Proof of a decimal mark is a number with more or fewer digits after it, one that begins with 0, or one of four and
    more digits that are not grouped.
    """
    if dialect.decimal == "." and dialect.separator == ",":
        return  # who separates by commas does not group by points
    shown: tuple[int, str] | None = None
    for i, cell in _cells(lines, dialect):
        if _LOOKS_GROUPED[dialect.decimal].fullmatch(cell):
            shown = shown or (i, cell)
        elif _proves(cell, dialect.decimal):
            return
        elif shown is None and i > dialect.first + _FIRST:
            return  # whole numbers only, so far and presumably to the end: a late one is still read as a decimal
    if shown is None:
        return
    line, cell = shown
    mark = dialect.decimal
    raise DataError(
        f"{place}, line {line + 1}",
        f"'{cell}' may be {cell.replace(mark, '.')} or {cell.replace(mark, '')}: every number with a "
        f"{_MARKS[mark]} in this file has exactly three digits after it",
        f"Give `decimal: '{mark}'` in the mapping if the {_MARKS[mark]} is the decimal mark; "
        "else switch off digit grouping in the export.",
    )


def _proves(cell: str, mark: str) -> bool:
    """Whether a number shows that the mark is a decimal one, or that thousands are not grouped."""
    if not is_number(cell, mark):
        return False
    return mark in cell or sum(map(str.isdigit, cell)) > 3


def _cells(lines: Sequence[str], dialect: Dialect) -> Iterator[tuple[int, str]]:
    """The cells of the numeric columns with their lines (from 0)."""
    numeric = [k for k, is_numeric in enumerate(dialect.numeric) if is_numeric]
    for i in range(dialect.first, len(lines)):
        row = split(lines[i], dialect.separator)
        for k in numeric:
            if k < len(row):
                yield i, row[k]
