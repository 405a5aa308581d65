"""simulate --controller and validate --controller, on a motor designed from its magnets."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

import linid as interface
from tests.workflow.small import ROOT, designed_sine, linid, summary

CONTROLLER = ROOT / "configs" / "controller.yaml"
ROUNDED = 2e-9  # m, by nine digits of the file


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return designed_sine(tmp_path_factory.mktemp("design"))


def write(path: Path, header: str, columns: list[np.ndarray]) -> Path:
    rows = "\n".join(",".join(f"{x:.9f}" for x in row) for row in np.column_stack(columns))
    path.write_text(f"{header}\n{rows}\n")
    return path


def table(path: Path) -> np.ndarray:
    with path.open(encoding="utf-8") as stream:
        return np.array(list(csv.reader(stream))[1:], dtype=float)


def test_a_model_follows_a_reference_and_a_machine_is_laid_beside_it(model: Path, tmp_path: Path) -> None:
    t = np.arange(800) * 1e-3
    course = 20.0 * np.sin(2.0 * np.pi * 1.5 * t) ** 3  # mm, from rest
    alone = write(tmp_path / "reference.csv", "Time (ms),Position (mm)", [1e3 * t, course])
    body = summary("simulate", model, alone, "--controller", CONTROLLER, "--out", tmp_path / "alone")
    found = table(tmp_path / "alone" / "closed_loop" / "reference.csv")
    np.testing.assert_allclose(found[:, 1], 1e-3 * course, atol=ROUNDED)
    np.testing.assert_allclose(found[:, 1] - found[:, 2], found[:, 3], atol=ROUNDED)
    row = body["closed_loop"][0]
    assert row["following_error_rms"] == pytest.approx(np.sqrt(np.mean(found[:, 3] ** 2)), rel=1e-3)
    assert 0.0 < row["following_error_largest"] < 1e-3 and row["share_limited"] == 0.0
    assert (tmp_path / "alone" / "figures" / "closed_loop_reference.png").exists()

    currents = [0.1 * np.sin(30.0 * t + 2.0 * np.pi / 3.0 * j) for j in range(3)]
    header = "Time (ms),Actual Position (mm),Set Position (mm)," + ",".join(f"Current {p} (A)" for p in "UVW")
    write(tmp_path / "machine.csv", header, [1e3 * t, 1e3 * found[:, 2], course, *currents])
    campaign = tmp_path / "campaign.yaml"
    campaign.write_text("channels: {reference: 'Set Position'}\nrecordings: [{file: machine.csv, kind: motor}]\n")
    one = interface.read(campaign).recordings[0]
    assert one.reference is not None
    np.testing.assert_allclose(one.reference, 1e-3 * course, atol=ROUNDED)
    body = summary(
        "validate", model, campaign, "--controller", CONTROLLER, "--no-figures", "--out", tmp_path / "beside"
    )
    row = body["closed_loop"][0]
    assert row["gap_rms"] < ROUNDED
    assert row["following_error_measured_rms"] == pytest.approx(row["following_error_rms"], abs=ROUNDED)
    told = linid("validate", model, campaign, "--no-figures", "--out", tmp_path / "open")
    assert told.exit_code == 0 and "--controller compares" in told.stderr


def test_what_cannot_follow_is_said(model: Path, tmp_path: Path) -> None:
    wrong = tmp_path / "controller.yaml"
    wrong.write_text("position_gain_per_s: 60\nspeed_gain: 5\n")
    stand = ROOT / "data" / "stand" / "moves_1.csv"
    result = linid("simulate", model, stand, "--controller", wrong, "--out", tmp_path / "a")
    assert result.exit_code == 3 and "speed_gain" in result.stderr
    result = linid("validate", model, stand, "--controller", CONTROLLER, "--no-figures", "--out", tmp_path / "b")
    assert result.exit_code == 4 and "reference" in result.stderr
