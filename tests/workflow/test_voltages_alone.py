"""A file of time and voltages, a motor from its dimensions: simulated without any position."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

import linid as interface
from linid.recording import Recording
from linid.simulation.voltage_reference import simulate_voltage_reference
from tests.workflow.small import ROOT, designed_sine, linid, summary

R, L = 5.0, 1.7e-3  # of configs/motor_geometry.yaml


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return designed_sine(tmp_path_factory.mktemp("design"))


def voltages(t: np.ndarray) -> np.ndarray:
    """Three phases that rise from zero and turn slowly: the mover follows as a synchronous motor does."""
    angle = 2.0 * np.pi * 2.0 * t**2
    return np.stack([3.0 * (1.0 - np.exp(-t / 0.02)) * np.sin(angle + 2.0 * np.pi / 3.0 * j) for j in range(3)])


def test_a_designed_motor_runs_by_voltages_alone(model: Path, tmp_path: Path) -> None:
    t = np.arange(600) * 1e-3
    u = voltages(t)
    lines = "\n".join(",".join(f"{x:.9f}" for x in (1e3 * a, *b)) for a, b in zip(t, u.T, strict=True))
    path = tmp_path / "drive.csv"
    path.write_text("Time (ms),Voltage U (V),Voltage V (V),Voltage W (V)\n" + lines + "\n")
    start = ("--start-position", 0.002, "--start-speed", 0.0)
    body = summary("simulate", model, path, "--input", "voltage", *start, "--out", tmp_path / "o")
    assert body["simulations"][0]["measured"] is False
    with (tmp_path / "o" / "simulations" / "drive.csv").open(encoding="utf-8") as stream:
        rows = list(csv.reader(stream))
    assert rows[0][1] == "y_measured (m)" and {row[1] for row in rows[1:]} == {""}
    found = np.array([[float(x) for x in (row[2], *row[4:])] for row in rows[1:]])
    assert (tmp_path / "o" / "figures" / "simulation_drive.png").exists()

    values = {e.name: e.value for e in interface.load(model).result.estimates}
    assert (values["phase_resistance"], values["phase_inductance"]) == (R, L)
    driven = Recording("drive", t, np.full(t.size, math.nan), phase_voltages=np.round(u, 9))
    exact = simulate_voltage_reference("sine", "star", values, driven, (0.002, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert np.ptp(exact.y) > 5e-3
    assert np.abs(found[:, 0] - exact.y).max() < 1e-6
    assert np.abs(found[:, 1:].T - exact.currents).max() < 1e-3 * np.abs(exact.currents).max()


def test_without_a_start_it_is_at_rest_at_zero(model: Path, tmp_path: Path) -> None:
    t = np.arange(200) * 1e-3
    still = Recording("still", t, np.full(t.size, math.nan), phase_voltages=voltages(t))
    trace = interface.simulate(interface.load(model), still, by_voltage=True)
    assert trace.y_simulated[0] == 0.0 and trace.velocity_simulated[0] == 0.0


def test_a_file_without_position_is_still_refused_elsewhere(model: Path, tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text(
        "Time (ms),Voltage U (V),Voltage V (V),Voltage W (V)\n" + "".join(f"{k},1,0,-1\n" for k in range(60))
    )
    result = linid("simulate", model, path, "--out", tmp_path / "o")
    assert result.exit_code == 4 and "no position column" in result.stderr


def test_separate_windings_keep_their_mutual_inductance(tmp_path: Path) -> None:
    text = (ROOT / "configs" / "motor_geometry.yaml").read_text()
    star = "mutual_inductance_h: 0.0, connection: star"
    assert star in text
    for mutual, connection, expected in ((-3e-4, "separate", (L, -3e-4)), (-3e-4, "star", (L + 3e-4, None))):
        geometry = tmp_path / f"{connection}.yaml"
        geometry.write_text(text.replace(star, f"mutual_inductance_h: {mutual}, connection: {connection}"))
        out = tmp_path / connection
        assert linid("field", geometry, "--no-figures", "--out", out).exit_code == 0
        result = interface.load(out / "model_theta.json").result
        values = {e.name: e.value for e in result.estimates}
        assert result.winding == connection
        assert values["phase_inductance"] == pytest.approx(expected[0])
        assert values.get("mutual_inductance") == expected[1]
