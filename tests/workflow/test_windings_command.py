"""fit-motor and simulate by phase voltages: the stages and their files, resumption, and the same by the interface."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import linid as interface
from linid.workflow.run.settings import parse_assignment
from tests.workflow.small import ROOT, TINY, linid

NAMES = ("freewheel_1", "sine_current_1", "sine_current_2")
TASK = ("--model", "sine", "--input", "voltage", "--mass", 3, *TINY)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("voltage") / "stand"
    only = [word for name in NAMES for word in ("--only", name)]
    assert linid("generate", ROOT / "configs" / "stand_voltage.yaml", *only, "--out", folder).exit_code == 0
    return folder / "campaign.yaml"


@pytest.fixture(scope="module")
def run(path: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("windings") / "o"
    done = linid("fit-motor", path, *TASK, "--out", out)
    assert done.exit_code in (0, 5), done.output
    return out


def test_each_stage_has_its_files(run: Path) -> None:
    for folder in (run / "friction", run / "by_currents"):
        assert (folder / "checkpoint.json").exists() and (folder / "convergence.csv").exists()
    assert not (run / "checkpoint.json").exists()  # the windings are not searched
    assert "phase_resistance" not in (run / "by_currents" / "parameters.csv").read_text(encoding="utf-8")
    assert "phase_resistance" in (run / "parameters.csv").read_text(encoding="utf-8")


def test_the_interface_finds_the_same(path: Path, run: Path) -> None:
    settings = parse_assignment("least_squares_steps=4") | {"population": 10, "generations": 4, "mass": 3.0}
    ours = interface.fit(interface.read(path), "sine", winding="star", **settings)
    assert ours.to_frame().equals(interface.load(run / "parameters.json").to_frame())


def test_what_was_found_by_the_currents_is_taken_over(path: Path, run: Path) -> None:
    record = json.loads((run / "run.json").read_text(encoding="utf-8"))
    before = (run / "parameters.json").read_text(encoding="utf-8")
    (run / "run.json").write_text(json.dumps(record | {"status": "interrupted"}), encoding="utf-8")
    done = linid("fit-motor", path, *TASK, "--out", run, "--resume", "-v")
    assert f"friction: taken from {run / 'friction' / 'parameters.json'}" in done.stderr
    assert f"sine: taken from {run / 'by_currents' / 'parameters.json'}" in done.stderr
    assert "windings: least squares" in done.stderr
    assert (run / "parameters.json").read_text(encoding="utf-8") == before


def test_a_dry_run_tells_the_stages_that_search(path: Path) -> None:
    plan = json.loads(linid("fit-motor", path, *TASK, "--dry-run", "--json").stdout)
    assert [(stage["stage"], stage["model"]) for stage in plan["stages"]] == [
        ("friction", "friction"),
        ("motor", "sine"),
    ]


def test_voltages_drive_a_simulation(path: Path, run: Path, tmp_path: Path) -> None:
    model = run / "parameters.json"
    assert linid("simulate", model, path, "--input", "voltage", "--out", tmp_path / "s", "--no-figures").exit_code == 0
    header = (tmp_path / "s" / "simulations" / "sine_current_2.csv").read_text(encoding="utf-8").splitlines()[0]
    assert header.endswith("i_u (A),i_v (A),i_w (A)")
    trace = interface.simulate(interface.load(model), interface.read(path)["sine_current_2"], by_voltage=True)
    assert trace.phase_currents is not None and trace.phase_currents.shape == (3, trace.t.size)
    with pytest.raises(interface.DataError, match="no phase voltages"):
        interface.simulate(interface.load(model), interface.read(path)["freewheel_1"], by_voltage=True)
