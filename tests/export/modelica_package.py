"""Runs a Modelica package from the tree that pymoca's grammar makes of it: functions, and a block that samples.

Stricter than a compiler: inputs take no value, integers no real number, indices start at 1, and what nothing has been
assigned to is not a number.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest


def whole(x: Any) -> int:
    """The number itself; raises TypeError for one that is no integer."""
    if type(x) is not int:
        raise TypeError(f"{x!r} is no Integer")
    return x


def place(k: Any) -> int:
    """Where Python counts an index; raises IndexError below 1."""
    if whole(k) < 1:
        raise IndexError(k)
    return int(k) - 1


def copied(x: Any) -> Any:
    """An array with its rows."""
    return [copied(one) for one in x] if isinstance(x, list) else x


def filled(value: float, sizes: tuple[int, ...]) -> Any:
    """An array of these sizes."""
    return [filled(value, sizes[1:]) for _ in range(sizes[0])] if sizes else value


def size(x: Any, dimension: int) -> int:
    """How long an array is along a dimension, counted from 1."""
    return len(x) if dimension == 1 else size(x[0], dimension - 1)


BUILT_IN: dict[str, Callable[..., Any]] = {
    **{n: getattr(math, n) for n in ("log", "sin", "cos", "tan", "tanh", "sinh", "atan", "atan2", "sqrt", "pow")},
    "exp": lambda x: math.exp(x) if x < 709.0 else math.inf,
    "floor": lambda x: float(math.floor(x)),
    "integer": math.floor,
    "abs": abs,
    "min": min,
    "max": max,
    "mod": lambda a, b: a % b,
    "div": lambda a, b: math.trunc(a / b),
    "size": size,
    "zeros": lambda *sizes: filled(0.0, sizes),
}
SIGNS = {"<>": "!=", "and": "and", "or": "or"}
KINDS = {"Integer": "whole", "Real": "", "Boolean": ""}


class Package:
    """The functions of a package as functions of Python that give tuples, by name: those of packages inside too."""

    def __init__(self, text: str) -> None:
        parser = pytest.importorskip("pymoca.parser", reason="needs pymoca, of the extra test")
        self.tree = parser.parse(text, bypass_cache=True).classes[text.split()[1]]
        self.constants = {s.name: value_of(s).value for s in self.tree.symbols.values() if "constant" in s.prefixes}
        inner = self.tree.classes["Core"]
        self.definitions = {f"Core.{name}": one for name, one in inner.classes.items()}
        self.definitions |= {name: one for name, one in self.tree.classes.items() if one.type == "function"}
        self.functions: dict[str, Any] = dict(BUILT_IN) | {"whole": whole, "place": place, "copied": copied}
        self.functions |= {"filled": filled, "nan": math.nan}
        for name in self.definitions:
            exec("\n".join(Definition(self, name).lines()), self.functions)

    def __getitem__(self, name: str) -> Callable[..., tuple[Any, ...]]:
        """A function by its name."""
        function: Callable[..., tuple[Any, ...]] = self.functions[python_name(name)]
        return function

    def found(self, name: str, scope: str) -> str | None:
        """The full name of a function that is called so within a package, None for one that is built in."""
        for one in (f"{scope}.{name}", name):
            if one in self.definitions:
                return one
        assert name in (*BUILT_IN, "pre"), f"nobody defines {name}"
        return None


def python_name(name: str) -> str:
    """A function's name in Python."""
    return "f_" + name.replace(".", "_")


def value_of(symbol: Any) -> Any:
    """What a declaration says that a symbol is."""
    for one in symbol.class_modification.arguments:
        if one.value.component.name == "value":
            return one.value.modifications[0]
    return None


def attribute(symbol: Any, name: str) -> Any:
    """An attribute such as the unit, None where it has none."""
    for one in symbol.class_modification.arguments:
        if one.value.component.name == name:
            return one.value.modifications[0].value
    return None


