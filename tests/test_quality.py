"""ruff and mypy as tests, so that the one test command says all."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize("arguments", [("ruff", "check", "."), ("mypy",)], ids=" ".join)
def test_tool_finds_nothing(arguments: tuple[str, ...]) -> None:
    done = subprocess.run([sys.executable, "-m", *arguments], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_ci_runs_the_test_command_of_the_readme() -> None:
    command = 'python -m pip install -e ".[test]" && python -m pytest'
    assert command in (ROOT / "README.md").read_text(encoding="utf-8")
    assert (ROOT / ".ci" / "run").read_text(encoding="utf-8").rstrip().splitlines()[-1] == command


def test_the_documentation_names_every_exit_code_and_command() -> None:
    from linid.cli.main import cli

    pages = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages)
    assert [name for name in cli.commands if not re.search(rf"\blinid {name}\b", text)] == []
    results = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
    assert [code for code in (0, 1, 2, 3, 4, 5, 130, 143) if f"| {code} |" not in results] == []
