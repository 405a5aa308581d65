"""What a simpler form costs: closed forms, and the command on recordings of a known axis."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from linid.cli.main import cli
from linid.diagnosis.gap import RecordingGap
from linid.export.loss import Measured, loss_of, measure_loss, measure_model, readme
from linid.export.target import reshaped
from linid.identification.model_file import model_to_text
from tests.export.axis import EIGHT, result_of
from tests.simulation.axis_with_effects import campaign_with


def gaps(kind: str, ahead: tuple[float, ...]) -> tuple[RecordingGap, ...]:
    return tuple(
        RecordingGap(f"{kind}_{k}", kind, "held_out", x, 0.0, x, 0.0, 2.0 * x, 0.1, 0.0) for k, x in enumerate(ahead)
    )


def test_the_share_is_that_of_the_root_mean_squares() -> None:
    measured = Measured(gaps("driven", (10.0, 10.0)), gaps("driven", (2.0, 2.0)))
    ahead, force = loss_of(measured, gaps("driven", (4.0, 4.0))).kept
    assert (ahead.measure, force.measure) == ("ahead", "force")  # free runs of driven axes say nothing
    assert ahead.share == pytest.approx(0.75) and force.base == pytest.approx(20.0)
    assert (ahead.low, ahead.high) == (pytest.approx(0.75), pytest.approx(0.75))
    wheel = loss_of(Measured(gaps("free_wheel", (3.0,)), gaps("free_wheel", (1.0,))), gaps("free_wheel", (1.5,)))
    assert wheel.kept[0].measure == "free_run" and wheel.kept[0].share == pytest.approx(0.75)
    assert math.isnan(wheel.kept[0].low)  # one recording has no interval


def test_the_interval_tells_how_recordings_differ() -> None:
    measured = Measured(gaps("driven", (10.0,) * 4), gaps("driven", (0.0,) * 4))
    kept = loss_of(measured, gaps("driven", (0.0, 0.0, 0.0, 10.0))).kept[0]
    assert kept.share == pytest.approx(0.5) and kept.low <= 0.3 and kept.high == pytest.approx(1.0)


def test_effects_that_close_nothing_have_no_share() -> None:
    measured = Measured(gaps("driven", (1.0, 1.0)), gaps("driven", (1.0, 1.0)))
    loss = loss_of(measured, gaps("driven", (1.0, 1.0)))
    assert "close no gap" in loss.text and loss.row()["kept"][0]["share"] is None
    json.dumps(loss.row(), allow_nan=False)


def test_a_form_without_an_effect_loses_what_the_effect_explains() -> None:
    recordings = campaign_with(("cogging", "gravity"))[-2:]
    whole = result_of(("cogging", "gravity"), substeps=8)
    measured = measure_model(whole, None, recordings)
    assert measure_loss(measured, None, recordings).kept[0].share == pytest.approx(1.0)
    assert measure_loss(measured, reshaped(whole, effects=()), recordings).kept[0].share == pytest.approx(0.0)
    part = measure_loss(measured, reshaped(whole, effects=("gravity",)), recordings).kept[-1]
    assert part.measure == "force" and 0.1 < part.share < 0.95  # the constant part of gravity is kept, cogging is not


def test_the_readme_says_what_is_lost() -> None:
    assert "not computed" in readme(["one"], None, ["no cogging"]) and "- no cogging" in readme(
        ["one"], None, ["no cogging"]
    )


def _folder(tmp_path: Path) -> tuple[Path, Path]:
    """A model and a recording of its axis, as files."""
    model = tmp_path / "parameters.json"
    model.write_text(model_to_text(result_of(EIGHT)), encoding="utf-8")
    (recording,) = campaign_with(EIGHT)[-1:]
    columns = np.column_stack([recording.t, recording.y * 1e3, *np.atleast_2d(recording.phase_currents)])
    csv = tmp_path / "moves.csv"
    np.savetxt(
        csv,
        columns,
        delimiter=",",
        header="time (s),position (mm),current_u (A),current_v (A),current_w (A)",
        comments="",
    )
    return model, csv


def test_the_command_writes_files_and_losses(tmp_path: Path) -> None:
    model, csv = _folder(tmp_path)
    out = tmp_path / "out"
    arguments = ["export", str(model), str(csv), "--to", "python", "--to", "urdf", "--out", str(out), "--json", "-q"]
    done = CliRunner().invoke(cli, arguments)
    assert done.exit_code == 0, done.output
    whole, simple = json.loads(done.stdout)["targets"]
    assert whole["loss"]["kept"][0]["share"] == pytest.approx(1.0) and whole["lacks"] == []
    assert simple["loss"]["kept"][-1]["share"] < 0.9 and simple["lacks"]
    assert json.loads((out / "urdf" / "loss.json").read_text(encoding="utf-8")) == simple["loss"]
    assert simple["lacks"][0] in (out / "urdf" / "README.txt").read_text(encoding="utf-8")
    assert all(Path(name).is_file() for name in (*whole["files"], *simple["files"]))


@pytest.mark.parametrize(
    ("arguments", "code", "fact"),
    [
        (["{model}", "--to", "cobol"], 2, "no target 'cobol'"),
        (["nowhere.json", "--to", "python"], 3, "nowhere.json"),
        (["{model}", "--to", "python", "--base", "nowhere.json"], 3, "nowhere.json"),
        (["{model}"], 2, "--to"),
    ],
)
def test_what_cannot_be_exported_is_said(arguments: list[str], code: int, fact: str, tmp_path: Path) -> None:
    model = tmp_path / "model.json"
    model.write_text(model_to_text(result_of()), encoding="utf-8")
    done = CliRunner().invoke(
        cli, ["export", *(a.format(model=model) for a in arguments), "--out", str(tmp_path / "o")]
    )
    assert done.exit_code == code and fact in done.output
    assert not (tmp_path / "o" / "python").exists()


def test_the_list_names_all_targets() -> None:
    from linid.export.registry import all_targets

    shown = CliRunner().invoke(cli, ["export", "--list"]).output
    assert [line.split()[0] for line in shown.splitlines()] == list(all_targets())
