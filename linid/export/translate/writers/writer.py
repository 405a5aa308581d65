"""What all writers share: precedence, numbers, and the way through statements."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

from linid.export.translate.tree import (
    Break,
    Call,
    Continue,
    Element,
    Expression,
    For,
    Function,
    If,
    Invoke,
    Let,
    Number,
    Operation,
    Return,
    Statement,
    Store,
    Variable,
    While,
)

_ORDER = {"or": 1, "and": 2, "not": 3, **dict.fromkeys(("<", "<=", ">", ">=", "==", "!="), 4)}
_ORDER |= {"|": 5, "&": 5, "<<": 5, ">>": 5, "+": 6, "-": 6, "*": 7, "/": 7, "//": 7, "%": 7, "neg": 8, "**": 9}
_ATOM = 10
_ONCE = ("-", "/", "//", "%", "<<", ">>", "<", "<=", ">", ">=", "==", "!=", "&", "|")  # (a - b) - c is not a - (b - c)


@dataclass(frozen=True)
class Words:
    """How a language says things; in the patterns {0}, {1} are operands, which stand in brackets where needed."""

    functions: Mapping[str, str]
    infix: Mapping[str, str]
    negation: str
    infinity: str
    nan: str
    true: str
    false: str
    select: str
    power: str
    integer_division: str
    remainder: str
    shift_left: str = "{0} << {1}"
    shift_right: str = "{0} >> {1}"
    loose_and: bool = False  # whether `and` within `or` wants brackets


class Writer(ABC):
    """Writes functions of the small tree in one language."""

    words: Words
    indent = "    "
    leave: str
    again: str
    functions: Mapping[str, Function]
    reserved: frozenset[str] = frozenset()

    def program(self, functions: list[Function]) -> str:
        """All functions, each after what it calls."""
        self.functions = {one.name: one for one in functions}
        return "\n\n".join(self.function(one) for one in functions)

    # Expressions.

    def expression(self, node: Expression) -> str:
        """An expression."""
        return self._written(node)[0]

    def _written(self, node: Expression) -> tuple[str, int]:
        """An expression, and how tightly it binds."""
        match node:
            case Number():
                text = self.number(node)
                return text, _ATOM if text[0] != "-" else _ORDER["neg"]
            case Variable():
                return self.variable(node.name), _ATOM
            case Element():
                return self.element(node.array, self.expression(node.index), node.label), _ATOM
            case Call():
                function = self.functions[node.function]
                return self.call(function, [self.expression(one) for one in node.arguments]), _ATOM
        assert isinstance(node, Operation)
        return self._operation(node)

    def _operation(self, node: Operation) -> tuple[str, int]:
        name, words = node.name, self.words
        if name == "choose":
            return self.choose(*(self.expression(one) for one in node.arguments)), _ATOM
        if name in words.functions:
            return self.library(node, [self.expression(one) for one in node.arguments]), _ATOM
        patterns = {
            "**": words.power,
            "//": words.integer_division,
            "%": words.remainder,
            "<<": words.shift_left,
            ">>": words.shift_right,
            "neg": "-{0}",
            "not": words.negation,
        }
        if name == "select":
            return words.select.format(*(self._within(one, 2) for one in node.arguments)), _ATOM
        pattern = patterns.get(name, f"{{0}} {words.infix.get(name, name)} {{1}}")
        if pattern.endswith(")"):  # brackets of its own
            return pattern.format(*(self.expression(one) for one in node.arguments)), _ATOM
        order = _ORDER[name]
        if name == "or" and words.loose_and:
            return pattern.format(*(self._within(one, _ORDER["not"]) for one in node.arguments)), order
        parts = []
        for k, one in enumerate(node.arguments):
            tighter = (k > 0 and name in _ONCE) or (name == "**" and k == 0) or name == "neg"
            parts.append(self._within(one, order + tighter))
        return pattern.format(*parts), order

    def _within(self, node: Expression, least: int) -> str:
        text, order = self._written(node)
        return text if order >= least else f"({text})"

    def library(self, node: Operation, arguments: list[str]) -> str:
        """A function of the mathematical library."""
        return f"{self.words.functions[node.name]}({', '.join(arguments)})"

    def number(self, node: Number) -> str:
        """A number, exact."""
        if node.kind == "bool":
            return self.words.true if node.value else self.words.false
        if node.kind == "int":
            return str(int(node.value))
        if math.isnan(node.value):
            return self.words.nan
        if math.isinf(node.value):
            return self.words.infinity if node.value > 0 else f"-{self.words.infinity}"
        return repr(float(node.value))

    def variable(self, name: str) -> str:
        """A variable's name, which no function and no word of the language has."""
        return f"{name}_" if name in self.functions or name in self.reserved else name

    # Statements.

    def block(self, body: tuple[Statement, ...], depth: int) -> list[str]:
        """Statements, indented."""
        out: list[str] = []
        for one in body:
            out += [self.indent * depth + line for line in self._statement(one)]
        return out

    def _statement(self, one: Statement) -> list[str]:
        match one:
            case Let(name, value):
                return [self.let(self.variable(name), self.expression(value))]
            case Store(place, value):
                return [self.let(self.expression(place), self.expression(value))]
            case Invoke(names, function, arguments):
                called = self.functions[function]
                return self.invoke(tuple(map(self.variable, names)), called, [self.expression(a) for a in arguments])
            case If(condition, then, otherwise):
                return self.branch(self.expression(condition), self.block(then, 1), self.block(otherwise, 1))
            case While(condition, body):
                return self.loop(condition, self.block(body, 1))
            case For(name, start, stop, body):
                inner = self.block(body, 1)
                return self.count(self.variable(name), self.expression(start), self.expression(stop), inner)
            case Break():
                return [self.leave]
            case Continue():
                return [self.again]
            case Return(values):
                return self.returned([self.expression(value) for value in values])
        raise AssertionError(one)

    @abstractmethod
    def choose(self, place: str, *numbers: str) -> str:
        """The number at a place, counted from 0."""

    @abstractmethod
    def element(self, array: str, index: str, label: str) -> str:
        """An element of memory."""

    @abstractmethod
    def call(self, function: Function, arguments: list[str]) -> str:
        """A call in an expression."""

    @abstractmethod
    def function(self, function: Function) -> str:
        """The definition of a function."""

    @abstractmethod
    def let(self, name: str, value: str) -> str:
        """A variable or an element takes a value."""

    @abstractmethod
    def invoke(self, names: tuple[str, ...], function: Function, arguments: list[str]) -> list[str]:
        """A call of a function with several results, or one that changes memory."""

    @abstractmethod
    def returned(self, values: list[str]) -> list[str]:
        """A return."""

    @abstractmethod
    def branch(self, condition: str, then: list[str], otherwise: list[str]) -> list[str]:
        """A condition with its ways, which are indented."""

    @abstractmethod
    def loop(self, condition: Expression, body: list[str]) -> list[str]:
        """A loop with a condition."""

    @abstractmethod
    def count(self, name: str, start: str, stop: str, body: list[str]) -> list[str]:
        """A loop over whole numbers."""
