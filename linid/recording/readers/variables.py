"""Named variables of a file that holds arrays -> columns: vectors, columns of matrices, fields of structs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from linid.errors import DataError
from linid.recording.source import Source
from linid.recording.table import Column, Table, array_column

Fields = Callable[[Any], Iterator[tuple[str, Any]] | None]
_DEEPEST = 8  # structs within structs
_MOST_COLUMNS = 2000
_WIDEST = 100  # columns of a matrix; what is wider both ways is no recording


def table_of(name: str, source: Source, named: Iterable[tuple[str, Any]], fields: Fields, remedy: str) -> Table:
    """The table of all numeric vectors, `data[2]` and `data.position` inside others, and of all scalars by name.

    named: variables in their order; fields: what a container holds, with the addresses behind its name. Raises
    DataError where there is no vector.
    """
    vectors: list[tuple[str, np.ndarray[Any, Any]]] = []
    scalars: dict[str, float] = {}
    skipped: list[str] = []
    for address, value in _leaves(list(named), fields, 0):
        array = np.asarray(value)
        if array.dtype.kind not in "iufb" or array.size == 0:
            skipped.append(address)
        elif array.size == 1:
            scalars[address] = float(array.ravel()[0])
        elif array.size == max(array.shape):
            vectors.append((address, array.ravel()))
        elif len(parts := _columns_of(array)):
            vectors += [(f"{address}[{k + 1}]", part) for k, part in enumerate(parts)]
        else:
            skipped.append(address)
    if not vectors:
        raise DataError(source.place, "holds no numeric vector", f"Save one vector per channel. {remedy}")
    if len(vectors) > _MOST_COLUMNS:
        raise DataError(
            source.place,
            f"holds {len(vectors)} vectors, at most {_MOST_COLUMNS} are read",
            f"Save only the channels of the recording. {remedy}",
        )
    columns = tuple(_column(address, values) for address, values in vectors)
    listed = ", ".join(skipped[:20]) + (" ..." if len(skipped) > 20 else "")
    notes = (*source.notes, *((f"not vectors, left out: {listed}",) if skipped else ()))
    return Table(source.path, name, columns, source.sha256, notes=notes, scalars=scalars)


def _column(address: str, values: np.ndarray[Any, Any]) -> Column:
    return array_column(address, values, aliases=(address,))


def _leaves(named: Sequence[tuple[str, Any]], fields: Fields, depth: int) -> Iterator[tuple[str, Any]]:
    """All that is no container, by its address."""
    for address, value in named:
        inside = fields(value) if depth < _DEEPEST else None
        if inside is None:
            yield address, value
        else:
            yield from _leaves([(address + rest, one) for rest, one in inside], fields, depth + 1)


def _columns_of(array: np.ndarray[Any, Any]) -> list[np.ndarray[Any, Any]]:
    """The channels of a matrix, which has fewer of them than samples; none of what has more than two dimensions."""
    slim = array.reshape([n for n in array.shape if n > 1])
    if slim.ndim != 2 or min(slim.shape) > _WIDEST:
        return []
    return list(slim if slim.shape[0] < slim.shape[1] else slim.T)
