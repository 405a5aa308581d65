"""LinuxCNC halscope: a line with the sampling period in nSec, then rows of `name value` pairs."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from linid.errors import DataError
from linid.recording.dialect import is_number, to_float
from linid.recording.mapping import ChannelMapping
from linid.recording.readers.reader import Reader
from linid.recording.source import Source
from linid.recording.table import Column, Table, Used, array_column

_PERIOD = re.compile(r"(?i)\s*sampling period is\s+(\d{1,12})\s*nsec\b.*")


def _recognises(source: Source) -> bool:
    return any(_PERIOD.fullmatch(line[:200]) for line in source.text.lines[:20])


def _read(source: Source, mapping: ChannelMapping, used: Used | None = None) -> Table:
    del used
    file = source.text
    found = next(((i, m) for i, line in enumerate(file.lines[:200]) if (m := _PERIOD.fullmatch(line[:200]))), None)
    if found is None or int(found[1][1]) == 0:
        raise DataError(
            source.place, "no line `Sampling period is ... nSec` found", "Remove `layout: halscope` from the mapping."
        )
    rows = [(i, line.split()) for i, line in enumerate(file.lines) if i > found[0] and line.strip()]
    if not rows:
        raise DataError(source.place, "a header but no rows of samples", "Save the samples, not only the settings.")
    names = rows[0][1][::2]
    mark = mapping.decimal or ("," if any("," in cell for _, cells in rows[:200] for cell in cells[1::2]) else ".")
    last = rows[-1][0]
    values, lines, notes = _values(rows, names, mark, source.place, last)
    columns = [_column(name, values[:, k], lines) for k, name in enumerate(names)]
    return Table(
        source.path,
        "halscope",
        tuple(columns),
        source.sha256,
        file.encoding,
        "pairs of name and value",
        found[0] + 1,
        rows[0][0] + 1,
        int(found[1][1]) * 1e-9,
        (*file.notes, *notes),
    )


def _values(
    rows: Sequence[tuple[int, list[str]]], names: list[str], mark: str, place: str, last: int
) -> tuple[np.ndarray[tuple[int, int], np.dtype[np.float64]], np.ndarray[tuple[int], np.dtype[np.int64]], list[str]]:
    """Values (n, channels), line numbers and notes; each row must name the same channels."""
    values, lines, notes = [], [], []
    for i, cells in rows:
        if cells[::2] != names or len(cells) != 2 * len(names):
            if i == last:
                notes.append(f"last row (line {i + 1}) is cut short and left out")
                continue
            raise DataError(
                f"{place}, line {i + 1}",
                f"other channels than in the first row: {' '.join(cells)[:60]!r}",
                "Split the file there, or save it again.",
            )
        bad = next((cell for cell in cells[1::2] if not is_number(cell, mark)), None)
        if bad is not None and i == last:
            notes.append(f"last row (line {i + 1}) is cut short and left out")
            continue
        values.append([to_float(cell, mark) for cell in cells[1::2]])
        lines.append(i + 1)
    return np.array(values, dtype=np.float64).reshape(len(lines), len(names)), np.array(lines, dtype=np.int64), notes


def _column(
    name: str, values: np.ndarray[tuple[int], np.dtype[np.float64]], lines: np.ndarray[tuple[int], np.dtype[np.int64]]
) -> Column:
    return array_column(name, values, lines=lines)


READER = Reader(
    "halscope", "LinuxCNC halscope: rows of `name value` pairs, the sampling period above", _recognises, _read
)
