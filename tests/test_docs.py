"""The documentation's site builds without a warning and holds what the program has."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import linid
from linid.cli.main import cli

ROOT = Path(__file__).resolve().parents[1]


def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    for module in ("sphinx", "myst_parser", "sphinx_click", "furo"):
        pytest.importorskip(module, reason='needs the extra: pip install "linid[docs]"')
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", "docs", str(tmp_path / "site")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr[-3000:]
    commands = (tmp_path / "site/reference/cli.html").read_text(encoding="utf-8")
    assert all(f'id="linid-{name}"' in commands for name in cli.commands)
    reference = (tmp_path / "site/reference/api.html").read_text(encoding="utf-8")
    assert all(f'id="linid.api.{name}"' in reference for name in linid.__all__ if name not in ("plot", "Recording"))
    assert 'id="linid.recording.recording.Recording"' in reference or 'id="linid.api.Recording"' in reference
    effects = (tmp_path / "site/reference/effects.html").read_text(encoding="utf-8")
    assert "load_dependent_friction" in effects
