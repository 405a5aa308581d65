"""The paper's reproduction as a batch: every counterpart under its name, a page without outside references."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import pytest

from tests.workflow.small import ROOT, STAND, linid, summary

CASES = ("sine_current", "square_current", "sine_position", "moves")
NUMBERS = (3, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17)


def campaign(folder: Path, *, cases: tuple[str, ...] = CASES) -> Path:
    """Three free wheels and both splits of each case, shortened."""
    rows = [("freewheel_2", "free_wheel", "fit", 0.0), ("freewheel_4", "free_wheel", "fit", 0.5)]
    rows.append(("freewheel_5", "free_wheel", "fit", 1.0))
    for case in cases:
        held_out = 3 if case != "square_current" else 2
        rows += [(f"{case}_1", "motor", "fit", 0.0), (f"{case}_{held_out}", "motor", "held_out", 0.0)]
    lines = ["name: small", "recordings:"]
    for name, kind, split, mass in rows:
        window = ", window: [0.0, 1.2]" if kind == "motor" else ""
        lines.append(f"  - {{file: {STAND / name}.csv, kind: {kind}, split: {split}, added_mass_kg: {mass}{window}}}")
    path = folder / "campaign.yaml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def batch(folder: Path, files: Path) -> Path:
    geometry = ROOT / "configs" / "motor_geometry.yaml"
    text = f"""
defaults: {{population: 10, generations: 2, least_squares_steps: 4, figures: false, figure_formats: [png]}}
jobs:
  - {{name: friction, command: fit-friction, files: [{files}]}}
  - {{name: motor, command: fit-motor, model: [sine, theta], friction: friction, files: [{files}]}}
  - {{name: field, command: field, geometry: {geometry}, model: motor_theta, friction: friction}}
  - {{name: imposed, command: generate, axis: {ROOT / "configs" / "stand_by_voltage.yaml"},
      only: [freewheel_1, freewheel_2, sine_voltage_1, sine_voltage_2]}}
  - {{name: voltage, command: fit-motor, model: sine, input: voltage, files: ["job:imposed"]}}
  - {{name: paper, command: reproduce, files: [{files}], geometry: {geometry}, friction: friction, sine: motor_sine,
      theta: motor_theta, narrow_files: [{files}], narrow_sine: motor_sine, narrow_theta: motor_theta,
      voltage_files: ["job:imposed"], voltage_model: voltage}}
"""
    path = folder / "batch.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.slow
def test_every_counterpart_is_written_under_its_name(tmp_path: Path) -> None:
    out = tmp_path / "o"
    body = summary("batch", batch(tmp_path, campaign(tmp_path)), "--out", out, "--jobs", 2)
    labels = ["friction", "motor_sine", "motor_theta", "field", "imposed", "voltage", "paper"]
    assert [job["label"] for job in body["jobs"]] == labels
    assert {job["status"] for job in body["jobs"]} <= {"done", "not_converged"}
    assert (out / "field" / "field.json").exists() and (out / "field" / "model_theta.json").exists()
    names = {path.name for path in (out / "paper" / "figures").iterdir()}
    for number in NUMBERS:
        assert any(re.match(rf"figure_{number:02d}_\w+\.png$", name) for name in names), number
    assert "figure_by_voltage.png" in names
    page = (out / "paper" / "paper.html").read_text(encoding="utf-8")
    assert "eqs. (31) and (39)" in page
    assert not re.findall(r'(?:src|href)="(?!data:|#)', page) and "<script" not in page
    assert all(f"Fig. {number}:" in page for number in NUMBERS)
    markdown = (out / "paper" / "paper.md").read_text(encoding="utf-8")
    assert markdown.count("**") == 2 * 13
    with (out / "paper" / "table_3_theta.csv").open(encoding="utf-8") as stream:
        rows = {row["name"]: row for row in csv.DictReader(stream)}
    assert float(rows["nome"]["printed"]) == 0.493 and rows["bristle_stiffness"]["meant"] == "11690.0"
    assert (out / "paper" / "table_2_sine.tex").read_text(encoding="utf-8").count(r"\\") > 10


def test_a_campaign_without_a_case_is_refused(tmp_path: Path) -> None:
    files = campaign(tmp_path, cases=CASES[:3])
    model = tmp_path / "model.json"
    made = linid("field", ROOT / "configs" / "motor_geometry.yaml", "--out", tmp_path / "field", "--no-figures")
    assert made.exit_code == 0
    model.write_bytes((tmp_path / "field" / "model_sine.json").read_bytes())
    text = f"""
jobs:
  - {{name: paper, command: reproduce, files: [{files}], geometry: {ROOT / "configs" / "motor_geometry.yaml"},
      friction: {model}, sine: {model}, theta: {model}, narrow_files: [{files}], narrow_sine: {model},
      narrow_theta: {model}}}
"""
    path = tmp_path / "batch.yaml"
    path.write_text(text, encoding="utf-8")
    result = linid("batch", path, "--out", tmp_path / "o")
    assert result.exit_code == 4 and "moves_" in result.stdout


def test_recordings_by_voltage_need_a_model_of_the_windings(tmp_path: Path) -> None:
    path = batch(tmp_path, campaign(tmp_path))
    path.write_text(path.read_text(encoding="utf-8").replace(", voltage_model: voltage", ""), encoding="utf-8")
    result = linid("batch", path, "--out", tmp_path / "o")
    assert result.exit_code == 3 and "belong together" in result.stderr and not (tmp_path / "o").exists()


@pytest.mark.parametrize("key", ["geometry", "sine", "narrow_files"])
def test_a_missing_file_is_named_before_anything_runs(tmp_path: Path, key: str) -> None:
    files, geometry = campaign(tmp_path), ROOT / "configs" / "motor_geometry.yaml"
    model = tmp_path / "model.json"
    model.write_text("{}", encoding="utf-8")
    given = {
        "files": f"[{files}]",
        "geometry": geometry,
        "friction": model,
        "sine": model,
        "theta": model,
        "narrow_files": f"[{files}]",
        "narrow_sine": model,
        "narrow_theta": model,
    }
    given[key] = "[gone.yaml]" if key == "narrow_files" else "gone.json"
    lines = "".join(f"    {name}: {value}\n" for name, value in given.items())
    path = tmp_path / "batch.yaml"
    path.write_text(f"jobs:\n  - name: paper\n    command: reproduce\n{lines}", encoding="utf-8")
    result = linid("batch", path, "--out", tmp_path / "o")
    assert result.exit_code == 3 and "gone" in result.stderr and not (tmp_path / "o").exists()
