"""Kernels compiled ahead: those that commands need, by two processes, and nothing where all is there."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from linid.installed_kernels import SWITCH
from linid.simulation import compile_ahead
from linid.simulation.compile_ahead import ALL, FIT, PLANS, Compilation, _kernels

ROOT = Path(__file__).resolve().parents[2]
PLAN = """
import sys
from linid.simulation import compile_ahead
from linid.simulation.compile_ahead import Compilation, Plan

kernels = compile_ahead._kernels()
lacking = [name for name in sys.argv[1:] if not compile_ahead._is_kept(kernels[name])]
told = []
Compilation(Plan(tuple(sys.argv[1:2]), tuple(sys.argv[2:]), wait=True)).finish(lambda *done: told.append(done))
there = all(compile_ahead._is_kept(kernels[name]) for name in sys.argv[1:])
print(lacking, told, there, sorted(set(sys.modules) & {"linid.identification", "matplotlib"}))
"""


def test_plans_name_kernels_that_there_are() -> None:
    kernels = _kernels()
    for plan in (*PLANS.values(), ALL):
        assert set(plan.here) | set(plan.beside) <= set(kernels)
    assert set(ALL.here) | set(ALL.beside) >= set(kernels)  # after `linid compile` nothing is left


def test_two_processes_compile_each_its_part_and_the_second_time_nothing(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "LINID_CACHE_DIR": str(tmp_path), SWITCH: "0"}
    names = ["along under lugre", "readings with effects"]

    def run() -> str:
        command = [sys.executable, "-c", PLAN, *names]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.strip()

    assert run() == f"{names} [(0, 2), (1, 2), (2, 2)] True []"
    assert run() == "[] [] True []"


def test_a_lost_process_leaves_its_kernels_to_be_compiled_when_they_are_needed(monkeypatch) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.setattr(compile_ahead, "_is_kept", lambda kernel: False)
    monkeypatch.setattr(compile_ahead, "_SERVE", "raise SystemExit(3)")
    told: list[tuple[int, int]] = []
    Compilation(FIT).finish(lambda *done: told.append(done))
    assert told == [(0, 3), (1, 3), (2, 3)]


def test_without_a_folder_to_keep_kernels_in_no_process_is_begun(tmp_path: Path) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.touch()
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "LINID_CACHE_DIR": str(in_the_way), SWITCH: "0"}
    command = "from linid.simulation.compile_ahead import ALL, Compilation; print(Compilation(ALL)._helper)"
    done = subprocess.run([sys.executable, "-c", command], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "None"
