"""Processes that linid starts beside itself take their modules from where it does."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from linid.own_process import own_python


def test_a_users_file_is_not_taken_for_a_library(tmp_path: Path) -> None:
    """Neither numpy nor the standard library, nor linid itself; arguments arrive."""
    for name in ("numpy", "signal", "linid"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit(9)\n")
    code = "import signal, numpy, linid.arrays; print(*sys.argv[1:], numpy.pi > 3)"
    done = subprocess.run([*own_python(code), "a", "b"], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout.split()) == (0, ["a", "b", "True"])
    plain = subprocess.run([sys.executable, "-c", "import linid"], cwd=tmp_path, capture_output=True)
    assert plain.returncode == 9


def test_modules_come_from_this_process(tmp_path: Path, monkeypatch) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "only_here.py").write_text("print('found')\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    done = subprocess.run(own_python("import only_here"), capture_output=True, text=True)
    assert done.stdout == "found\n"
