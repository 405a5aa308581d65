"""TwinCAT, Elmo, ControlDesk and MATLAB layouts read to the true values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.io

from linid.errors import DataError
from linid.recording import ChannelMapping, inspect_file, read_recording

from .exports import IU, IV, IW, N, T, Y, write

MAPPING_ELMO = {"position": {"column": "Position", "unit": "counts", "scale": 1e-6}}


def twincat(
    separator: str = "\t", mark: str = ",", *, slow: int = 1, units: bool = True, eof: bool = True
) -> list[str]:
    """Two time groups: position and current U at 1 kHz, current V every `slow` ms, so later rows are short."""

    def number(x: float) -> str:
        return f"{x:.9g}".replace(".", mark)

    def row(key: str, a: str, b: str, c: str) -> str:
        return separator.join([key, a, b, key, c])

    head = [
        separator.join(["Name", '"recording one"']),
        separator.join(["File", '"C:\\x.csv"']),
        separator.join(['"Starttime of export"', "132959733843760000", '"Montag, 2. Mai 2022"', "15:56:24.376"]),
        separator.join(['"Endtime of export"', "132959733853750000", '"Montag, 2. Mai 2022"', "15:56:25.375"]),
        "",
        row("Name", "ActPos", "Phase Current U", "Phase Current V"),
        row("SymbolComment", "", "", ""),
        row("Data-Type", "REAL64", "REAL64", "REAL64"),
        row("SampleTime[ms]", "1", "1", number(slow)),
        row("SymbolName", "Axis 1.ActPos", "Axis 1.Iu", "Axis 1.Iv"),
        row("Port", "851", "851", "851"),
        row("ScaleFactor", "1", "1", "1"),
    ]
    if units:
        head.append(row("Unit", "mm (Length)", "A (Current)", "A (Current)"))
    head.append("")
    body = []
    for k in range(N):
        fast = [number(x) for x in (1e3 * T[k], 1e3 * Y[k], IU[k])]
        j = k * slow
        rest = [number(1e3 * T[j]), number(IV[j])] if j < N else []
        body.append(separator.join(fast + rest))
    return head + body + (["EOF"] if eof else [])


@pytest.mark.parametrize(("separator", "mark"), [("\t", ","), ("\t", "."), (";", ","), (",", ".")])
def test_twincat_dialects(tmp_path: Path, separator: str, mark: str) -> None:
    recording = read_recording(write(tmp_path, twincat(separator, mark)))
    np.testing.assert_allclose(recording.t, T, atol=1e-12)
    np.testing.assert_allclose(recording.y, Y, atol=1e-11)
    np.testing.assert_allclose(recording.phase_currents, [IU, IV, -(IU + IV)], atol=1e-8)


def test_twincat_slow_group_is_resampled_and_never_extrapolated(tmp_path: Path) -> None:
    path = write(tmp_path, twincat(slow=4))
    recording = read_recording(path)
    assert any("Phase Current V" in n and "cubic spline" in n for n in recording.notes)
    assert any("3 samples at the ends left out" in n for n in recording.notes)
    assert len(recording.t) == N - 3
    assert recording.phase_currents is not None
    np.testing.assert_allclose(recording.phase_currents[1], IV[:-3], atol=1e-4)
    np.testing.assert_allclose(recording.phase_currents[0], IU[:-3], atol=1e-8)
    inspection = inspect_file(path)
    assert inspection.layout == "twincat" and inspection.groups == 2 and inspection.problem is None
    assert inspection.rate == pytest.approx(1000.0)


def test_twincat_header_with_other_decimal_mark_than_the_data(tmp_path: Path) -> None:
    text = [line.replace("SampleTime[ms]\t1", "SampleTime[ms]\t0,2") for line in twincat("\t", ".")]
    np.testing.assert_allclose(read_recording(write(tmp_path, text)).y, Y, atol=1e-11)


def test_twincat_without_units_asks_for_them(tmp_path: Path) -> None:
    path = write(tmp_path, twincat(units=False))
    with pytest.raises(DataError, match="no unit declared"):
        read_recording(path)
    mapping = {
        "position": {"column": "Axis 1.ActPos", "unit": "mm"},
        "current_u": {"column": "Axis 1.Iu", "unit": "A"},
        "current_v": {"column": "Axis 1.Iv", "unit": "A"},
    }
    recording = read_recording(path, channels=ChannelMapping.model_validate(mapping))
    np.testing.assert_allclose(recording.y, Y, atol=1e-11)


def test_twincat_names_only(tmp_path: Path) -> None:
    text = ["Name,Axis.ActPos (mm),Name,Axis.Iq (A)"]
    text += [f"{k},{0.5 * k:.1f},{k},{(k % 9) / 10}" for k in range(100)]
    recording = read_recording(write(tmp_path, text))
    np.testing.assert_allclose(recording.y, 5e-4 * np.arange(100))
    assert recording.drive_input is not None and recording.drive_input[8] == 0.8


def test_twincat_full_time_stamps(tmp_path: Path) -> None:
    start = 132959733843760000
    text = [
        "Name\tx",
        f"Starttime of export\t{start}",
        "",
        "Name\tActPos",
        "SampleTime[ms]\t1",
        "Unit\tmm (Length)",
        "",
    ]
    text += [f"{start + 10000 * k}\t{k}" for k in range(100)]
    recording = read_recording(write(tmp_path, text))
    np.testing.assert_allclose(recording.t, np.arange(100) * 1e-3, atol=2e-6)


def test_twincat_declared_scaling_is_noted_not_applied(tmp_path: Path) -> None:
    text = [line.replace("ScaleFactor\t1", "ScaleFactor\t-10") for line in twincat()]
    recording = read_recording(write(tmp_path, text))
    np.testing.assert_allclose(recording.y, Y, atol=1e-11)
    assert any("ActPos: ScaleFactor -10" in note for note in recording.notes)


def test_twincat_header_without_samples(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no rows of samples"):
        read_recording(write(tmp_path, twincat(eof=False)[:14]))


def elmo(period: str = "Sampling Time [us],1000,") -> list[str]:
    head = ["[Recording Info]", "Drive,Gold Drum,", period, "Samples,200,", "[Data]", "Position,Active Current [A],"]
    return head + [f"{round(1e6 * y)},{u:.6f}," for y, u in zip(Y, IU, strict=True)]


@pytest.mark.parametrize(
    "period", ["Sampling Time [us],1000,", "Sampling Time = 1 ms", "Time Resolution,0.001 s,", "TS [us],1000,"]
)
def test_elmo_sections_with_a_declared_period(tmp_path: Path, period: str) -> None:
    recording = read_recording(write(tmp_path, elmo(period)), channels=ChannelMapping.model_validate(MAPPING_ELMO))
    np.testing.assert_allclose(recording.t, T, atol=1e-12)
    np.testing.assert_allclose(recording.y, Y, atol=1e-6)
    np.testing.assert_allclose(recording.drive_input, IU, atol=1e-6)


def test_elmo_period_without_unit_is_not_guessed(tmp_path: Path) -> None:
    path = write(tmp_path, elmo("Sampling Time,1000,"))
    with pytest.raises(DataError, match="no time column"):
        read_recording(path, channels=ChannelMapping.model_validate(MAPPING_ELMO))
    recording = read_recording(path, channels=ChannelMapping.model_validate({**MAPPING_ELMO, "period": "1 ms"}))
    np.testing.assert_allclose(recording.t, T, atol=1e-12)


def test_elmo_is_recognised(tmp_path: Path) -> None:
    inspection = inspect_file(write(tmp_path, elmo()))
    assert inspection.layout == "elmo"
    assert inspection.problem is not None and "no unit declared" in inspection.problem


@pytest.mark.parametrize("first_row_with_mark", [True, False])
def test_controldesk(tmp_path: Path, first_row_with_mark: bool) -> None:
    head = ["format,CSV,,", "version,1.1,,", "origin,test bench,,", "description,,,"]
    head += ['path,"Time","Model Root/Axis/Position","Model Root/Axis/I_q"', "unit,s,mm,A", "type,double,double,double"]
    rows = [f",{t:.4f},{1e3 * y:.6f},{u:.6f}" for t, y, u in zip(T, Y, IU, strict=True)]
    body = ["trace_values" + rows[0], *rows[1:]] if first_row_with_mark else ["trace_values,,,", *rows]
    recording = read_recording(write(tmp_path, [*head, *body, "", "end of capture,,,"]))
    np.testing.assert_allclose(recording.t, T, atol=1e-12)
    np.testing.assert_allclose(recording.y, Y, atol=1e-9)
    np.testing.assert_allclose(recording.drive_input, IU, atol=1e-6)
    assert any("1 line of text after the data" in note for note in recording.notes)
    assert inspect_file(tmp_path / "scope.csv").layout == "controldesk"


def test_controldesk_without_names(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no row of signal names"):
        read_recording(
            write(tmp_path, ["version,1.1", *(f"trace_values,{k}" if not k else f",{k}" for k in range(60))])
        )


def test_two_time_columns_make_two_groups(tmp_path: Path) -> None:
    text = ["Time (ms);Position (mm);Time (ms);Iq (A)"]
    text += [f"{k};{1e3 * Y[k]:.9f};{2 * k if 2 * k < N else ''};{IU[2 * k] if 2 * k < N else ''}" for k in range(N)]
    recording = read_recording(write(tmp_path, text))
    assert any("another time group" in note for note in recording.notes)
    np.testing.assert_allclose(recording.drive_input, IU[: len(recording.t)], atol=1e-5)


def matlab(folder: Path, name: str = "run.mat", **variables: object) -> Path:
    path = folder / name
    scipy.io.savemat(path, variables)
    return path


def test_matlab_vectors_with_mapping_and_scalar_scale(tmp_path: Path) -> None:
    path = matlab(tmp_path, t=T[:, None], q=Y[None, :], u=IU, gain=3.0, info="text")
    mapping = {
        "time": {"column": "t", "unit": "s"},
        "position": {"column": "q", "unit": "m"},
        "command": {"column": "u", "unit": "V", "scale": "gain"},
    }
    recording = read_recording(path, channels=ChannelMapping.model_validate(mapping))
    np.testing.assert_array_equal(recording.y, Y)
    np.testing.assert_allclose(recording.drive_input, 3.0 * IU)
    assert recording.input_unit == "V" and any("info" in note for note in recording.notes)
    mapping["command"]["scale"] = "gian"
    with pytest.raises(DataError, match=r"'gian' is neither a number nor a scalar.*gain"):
        read_recording(path, channels=ChannelMapping.model_validate(mapping))


def test_matlab_unequal_lengths(tmp_path: Path) -> None:
    path = matlab(tmp_path, time_s=T, pos_mm=1e3 * Y[:-5])
    with pytest.raises(DataError, match="equal length"):
        read_recording(path)


def test_matlab_nan_is_counted(tmp_path: Path) -> None:
    y = 1e3 * Y
    y[50] = np.nan
    recording = read_recording(matlab(tmp_path, time_s=T, pos_mm=y))
    assert recording.y[50] == pytest.approx(Y[50], abs=1e-7)
    assert any("1 unreadable cell" in note for note in recording.notes)


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (b"MATLAB 7.3 MAT-file, Platform: x" + bytes(600), "HDF5"),
        (b"\x89HDF\r\n\x1a\n" + bytes(600), "HDF5"),
        (b"not a matlab file at all" * 20, "not a readable MATLAB file"),
        (b"", "empty"),
    ],
)
def test_matlab_that_cannot_be_read(tmp_path: Path, content: bytes, text: str) -> None:
    with pytest.raises(DataError, match=text):
        read_recording(write(tmp_path, content, name="run.mat"))


def test_matlab_without_vectors(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no numeric vector"):
        read_recording(matlab(tmp_path, a=1.0, b="x"))


def test_layout_can_be_forced_and_is_checked(tmp_path: Path) -> None:
    path = write(tmp_path, ["Time (ms),Position (mm)", *(f"{k},{k}" for k in range(60))])
    with pytest.raises(DataError, match="TwinCAT"):
        read_recording(path, channels=ChannelMapping(layout="twincat"))
    with pytest.raises(DataError, match="trace_values"):
        read_recording(path, channels=ChannelMapping(layout="controldesk"))


def test_phase_names_of_several_makers(tmp_path: Path) -> None:
    for names in (
        ("Iu", "Iv", "Iw"),
        ("I_A", "I_B", "I_C"),
        ("Motor Current L1", "Motor Current L2", "Motor Current L3"),
        ("PhaseCurrent1", "PhaseCurrent2", "PhaseCurrent3"),
        ("Current Phase U", "Current Phase V", "Current Phase W"),
    ):
        text = ["t [s];Istposition [mm];Sollposition [mm];" + ";".join(f"{n} [A]" for n in names)]
        text += [f"{t};{1e3 * y};0;{u};{v};{w}" for t, y, u, v, w in zip(T, Y, IU, IV, IW, strict=True)]
        recording = read_recording(write(tmp_path, text))
        np.testing.assert_allclose(recording.phase_currents, [IU, IV, IW], atol=1e-15)
