"""Text exports as drives' own tools write them, beside the plain ones: read to the true values, or refused."""

from __future__ import annotations

import gzip
import zipfile
from pathlib import Path

import numpy as np
import pytest

from linid.errors import DataError
from linid.recording import ChannelMapping, inspect_file, read_recording

from ..expectations import error_of
from ..exports import IU, IV, N, T, Y, lines, write


def eas_chart(end: str = ",") -> list[str]:
    """A chart of the Elmo Application Studio: names by number, then a row of the numbers above the samples."""
    head = ["Elmo txt chart ver 2.0", "", "[Drive Information]", "Target,Drive 01,", "", "[Signal Names]"]
    head += ["1,Time (s),", "2,Position (cnt),", "3,Active Current [A],", "7,Velocity [cnt/sec],", ""]
    head += ["[Signals Data Group 1]", "1,2,3,"]
    return head + [f"{t:.4f},{round(1e6 * y)},{u:.6f}{end}" for t, y, u in zip(T, Y, IU, strict=True)]


ELMO = ChannelMapping.model_validate({"position": {"column": "Position", "unit": "counts", "scale": 1e-6}})


@pytest.mark.parametrize("end", [",", ""])
def test_eas_chart(tmp_path: Path, end: str) -> None:
    path = write(tmp_path, eas_chart(end))
    assert inspect_file(path).layout == "elmo"
    recording = read_recording(path, channels=ELMO)
    np.testing.assert_allclose(recording.t, T, atol=1e-12)
    np.testing.assert_allclose(recording.y, Y, atol=1e-6)
    np.testing.assert_allclose(recording.drive_input, IU, atol=1e-6)


def test_eas_chart_that_is_damaged(tmp_path: Path) -> None:
    text = [line.replace("1,2,3,", "1,2,9,") for line in eas_chart()]
    error_of(write(tmp_path, text), "line 13", "'9'", "[Signal Names]")
    error_of(write(tmp_path, eas_chart()[:13]), "no rows of samples")
    text = [*eas_chart(), "", "[Signals Data Group 2]", "1,7,", "0.0,1,"]
    error_of(write(tmp_path, text), "2 groups of signals")


def halscope(mark: str = ",") -> list[str]:
    def number(x: float) -> str:
        return f"{x:+.6f}".replace(".", mark)

    body = [
        f"joint.0.motor-pos-fb {number(1e3 * y)} hm2.pwm.00.current-u {number(u)} hm2.pwm.00.current-v {number(v)}"
        for y, u, v in zip(Y, IU, IV, strict=True)
    ]
    return ["Sampling period is 1000000 nSec ", *body]


HAL = ChannelMapping.model_validate(
    {
        "position": {"column": "joint.0.motor-pos-fb", "unit": "mm"},
        "current_u": {"column": "hm2.pwm.00.current-u", "unit": "A"},
        "current_v": {"column": "hm2.pwm.00.current-v", "unit": "A"},
    }
)


@pytest.mark.parametrize("mark", [",", "."])
def test_halscope(tmp_path: Path, mark: str) -> None:
    path = write(tmp_path, halscope(mark), name="scope.log")
    assert inspect_file(path).layout == "halscope"
    recording = read_recording(path, channels=HAL)
    np.testing.assert_allclose(recording.t, T, atol=1e-12)
    np.testing.assert_allclose(recording.y, Y, atol=1e-8)
    assert recording.phase_currents is not None
    np.testing.assert_allclose(recording.phase_currents[:2], [IU, IV], atol=1e-6)


def test_halscope_cut_short_or_mixed(tmp_path: Path) -> None:
    text = halscope()
    recording = read_recording(write(tmp_path, [*text[:-1], text[-1][:40]]), channels=HAL)
    assert len(recording.t) == N - 1 and any("cut short" in note for note in recording.notes)
    text[100] = text[100].replace("current-v", "current-w")
    error_of(write(tmp_path, text), "line 101", "other channels")


def test_codesys_ascii_trace(tmp_path: Path) -> None:
    head = ["CoDeSys Trace", "D:\\PROJECTS\\AXIS.PRO", "Time PLC_PRG.ActPos PLC_PRG.ActCurrent"]
    body = [f"{1e3 * t:.0f} {1e3 * y:.6f} {u:.6f}" for t, y, u in zip(T, Y, IU, strict=True)]
    mapping = {
        "position": {"column": "PLC_PRG.ActPos", "unit": "mm"},
        "current_q": {"column": "PLC_PRG.ActCurrent", "unit": "A"},
    }
    path = write(tmp_path, [*head, *body], name="trace.txt")
    assert inspect_file(path).layout == "codesys"
    recording = read_recording(path, channels=ChannelMapping.model_validate(mapping))
    np.testing.assert_allclose(recording.t, T, atol=1e-12)
    np.testing.assert_allclose(recording.y, Y, atol=1e-9)
    cycles = [head[0], head[1], head[2].replace("Time", "Cycle"), *body]
    path = write(tmp_path, cycles, name="cycles.txt")
    with pytest.raises(DataError, match="no time column"):
        read_recording(path, channels=ChannelMapping.model_validate(mapping))
    given = ChannelMapping.model_validate({**mapping, "period": "1 ms"})
    np.testing.assert_allclose(read_recording(path, channels=given).t, T, atol=1e-12)
    error_of(write(tmp_path, [*head[:2], "Time a", *body], name="x.txt"), "line 3")


