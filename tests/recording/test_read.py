"""Clean files and real data read to the true values."""

from __future__ import annotations

import hashlib
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from shared_data import shared

from linid.errors import DataError, UsageError
from linid.recording import ChannelMapping, check_long_enough, read_campaign, read_recording
from linid.recording.recording import Recording

from .exports import HEADER, IU, IV, IW, N, T, Y, german, lines, rows, write


def assert_motion(recording, decimals: int = 4) -> None:
    np.testing.assert_allclose(recording.t, T, atol=1e-9)
    np.testing.assert_allclose(recording.y, Y, atol=0.6e-3 * 10**-decimals)
    np.testing.assert_allclose(recording.phase_currents, [IU, IV, IW], atol=0.6 * 10**-decimals)


def test_clean_file_gives_si_values_and_no_notes(tmp_path: Path) -> None:
    path = write(tmp_path, lines())
    recording = read_recording(path, split="held_out", added_mass=0.5)
    assert_motion(recording)
    assert recording.notes == ()
    assert (recording.kind, recording.split, recording.added_mass) == ("motor", "held_out", 0.5)
    assert recording.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert recording.source == path
    with pytest.raises(ValueError):
        recording.y[0] = 1.0


def test_printed_values_are_kept_to_the_last_bit(tmp_path: Path) -> None:
    text = ["Time (s),Position (m)"] + [f"{k * 0.001:.3f},{0.1 + k * 1.23456789012e-5!r}" for k in range(100)]
    recording = read_recording(write(tmp_path, text))
    assert recording.y.tolist() == [float(line.split(",")[1]) for line in text[1:]]


@pytest.mark.parametrize(
    ("separator", "comma"),
    [(";", False), (";", True), ("\t", False), ("\t", True), (" ", False), (" ", True), (",", False)],
)
def test_separators_and_decimal_marks(tmp_path: Path, separator: str, comma: bool) -> None:
    header = HEADER.replace(" (", "(").replace(" ", "_") if separator == " " else HEADER
    body = [row.replace(",", "|").replace(".", "," if comma else ".").replace("|", separator) for row in rows()]
    recording = read_recording(write(tmp_path, [header.replace(",", separator), *body]))
    assert_motion(recording)


@pytest.mark.parametrize(
    ("encoding", "unit"),
    [("utf-8", "µm"), ("utf-8-sig", "μm"), ("cp1252", "µm"), ("utf-16", "µm"), ("utf-16-le", "um")],
)
def test_encodings(tmp_path: Path, encoding: str, unit: str) -> None:
    text = "\r\n".join([f"Time (ms);Position ({unit})", *(f"{k};{100 + 3 * k}" for k in range(60))])
    recording = read_recording(write(tmp_path, text, encoding=encoding))
    np.testing.assert_allclose(recording.y, (100 + 3 * np.arange(60)) * 1e-6)


@pytest.mark.parametrize(
    "header",
    [
        "Time (ms);Actual Position (mm)",
        "Time [ms];Actual Position [mm]",
        "Time / ms;Actual Position / mm",
        "Time, ms;Actual Position, mm",
        "time_ms;pos_mm",
        '"Time (ms)";"ActPos {mm}"',
        "# Time (ms);Position (actual) (mm)",
        "Time;Actual Position\n[ms];[mm]",
        "Zeit;Lage-Istwert\nms;mm",
    ],
)
def test_header_styles(tmp_path: Path, header: str) -> None:
    text = [*header.split("\n"), *(f"{k};{10 + 0.25 * k}" for k in range(60))]
    recording = read_recording(write(tmp_path, text))
    np.testing.assert_allclose(recording.t, np.arange(60) * 1e-3)
    np.testing.assert_allclose(recording.y, (10 + 0.25 * np.arange(60)) * 1e-3)
    assert recording.kind == "free_wheel"


def test_excel_separator_line(tmp_path: Path) -> None:
    assert_motion(read_recording(write(tmp_path, ["sep=;", *map(german, lines())])))


def test_trailing_separators_are_harmless(tmp_path: Path) -> None:
    assert_motion(read_recording(write(tmp_path, [line + "," for line in lines()])))
    assert_motion(read_recording(write(tmp_path, [HEADER, *(row + ",," for row in rows())])))


def test_metadata_above_the_header(tmp_path: Path) -> None:
    head = ["Recorder export", "Date,2024-01-05", "Samples,200", ""]
    assert_motion(read_recording(write(tmp_path, head + lines())))


