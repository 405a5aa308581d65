"""MATLAB .mat files (up to v7) with one named vector per channel."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from linid.errors import DataError
from linid.recording.names import is_time, split_header
from linid.recording.table import Column, Table
from linid.recording.text import read_bytes, sha256_of


def read_mat(path: Path) -> Table:
    """All numeric vectors as columns and all numeric scalars by name; v7.3 files are refused with the remedy."""
    import scipy.io

    data = read_bytes(path)
    remedy = "In MATLAB: save('file.mat', 'name1', 'name2', '-v7')."
    if data[:4] == b"\x89HDF" or b"MATLAB 7.3" in data[:128]:
        raise DataError(str(path), "is a MATLAB v7.3 (HDF5) file, which is not supported", remedy)
    try:
        content = scipy.io.loadmat(io.BytesIO(data))  # type: ignore[arg-type,unused-ignore]
    except Exception as error:  # loadmat raises many kinds on damaged files
        raise DataError(str(path), f"is not a readable MATLAB file ({error})", remedy) from None
    vectors: dict[str, np.ndarray[tuple[int], np.dtype[np.float64]]] = {}
    scalars: dict[str, float] = {}
    skipped: list[str] = []
    for name, value in content.items():
        array = np.asarray(value)
        if name.startswith("__"):
            continue
        if array.dtype.kind not in "iufb" or array.size == 0 or array.size > max(array.shape, default=1):
            skipped.append(name)
        elif array.size == 1:
            scalars[name] = float(array.ravel()[0])
        else:
            vectors[name] = array.astype(np.float64).ravel()
    if not vectors:
        raise DataError(str(path), "holds no numeric vector", "Save one vector per channel. " + remedy)
    columns = []
    for name, values in vectors.items():
        plain, unit = split_header(name)
        bad = {int(i): str(values[i]) for i in np.flatnonzero(~np.isfinite(values))}
        numbers = np.where(np.isfinite(values), values, np.nan)
        columns.append(
            Column(name, plain, unit, numbers, np.arange(1, len(values) + 1), bad, aliases=(name,), time=is_time(plain))
        )
    notes = (f"not vectors, left out: {', '.join(skipped)}",) if skipped else ()
    return Table(path, "mat", tuple(columns), sha256_of(data), notes=notes, scalars=scalars)
