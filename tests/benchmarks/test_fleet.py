"""The fleet's benchmark: a shared folder is slow for workers alone, axes are drawn by their number."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from linid.stand.export import TRUTH_FILE, read_truth
from tests.benchmarks.fleet import SLOW, SPREAD, make_axis
from tests.identification.stand import stand

LOOK = """import sys, time
from pathlib import Path
for folder in sys.argv[1:]:
    began = time.perf_counter()
    (Path(folder) / "note").write_text("x")
    (Path(folder) / "note").exists()
    print(time.perf_counter() - began)
"""


def test_looks_at_the_shared_folder_alone_take_longer(tmp_path: Path) -> None:
    for name in ("before", "shared", "own"):
        (tmp_path / name).mkdir()
    (tmp_path / "before" / "sitecustomize.py").write_text(SLOW, encoding="utf-8")
    slow = {"SLOW_FOLDER": str(tmp_path / "shared"), "SLOW_SECONDS": "0.2"}
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "before"), **slow}
    command = [sys.executable, "-c", LOOK, str(tmp_path / "shared"), str(tmp_path / "own")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    shared, own = map(float, done.stdout.split())
    assert shared >= 0.4 and shared - own >= 0.3


def test_an_axis_has_friction_of_its_own_and_is_made_once(tmp_path: Path) -> None:
    truths = []
    for number in (1, 2):
        folder = tmp_path / f"axis_{number}"
        make_axis(folder, number)
        truths.append(read_truth(folder / TRUTH_FILE))
        written = {path: path.stat().st_mtime_ns for path in folder.iterdir()}
        make_axis(folder, number)
        assert {path: path.stat().st_mtime_ns for path in folder.iterdir()} == written
    first, second = truths
    usual = stand(only=("freewheel_1",)).truth
    for name in ("coulomb_force", "static_force", "viscous_friction", "bristle_stiffness"):
        assert first[name] != second[name]
        assert all(1.0 <= one[name] / usual[name] <= SPREAD for one in truths)
    assert first["mass"] == second["mass"] and first["stribeck_exponent"] == 2
