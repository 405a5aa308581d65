"""MATLAB v7.3 files and plain HDF5: datasets as vectors, groups as structs, cell arrays by their references."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from linid.recording.mapping import ChannelMapping
from linid.recording.readers.reader import Reader, library, whole
from linid.recording.readers.variables import table_of
from linid.recording.source import Source
from linid.recording.table import Table, Used

_REMEDY = "Save the channels again, as vectors."
_HIDDEN = ("#refs#", "#subsystem#")


def _recognises(source: Source) -> bool:
    return source.head.startswith(b"\x89HDF\r\n") or b"MATLAB 7.3" in source.head[:128]


def _read(source: Source, mapping: ChannelMapping, used: Used | None = None) -> Table:
    del mapping, used
    h5py = library("h5py", source)
    with whole(source, "HDF5"), source.opened() as stream, h5py.File(stream, "r") as file:

        def fields(value: Any) -> Iterator[tuple[str, Any]] | None:
            return _fields(h5py, file, value)

        named = [(name, _loaded(h5py, file[name])) for name in file if name not in _HIDDEN]
        return table_of("hdf5", source, named, fields, _REMEDY)


def _loaded(h5py: Any, item: Any) -> Any:
    """Numbers as an array; containers, and what is no number, as they are."""
    if isinstance(item, h5py.Dataset) and item.dtype.kind in "iufb" and not item.attrs.get("MATLAB_empty"):
        return item[()]
    return item


def _fields(h5py: Any, file: Any, value: Any) -> Iterator[tuple[str, Any]] | None:
    if isinstance(value, h5py.Group):
        return ((f".{name}", _loaded(h5py, value[name])) for name in value)
    if isinstance(value, h5py.Dataset) and value.dtype == h5py.ref_dtype:
        return _cells(h5py, file, value)
    return None


def _cells(h5py: Any, file: Any, value: Any) -> Iterator[tuple[str, Any]]:
    # MATLAB stores arrays column by column, so that HDF5 sees them transposed.
    references = value[()].T
    for where in _indices(references.shape):
        inside = [k + 1 for k, n in zip(where, references.shape, strict=True) if n > 1]
        if references[where]:
            yield (f"[{','.join(map(str, inside))}]" if inside else ""), _loaded(h5py, file[references[where]])


def _indices(shape: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    import numpy as np

    return iter(np.ndindex(shape))


READER = Reader("hdf5", "MATLAB v7.3 and HDF5: datasets, groups as structs, cell arrays", _recognises, _read, "formats")
