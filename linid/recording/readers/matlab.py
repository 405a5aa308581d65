"""MATLAB .mat files of level 5 (up to v7): vectors, and vectors inside matrices, cell arrays and structs."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import numpy as np

from linid.errors import DataError
from linid.recording.mapping import ChannelMapping
from linid.recording.readers.mat_structure import check_structure
from linid.recording.readers.reader import Reader
from linid.recording.readers.variables import table_of
from linid.recording.source import MOST_UNPACKED, Source
from linid.recording.table import Table, Used

_REMEDY = "In MATLAB: save('file.mat', 'name1', 'name2', '-v7')."


def _recognises(source: Source) -> bool:
    if source.head.startswith(b"\x89HDF") or b"MATLAB 7.3" in source.head[:128]:
        return False
    return source.suffix == ".mat" or source.head.startswith(b"MATLAB 5.0")


def _read(source: Source, mapping: ChannelMapping, used: Used | None = None) -> Table:
    del mapping, used
    import scipy.io

    data = source.content()
    try:
        check_structure(data, MOST_UNPACKED)
        content = scipy.io.loadmat(io.BytesIO(data))  # type: ignore[arg-type,unused-ignore]
    except MemoryError:
        raise DataError(source.place, "declares more data than fits into memory", _REMEDY) from None
    except Exception as error:  # loadmat raises many kinds on damaged files
        raise DataError(source.place, f"is not a readable MATLAB file ({_first_line(error)})", _REMEDY) from None
    named = [(name, value) for name, value in content.items() if isinstance(name, str) and not name.startswith("__")]
    return table_of("mat", source, named, fields_of, _REMEDY)


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:200]


def fields_of(value: Any) -> Iterator[tuple[str, Any]] | None:
    """What a cell array or struct holds, with the addresses behind its name; None for plain numbers."""
    array = np.asarray(value)
    if array.dtype.names:
        return _of_struct(array)
    if array.dtype == object:
        return _of_cells(array)
    return None


def _of_struct(array: np.ndarray[Any, Any]) -> Iterator[tuple[str, Any]]:
    for number, one in enumerate(array.ravel(), start=1):
        place = f"[{number}]" if array.size > 1 else ""
        for name in array.dtype.names or ():
            yield f"{place}.{name}", one[name]


def _of_cells(array: np.ndarray[Any, Any]) -> Iterator[tuple[str, Any]]:
    for where in np.ndindex(array.shape):
        inside = [k + 1 for k, n in zip(where, array.shape, strict=True) if n > 1]
        yield (f"[{','.join(map(str, inside))}]" if inside else ""), array[where]


READER = Reader("mat", "MATLAB .mat up to v7: vectors, also inside matrices, cells, structs", _recognises, _read)
