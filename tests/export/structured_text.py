"""Runs a function block in Structured Text from the tree that blark's grammar of TwinCAT makes of it."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

import pytest

_START = {"BOOL": False, "LREAL": 0.0, "DINT": 0}
_FUNCTIONS = {
    "ABS": abs,
    "EXP": math.exp,
    "EXPT": pow,
    "MIN": min,
    "TRUNC": math.trunc,
    "DINT_TO_LREAL": float,
    "LIMIT": lambda low, x, high: min(max(low, x), high),
}
_OPERATORS = {"AND": "and", "OR": "or", "NOT": "not ", "<>": "!=", "=": "=="}
_ARRAY = re.compile(r"(\w+) : ARRAY\[0\.\.(\d+)\] OF LREAL := \[([^\]]*)\];")


@dataclass
class Block:
    """A function block: its variables, which live from call to call, and its body."""

    variables: dict[str, Any]
    body: Any

    def __call__(self, **inputs: float) -> dict[str, Any]:
        """All variables after a call with these inputs."""
        self.variables.update(inputs)
        exec(self.body, _FUNCTIONS, self.variables)
        return self.variables


def block_of(text: str) -> Block:
    """The function block that a text declares. Long arrays are read apart: the grammar gets their first two entries."""
    parse = pytest.importorskip("blark.parse", reason="needs blark, of the extra test")
    arrays = {}

    def shortened(found: re.Match[str]) -> str:
        texts = re.sub(r"//[^\n]*", "", found[3]).split(",")
        arrays[found[1]] = [float(one) for one in texts]
        assert len(texts) == int(found[2]) + 1
        return f"{found[1]} : ARRAY[0..1] OF LREAL := [{texts[0]},{texts[1]}];"

    source = parse.parse_source_code(_ARRAY.sub(shortened, text)).transform()
    (block,) = source.items
    variables = {name: x for group in block.declarations for one in group.items for name, x in _declared(one)}
    lines = _statements(block.body.statements, "")
    return Block(variables | arrays, compile("\n".join(lines), "function block", "exec"))


def _declared(one: Any) -> list[tuple[str, Any]]:
    names = [str(variable.variable.name) for variable in one.variables]
    kind, value = str(getattr(one.init.spec, "type", "")), getattr(one.init, "value", None)
    if not hasattr(value, "value") and not hasattr(value, "expr"):  # none, or an array's
        return [(name, _START.get(kind)) for name in names]
    return [(name, eval(_text(value))) for name in names]


def _statements(statements: Any, indent: str) -> list[str]:
    """Lines of Python for statements."""
    lines = []
    for one in statements:
        kind = type(one).__name__
        if kind == "AssignmentStatement":
            (name,) = one.variables
            lines.append(f"{indent}{_text(name)} = {_text(one.expression)}")
        elif kind == "IfStatement":
            lines.append(f"{indent}if {_text(one.if_expression)}:")
            lines += _statements(one.statements.statements, indent + " ")
            if one.else_clause is not None:
                lines += [f"{indent}else:", *_statements(one.else_clause.statements.statements, indent + " ")]
        else:
            raise AssertionError(f"unknown statement {kind}")
    return lines


def _text(node: Any) -> str:
    """Python's text of an expression."""
    kind = type(node).__name__
    if kind == "BinaryOperation":
        return f"({_text(node.left)} {_OPERATORS.get(str(node.op), str(node.op))} {_text(node.right)})"
    if kind == "UnaryOperation":
        return f"({_OPERATORS.get(str(node.op), str(node.op))}{_text(node.expr)})"
    if kind == "ParenthesizedExpression":
        return f"({_text(node.expr)})"
    if kind == "FunctionCall":
        return f"{node.name.name}({', '.join(_text(one.value) for one in node.parameters)})"
    if kind == "MultiElementVariable":
        (subscripts,) = node.elements
        return f"{node.name.name}[{_text(subscripts.subscripts[0])}]"
    if kind == "SimpleVariable":
        return str(node.name)
    if kind == "Boolean":
        return str(node.value).title()
    assert kind in ("Real", "Integer"), kind
    return str(node.value)
