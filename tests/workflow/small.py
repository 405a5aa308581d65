"""A small problem on the generated stand, and the command line in this process or one of its own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

from click.testing import CliRunner, Result

from linid.cli.main import cli

ROOT = Path(__file__).resolve().parents[2]
STAND = ROOT / "data" / "stand"
TINY = ("--population", "10", "--generations", "4", "--set", "least_squares_steps=4", "--no-figures")


def campaign(folder: Path, *, motor: bool = False) -> Path:
    """Two free wheels to fit and one held out; with `motor` also a driven recording of each split."""
    rows = [("freewheel_2", "free_wheel", "fit", 0.0), ("freewheel_4", "free_wheel", "fit", 0.5)]
    rows.append(("freewheel_6", "free_wheel", "held_out", 1.0))
    if motor:
        rows += [("sine_current_2", "motor", "fit", 0.0), ("sine_current_3", "motor", "held_out", 0.0)]
    lines = ["name: small", "recordings:"]
    for name, kind, split, mass in rows:
        window = ", window: [0.0, 1.0]" if kind == "motor" else ""
        lines.append(f"  - {{file: {STAND / name}.csv, kind: {kind}, split: {split}, added_mass_kg: {mass}{window}}}")
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "campaign.yaml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def designed_sine(folder: Path) -> Path:
    """A sine MODEL of the example magnets, made in a folder."""
    out = folder / "out"
    done = linid("field", ROOT / "configs" / "motor_geometry.yaml", "--no-figures", "--out", out)
    assert done.exit_code == 0, done.stderr
    return out / "model_sine.json"


def linid(*arguments: object) -> Result:
    """Run the command line in this process."""
    return CliRunner().invoke(cli, [str(a) for a in arguments])


def summary(*arguments: object) -> dict[str, Any]:
    """Run with --json and return the summary; its exit code must be the process's."""
    result = linid(*arguments, "--json")
    parsed: dict[str, Any] = json.loads(result.stdout)
    assert parsed["exit_code"] == result.exit_code, result.stderr
    return parsed


def command(*arguments: object) -> list[str]:
    """The same as a command of its own."""
    return [sys.executable, "-m", "linid.cli.main", *(str(a) for a in arguments)]


def start(*arguments: object, cwd: Path) -> subprocess.Popen[str]:
    """Start the command line in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        command(*arguments),
        cwd=cwd,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=interruptible,
    )


def interruptible() -> None:
    """For a child process: Ctrl-C stops it, even where the tests run in the background, which ignore SIGINT."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def children(pid: int, mark: str = "spawn_main") -> list[int]:
    """The worker processes that a process has spawned (not multiprocessing's resource tracker).

    mark: in their command line.
    """
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(stat.read_text(encoding="utf-8").rpartition(")")[2].split()[1])
            line = (stat.parent / "cmdline").read_text(encoding="utf-8")
        except OSError:
            continue
        if parent == pid and mark in line:
            found.append(int(stat.parent.name))
    return found