def sizes_of(symbol: Any) -> list[Any]:
    """The sizes that an array is declared with, [] of a number."""
    return [one for one in symbol.dimensions[0] if getattr(one, "value", one) is not None]


class Scope:
    """Expressions and statements as Python. variable(name): how a variable is written."""

    def __init__(self, package: Package, inside: str, variable: Callable[[str], str]) -> None:
        self.package, self.inside, self.variable = package, inside, variable

    def text(self, node: Any) -> str:
        """An expression."""
        kind = type(node).__name__
        if kind == "Primary":
            return repr(node.value)
        if kind == "ComponentRef":
            return self.reference(node)
        if kind == "Array":
            return f"[{', '.join(map(self.text, node.values))}]"
        if kind == "IfExpression":
            (condition,), (one, other) = node.conditions, node.expressions
            return f"({self.text(one)} if {self.text(condition)} else {self.text(other)})"
        assert kind == "Expression", kind
        operator, parts = str(node.operator), node.operands
        if operator == "^":
            return f"pow({self.text(parts[0])}, {self.text(parts[1])})"
        if not operator[0].isalpha() or operator in ("and", "or", "not"):
            if len(parts) == 1:
                return f"({operator} {self.text(parts[0])})"
            return f"({self.text(parts[0])} {SIGNS.get(operator, operator)} {self.text(parts[1])})"
        return self.call(operator, parts)

    def call(self, name: str, parts: list[Any], every: bool = False) -> str:
        """A call; every: with all that it gives."""
        given = ", ".join(map(self.text, parts))
        full = self.package.found(name, self.inside)
        if full is None:
            return f"{name}({given})"
        inputs = [s for s in self.package.definitions[full].symbols.values() if "input" in s.prefixes]
        assert len(inputs) == len(parts), f"{full} takes {len(inputs)} where {len(parts)} are given"
        return f"{python_name(full)}({given})" + ("" if every else "[0]")

    def reference(self, node: Any) -> str:
        """A variable, an element, or a part of an array."""
        assert not node.child, str(node)
        if node.name in self.package.constants:
            return repr(self.package.constants[node.name])
        out = self.variable(node.name)
        for one in node.indices[0]:
            if one is not None:
                out += f"[{self.index(one)}]"
        return out

    def index(self, node: Any) -> str:
        """An index as Python counts it."""
        if type(node).__name__ != "Slice":
            return f"place({self.text(node)})"
        if node.start.value is None:
            return ":"
        return f"place({self.text(node.start)}):{self.text(node.stop)}"


