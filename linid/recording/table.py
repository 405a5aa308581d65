"""A read export before its columns mean anything: named columns in time groups, with declared unit texts."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from linid.recording.body import Body, read_body
from linid.recording.dialect import Dialect
from linid.recording.names import is_time, split_header
from linid.recording.pieces import LongText
from linid.recording.recording import Array
from linid.recording.text import TextFile


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
    lines: np.ndarray[tuple[int], np.dtype[np.int64]]
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


def make_columns(
    headers: Sequence[str],
    body: Body,
    numeric: Sequence[bool],
    *,
    first: int = 0,
    units: Sequence[str | None] | None = None,
    aliases: Sequence[Sequence[str]] | None = None,
    groups: Sequence[int] | None = None,
    times: Sequence[bool] | None = None,
) -> tuple[Column, ...]:
    """Columns from the body's, by their headers; a group that ends early (blank to its end) is cut to its own length.

    first: number of the body's columns before the first header. Without `groups`, every column named like a time
    starts a group of the columns to its right.
    """
    parsed = [split_header(header) for header in headers]
    is_clock = list(times) if times is not None else [is_time(name) for name, _ in parsed]
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
        declared = units[k] if units is not None and units[k] else unit
        columns.append(
            Column(
                header=headers[k], name=name, unit=declared, values=body.columns[first + k][:n],
                lines=body.lines[:n],
                bad={row: text for row, text in by_column.get(k, {}).items() if row < n},
                group=groups[k], aliases=tuple(aliases[k]) if aliases else (), numeric=numeric[k], time=is_clock[k],
            )
        )  # fmt: skip
    return tuple(columns)


def with_body(
    build: Callable[[Body], Table], file: TextFile, dialect: Dialect, used: Used | None, *, first: int = 0,
    short_rows: bool = False,
) -> Table:  # fmt: skip
    """The table that `build` makes of the file's rows, with the values of the columns in use.

    used: see `layouts.read_table`; first: number of the body's columns before the table's first; short_rows: see
    `body.read_body`.
    """
    wanted = None
    if used is not None and isinstance(file.lines, LongText):  # a short file is not worth the asking
        nothing = Body((np.empty(0),) * dialect.fields, np.empty(0, dtype=np.int64), (0,) * dialect.fields)
        wanted = used(build(nothing))
    if wanted is not None:
        wanted = {first + k for k in wanted}
    return build(read_body(file.lines, dialect, str(file.path), short_rows=short_rows, wanted=wanted))
