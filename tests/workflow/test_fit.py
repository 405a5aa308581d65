"""fit-friction and fit-motor from the command line: files, tables, exit codes, sameness on any number of threads."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest
import yaml

from linid.identification.model_file import load_model
from tests.workflow.small import STAND, TINY, campaign, linid, summary

FILES = {
    "config.yaml",
    "run.json",
    "checkpoint.json",
    "parameters.json",
    "parameters.csv",
    "parameters.tex",
    "convergence.csv",
    "gaps.csv",
    "gaps.tex",
    "gaps.json",
}


@pytest.fixture(scope="module")
def friction(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """One small friction fit with figures."""
    folder = tmp_path_factory.mktemp("friction")
    path = campaign(folder)
    out = folder / "out"
    options = [o for o in TINY if o != "--no-figures"]
    body = summary("fit-friction", path, "--out", out, *options, "--set", "figure_formats=[png]", "--seed", "3")
    return out, body


def test_a_friction_fit_finds_the_truth_and_writes_its_files(friction: tuple[Path, dict[str, Any]]) -> None:
    out, body = friction
    assert {p.name for p in out.iterdir() if not p.name.startswith(".")} == FILES | {"figures"}
    truth = yaml.safe_load((STAND / "truth.yaml").read_text(encoding="utf-8"))["parameters"]
    found = {p["name"]: p["value"] for p in body["parameters"]}
    for name in ("coulomb_force", "viscous_friction", "mass"):
        assert found[name] == pytest.approx(truth[name], rel=0.02)
    assert load_model(out / "parameters.json").value("mass") == found["mass"]
    assert [(g["recording"], g["split"]) for g in body["gaps"]] == [
        ("freewheel_2", "fit"),
        ("freewheel_4", "fit"),
        ("freewheel_6", "held_out"),
    ]


def test_figures_exist(friction: tuple[Path, dict[str, Any]]) -> None:
    figures = friction[0] / "figures"
    assert {p.name for p in figures.glob("*.*")} == {"free_wheel_displacement.png", "friction_curve.png"}
    held_out = {"gaps.png", "overview.png", "comparison_freewheel_6.png"}
    assert {p.name for p in (figures / "held_out").iterdir()} == held_out
    assert (figures / "held_out" / "comparison_freewheel_6.png").stat().st_size > 5000


@pytest.mark.parametrize(("how_many", "count"), [("all", 10), ("none", 0)])
def test_all_figures_or_none(friction: tuple[Path, dict[str, Any]], tmp_path: Path, how_many: str, count: int) -> None:
    path, settings = friction[0].parent / "campaign.yaml", friction[0] / "config.yaml"
    done = linid("fit-friction", path, "--config", settings, "--figures", how_many, "--out", tmp_path / "o")
    assert done.exit_code in (0, 5), done.stderr
    assert len(list((tmp_path / "o").rglob("*.png"))) == count
    few = [p.relative_to(friction[0]) for p in friction[0].rglob("*.png")]
    for name in few if how_many == "all" else []:
        assert (tmp_path / "o" / name).read_bytes() == (friction[0] / name).read_bytes()


def test_tables_are_shown_before_figures_are_drawn(
    friction: tuple[Path, dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A figure that cannot be drawn costs the exit code, not the tables."""
    import linid.report.figures.write as write
    from linid.report.figures import drawing_process

    def fail(*arguments: Any, **options: Any) -> None:
        raise OSError(28, "No space left on device", str(tmp_path))

    monkeypatch.setattr(write, "write_drawings", fail)
    monkeypatch.setattr(drawing_process, "begin", lambda: None)
    path, settings = friction[0].parent / "campaign.yaml", friction[0] / "config.yaml"
    done = linid("fit-friction", path, "--config", settings, "--out", tmp_path / "o")
    assert done.exit_code == 1 and "No space left" in done.stderr
    assert "F_C" in done.stdout and done.stdout.count("Results:") == 1
    assert (tmp_path / "o" / "gaps.csv").exists()
    assert json.loads((tmp_path / "o" / "run.json").read_text(encoding="utf-8"))["status"] == "failed"
    as_json = linid("fit-friction", path, "--config", settings, "--out", tmp_path / "j", "--json")
    assert json.loads(as_json.stdout)["exit_code"] == 1  # one document, not the summary and then the error


def test_the_run_record(friction: tuple[Path, dict[str, Any]]) -> None:
    record = json.loads((friction[0] / "run.json").read_text(encoding="utf-8"))
    assert record["seed"] == 3 and record["status"] in ("done", "not_converged")
    assert len(record["inputs"]) == 4 and all(len(entry["sha256"]) == 64 for entry in record["inputs"])
    assert {"numpy", "scipy", "numba", "python"} <= set(record["versions"])
    assert record["seconds"] > 0 and record["started"] <= record["finished"]


