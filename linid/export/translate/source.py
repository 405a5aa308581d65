"""The source of a function that is to be translated, what its names mean, and errors that say where it stands."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from linid.errors import ConfigError


@dataclass(frozen=True)
class Source:
    """A function's definition: tree of its source; file and first line, for errors; how often each name is
    assigned."""

    tree: ast.FunctionDef
    file: str
    first: int
    assigned: Mapping[str, int]

    @property
    def words(self) -> str:
        """The first sentence of its docstring, in one line."""
        text = " ".join((ast.get_docstring(self.tree) or "").split())
        return re.split(r"\.(?=\s+[A-Z]|$)|;\s", text)[0]


def plain_function(function: Any) -> Any:
    """The Python function behind a compiled one."""
    return getattr(function, "py_func", function)


@cache
def source_of(function: Any) -> Source:
    """The definition of a Python function; raises ConfigError where its source is not at hand."""
    try:
        text = textwrap.dedent(inspect.getsource(function))
        tree = ast.parse(text).body[0]
        file = inspect.getsourcefile(function) or "unknown file"
    except (OSError, TypeError, SyntaxError) as error:
        raise ConfigError(
            getattr(function, "__qualname__", str(function)),
            f"cannot be translated: its source is not at hand ({error})",
            "Define it in a file, by `def`.",
        ) from None
    first = function.__code__.co_firstlineno
    if not isinstance(tree, ast.FunctionDef):
        raise ConfigError(f"{file}:{first}", "is no function defined by `def`", "Define it so, to export models of it.")
    arguments = [one.arg for one in tree.args.args]
    return Source(tree, file, first, Counter([*arguments, *assigned_names(tree.body)]))


def assigned_names(body: Iterable[ast.stmt]) -> list[str]:
    """Names that statements assign, as often as they stand there."""
    return [
        node.id
        for one in body
        for node in ast.walk(one)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    ]


def outer_names(function: Any) -> dict[str, Any]:
    """What the free names of a function mean: of the functions around it."""
    cells = function.__closure__ or ()
    return {name: cell.cell_contents for name, cell in zip(function.__code__.co_freevars, cells, strict=True)}


def leaves_loop(body: Iterable[ast.stmt]) -> bool:
    """Whether a loop's body leaves its turn early."""
    return any(isinstance(node, ast.Break | ast.Continue) for one in body for node in ast.walk(one))
