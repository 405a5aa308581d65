"""The command `diagnose`: what it writes can be checked by anyone, and a run cut short goes on to the same bytes."""

from __future__ import annotations

import json
import signal
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from linid.physics.laws.registry import LAWS
from tests.workflow.small import campaign, linid, start

MINUTES = 5.0


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("diagnosis")
    result = linid("diagnose", campaign(folder, motor=True), "--out", folder / "out", "--no-figures", "--jobs", 2)
    assert result.exit_code == 0, result.stderr
    return folder


def test_the_predictions_give_the_stated_free_run_gaps(undisturbed: Path) -> None:
    """RMS(simulated - measured)/std(measured), recomputed from the CSV files."""
    stated = json.loads((undisturbed / "out/diagnosis.json").read_text(encoding="utf-8"))
    assert stated["schema"] == 2 and stated["base_effects"] == []
    for one in stated["recordings"]:
        table = pd.read_csv(undisturbed / "out/predictions" / f"{one['recording']}.csv")
        measured = table["measured"].to_numpy()
        for when in ("before", "after"):
            error = table[f"free_run_{when}"].to_numpy() - measured
            size = float(np.sqrt(np.mean(error**2)) / np.std(measured))
            assert size == pytest.approx(one["measures"]["free_run"][when], rel=1e-4, abs=1e-6)


def test_the_friction_law_of_a_lugre_stand_is_not_another_one(undisturbed: Path) -> None:
    law = json.loads((undisturbed / "out/diagnosis.json").read_text(encoding="utf-8"))["friction_law"]
    assert law["law"] == law["base"] == "lugre" and law["closed"] == 0 and law["parameters"] == {}
    assert set(law["gains"]) == set(LAWS) and law["gains"]["lugre"] == {"gain": 0, "certainty": 0}
    page = (undisturbed / "out/report.html").read_text(encoding="utf-8")
    assert ("<h2>Friction law</h2>" in page) is not law["told"]
    before = json.loads((undisturbed / "out/model_before.json").read_text(encoding="utf-8"))
    assert before["law"] == "lugre"


@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGINT], ids=["kill -9", "Ctrl-C"])
def test_a_run_cut_short_goes_on_to_the_same_bytes(undisturbed: Path, tmp_path: Path, blow: signal.Signals) -> None:
    out = tmp_path / "out"
    arguments = ("diagnose", undisturbed / "campaign.yaml", "--out", out, "--no-figures")
    process = start(*arguments, cwd=tmp_path)
    deadline = time.monotonic() + 60.0 * MINUTES
    while _steps(out / "checkpoint.json") < 2:
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < deadline, "no checkpoint was written"
        time.sleep(0.01)
    process.send_signal(blow)
    process.communicate(timeout=60.0 * MINUTES)
    assert not (out / "diagnosis.json").exists(), "it ended before it could be cut short"
    result = linid(*arguments, "--resume", "--jobs", 2)
    assert result.exit_code == 0, result.stderr
    for name in ("diagnosis.json", "model_before.json", "predictions/freewheel_6.csv"):
        assert (out / name).read_bytes() == (undisturbed / "out" / name).read_bytes(), name


def _steps(checkpoint: Path) -> int:
    try:
        return len(json.loads(checkpoint.read_text(encoding="utf-8"))["state"])
    except (OSError, ValueError):
        return 0


def test_an_effect_may_belong_to_the_base(tmp_path: Path) -> None:
    path = campaign(tmp_path)
    result = linid("diagnose", path, "--out", tmp_path / "out", "--effect", "constant_force", "--no-figures")
    assert result.exit_code == 0, result.stderr
    stated = json.loads((tmp_path / "out/diagnosis.json").read_text(encoding="utf-8"))
    assert stated["base_effects"] == ["constant_force"]
    assert all(one["effect"] != "constant_force" for one in (*stated["ranking"], *stated["tried"]))
    before = json.loads((tmp_path / "out/model_before.json").read_text(encoding="utf-8"))
    assert before["effects"] == ["constant_force"]


def test_an_effect_that_makes_no_sense_is_refused(tmp_path: Path) -> None:
    result = linid("diagnose", campaign(tmp_path), "--out", tmp_path / "out", "--effect", "force_ripple")
    assert result.exit_code == 2 and "force_ripple" in result.stderr