class Definition(Scope):
    """One function of a package, by its full name."""

    def __init__(self, package: Package, name: str) -> None:
        self.node = package.definitions[name]
        self.symbols = dict(self.node.symbols)
        self.counters: list[str] = []
        self.full = name
        super().__init__(package, name.rpartition(".")[0], self.known)
        self.results = [one.name for one in self.symbols.values() if "output" in one.prefixes]

    def known(self, name: str) -> str:
        """A variable that is declared."""
        assert name in self.symbols or name in self.counters, f"{self.full}: nobody declares {name}"
        return f"v_{name}"

    def lines(self) -> list[str]:
        """The function in Python."""
        inputs = [one for one in self.symbols.values() if "input" in one.prefixes]
        out = [f"def {python_name(self.full)}({', '.join(f'v_{one.name}' for one in inputs)}):"]
        out += [f" whole(v_{one.name})" for one in inputs if str(one.type) == "Integer"]
        for one in self.symbols.values():
            if one not in inputs:
                sizes = "".join(f"{self.text(size)}, " for size in sizes_of(one))
                out.append(f" v_{one.name} = filled(nan, ({sizes}))")
        return [*out, *self.block(self.node.statements, " "), f" {self.back()}"]

    def back(self) -> str:
        """A return with all that the function gives."""
        return f"return ({''.join(f'v_{name}, ' for name in self.results)})"

    def block(self, body: list[Any], indent: str) -> list[str]:
        """Statements."""
        out = [f"{indent}{line}" for one in body for line in self.statement(one)]
        return out or [f"{indent}pass"]

    def statement(self, one: Any) -> list[str]:
        """One statement."""
        kind = type(one).__name__
        if kind == "Primary":
            return [self.back() if one.value == "return" else one.value]
        if kind == "AssignmentStatement":
            return self.assigned(one.left, one.right)
        if kind == "WhileStatement":
            return [f"while {self.text(one.condition)}:", *self.block(one.statements, " ")]
        if kind == "ForStatement":
            (index,) = one.indices
            first, last = self.text(index.expression.start), self.text(index.expression.stop)
            self.counters.append(index.name)
            body = self.block(one.statements, " ")
            self.counters.remove(index.name)
            return [f"for v_{index.name} in range(whole({first}), whole({last}) + 1):", *body]
        assert kind == "IfStatement", kind
        out = []
        for k, (condition, body) in enumerate(zip(one.conditions, one.blocks, strict=True)):
            head = "else" if condition is True else f"{'elif' if k else 'if'} {self.text(condition)}"
            out += [f"{head}:", *self.block(body, " ")]
        return out

    def assigned(self, left: list[Any], right: Any) -> list[str]:
        """Values for variables, all at once."""
        for one in left:
            assert "input" not in self.symbols[one.name].prefixes, f"{self.full}: {one.name} is an input"
        operator = str(getattr(right, "operator", ""))
        if len(left) > 1:
            value = self.call(operator, right.operands, every=True)
            names = [f"new_{k}" for k in range(len(left))]
            rows = zip(left, names, strict=True)
            return [f"{', '.join(names)} = {value}", *(f"{self.reference(one)} = {name}" for one, name in rows)]
        (one,) = left
        symbol = self.symbols[one.name]
        kind, indexed = KINDS[str(symbol.type)], one.indices[0] != [None]
        if not indexed and sizes_of(symbol):
            kind = "copied"
        return [f"{self.reference(one)} = {kind}({self.text(right)})"]


class SampledBlock:
    """The block Axis of a package: its equations at the first sample, and from sample to sample."""

    def __init__(self, package: Package, **parameters: float) -> None:
        self.node = package.tree.classes["Axis"]
        self.scope = Scope(package, "", lambda name: f"now[{name!r}]")
        self.names = package.functions | {"sample": None, "pre": lambda x: x}
        self.now: dict[str, Any] = {}
        for one in self.node.symbols.values():
            if "parameter" in one.prefixes:
                given = one.name in parameters
                self.now[one.name] = parameters.pop(one.name) if given else self.value(value_of(one))
        assert not parameters, parameters
        self.inputs = [one.name for one in self.node.symbols.values() if "input" in one.prefixes]

    def value(self, node: Any) -> Any:
        """The value of an expression now, before what discrete variables become."""
        text = self.scope.text(node)
        return eval(text, dict(self.names), {"now": self.now})

    def begin(self, *inputs: float) -> dict[str, Any]:
        """All variables at the first sample."""
        self.now |= dict(zip(self.inputs, inputs, strict=True))
        for one in self.node.initial_equations:
            assert str(one.left.operator) == "pre"
            self.now[one.left.operands[0].name] = self.value(one.right)
        return self.seen()

    def sample(self, *inputs: float) -> dict[str, Any]:
        """All variables at the next sample, where the inputs are these."""
        self.now |= dict(zip(self.inputs, inputs, strict=True))
        (when,) = (one for one in self.node.equations if type(one).__name__ == "WhenEquation")
        self.now |= {one.left.name: self.value(one.right) for one in when.blocks[0]}
        return self.seen()

    def seen(self) -> dict[str, Any]:
        """What the equations outside give."""
        for one in self.node.equations:
            if isinstance(getattr(one, "left", None), list):
                text = self.scope.call(str(one.right.operator), one.right.operands, every=True)
                found = eval(text, dict(self.names), {"now": self.now})
                self.now |= {left.name: x for left, x in zip(one.left, found, strict=True)}
        return self.now
