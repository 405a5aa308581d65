"""What functions are made from and for: forms of arguments and results, and the memory that they share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

from linid.export.translate.tree import Element, Function, Kind, Number, Variable
from linid.export.translate.values import Group, Known, Running, Value, is_number, kind_of, leaves, rebuilt


class Memory(Protocol):
    """The arrays that a program works on."""

    def read(self, array: str, index: Value) -> Value:
        """An element of an array."""

    def place(self, array: str, index: Value) -> Element | None:
        """Where a new value of an element goes; None where nothing ever reads it."""


class NoMemory:
    """Of functions that work on their arguments alone."""

    def read(self, array: str, index: Value) -> Value:
        """Never asked: raises KeyError."""
        raise KeyError(array)

    def place(self, array: str, index: Value) -> Element | None:
        """Never asked: raises KeyError."""
        raise KeyError(array)


@dataclass(frozen=True)
class Made:
    """A function for one form of arguments. used: which of its running arguments it needs; result: the form of what it
    gives, with what is known of it."""

    function: Function
    used: tuple[bool, ...]
    result: Value


class Maker(Protocol):
    """Who makes functions of functions."""

    memory: Memory
    functions: dict[str, Function]

    def make(self, function: Any, arguments: list[Value], name: str = "") -> Made:
        """A function for arguments of this form."""


def generalised(value: Value) -> Value:
    """An argument whose known reals are taken as running ones: a function for every real would be too many."""
    if isinstance(value, Group):
        return Group(tuple(generalised(item) for item in value.items), value.type)
    if isinstance(value, Known) and is_number(value.value) and kind_of(value.value) == "float":
        return Running(Number(value.value, "float"))
    return value


def with_variables(value: Value, name: str, name_of: Callable[[str], str]) -> tuple[Value, list[Variable]]:
    """An argument as its function sees it: variables in place of running numbers."""
    made: list[Variable] = []

    def parts() -> Iterator[Value]:
        for path, leaf in leaves(value, name):
            if isinstance(leaf, Running):
                made.append(Variable(name_of(path), leaf.expression.kind))
                yield Running(made[-1])
            else:
                yield leaf

    return rebuilt(value, parts()), made


def joined(kinds: list[Kind]) -> Kind:
    """The kind that holds numbers of all these."""
    if len(set(kinds)) == 1:
        return kinds[0]
    return "float" if "float" in kinds else "int"


def same(one: Value, other: Value) -> bool:
    """Whether two parts are the same."""
    if isinstance(one, Known) and isinstance(other, Known):
        if is_number(one.value) and is_number(other.value):
            return repr(one.value) == repr(other.value)
        return one.value is other.value
    return one == other


def united(results: list[Value], whole: bool = False) -> tuple[Value, list[int]]:
    """The form that holds several results, and which of its leaves are known at run time only; whole: numbers that are
    known are taken for such, for callers that know nothing.

    Raises TypeError for results of different forms.
    """
    rows = [[leaf for _, leaf in leaves(one)] for one in results]
    if len({len(row) for row in rows}) > 1:
        raise TypeError("results of different forms")
    parts: list[Value] = []
    running: list[int] = []
    for number, column in enumerate(zip(*rows, strict=True)):
        wanted = whole and isinstance(column[0], Known) and is_number(column[0].value)
        fixed = not any(isinstance(one, Running) for one in column) and all(same(one, column[0]) for one in column)
        if fixed and not wanted:
            parts.append(column[0])
            continue
        running.append(number)
        parts.append(column[0])
    return rebuilt(results[0], iter(parts)), running