def test_units_in_a_line_and_a_declared_interval(tmp_path: Path) -> None:
    """As Mitsubishi's MR Configurator writes: settings, an interval in ms, names, units below them."""
    head = ["[Graph data]", "Model,MR-J4", "Sampling time interval(ms),1.0", "Speed,Cumulative feedback,Iq"]
    head = [*head[1:3], "Act Position,Motor speed,Iq Act", "mm,r/min,A"]
    body = [f"{1e3 * y:.6f},{k % 7}.25,{u:.6f}" for k, (y, u) in enumerate(zip(Y, IU, strict=True))]
    recording = read_recording(write(tmp_path, [*head, *body]))
    np.testing.assert_allclose(recording.t, T, atol=1e-12)
    np.testing.assert_allclose(recording.y, Y, atol=1e-9)
    np.testing.assert_allclose(recording.drive_input, IU, atol=1e-6)


def test_labview_measurement_file(tmp_path: Path) -> None:
    end = "***End_of_Header***"
    head = ["LabVIEW Measurement\t", "Writer_Version\t2", "Separator\tTab", f"{end}\t", "\t", "Channels\t2\t\t"]
    head += ["Samples\t200\t200\t", "Y_Unit_Label\tmm\tA\t", "X_Dimension\tTime\tTime\t", "X0\t0.0E+0\t0.0E+0\t"]
    head += ["Delta_X\t0.001000\t0.001000\t", f"{end}\t\t\t", "X_Value\tPosition\tIq Actual\tComment"]
    body = [f"{t:.6f}\t{1e3 * y:.6f}\t{u:.6f}" for t, y, u in zip(T, Y, IU, strict=True)]
    recording = read_recording(write(tmp_path, [*head, *body], name="run.lvm"))
    np.testing.assert_allclose(recording.t, T, atol=1e-12)
    np.testing.assert_allclose(recording.y, Y, atol=1e-9)
    np.testing.assert_allclose(recording.drive_input, IU, atol=1e-6)


def test_a_heading_that_names_nothing_leaves_numbers_to_map(tmp_path: Path) -> None:
    text = ["Trace of axis 1", *(f"{k};{1e3 * y:.6f};{u:.6f}" for k, (y, u) in enumerate(zip(Y, IU, strict=True)))]
    path = write(tmp_path, text)
    error_of(path, "no position column", "'column 2'")
    mapping = {
        "time": {"column": "#1", "unit": "ms"},
        "position": {"column": "#2", "unit": "mm"},
        "current_q": {"column": "#3", "unit": "A"},
    }
    recording = read_recording(path, channels=ChannelMapping.model_validate(mapping))
    np.testing.assert_allclose(recording.y, Y, atol=1e-9)
    assert any("the columns go by number" in note for note in recording.notes)


STAMPS = {
    "clock": "12:59:{s:09.6f}",
    "ISO": "2026-11-23T12:59:{s:09.6f}",
    "zone": "2026-11-23 12:59:{s:09.6f}+01:00",
    "dotted": "23.11.2026 12:59:{s:09.6f}",
}


@pytest.mark.parametrize("form", STAMPS.values(), ids=STAMPS)
@pytest.mark.parametrize("comma", [False, True])
def test_clock_times_and_dates(tmp_path: Path, form: str, comma: bool) -> None:
    rows = [(form.format(s=59.0 + t), f"{1e3 * y:.6f}") for t, y in zip(T / 2, Y, strict=True)]
    text = ["Timestamp;Position (mm)", *(";".join(row) for row in rows)]
    text = [line.replace(".", ",") if comma and "dot" not in form else line for line in text]
    if comma and form == STAMPS["dotted"]:
        text = ["Timestamp;Position (mm)", *(f"{a[:-7]},{a[-6:]};{b.replace('.', ',')}" for a, b in rows)]
    path = write(tmp_path, text)
    recording = read_recording(path, kind="free_wheel")
    np.testing.assert_allclose(recording.t - recording.t[0], T / 2, atol=2e-9)
    np.testing.assert_allclose(recording.y, Y, atol=1e-9)


def test_a_clock_that_passes_midnight_goes_back(tmp_path: Path) -> None:
    stamps = [f"23:59:{59 + k / 100:06.3f}" if k < 100 else f"00:00:{(k - 100) / 100:06.3f}" for k in range(200)]
    error_of(write(tmp_path, ["Time;Position (mm)", *(f"{s};{k}.5" for k, s in enumerate(stamps))]), "time goes back")


@pytest.mark.parametrize("how", ["gz", "zip"])
def test_packed_exports(tmp_path: Path, how: str) -> None:
    plain = "\n".join(lines()).encode()
    path = tmp_path / ("scope.csv." + how)
    if how == "gz":
        path.write_bytes(gzip.compress(plain))
    else:
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("scope.csv", plain)
    recording = read_recording(path)
    np.testing.assert_allclose(recording.y, Y, atol=1e-7)
    assert any("unpacked from" in note for note in recording.notes)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(DataError, match=r"damaged gzip|cannot be unpacked"):
        read_recording(path)


def test_archives_of_several_files_and_bombs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "two.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.csv", "x")
        archive.writestr("b.csv", "y")
    error_of(path, "2 files", "a.csv, b.csv")
    from linid.recording import source

    monkeypatch.setattr(source, "MOST_UNPACKED", 1 << 20)
    bomb = tmp_path / "bomb.csv.gz"
    bomb.write_bytes(gzip.compress(bytes(1 << 22)))
    error_of(bomb, "unpacks to more than 1 MiB")
