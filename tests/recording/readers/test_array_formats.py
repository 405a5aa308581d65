"""Formats of arrays, each written by its own library: read to the true values, and refused when damaged or too new."""

from __future__ import annotations

import builtins
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io

from linid.errors import DataError
from linid.recording import ChannelMapping, inspect_file, read_recording

from ..exports import IU, T, Y

CHANNELS = {"Time (s)": T, "Actual Position (mm)": 1e3 * Y, "Iq (A)": IU}


def matlab_73(path: Path) -> None:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in zip(("time_s", "pos_mm", "iq_Amps"), CHANNELS.values(), strict=True):
            file.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = b"double"
    head = b"MATLAB 7.3 MAT-file, Platform: PCWIN64".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as raw:
        raw.write(head)


def mdf(path: Path) -> None:
    import asammdf

    signals = [asammdf.Signal(1e3 * Y, T, unit="mm", name="ActPos"), asammdf.Signal(IU, T, unit="A", name="Iq Actual")]
    file = asammdf.MDF()
    file.append(signals)
    file.save(path, overwrite=True)


def tdms(path: Path) -> None:
    import nptdms

    waveform = {"wf_increment": 1e-3, "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(str(path)) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("Axis", "ActPos", 1e3 * Y, properties={**waveform, "unit_string": "mm"}),
                nptdms.ChannelObject("Axis", "Iq Actual", IU, properties={**waveform, "unit_string": "A"}),
            ]
        )


def parquet(path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table(dict(CHANNELS)), path)


def _text(text: str) -> bytes:
    data = text.encode()
    return struct.pack("<i", len(data)) + data


def svb(path: Path, timed: bool = True) -> None:
    """As Beckhoff documents the layout (TE13xx, Export to svb)."""
    content = [("Axis.ActPos (mm)", 1e3 * Y, "REAL64", "<f8"), ("Axis.Iq (A)", IU, "REAL32", "<f4")]
    main_size = 8 + 4 + len("scope") + 8 + 8 + 4

    def header(name: str, values: np.ndarray[Any, Any], kind: str, form: str, begin: int) -> bytes:
        width = np.dtype(form).itemsize
        fields = _text(name) + _text("1.2.3.4.1.1") + struct.pack("<iqb", 851, 10000, 1) + _text("MAIN.x") + _text("")
        fields += struct.pack("<qq", 16448, 385312) + _text(kind) + struct.pack("<ii", 5, width)
        size = values.size * (width + 4 * timed)
        fields += struct.pack("<qqqddq", values.size, size, begin, 0.0, 1.0, -1)
        return struct.pack("<q", len(fields) + 8) + fields

    headers_size = sum(len(header(*one, 0)) for one in content)
    begin, headers, body = main_size + headers_size, b"", b""
    for name, values, kind, form in content:
        headers += header(name, values, kind, form, begin + len(body))
        if timed:
            rows = np.zeros(values.size, dtype=[("t", "<u4"), ("x", form)])
            rows["t"], rows["x"] = np.round(1e7 * T).astype(np.uint32), values
            body += rows.tobytes()
        else:
            body += values.astype(form).tobytes()
    main = (
        struct.pack("<q", main_size) + _text("scope") + struct.pack("<qqi", 132959733843760000, 132959733853750000, 2)
    )
    path.write_bytes(main + headers + body)


WRITERS: dict[str, tuple[Callable[[Path], None], str, str]] = {
    "hdf5": (matlab_73, "run.mat", "h5py"),
    "mdf": (mdf, "run.mf4", "asammdf"),
    "tdms": (tdms, "run.tdms", "nptdms"),
    "parquet": (parquet, "run.parquet", "pyarrow"),
    "svb": (svb, "run.svb", ""),
}


@pytest.mark.parametrize("name", WRITERS)
def test_round_trip(tmp_path: Path, name: str) -> None:
    write, file, library = WRITERS[name]
    if library:
        pytest.importorskip(library)
    path = tmp_path / file
    write(path)
    assert inspect_file(path).layout == name
    recording = read_recording(path)
    np.testing.assert_allclose(recording.t - recording.t[0], T, atol=1e-9)
    np.testing.assert_allclose(recording.y, Y, atol=1e-12)
    np.testing.assert_allclose(recording.drive_input, IU, atol=1e-7)


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("keep", [0.2, 0.5, 0.9])
def test_damaged(tmp_path: Path, name: str, keep: float) -> None:
    """Cut short: refused, or read without what is missing, never another error."""
    write, file, library = WRITERS[name]
    if library:
        pytest.importorskip(library)
    path = tmp_path / file
    write(path)
    data = path.read_bytes()
    path.write_bytes(data[: int(keep * len(data))])
    try:
        recording = read_recording(path)
    except DataError as error:
        assert str(path) in error.place and error.remedy
    else:
        n = recording.t.size
        np.testing.assert_allclose(recording.y, Y[:n], atol=1e-9)


@pytest.mark.parametrize("name", [name for name in WRITERS if name != "svb"])
def test_without_its_library_the_extra_is_named(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    write, file, library = WRITERS[name]
    pytest.importorskip(library)
    path = tmp_path / file
    write(path)
    from linid.recording.readers import reader

    def missing(module: str) -> Any:
        raise builtins.ImportError(module)

    monkeypatch.setattr(reader, "import_module", missing)
    with pytest.raises(DataError, match=r"needs the library .*linid\[formats\]"):
        read_recording(path)


def test_svb_without_times(tmp_path: Path) -> None:
    path = tmp_path / "scope.svb"
    svb(path, timed=False)
    recording = read_recording(path)
    np.testing.assert_allclose(recording.t, T, atol=1e-12)
    np.testing.assert_allclose(recording.y, Y, atol=1e-12)


def test_matlab_matrices_cells_and_structs(tmp_path: Path) -> None:
    cells = np.empty((2, 2), dtype=object)
    cells[0, 0], cells[0, 1], cells[1, 0], cells[1, 1] = T, 1e3 * Y, IU, "text"
    content = {
        "data": np.stack([T, 1e3 * Y, IU]),
        "tall": np.stack([T, 1e3 * Y, IU], axis=1),
        "run": cells,
        "log": {"t": T, "axis": {"position": 1e3 * Y, "current": IU}, "gain": 2.5},
    }
    path = tmp_path / "all.mat"
    scipy.io.savemat(path, content)
    for time, position, current in (
        ("data[1]", "data[2]", "data[3]"),
        ("tall[1]", "tall[2]", "tall[3]"),
        ("run[1,1]", "run[1,2]", "run[2,1]"),
        ("log.t", "log.axis.position", "log.axis.current"),
    ):
        mapping = {
            "time": {"column": time, "unit": "s"},
            "position": {"column": position, "unit": "mm"},
            "current_q": {"column": current, "unit": "A"},
        }
        recording = read_recording(path, channels=ChannelMapping.model_validate(mapping))
        np.testing.assert_array_equal(recording.y, 1e3 * Y * 1e-3)
        np.testing.assert_array_equal(recording.drive_input, IU)
    scaled = {**mapping, "position": {"column": "data[2]", "unit": "mm", "scale": "log.gain"}}
    np.testing.assert_allclose(read_recording(path, channels=ChannelMapping.model_validate(scaled)).y, 2.5 * Y)
    with pytest.raises(DataError, match=r"data\[2\]"):
        wrong = {**mapping, "position": {"column": "data[9]", "unit": "mm"}}
        read_recording(path, channels=ChannelMapping.model_validate(wrong))
