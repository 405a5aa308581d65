"""Phase voltages: found by name or mapping, all three or none, and carried along with the other channels."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from linid.recording import ChannelMapping, inspect_file, read_campaign, read_recording, starter_mapping, trim
from linid.recording.names import candidates
from linid.workflow.run.inputs import fingerprint

from .expectations import error_of
from .exports import HEADER, IU, IV, IW, N, T, lines, rows, write

VOLTAGES = np.round(np.stack([20 * IU + 1.0, 20 * IV, 20 * IW - 0.5]), 3)
NAMES = ["Phase U Voltage (V)", "Phase V Voltage (V)", "Phase W Voltage (V)"]


def export(names: list[str] = NAMES, *, currents: bool = True) -> list[str]:
    """The clean export with one more column per name; without the currents if so asked."""
    width = 5 if currents else 2
    head = [",".join([*HEADER.split(",")[:width], *names])]
    body = [
        ",".join([*row.split(",")[:width], *(f"{x:.3f}" for x in VOLTAGES[: len(names), k])])
        for k, row in enumerate(rows())
    ]
    return head + body


def test_voltages_beside_currents(tmp_path: Path) -> None:
    plain = read_recording(write(tmp_path, lines(), "plain.csv"))
    recording = read_recording(write(tmp_path, export()))
    assert plain.phase_voltages is None and recording.notes == plain.notes == ()
    assert recording.phase_voltages is not None and not recording.phase_voltages.flags.writeable
    np.testing.assert_array_equal(recording.phase_voltages, VOLTAGES)
    np.testing.assert_array_equal(recording.phase_currents, plain.phase_currents)
    assert fingerprint([plain])[0][1] != fingerprint([recording])[0][1]


@pytest.mark.parametrize("kind", [None, "motor", "free_wheel"])
def test_voltages_alone_drive_a_motor(tmp_path: Path, kind: str | None) -> None:
    recording = read_recording(write(tmp_path, export(currents=False)), kind=kind)
    assert recording.kind == (kind or "motor")
    assert recording.phase_currents is None and recording.phase_voltages is not None and recording.notes == ()


def test_back_emf_without_current_is_a_free_wheel(tmp_path: Path) -> None:
    still = [
        line if not k else ",".join([*line.split(",")[:2], "0", "0", "0", *line.split(",")[5:]])
        for k, line in enumerate(export())
    ]
    recording = read_recording(write(tmp_path, still))
    assert recording.kind == "free_wheel" and recording.notes == ()


def test_silent_voltages_are_no_drive(tmp_path: Path) -> None:
    silent = [
        line if not k else ",".join([*line.split(",")[:2], "0", "0", "0"])
        for k, line in enumerate(export(currents=False))
    ]
    path = write(tmp_path, silent)
    assert read_recording(path).kind == "free_wheel"
    assert "all voltages are zero" in read_recording(path, kind="motor").notes[0]


@pytest.mark.parametrize("currents", [True, False])
def test_two_voltages_are_refused(tmp_path: Path, currents: bool) -> None:
    path = write(tmp_path, export(NAMES[:2], currents=currents))
    error_of(path, "found 2 of the three phase voltages", "voltage_w missing", "all three")
    problem = inspect_file(path).problem
    assert problem is not None and "voltage_w missing" in problem


def test_one_mapped_voltage_is_refused_and_mapped_currents_do_without(tmp_path: Path) -> None:
    path = write(tmp_path, export(["Phase U Voltage (V)", "State", "Mode"]))
    one = ChannelMapping.model_validate({"voltage_u": "Phase U Voltage"})
    error_of(path, "found 1 of the three", "voltage_v and voltage_w missing", channels=one)
    path = write(tmp_path, export(NAMES[:2]))
    currents = ChannelMapping.model_validate({f"current_{p}": f"Phase Current {p.upper()}" for p in "uvw"})
    assert read_recording(path, channels=currents).phase_voltages is None


def test_mapped_voltages_keep_the_currents_found_by_name(tmp_path: Path) -> None:
    path = write(tmp_path, export(["A", "B", "C"]))
    mapping = {f"voltage_{p}": {"column": c, "unit": "mV"} for p, c in zip("uvw", "ABC", strict=True)}
    recording = read_recording(path, channels=ChannelMapping.model_validate(mapping))
    assert recording.phase_currents is not None
    np.testing.assert_allclose(recording.phase_voltages, 1e-3 * VOLTAGES, rtol=1e-15)


def test_units_are_asked_for_and_checked(tmp_path: Path) -> None:
    names = ["Voltage U", "Voltage V", "Voltage W"]
    error_of(write(tmp_path, export(names)), "no unit declared", "unit: V")
    error_of(write(tmp_path, export([f"{n} (A)" for n in names])), "'A' is a current, expected a voltage")
    counts = {f"voltage_{p}": {"column": f"Voltage {p.upper()}", "unit": "counts"} for p in "uvw"}
    path = write(tmp_path, export(names))
    error_of(path, "in V per count", channels=ChannelMapping.model_validate(counts))


@pytest.mark.parametrize(
    "names",
    [
        ["Phase U Voltage", "Phase V Voltage", "Phase W Voltage"],
        ["PhaseVoltageU", "PhaseVoltageV", "PhaseVoltageW"],
        ["Voltage U Actual", "Voltage V Actual", "Voltage W Actual"],
        ["Axis 1 Voltage A", "Axis 1 Voltage B", "Axis 1 Voltage C"],
        ["U_U", "U_V", "U_W"],
        ["V_a", "V_b", "V_c"],
        ["U1", "U2", "U3"],
        ["U_L1", "U_L2", "U_L3"],
        ["Spannung Phase 1", "Spannung Phase 2", "Spannung Phase 3"],
        ["L1 Voltage", "L2 Voltage", "L3 Voltage"],
    ],
)
def test_names_of_phase_voltages(names: list[str]) -> None:
    found = candidates(names)
    assert [found[role] for role in ("voltage_u", "voltage_v", "voltage_w")] == [[0], [1], [2]]
    assert not any(found[role] for role in ("current_u", "position", "command", "time"))


@pytest.mark.parametrize(
    "names",
    [
        ["Voltage U-V", "Voltage V-W", "Voltage W-U"],
        ["U-V Voltage", "V-W Voltage", "W-U Voltage"],
        ["L1-L2 Voltage", "L2-L3 Voltage", "L3-L1 Voltage"],
        ["U_UV", "U_VW", "U_WU"],
        ["Input Voltage 1", "Input Voltage 2", "Input Voltage 3"],
        ["Phase U Voltage Command", "Phase V Voltage Setpoint", "Voltage W Reference"],
        ["DC Bus Voltage", "Supply Voltage", "Voltage Q"],
        ["v 1", "v 2", "v 3"],
    ],
)
def test_names_of_other_voltages(names: list[str]) -> None:
    found = candidates(names)
    assert not any(found[role] for role in ("voltage_u", "voltage_v", "voltage_w"))


def test_voltages_are_cut_and_resampled_with_the_rest(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path, export()))
    cut = trim(recording, 0.02, 0.05)
    np.testing.assert_array_equal(cut.phase_voltages, VOLTAGES[:, 20:51])
    t = T + np.random.default_rng(1).uniform(-2e-4, 2e-4, N)
    columns = [1e3 * t, 100 + 5 * np.sin(20 * t), *(20 * np.cos(20 * t + k) for k in range(3))]
    head = ",".join(["Time (ms)", "Position (mm)", *NAMES])
    uneven = [head, *(",".join(f"{x:.9f}" for x in row) for row in zip(*columns, strict=True))]
    resampled = read_recording(write(tmp_path, uneven))
    assert any("resampled" in note for note in resampled.notes)
    course = np.stack([20 * np.cos(20 * resampled.t + k) for k in range(3)])
    np.testing.assert_allclose(resampled.phase_voltages, course, atol=1e-5)


def test_inspection_maps_the_voltages(tmp_path: Path) -> None:
    path = write(tmp_path, export())
    seen = inspect_file(path)
    assert [column.channel for column in seen.columns[5:]] == ["voltage_u", "voltage_v", "voltage_w"]
    assert {column.si for column in seen.columns[5:]} == {"V"}
    channels = yaml.safe_load(starter_mapping(seen))["channels"]
    again = read_recording(path, channels=ChannelMapping.model_validate(channels))
    np.testing.assert_array_equal(again.phase_voltages, VOLTAGES)
    bare = write(tmp_path, [",".join(line.split(",")[:2]) for line in lines()])
    assert "voltage_u: {column: TODO, unit: V}" in starter_mapping(inspect_file(bare))


def test_a_campaign_maps_voltages_for_all(tmp_path: Path) -> None:
    write(tmp_path, export(["Ua", "Ub", "Uc"]), "run.csv")
    (tmp_path / "campaign.yaml").write_text(
        "channels:\n"
        "  voltage_u: {column: Ua, unit: V}\n  voltage_v: {column: Ub, unit: V}\n  voltage_w: {column: Uc, unit: V}\n"
        "recordings:\n  - {file: run.csv}\n"
    )
    (recording,) = read_campaign(tmp_path / "campaign.yaml").recordings
    np.testing.assert_array_equal(recording.phase_voltages, VOLTAGES)
