"""The command line itself: help, lazy imports, inspect, effects, completion, exit codes of wrong use."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest

from linid.cli.main import cli
from tests.workflow.small import STAND, campaign, linid

COMMANDS = sorted(cli.commands)


def test_the_commands() -> None:
    assert COMMANDS == [
        "batch",
        "challenge",
        "compile",
        "completion",
        "diagnose",
        "effects",
        "export",
        "field",
        "fit-friction",
        "fit-motor",
        "generate",
        "inspect",
        "monitor",
        "simulate",
        "validate",
    ]


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help_with_an_example(name: str) -> None:
    result = linid(name, "--help")
    assert result.exit_code == 0
    assert "Example" in result.output and f"linid {name}" in result.output


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_is_explained(name: str) -> None:
    for parameter in cli.commands[name].params:
        if isinstance(parameter, click.Option):
            assert parameter.help, f"{name} {parameter.opts}"


def test_help_loads_no_heavy_module() -> None:
    heavy = ("numpy", "scipy", "pandas", "numba", "pydantic", "rich")
    code = f"import sys, linid.cli.main; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_inspect_shows_columns_units_and_mapping(tmp_path: Path) -> None:
    mapping = tmp_path / "mapping.yaml"
    result = linid("inspect", STAND / "moves_1.csv", "--mapping", mapping)
    assert result.exit_code == 0
    assert "mm -> m" in result.output and "1000 Hz" in result.output
    assert max(len(line) for line in result.output.splitlines()) <= 80 + len(str(mapping))
    assert "current_u" in mapping.read_text(encoding="utf-8")
    assert linid("inspect", STAND / "moves_1.csv", "--mapping", mapping).exit_code == 2
    assert linid("inspect", STAND / "moves_1.csv", "--channels", mapping).exit_code == 0


def test_inspect_json() -> None:
    body = json.loads(linid("inspect", STAND / "freewheel_1.csv", "--json").stdout)
    assert body["rate"] == pytest.approx(1000.0) and body["rows"] == 1500


def test_inspect_of_a_file_without_position_says_what_is_missing(tmp_path: Path) -> None:
    path = tmp_path / "odd.csv"
    path.write_text("Time (ms),Blue (mm)\n" + "".join(f"{k},{k * k}\n" for k in range(100)), encoding="utf-8")
    result = linid("inspect", path)
    assert result.exit_code == 4
    assert "PROBLEM" in result.output and "position: {column: TODO" in result.output


def test_inspect_of_a_campaign_lists_its_recordings(tmp_path: Path) -> None:
    result = linid("inspect", campaign(tmp_path))
    assert result.exit_code == 0 and "freewheel_4" in result.output and "held_out" in result.output


def test_inspect_prints_the_checks_and_their_findings(tmp_path: Path) -> None:
    result = linid("inspect", campaign(tmp_path))
    assert (
        "Step, noise: of the position" in result.output
        and "Follows" not in result.output
        and "Nothing to object to." in result.output
    )
    body = json.loads(linid("inspect", campaign(tmp_path), "--json").stdout)
    assert {"coherence", "delay", "resolution", "reading"} <= set(body["checks"]["recordings"][0])
    assert body["checks"]["findings"] == []
    # Degrees that the header calls radians, 14 per sample, of which a gear leaves 10 to be wrapped.
    rows = "\n".join(f"{k},{10 * k % 360 + 4 * k}" for k in range(200))
    path = tmp_path / "turns.csv"
    path.write_text(f"Time (ms),Position (rad)\n{rows}\n", encoding="utf-8")
    result = linid("inspect", path)
    assert result.exit_code == 0 and "WARNING turns: the position jumps 5 times by about 360 rad" in result.output
    (jumps, *_) = json.loads(linid("inspect", path, "--json").stdout)["checks"]["findings"]
    assert (jumps["check"], jumps["level"], jumps["recording"]) == ("jumps", "warning", "turns")


def test_effects() -> None:
    assert "constant_force" in linid("effects").output
    assert "F_0" in linid("effects", "constant_force").output
    result = linid("effects", "constant_farce")
    assert result.exit_code == 2 and "constant_force" in result.stderr


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_scripts_are_valid(shell: str) -> None:
    result = linid("completion", shell)
    assert result.exit_code == 0 and "_LINID_COMPLETE" in result.output
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} here to check its syntax")
    done = subprocess.run([shell, "-n"], input=result.output, text=True, capture_output=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("fit-friction",),
        ("fit-motor", STAND / "campaign.yaml"),
        ("fit-friction", "x.csv", "--window", "0.2"),
        ("fit-friction", "x.csv", "--known", "mass"),
        ("fit-friction", "x.csv", "--bound", "mass=1"),
        ("fit-friction", "x.csv", "--added-mass", "x.csv=heavy"),
        ("fit-friction", STAND / "campaign.yaml", "--known", "mas=1"),
        ("fit-friction", STAND / "campaign.yaml", "--effect", "cable", "--dry-run"),
        ("fit-friction", STAND / "moves_1.csv"),
        ("batch",),
        ("nonsense",),
    ],
    ids=lambda a: " ".join(map(str, a[:3])),
)
def test_wrong_use_exits_with_2(arguments: tuple[object, ...]) -> None:
    result = linid(*arguments)
    assert result.exit_code == 2, result.output
    assert "Traceback" not in result.output + result.stderr


def test_an_internal_error_exits_with_1_and_says_how_to_report(monkeypatch: pytest.MonkeyPatch) -> None:
    import linid.workflow.commands.effects as module

    def fail(name: str | None) -> None:
        raise ZeroDivisionError("broken on purpose")

    monkeypatch.setattr(module, "list_effects", fail)
    result = linid("effects")
    assert result.exit_code == 1
    assert "--debug" in result.stderr and "broken on purpose" in result.stderr and "Traceback" not in result.stderr
    assert isinstance(linid("effects", "--debug").exception, ZeroDivisionError)


def test_errors_as_json() -> None:
    result = linid("fit-friction", "missing.yaml", "--json")
    body = json.loads(result.stdout)
    assert result.exit_code == body["exit_code"] == 3 and "missing.yaml" in body["error"]
