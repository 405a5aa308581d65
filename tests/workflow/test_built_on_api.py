"""The command line calls the public Python interface, which knows nothing of it; commands only add files and words."""

from __future__ import annotations

import ast
import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from linid import api
from linid.errors import UsageError
from linid.workflow.run.results import gap_rows
from tests.test_imports import PACKAGE, imported_modules, module_name, modules
from tests.workflow.small import TINY, campaign, linid

FUNCTIONS = ("read", "fit", "load", "validate", "simulate", "diagnose")
COMMANDS = ("fit_friction", "fit_motor", "validate", "simulate", "diagnose")
# What reads, fits and measures below the interface.
BELOW = {
    "linid.diagnosis.diagnose.diagnose",
    "linid.diagnosis.measures.measure_gaps",
    "linid.diagnosis.voltage_run.voltage_driven",
    "linid.identification.fit.fit",
    "linid.identification.fit_windings.fit_windings",
    "linid.interface.measuring.measure",
    "linid.interface.reading.read_files",
    "linid.interface.stages.run_stages",
    "linid.recording.read_campaign",
    "linid.recording.read_recording",
    "linid.simulation.run.Simulator",
}


def test_the_interface_needs_nothing_of_the_command_line() -> None:
    imports = {module_name(path): imported_modules(path) for path in modules()}
    found, waiting = set(), ["linid.api", "linid.plot"]
    while waiting:
        name = waiting.pop()
        found.add(name)
        waiting += [other for other in imports[name] if other not in found and other != "linid"]
    assert "linid.interface.stages" in found and "linid.diagnosis.diagnose" in found
    assert [name for name in sorted(found) if name.startswith(("linid.workflow", "linid.cli"))] == []


def imported_names(path: Path) -> Iterator[str]:
    """What a module imports by name when it runs, dotted."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    typing = {inner for node in ast.walk(tree) if isinstance(node, ast.If) for inner in ast.walk(node)}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node not in typing:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_reads_fits_and_measures_by_the_interface_alone(command: str) -> None:
    path = PACKAGE / "workflow" / "commands" / f"{command}.py"
    shared = sorted((PACKAGE / "workflow" / "run").glob("*.py"))
    assert {name for each in (path, *shared) for name in imported_names(each)} & BELOW == set()
    assert "linid.api" in imported_names(path)


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Any]]:
    """Calls of the public functions and what they gave back."""
    made: list[tuple[str, Any]] = []

    def recorded(name: str, function: Any) -> Any:
        def call(*arguments: Any, **options: Any) -> Any:
            made.append((name, function(*arguments, **options)))
            return made[-1][1]

        return call

    for name in FUNCTIONS:
        monkeypatch.setattr(api, name, recorded(name, getattr(api, name)))
    return made


def test_files_hold_what_the_interface_gave(calls: list[tuple[str, Any]], tmp_path: Path) -> None:
    path, friction, motor = campaign(tmp_path, motor=True), tmp_path / "friction", tmp_path / "motor"
    assert linid("fit-friction", path, *TINY, "--out", friction).exit_code in (0, 5)
    assert [name for name, _ in calls] == ["read", "fit", "validate"]
    assert (
        api.Fit(calls[1][1].result).save(tmp_path / "f.json").read_text() == (friction / "parameters.json").read_text()
    )
    model = friction / "parameters.json"
    calls.clear()
    assert linid("fit-motor", path, "--model", "sine", "--friction", model, *TINY, "--out", motor).exit_code in (0, 5)
    assert [name for name, _ in calls] == ["load", "read", "fit", "validate"]
    assert calls[2][1].save(tmp_path / "m.json").read_text() == (motor / "parameters.json").read_text()
    calls.clear()
    assert linid("validate", model, path, "--out", tmp_path / "v", "--no-figures").exit_code == 0
    assert [name for name, _ in calls] == ["load", "read", "validate"]
    written = json.loads((tmp_path / "v" / "gaps.json").read_text(encoding="utf-8"))["gaps"]
    assert written == gap_rows(calls[2][1].gaps) and len(written) == 1
    calls.clear()
    assert linid("simulate", model, path, "--out", tmp_path / "s", "--no-figures", "--jobs", 2).exit_code == 0
    assert sorted(name for name, _ in calls) == ["load", "read", "simulate", "simulate", "simulate"]
    for trace in (made for name, made in calls if name == "simulate"):
        with (tmp_path / "s" / "simulations" / f"{trace.recording}.csv").open(encoding="utf-8") as file:
            rows = list(csv.reader(file))[1:]
        assert np.allclose([float(row[2]) for row in rows], trace.y_simulated, rtol=1e-8, atol=0.0)


def test_a_diagnosis_is_that_of_the_interface(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """With the folder's memory of finished steps; what is found is compared where the command is tested."""
    asked: list[Any] = []

    def refused(*arguments: Any, **options: Any) -> Any:
        asked.append((arguments, options))
        raise UsageError("here", "is enough", "None.")

    monkeypatch.setattr(api, "diagnose", refused)
    done = linid("diagnose", campaign(tmp_path), "--mass", 2, "--seed", 5, "--jobs", 1, "--out", tmp_path / "d")
    assert done.exit_code == 2 and "is enough" in done.stderr
    (((given, kind), options),) = asked
    assert isinstance(given, api.Campaign) and kind == "friction" and options["mass"] == 2.0
    means = options["means"]
    assert (means.seed, means.jobs, means.workers) == (5, 1, None)
    assert means.memory.path == tmp_path / "d" / "checkpoint.json"