def test_text_columns_do_not_disturb(tmp_path: Path) -> None:
    text = [HEADER + ",State"] + [row + (",RUN" if k % 3 else ",STOP") for k, row in enumerate(rows())]
    assert_motion(read_recording(write(tmp_path, text)))


def test_two_phase_currents_give_the_third(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path, [line.rsplit(",", 1)[0] for line in lines()]))
    assert recording.phase_currents is not None
    np.testing.assert_allclose(recording.phase_currents.sum(axis=0), 0.0, atol=1e-12)
    assert any("current_w = -(current_u + current_v)" in note for note in recording.notes)


def test_kind_is_free_wheel_when_all_currents_are_zero(tmp_path: Path) -> None:
    text = [HEADER] + [",".join([*row.split(",")[:2], "0.000", "0.000", "0.000"]) for row in rows()]
    path = write(tmp_path, text)
    assert read_recording(path).kind == "free_wheel"
    recording = read_recording(path, kind="motor")
    assert recording.kind == "motor" and any("zero" in note for note in recording.notes)


def test_motor_without_currents_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, [",".join(line.split(",")[:2]) for line in lines()])
    with pytest.raises(DataError, match="without currents"):
        read_recording(path, kind="motor")


def test_negative_time_before_the_trigger_is_kept(tmp_path: Path) -> None:
    text = ["Time (ms),Position (mm)"] + [f"{k - 50},{0.1 * k:.2f}" for k in range(100)]
    recording = read_recording(write(tmp_path, text))
    assert recording.t[0] == pytest.approx(-0.05)
    assert any("trigger" in note for note in recording.notes)


def test_window_uses_the_files_own_time(tmp_path: Path) -> None:
    path = write(tmp_path, lines())
    recording = read_recording(path, window=(0.05, 0.15))
    np.testing.assert_allclose(recording.t, T[50:151], atol=1e-9)
    assert any("window [0.05, 0.15] s: 101 of 200 samples" in note for note in recording.notes)
    with pytest.raises(DataError, match=r"window \[3, 4\] s holds 0 samples; the file runs from 0 to 0.199 s"):
        read_recording(path, window=(3.0, 4.0))


def test_period_replaces_a_missing_time_column(tmp_path: Path) -> None:
    path = write(tmp_path, ["Position (mm),I_q (A)"] + [f"{0.5 * k},{np.sin(k):.3f}" for k in range(80)])
    for recording in (
        read_recording(path, period=5e-4),
        read_recording(path, channels=ChannelMapping.model_validate({"period": "500 us"})),
        read_recording(path, channels=ChannelMapping.model_validate({"period": {"value": 0.5, "unit": "ms"}})),
    ):
        np.testing.assert_allclose(recording.t, np.arange(80) * 5e-4)
        assert recording.drive_input is not None and recording.input_unit == "A"
    with pytest.raises(DataError, match="no time column"):
        read_recording(path)
    with pytest.raises(UsageError):
        read_recording(path, period=0.0)


def test_no_header_line_needs_column_numbers(tmp_path: Path) -> None:
    path = write(tmp_path, rows())
    with pytest.raises(DataError, match="no position column"):
        read_recording(path)
    mapping = ChannelMapping.model_validate(
        {
            "time": {"column": "#1", "unit": "ms"},
            "position": {"column": "#2", "unit": "mm"},
            **{f"current_{p}": {"column": f"#{k}", "unit": "A"} for k, p in ((3, "u"), (4, "v"), (5, "w"))},
        }
    )
    assert_motion(read_recording(path, channels=mapping))


def test_mapping_scale_offset_and_counts(tmp_path: Path) -> None:
    text = ["t [s];enc;ref"] + [f"{k * 1e-3:.3f};{1000 + 4 * k};{k}" for k in range(60)]
    path = write(tmp_path, text)
    mapping = {"position": {"column": "enc", "unit": "counts", "scale": 1e-6, "offset": -1e-3}}
    recording = read_recording(path, channels=ChannelMapping.model_validate(mapping))
    np.testing.assert_allclose(recording.y, 4e-6 * np.arange(60), atol=1e-15)
    mapping = {"position": {"column": "enc", "unit": "um", "scale": 0.5}}
    recording = read_recording(path, channels=ChannelMapping.model_validate(mapping))
    np.testing.assert_allclose(recording.y, 0.5e-6 * (1000 + 4 * np.arange(60)))
    with pytest.raises(DataError, match="without a scale"):
        read_recording(path, channels=ChannelMapping.model_validate({"position": {"column": "enc", "unit": "counts"}}))


