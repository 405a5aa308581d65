"""Campaigns over time beside one model: order, rows, the page, exit codes, a batch that does the same."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from linid.cli.main import cli
from linid.errors import ConfigError
from linid.identification.model_file import model_to_text
from linid.report.files import write_atomic
from linid.workflow.batch.file import read_batch
from linid.workflow.commands.monitor import in_time
from tests.diagnosis import machine
from tests.diagnosis.test_foreign import HEAVIER, NOISE, SPEEDS


def write_campaign(folder: Path, recorded: str, heavier: float) -> Path:
    """Recordings of the machine solved by hand, with a mass that its model does not know."""
    folder.mkdir(parents=True)
    lines = [f"recorded: {recorded}", "recordings:"]
    for k, speed in enumerate(SPEEDS, 1):
        one = machine.recording(duration=2.0)
        assert one.drive_input is not None
        noise = NOISE * np.random.default_rng(k).standard_normal(one.t.size)
        y = machine.position(one.t, v0=speed, added=heavier) + noise
        rows = [f"{t:.3f};{1e3 * p:.6f};{i:.9f}" for t, p, i in zip(one.t, y, one.drive_input, strict=True)]
        text = "\n".join(["time (s);position (mm);i_q (A)", *rows])
        (folder / f"run_{k}.csv").write_text(text + "\n", encoding="utf-8")
        lines.append(f"  - {{file: run_{k}.csv, split: {'held_out' if k % 4 == 0 else 'fit'}}}")
    (folder / "campaign.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder / "campaign.yaml"


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_atomic(tmp_path_factory.mktemp("model") / "model.json", model_to_text(machine.result()).encode())


def test_a_heavier_machine_is_told_from_the_day_on_which_it_was(tmp_path: Path, model: Path) -> None:
    late = write_campaign(tmp_path / "late", "2026-11-02", HEAVIER)
    early = write_campaign(tmp_path / "early", "2026-05-02", 0.0)
    out = tmp_path / "out"
    arguments = ["monitor", str(model), str(late), str(early), "--out", str(out), "--jobs", "1", "--json", "-q"]
    done = CliRunner().invoke(cli, arguments)
    assert done.exit_code == 6, done.output
    summary = json.loads(done.stdout)
    assert [one["campaign"] for one in summary["campaigns"]] == ["early", "late"] and summary["changed"] == ["late"]
    with (out / "monitor.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    (mass,) = (row for row in rows if row["kind"] == "parameter")
    assert (mass["campaign"], mass["item"], mass["recorded"]) == ("late", "mass", "2026-11-02")
    assert float(mass["value"]) == pytest.approx(machine.MASS + HEAVIER, rel=2e-3)
    assert float(mass["commissioned"]) == machine.MASS
    told = json.loads((out / "late" / "diagnosis.json").read_text(encoding="utf-8"))["compensation"]
    found = {
        row["item"]: float(row["value"])
        for row in rows
        if row["campaign"] == "late" and row["kind"] == "following error"
    }
    assert list(found.values()) == pytest.approx([told[case]["rms"]["value"] for case in ("without", "base", "full")])
    early, late = summary["campaigns"]
    assert early["following"] == "" and "with today's" in late["following"]
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "trend-mass" in page and "2026-05-02" in page
    # Nothing is done twice, and what was found stands.
    again = CliRunner().invoke(cli, [*arguments, "--resume"])
    assert again.exit_code == 6, again.output
    assert json.loads(again.stdout)["campaigns"] == summary["campaigns"]


def test_a_campaign_that_fails_is_named_and_the_others_are_kept(tmp_path: Path, model: Path) -> None:
    good = write_campaign(tmp_path / "good", "2026-05-02", 0.0)
    bad = write_campaign(tmp_path / "bad", "2026-06-02", 0.0)
    (tmp_path / "bad" / "run_1.csv").write_text("time (s);position (mm);i_q (A)\n0;1;2\n", encoding="utf-8")
    out = tmp_path / "out"
    done = CliRunner().invoke(cli, ["monitor", str(model), str(good), str(bad), "--out", str(out), "--jobs", "1", "-q"])
    assert done.exit_code == 4 and "run_1.csv" in done.output
    assert (out / "good" / "diagnosis.json").exists() and (out / "report.html").exists()


def test_campaigns_stand_in_the_order_of_their_days_where_all_have_one(tmp_path: Path) -> None:
    days = {"a": "2026-03-01", "b": "2026-01-01", "c": ""}
    paths = []
    for name, day in days.items():
        path = tmp_path / f"{name}.yaml"
        path.write_text((f"recorded: {day}\n" if day else "") + "recordings: [{file: x.csv}]\n", encoding="utf-8")
        paths.append(path)
    assert [path.stem for path, _ in in_time(paths[:2])] == ["b", "a"]
    assert in_time(paths[:2])[0][1] == "2026-01-01"
    assert [path.stem for path, _ in in_time(paths)] == ["a", "b", "c"]
    with pytest.raises(ConfigError, match="is no campaign"):
        in_time([tmp_path / "x.csv"])


def test_a_batch_diagnoses_against_a_model_too(tmp_path: Path, model: Path) -> None:
    write_atomic(tmp_path / "model.json", model.read_bytes())
    (tmp_path / "campaign.yaml").write_text("recordings: [{file: x.csv}]\n", encoding="utf-8")
    job = "{name: today, command: diagnose, files: [campaign.yaml], since: model.json}"
    (tmp_path / "batch.yaml").write_text(f"jobs: [{job}]\n", encoding="utf-8")
    (spec,) = read_batch(tmp_path / "batch.yaml", {})
    assert spec.models == {"since": str(tmp_path / "model.json")}