def test_the_resolved_configuration_gives_the_same_result_again(
    friction: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    out = friction[0]
    again = tmp_path / "again"
    linid("fit-friction", out.parent / "campaign.yaml", "--config", out / "config.yaml", "--out", again, "--no-figures")
    assert (again / "parameters.json").read_bytes() == (out / "parameters.json").read_bytes()
    assert (again / "gaps.json").read_bytes() == (out / "gaps.json").read_bytes()


def test_the_number_of_threads_changes_no_bit(friction: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    out = friction[0]
    path = out.parent / "campaign.yaml"
    linid("fit-friction", path, "--config", out / "config.yaml", "--out", tmp_path / "two", "--no-figures", "--jobs", 2)
    assert (tmp_path / "two" / "parameters.json").read_bytes() == (out / "parameters.json").read_bytes()
    assert (tmp_path / "two" / "gaps.json").read_bytes() == (out / "gaps.json").read_bytes()


def test_a_folder_stands_for_its_model(friction: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    out = friction[0]
    path, options = out.parent / "campaign.yaml", ("--config", out / "config.yaml", "--no-figures")
    for name, start in (("file", out / "parameters.json"), ("folder", out)):
        linid("fit-friction", path, *options, "--friction", start, "--out", tmp_path / name)
    found = [(tmp_path / name / "parameters.json").read_bytes() for name in ("file", "folder")]
    assert found[0] == found[1] != (out / "parameters.json").read_bytes()
    failed = linid("fit-motor", "--model", "sine", path, "--friction", tmp_path)
    assert failed.exit_code == 3
    assert "holds no parameters.json and no model_after.json" in failed.stderr and "--friction" in failed.stderr


def test_another_seed_is_another_search(friction: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    out = friction[0]
    path = out.parent / "campaign.yaml"
    linid("fit-friction", path, *TINY, "--seed", 4, "--out", tmp_path / "o")
    mine, other = ((f / "convergence.csv").read_text(encoding="utf-8") for f in (tmp_path / "o", out))
    assert mine != other


def test_the_convergence_history_counts_up(friction: tuple[Path, dict[str, Any]]) -> None:
    with (friction[0] / "convergence.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    genetic = [row for row in rows if row["stage"] == "genetic"]
    assert [int(row["generation"]) for row in genetic] == list(range(len(genetic)))
    best = [float(row["best"]) for row in genetic]
    assert best == sorted(best, reverse=True)


def test_bare_free_wheels_with_their_masses(tmp_path: Path) -> None:
    body = summary(
        "fit-friction",
        STAND / "freewheel_2.csv",
        STAND / "freewheel_4.csv",
        "--added-mass",
        "freewheel_4.csv=0.5",
        "--out",
        tmp_path / "o",
        *TINY,
    )
    found = {p["name"]: p["value"] for p in body["parameters"]}
    assert found["mass"] == pytest.approx(0.588, rel=0.02)


def test_a_known_mass_is_kept(tmp_path: Path) -> None:
    body = summary("fit-friction", STAND / "freewheel_2.csv", "--mass", 0.588, "--out", tmp_path / "o", *TINY)
    mass = next(p for p in body["parameters"] if p["name"] == "mass")
    assert (mass["value"], mass["status"]) == (0.588, "fixed")


def test_a_push_is_cut_and_shown(tmp_path: Path) -> None:
    """A pushed recording: at rest, 0.2 s of push, then the coast of a free wheel."""
    import numpy as np

    t, y = np.loadtxt(STAND / "freewheel_2.csv", delimiter=",", skiprows=1, usecols=(0, 1), unpack=True)
    speed = (y[20] - y[0]) / (t[20] - t[0])
    rest, push = np.full(300, 0.0), 0.5 * speed * np.arange(200) ** 2 / 200.0
    whole = np.concatenate([rest, push, push[-1] + speed + (y - y[0])]) + y[0]
    rng = np.random.default_rng(1)
    rows = "".join(f"{k},{x + 2e-4 * rng.standard_normal():.4f}\n" for k, x in enumerate(whole))
    path = tmp_path / "push.csv"
    path.write_text("Time (ms),Actual Position (mm)\n" + rows, encoding="utf-8")
    options = [o for o in TINY if o != "--no-figures"]
    result = linid("fit-friction", path, "--mass", 0.588, "--out", tmp_path / "o", *options)
    assert result.exit_code in (0, 5), result.stderr
    assert "pushed until" in result.stderr
    assert (tmp_path / "o" / "figures" / "coast_down_push.png").exists()
    fitted = load_model(tmp_path / "o" / "parameters.json")
    assert 0.45 < fitted.starts["push"].t < 0.65
    assert fitted.value("coulomb_force") == pytest.approx(1.72, rel=0.05)


def test_a_search_cut_short_exits_with_5_and_writes_its_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from dataclasses import replace

    import linid.identification.fit as module

    real = module.fit
    monkeypatch.setattr(module, "fit", lambda *a, **k: replace(real(*a, **k), converged=False))
    result = linid("fit-friction", campaign(tmp_path), "--out", tmp_path / "o", *TINY)
    assert result.exit_code == 5
    assert (tmp_path / "o" / "parameters.json").exists() and (tmp_path / "o" / "gaps.csv").exists()
    assert json.loads((tmp_path / "o" / "run.json").read_text(encoding="utf-8"))["status"] == "not_converged"


def test_a_motor_fit_keeps_its_friction_stage_and_rechecks_the_free_wheels(tmp_path: Path) -> None:
    out = tmp_path / "o"
    body = summary("fit-motor", "--model", "sine", campaign(tmp_path, motor=True), "--out", out, *TINY)
    assert (out / "friction" / "parameters.json").exists() and (out / "friction" / "checkpoint.json").exists()
    assert load_model(out / "friction" / "parameters.json").model == "friction"
    assert load_model(out / "parameters.json").model == "sine"
    assert {g["recording"] for g in body["gaps"]} == {
        "freewheel_2",
        "freewheel_4",
        "freewheel_6",
        "sine_current_2",
        "sine_current_3",
    }
    found = {p["name"]: p["value"] for p in body["parameters"]}
    assert found["electrical_wavenumber"] == pytest.approx(222.0, rel=0.02)
    again = tmp_path / "again"
    given = ("--friction", out / "friction" / "parameters.json")
    linid("fit-motor", "--model", "sine", tmp_path / "campaign.yaml", *given, "--out", again, *TINY)
    assert not (again / "friction").exists()
    assert load_model(again / "parameters.json").estimates == load_model(out / "parameters.json").estimates


def test_the_console_tables_lose_nothing(tmp_path: Path) -> None:
    result = linid("fit-friction", campaign(tmp_path), "--out", tmp_path / "o", *TINY)
    parameters, gaps = result.stdout.split("Gap between")
    assert max(len(line) for line in parameters.splitlines()) <= 80
    assert "coulomb_force" in parameters and "held out" in gaps
    shares = [
        row["force_share"] for row in json.loads((tmp_path / "o" / "gaps.json").read_text(encoding="utf-8"))["gaps"]
    ]
    lines = [line for line in gaps.splitlines() if line.startswith("freewheel")]
    assert [float(line.split()[-1]) for line in lines] == pytest.approx([100 * share for share in shares], rel=0.01)
    assert "genetic" in result.stderr and "genetic: 4/4" not in result.stdout


def test_quiet_says_nothing_on_stderr(tmp_path: Path) -> None:
    result = linid("fit-friction", campaign(tmp_path), "--out", tmp_path / "o", "-q", *TINY)
    assert result.stderr == ""


def test_without_out_a_fresh_dated_folder_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = campaign(tmp_path / "c")
    first, second = (summary("fit-friction", path, *TINY)["folder"] for _ in range(2))
    assert first != second and first.startswith("linid_fit-friction_20")
    assert linid("fit-friction", path, "--out", first, *TINY).exit_code == 2
    assert linid("fit-friction", path, "--out", first, "--overwrite", *TINY).exit_code in (0, 5)


def test_the_paper_s_search_by_options(tmp_path: Path) -> None:
    """Operators and rates reach the fit, nothing polishes it, and its exit code says that no minimum is claimed."""
    options = ("--method", "plain", "--selection", "roulette", "--crossover", "blend", "--crossover-rate", 0.5)
    options += ("--mutation", "gaussian", "--mutation-rate", 0.3, "--population", 12, "--generations", 3)
    out = tmp_path / "o"
    result = linid("fit-friction", campaign(tmp_path), *options, "--no-figures", "--out", out)
    assert result.exit_code == 5, result.stderr
    stored = json.loads((out / "parameters.json").read_text(encoding="utf-8"))
    assert {row["stage"] for row in stored["history"]} == {"plain"} if "history" in stored else True
    stages = {line.split(",")[0] for line in (out / "convergence.csv").read_text(encoding="utf-8").splitlines()[1:]}
    assert stages == {"plain"}
    text = (out / "config.yaml").read_text(encoding="utf-8")
    assert "selection: roulette" in text and "mutation_rate: 0.3" in text


def test_a_search_from_scratch_is_reported_in_one_line(tmp_path: Path) -> None:
    out = tmp_path / "o"
    body = summary("fit-friction", campaign(tmp_path), "--verify-search", "--no-figures", "--out", out)
    assert "independent search from random candidates (seed 2)" in body["search_check"]
    assert load_model(out / "parameters.json").search_check == body["search_check"]
    again = linid("fit-friction", campaign(tmp_path), "--resume", "--verify-search", "--no-figures", "--out", out)
    assert " ".join(body["search_check"].split()[:4]) in " ".join(again.stdout.split())