def test_command_in_volts_and_measured_current_preferred(tmp_path: Path) -> None:
    text = ["t (s),Pos (m),Torque Command (V),Iq (A)"] + [f"{k / 1000},{k / 1e4},{k},{-k}" for k in range(60)]
    path = write(tmp_path, text)
    recording = read_recording(path)
    assert recording.drive_input is not None and recording.drive_input[10] == -10 and recording.input_unit == "A"
    assert any("Torque Command" in note for note in recording.notes)
    recording = read_recording(path, channels=ChannelMapping.model_validate({"command": "Torque Command"}))
    assert recording.drive_input is not None and recording.drive_input[10] == 10 and recording.input_unit == "V"


def test_long_enough(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path, [HEADER, *rows()[:20]]))
    with pytest.raises(DataError, match="found 20 samples"):
        check_long_enough(recording)
    check_long_enough(read_recording(write(tmp_path, lines())))


def test_recordings_and_errors_travel_between_processes(tmp_path: Path) -> None:
    recording = pickle.loads(pickle.dumps(read_recording(write(tmp_path, lines()))))
    assert len(recording.t) == N


def test_import_is_light() -> None:
    code = (
        "import sys, linid.recording; sys.exit(any(m in sys.modules for m in ('pandas', 'scipy', 'pydantic', 'yaml')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("number", range(1, 15))
def test_blind_campaigns(number: int) -> None:
    path = shared("blind", f"axis_{number:02d}", "campaign.yaml")
    campaign = read_campaign(path)
    assert campaign.axis == "linear" and len(campaign.recordings) >= 10
    for recording in campaign.recordings:
        first = recording.source.read_text().splitlines()[1].split(",")  # type: ignore[union-attr]
        assert recording.y[0] == pytest.approx(float(first[1]) * 1e-3, abs=1e-12)
        assert recording.period == pytest.approx(1e-3)
        assert recording.kind == ("free_wheel" if recording.name.startswith("freewheel") else "motor")


def test_rotary_campaign_with_uneven_sampling() -> None:
    campaign = read_campaign(shared("real", "mn4004", "campaign.yaml"))
    assert campaign.axis == "rotary" and campaign.known == {"force_constant": 0.0318}
    for recording in campaign.recordings:
        assert np.ptp(np.diff(recording.t)) < 1e-9
        assert any("resampled" in note for note in recording.notes)
        raw = np.loadtxt(recording.source, delimiter=",", skiprows=1)
        inside = (raw[:, 0] >= recording.t[0]) & (raw[:, 0] <= recording.t[-1])
        back = np.interp(raw[inside, 0], recording.t, recording.y)
        error = np.abs(back - raw[inside, 1])
        assert np.median(error) < 1e-3 and np.quantile(error, 0.999) < 0.1


def test_matlab_axis_by_mapping() -> None:
    mapping = {
        "time": {"column": "t", "unit": "s"},
        "position": {"column": "qm", "unit": "m"},
        "command": {"column": "vir", "unit": "N", "scale": "gtau"},
    }
    recording = read_recording(shared("emps", "DATA_EMPS.mat"), channels=ChannelMapping.model_validate(mapping))
    assert len(recording.t) == 24841 and recording.kind == "motor" and recording.input_unit == "N"
    import scipy.io

    raw = scipy.io.loadmat(shared("emps", "DATA_EMPS.mat"))
    np.testing.assert_array_equal(recording.y, raw["qm"].ravel())
    np.testing.assert_allclose(recording.drive_input, raw["vir"].ravel() * raw["gtau"].item())


def test_a_recording_keeps_its_own_arrays() -> None:
    """The caller's may change later, and are not frozen behind his back; read-only ones need no copy."""
    t = np.arange(0.0, 1.0, 1e-3)
    y, currents = np.sin(t), np.ones((3, t.size))
    recording = Recording("r", t, y, phase_currents=currents)
    y[0], currents[1, 2] = 7.0, 7.0
    assert recording.y[0] == 0.0 and recording.phase_currents is not None and recording.phase_currents[1, 2] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        recording.y[0] = 1.0
    shorter = replace(recording, t=recording.t[:10], y=recording.y[:10], phase_currents=None)
    assert np.shares_memory(shorter.y, recording.y)
