"""A read export before its columns mean anything: named columns in time groups, with declared unit texts."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from linid.arrays import Array
from linid.recording.body import Body, read_body
from linid.recording.dialect import LARGEST, Dialect
from linid.recording.names import is_time, plain, split_header
from linid.recording.pieces import LongText
from linid.recording.text import TextFile

Lines = np.ndarray[tuple[int], np.dtype[np.int64]]
_SHOWN_BAD = 1000  # unreadable cells whose text is kept


@dataclass(frozen=True)
class Column:
    """One column: header text as written, its name and declared unit, values with nan where unreadable.

    values: (n,) in the declared unit (empty where not asked for); bad: {row: cell text}; lines: (n,) line numbers in
    the file (from 1).
    """

    header: str
    name: str
    unit: str | None
    values: Array
    lines: Lines
    bad: dict[int, str] = field(default_factory=dict)
    group: int = 0
    aliases: tuple[str, ...] = ()
    numeric: bool = True
    time: bool = False


@dataclass(frozen=True)
class Table:
    """All columns of an export and how it was read.

    period_s: sampling period declared by the file, if any; header_line, first_line: from 1 (0: none).
    scalars: single numbers of a .mat file, by name.
    """

    path: Path
    layout: str
    columns: tuple[Column, ...]
    sha256: str
    encoding: str = ""
    dialect: str = ""
    header_line: int = 0
    first_line: int = 0
    period_s: float | None = None
    notes: tuple[str, ...] = ()
    scalars: dict[str, float] = field(default_factory=dict)

    @property
    def groups(self) -> int:
        """Number of time groups."""
        return 1 + max((column.group for column in self.columns), default=0)


Used = Callable[[Table], Collection[int] | None]


@dataclass(frozen=True)
class Headings:
    """What an export says of its columns, in their order, besides their values.

    headers: texts with or without a unit; units: before those of the headers; stamps: numbers of the columns of clock
    times, in s. Without `groups`, every column named like a time starts a group of the columns to its right; without
    `times`, names tell which columns count time.
    """

    headers: Sequence[str]
    units: Sequence[str | None] | None = None
    aliases: Sequence[Sequence[str]] | None = None
    groups: Sequence[int] | None = None
    times: Sequence[bool] | None = None
    stamps: Sequence[int] = ()


def make_columns(headings: Headings, body: Body, numeric: Sequence[bool], *, first: int = 0) -> tuple[Column, ...]:
    """Columns from the body's, by their headings; a group that ends early (blank to its end) is cut to its own length.

    first: number of the body's columns before the first heading.
    """
    units, aliases, stamps = headings.units, headings.aliases, headings.stamps
    headers = [plain(header) for header in headings.headers]
    parsed = [split_header(header) for header in headers]
    parsed = [(name, "s") if k in stamps else (name, unit) for k, (name, unit) in enumerate(parsed)]
    is_clock = list(headings.times) if headings.times is not None else _clocks([name for name, _ in parsed], stamps)
    groups = headings.groups
    if groups is None:
        started = np.cumsum(is_clock)
        groups = [max(0, int(n) - 1) for n in started] if sum(is_clock) > 1 else [0] * len(headers)
    by_column: dict[int, dict[int, str]] = {}
    for (row, k), text in body.bad.items():
        by_column.setdefault(k - first, {})[row] = text
    lengths = {}
    for g in set(groups):
        ends = [body.ends[first + k] for k in range(len(headers)) if groups[k] == g and numeric[k]]
        lengths[g] = max(ends, default=len(body.lines))
    columns = []
    for k, (name, unit) in enumerate(parsed):
        n = lengths[groups[k]]
        declared = units[k] if units is not None and units[k] and k not in stamps else unit
        columns.append(
            Column(
                header=headers[k],
                name=name,
                unit=declared,
                values=body.columns[first + k][:n],
                lines=body.lines[:n],
                bad={row: text for row, text in by_column.get(k, {}).items() if row < n},
                group=groups[k],
                aliases=tuple(aliases[k]) if aliases else (),
                numeric=numeric[k],
                time=is_clock[k],
            )
        )
    return tuple(columns)


def _clocks(names: Sequence[str], stamps: Sequence[int]) -> list[bool]:
    """Which columns count time: those named so in numbers; without any, one of clock times."""
    named = [is_time(name) and k not in stamps for k, name in enumerate(names)]
    if any(named) or not stamps:
        return named
    chosen = next((k for k in stamps if is_time(names[k])), stamps[0])
    return [k == chosen for k in range(len(names))]


def array_column(
    header: str,
    values: np.ndarray[Any, Any],
    *,
    unit: str | None = None,
    name: str | None = None,
    lines: Lines | None = None,
    group: int = 0,
    time: bool | None = None,
    aliases: tuple[str, ...] = (),
) -> Column:
    """A column of a format that holds arrays; what is no finite number of a drive becomes an unreadable cell.

    header: the channel's name as the file has it, with its unit unless `unit` is given; values: (n,) numbers; lines:
    (n,) line numbers, else samples from 1; time: whether it counts time (None: by its name).
    """
    numbers, header = np.asarray(values, dtype=np.float64).ravel(), plain(header)
    bare, declared = split_header(header)
    if unit is not None:
        bare, declared = (bare if declared == unit else header), unit or None
    good = np.abs(numbers) <= LARGEST
    bad = {int(i): str(numbers[i]) for i in np.flatnonzero(~good)[:_SHOWN_BAD]}
    return Column(
        header,
        name or bare,
        declared,
        np.where(good, numbers, np.nan),
        np.arange(1, numbers.size + 1) if lines is None else lines,
        bad,
        group,
        aliases,
        time=is_time(bare) if time is None else time,
    )


def with_body(
    build: Callable[[Body], Table],
    file: TextFile,
    dialect: Dialect,
    used: Used | None,
    *,
    first: int = 0,
    short_rows: bool = False,
) -> Table:
    """The table that `build` makes of the file's rows, with the values of the columns in use.

    used: see `readers.registry.read_table`; first: number of the body's columns before the table's first; short_rows:
    see `body.read_body`.
    """
    wanted = None
    if used is not None and isinstance(file.lines, LongText):  # a short file is not worth the asking
        nothing = Body((np.empty(0),) * dialect.fields, np.empty(0, dtype=np.int64), (0,) * dialect.fields)
        wanted = used(build(nothing))
    if wanted is not None:
        wanted = {first + k for k in wanted}
    return build(read_body(file.lines, dialect, str(file.path), short_rows=short_rows, wanted=wanted))
