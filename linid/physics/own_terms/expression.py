"""A formula as a checked tree: of Python's grammar nothing but numbers, names, operators and known functions."""

from __future__ import annotations

import ast
import math
import re
import warnings
from dataclasses import replace

from linid.errors import ConfigError
from linid.physics.own_terms import layout
from linid.physics.own_terms.node import Node
from linid.physics.own_terms.values import constant_value

MOST_CHARACTERS = 1000
DEEPEST = 40  # operations inside each other
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,29}\Z")
_BINARY: dict[type, str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}
_FUNCTIONS = (*layout.ONE_ARGUMENT, *layout.TWO_ARGUMENTS, *layout.SPLINES)
_FEWEST, _MOST = 4, 100  # coefficients along one direction of a curve
_TELL = "linid effects tells how to write a formula"


def parse_formula(text: str, place: str) -> tuple[Node, str]:
    """The tree of a formula, and its canonical text; raises ConfigError for what is no formula.

    place: what the error names first.
    """
    if len(text) > MOST_CHARACTERS:
        raise ConfigError(place, f"has a formula of {len(text)} characters", f"Use at most {MOST_CHARACTERS}.")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            body = ast.parse(text.strip(), mode="eval").body
        tree = _Checker(place).node(body, 0)
        return _numbered(tree), ast.unparse(body)
    except (SyntaxError, ValueError, OverflowError, RecursionError, MemoryError) as error:
        fact = str(getattr(error, "msg", error))[:80] or type(error).__name__
        raise ConfigError(place, f"{text[:60]!r} is no formula ({fact})", f"Correct it; {_TELL}.") from None


class _Checker:
    """Turns Python's tree into nodes and refuses all that a formula may not have."""

    def __init__(self, place: str) -> None:
        self.place = place

    def refuse(self, fact: str, remedy: str = f"Correct the formula; {_TELL}.") -> ConfigError:
        return ConfigError(self.place, fact, remedy)

    def node(self, one: ast.expr, depth: int) -> Node:
        if depth > DEEPEST:
            raise self.refuse(f"is nested deeper than {DEEPEST} levels", "Simplify the formula.")
        if isinstance(one, ast.Constant):
            return self.number(one)
        if isinstance(one, ast.Name):
            return self.named(one.id)
        if isinstance(one, ast.UnaryOp) and isinstance(one.op, ast.USub | ast.UAdd):
            inner = self.node(one.operand, depth + 1)
            return inner if isinstance(one.op, ast.UAdd) else Node("-x", (inner,))
        if isinstance(one, ast.BinOp) and type(one.op) in _BINARY:
            sides = (self.node(one.left, depth + 1), self.node(one.right, depth + 1))
            return Node(_BINARY[type(one.op)], sides)
        if isinstance(one, ast.Call):
            return self.call(one, depth)
        raise self.refuse(f"holds {ast.unparse(one)[:40]!r}, which is not part of a formula")

    def number(self, one: ast.Constant) -> Node:
        if isinstance(one.value, bool) or not isinstance(one.value, int | float) or not math.isfinite(float(one.value)):
            raise self.refuse(f"holds {str(one.value)[:40]!r}, which is no number")
        return Node("number", value=float(one.value))

    def named(self, name: str) -> Node:
        if name == "pi":
            return Node("number", value=math.pi)
        if name in layout.VARIABLES:
            return Node("variable", name=name)
        if name in _FUNCTIONS:
            raise self.refuse(f"uses {name} without arguments", f"Write {name}(...), or call the parameter otherwise.")
        if name == "a":
            remedy = f"Use one of {', '.join(layout.VARIABLES)}; a parameter needs another name."
            raise self.refuse("uses `a`: the acceleration is what the forces are to explain", remedy)
        if not _NAME.match(name):
            raise self.refuse(f"has the parameter {name[:40]!r}", "Take up to 30 letters, digits and underscores.")
        return Node("parameter", name=name)

    def call(self, one: ast.Call, depth: int) -> Node:
        name = one.func.id if isinstance(one.func, ast.Name) else ""
        if name not in _FUNCTIONS:
            written = ast.unparse(one.func)[:40]
            raise self.refuse(f"uses the unknown function {written!r}", f"Use {', '.join(_FUNCTIONS)}.")
        wanted = layout.SPLINE_NUMBERS.get(name, 2 if name in layout.TWO_ARGUMENTS else 1)
        if one.keywords or len(one.args) != wanted or any(isinstance(x, ast.Starred) for x in one.args):
            raise self.refuse(f"gives {name} {len(one.args)} arguments", f"{name} takes {wanted}.")
        args = [self.node(x, depth + 1) for x in one.args]
        return self.curve(name, args) if name in layout.SPLINES else Node(name, tuple(args))

    def curve(self, name: str, args: list[Node]) -> Node:
        at = layout.SPLINES[name]
        inner = tuple(args[k] for k in at)
        if any(node.coefficients for one in inner for node in one.walk()):
            raise self.refuse(f"has a curve inside the argument of {name}", "Write a surface, or a sum of curves.")
        numbers = tuple(self.constant(name, x) for k, x in enumerate(args) if k not in at)
        spans = [numbers[:3], numbers[3:]] if name == "spline2" else [numbers if name == "spline" else (0.0, *numbers)]
        for low, high, count in spans:
            if not low < high:
                raise self.refuse(f"gives {name} the range {low:g} to {high:g}", "Give the lower end first.")
            if count != int(count) or not _FEWEST <= count <= _MOST:
                raise self.refuse(f"gives {name} {count:g} coefficients", f"Use {_FEWEST} to {_MOST}.")
        return Node(name, inner, numbers=numbers)

    def constant(self, name: str, node: Node) -> float:
        if any(x.kind in ("variable", "parameter") or x.coefficients for x in node.walk()):
            raise self.refuse(f"gives {name} a range or a number that is not fixed", "Write numbers there.")
        value = constant_value(node)
        if not math.isfinite(value):
            raise self.refuse(f"gives {name} a range that is no number", "Write numbers there.")
        return value


def _numbered(tree: Node) -> Node:
    """The tree with the coefficients of its curves numbered from 1, in the order of the text."""
    count = 1

    def visit(node: Node) -> Node:
        nonlocal count
        first = 0
        if node.coefficients:
            first, count = count, count + node.coefficients
        return replace(node, args=tuple(visit(one) for one in node.args), first=first)

    return visit(tree)
