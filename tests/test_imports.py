"""The direction of the data flow: a package imports only from those left of it."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "linid"
# Left to right; those of one place do not import each other. `stand` sits beside identification.
ORDER = (
    ("arrays",),
    (
        "digests",
        "errors",
        "former_names",
        "installed_kernels",
        "kernel_cache",
        "own_process",
        "parallel_tasks",
        "statistics",
        "stop_signals",
        "threads",
    ),
    ("config", "entry_points"),
    ("recording",),
    ("physics",),
    ("simulation",),
    ("identification",),
    ("design", "diagnosis"),
    ("challenge", "reproduction"),
    ("export", "report"),
    ("interface",),
    ("api",),
    ("plot",),
    ("workflow",),
    ("cli",),
    ("__main__",),
)
STAND = {"arrays", "errors", "former_names", "kernel_cache", "statistics", "config", "recording", "physics"}
USES_STAND = {"challenge", "workflow", "cli"}


def part_of(name: str) -> str:
    """`linid.physics.model` -> physics."""
    pieces = name.split(".")
    return pieces[1] if len(pieces) > 1 else ""


def imported_parts(source: str, part: str) -> set[tuple[str, int]]:
    """Parts of linid that a module's source imports anywhere in it, with the line; `part`: the module's own."""
    found: set[tuple[str, int]] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {(part_of(a.name), node.lineno) for a in node.names if a.name.split(".")[0] == "linid"}
        elif isinstance(node, ast.ImportFrom) and node.level:
            found.add(("relative import", node.lineno))
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "linid":
            pieces = (node.module or "").split(".")
            names = [pieces[1]] if len(pieces) > 1 else [a.name for a in node.names]
            found |= {(name, node.lineno) for name in names}
    return {(name, line) for name, line in found if name != part}


def allowed(part: str) -> set[str]:
    """What a part may import."""
    if part == "stand":
        return STAND
    place = next(i for i, names in enumerate(ORDER) if part in names)
    left = {name for names in ORDER[:place] for name in names}
    return left | ({"stand"} if part in USES_STAND else set())


def wrong_imports(source: str, part: str) -> list[str]:
    """A sentence for each import against the direction."""
    may = allowed(part)
    return [
        f"line {line}: {part} imports {name}" for name, line in sorted(imported_parts(source, part)) if name not in may
    ]


def modules() -> list[Path]:
    return sorted(path for path in PACKAGE.rglob("*.py") if "__pycache__" not in path.parts)


def own_part(path: Path) -> str:
    first = path.relative_to(PACKAGE).parts[0]
    return first.removesuffix(".py")


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_follow_the_direction(path: Path) -> None:
    if own_part(path) == "__init__":
        found = {name for name, _ in imported_parts(path.read_text(encoding="utf-8"), "")}
        assert found <= {"api", "plot"}  # for type checkers: test_api looks at what is imported in fact
        return
    assert wrong_imports(path.read_text(encoding="utf-8"), own_part(path)) == []


def imported_modules(path: Path) -> set[str]:
    """Modules of linid that a module imports anywhere in it, inside functions as well."""
    names = {module_name(other) for other in modules()}
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {f"{node.module}.{alias.name}" for alias in node.names} | {node.module}
    return found & names


def module_name(path: Path) -> str:
    pieces = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(pieces[:-1] if pieces[-1] == "__init__" else pieces)


def test_no_module_imports_itself_by_way_of_others() -> None:
    imports = {module_name(path): imported_modules(path) for path in modules() if path.stem != "__init__"}
    while leaves := {name for name, others in imports.items() if not others & set(imports)}:
        imports = {name: others for name, others in imports.items() if name not in leaves}
    # What is left has no end: circles, and what imports them.
    assert sorted(imports) == []


def test_every_part_has_its_place() -> None:
    known = {name for names in ORDER for name in names} | {"stand", "__init__"}
    assert {own_part(path) for path in modules()} <= known


@pytest.mark.parametrize(
    ("source", "part"),
    [
        ("from linid.report.tables import x", "physics"),
        ("import linid.workflow.batch.run", "recording"),
        ("def f():\n    from linid.identification import fit", "simulation"),
        ("if TYPE_CHECKING:\n    from linid.diagnosis.gap import RecordingGap", "identification"),
        ("from linid import cli", "report"),
        ("from ..report import tables", "physics"),
        ("from linid.simulation.run import Simulator", "stand"),
        ("from linid.stand.generate import generate", "identification"),
        ("from linid.recording.recording import Recording", "errors"),
        ("from linid.report.tables import x", "challenge"),
        ("from linid.challenge.files import read_keys", "diagnosis"),
        ("def f():\n    from linid.workflow.run.stage import StageFiles", "api"),
        ("from linid.cli.options import overrides", "interface"),
    ],
)
def test_a_wrong_import_is_seen(source: str, part: str) -> None:
    assert len(wrong_imports(source, part)) == 1


@pytest.mark.parametrize(
    ("source", "part"),
    [
        ("from linid.errors import LinidError", "recording"),
        ("import numpy\nfrom linid.physics.model import Model", "simulation"),
        ("from linid.physics.friction import x", "physics"),
        ("from linid.stand.generate import generate", "workflow"),
        ("from linid.stand.modes import command", "challenge"),
    ],
)
def test_a_right_import_passes(source: str, part: str) -> None:
    assert wrong_imports(source, part) == []
