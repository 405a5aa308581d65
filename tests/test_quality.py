"""ruff and mypy as tests, so that the one test command says all."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
LONGEST_FUNCTION, MOST_PARAMETERS, LONGEST_FILE = 60, 8, 400
SKIPS = 12  # of the formatter, at most


@pytest.mark.parametrize(
    "arguments", [("ruff", "check", "."), ("ruff", "format", "--check", "."), ("mypy",)], ids=" ".join
)
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


def oversized(source: str) -> list[str]:
    """Functions that are too long or take too much (terms of effects and motors share one list of arguments)."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        names = [a.arg for a in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
        count = len([name for name in names if name not in ("self", "cls")])
        is_term = any(isinstance(one, ast.Name) and one.id == "term" for one in node.decorator_list)
        if (node.end_lineno or node.lineno) - node.lineno + 1 > LONGEST_FUNCTION:
            found.append(f"{node.name} is longer than {LONGEST_FUNCTION} lines")
        if count > MOST_PARAMETERS and not is_term:
            found.append(f"{node.name} takes {count} arguments")
    return found


def test_functions_and_files_can_be_taken_in_at_a_glance() -> None:
    sources = {path.relative_to(ROOT): path.read_text(encoding="utf-8") for path in (ROOT / "linid").rglob("*.py")}
    assert [f"{path}: {fault}" for path, source in sources.items() for fault in oversized(source)] == []
    assert [str(path) for path, source in sources.items() if len(source.splitlines()) > LONGEST_FILE] == []
    assert sum(source.count("fmt: " + "skip") + source.count("fmt: " + "off") for source in sources.values()) <= SKIPS


def test_what_is_oversized_is_found() -> None:
    long = "def f():\n" + "    x = 1\n" * LONGEST_FUNCTION
    many = "def f({}): pass".format(", ".join(f"x_{k}" for k in range(MOST_PARAMETERS + 1)))
    assert oversized(long) and oversized(many) and oversized("class A:\n    async " + many)
    assert not oversized("@term\n" + many) and not oversized(many.replace("x_0", "self"))
