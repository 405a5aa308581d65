"""A read export before its columns mean anything: named columns in time groups, with declared unit texts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from linid.recording.names import is_time, split_header
from linid.recording.recording import Array


@dataclass(frozen=True)
class Column:
    """One column: header text as written, its name and declared unit, values with nan where unreadable.

    values: (n,) in the declared unit; bad: {row: cell text}; lines: (n,) line numbers in the file (from 1).
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


def make_columns(
    headers: Sequence[str],
    values: Array,
    lines: np.ndarray[tuple[int], np.dtype[np.int64]],
    bad: dict[tuple[int, int], str],
    numeric: Sequence[bool],
    *,
    units: Sequence[str | None] | None = None,
    aliases: Sequence[Sequence[str]] | None = None,
    groups: Sequence[int] | None = None,
    times: Sequence[bool] | None = None,
) -> tuple[Column, ...]:
    """Columns from a value array; a group that ends early (blank to its end) is cut to its own length.

    Without `groups`, every column named like a time starts a group of the columns to its right.
    """
    parsed = [split_header(header) for header in headers]
    is_clock = list(times) if times is not None else [is_time(name) for name, _ in parsed]
    if groups is None:
        started = np.cumsum(is_clock)
        groups = [max(0, int(n) - 1) for n in started] if sum(is_clock) > 1 else [0] * len(headers)
    by_column: dict[int, dict[int, str]] = {}
    for (row, k), text in bad.items():
        by_column.setdefault(k, {})[row] = text
    lengths = {
        g: _length(values, [k for k in range(len(headers)) if groups[k] == g and numeric[k]]) for g in set(groups)
    }
    columns = []
    for k, (name, unit) in enumerate(parsed):
        n = lengths[groups[k]]
        declared = units[k] if units is not None and units[k] else unit
        columns.append(
            Column(
                header=headers[k], name=name, unit=declared, values=values[:n, k], lines=lines[:n],
                bad={row: text for row, text in by_column.get(k, {}).items() if row < n},
                group=groups[k], aliases=tuple(aliases[k]) if aliases else (), numeric=numeric[k], time=is_clock[k],
            )
        )  # fmt: skip
    return tuple(columns)


def _length(values: Array, columns: list[int]) -> int:
    """Rows up to the last one in which the group has a value."""
    if not columns or not len(values):
        return len(values)
    filled = np.flatnonzero(np.isfinite(values[:, columns]).any(axis=1))
    return int(filled[-1]) + 1 if len(filled) else 0
