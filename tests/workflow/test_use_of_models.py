"""validate, simulate and generate from the command line."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.workflow.small import ROOT, STAND, TINY, campaign, linid, summary


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A friction MODEL."""
    folder = tmp_path_factory.mktemp("model")
    linid("fit-friction", campaign(folder), "--out", folder / "out", *TINY)
    return folder / "out" / "parameters.json"


def test_validate_takes_the_held_out_recordings(model: Path, tmp_path: Path) -> None:
    out = tmp_path / "o"
    body = summary("validate", model, model.parents[1] / "campaign.yaml", "--out", out, "--set", "figure_formats=[png]")
    assert [g["recording"] for g in body["gaps"]] == ["freewheel_6"]
    assert body["gaps"][0]["free_run"] < 0.01
    assert (out / "figures" / "gaps.png").exists() and (out / "gaps.csv").exists()


@pytest.mark.parametrize(("split", "count"), [("all", 3), ("fit", 2), ("held_out", 1)])
def test_validate_split(model: Path, tmp_path: Path, split: str, count: int) -> None:
    path = model.parents[1] / "campaign.yaml"
    body = summary("validate", model, path, "--split", split, "--no-figures", "--out", tmp_path / "o")
    assert len(body["gaps"]) == count


def test_validate_needs_recordings_that_the_model_knows(model: Path, tmp_path: Path) -> None:
    result = linid("validate", model, STAND / "moves_1.csv", "--out", tmp_path / "o")
    assert result.exit_code == 4 and "friction model" in result.stderr


def test_validate_dry_run(model: Path, tmp_path: Path) -> None:
    result = linid("validate", model, model.parents[1] / "campaign.yaml", "--dry-run", "--out", tmp_path / "o")
    assert result.exit_code == 0 and "freewheel_6" in result.output and not (tmp_path / "o").exists()


def read_simulation(path: Path) -> np.ndarray:
    with path.open(encoding="utf-8") as stream:
        rows = list(csv.reader(stream))
    assert rows[0] == ["t (s)", "y_measured (m)", "y_simulated (m)", "v (m/s)"]
    return np.array(rows[1:], dtype=float)


def test_simulate_writes_the_free_run(model: Path, tmp_path: Path) -> None:
    out = tmp_path / "o"
    body = summary("simulate", model, STAND / "freewheel_6.csv", "--out", out, "--added-mass", 1.0)
    table = read_simulation(out / "simulations" / "freewheel_6.csv")
    assert table.shape == (1500, 4)
    rms = float(np.sqrt(np.mean((table[:, 2] - table[:, 1]) ** 2)))
    assert body["simulations"][0]["rms_error"] == pytest.approx(rms, rel=1e-3)
    assert rms < 0.01 * np.std(table[:, 1])
    assert (out / "figures" / "simulation_freewheel_6.png").exists()


def test_simulate_from_a_given_start(model: Path, tmp_path: Path) -> None:
    out = tmp_path / "o"
    given = ("--start-position", 0.25, "--start-speed", 0.3, "--added-mass", 1.0, "--no-figures")
    assert linid("simulate", model, STAND / "freewheel_6.csv", "--out", out, *given).exit_code == 0
    table = read_simulation(out / "simulations" / "freewheel_6.csv")
    assert table[0, 2] == 0.25 and table[0, 3] == 0.3
    assert table[-1, 2] > 0.25 and table[-1, 3] < 0.3


def test_generate_gives_the_stand_again(tmp_path: Path) -> None:
    out = tmp_path / "o"
    result = linid("generate", ROOT / "configs" / "stand_axis.yaml", "--only", "freewheel_2", "--out", out)
    assert result.exit_code == 0, result.stderr
    assert (out / "freewheel_2.csv").read_bytes() == (STAND / "freewheel_2.csv").read_bytes()
    assert yaml.safe_load((out / "truth.yaml").read_text(encoding="utf-8"))["seed"] == 1
    again = linid("generate", ROOT / "configs" / "stand_axis.yaml", "--only", "freewheel_2", "--out", out)
    assert again.exit_code == 2 and "--overwrite" in again.stderr


def test_generate_in_another_layout_is_read_back(tmp_path: Path) -> None:
    out = tmp_path / "o"
    options = ("--layout", "twincat", "--decimal-mark", ",", "--only", "freewheel_2", "--out", out)
    assert linid("generate", ROOT / "configs" / "stand_axis.yaml", *options).exit_code == 0
    body = json.loads(linid("inspect", out / "freewheel_2.csv", "--json").stdout)
    assert body["layout"] == "twincat" and body["problem"] is None


def test_generate_of_a_wrong_axis_exits_with_3(tmp_path: Path) -> None:
    path = tmp_path / "axis.yaml"
    path.write_text("name: x\nmass: 3\n", encoding="utf-8")
    result = linid("generate", path)
    assert result.exit_code == 3 and "mass_kg" in result.stderr
