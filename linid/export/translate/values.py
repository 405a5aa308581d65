"""What the translation knows of a value: all (Known), its kind (Running), its parts (Group), or its place (View)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from linid.export.translate.tree import Expression, Kind, Number


@dataclass(frozen=True, eq=False)
class Known:
    """A value that is known: a number, or a function, a bundle of functions, a module."""

    value: Any


@dataclass(frozen=True)
class Running:
    """A number that is known at run time only."""

    expression: Expression


@dataclass(frozen=True)
class Group:
    """A tuple, or a named tuple of some type."""

    items: tuple[Value, ...]
    type: type | None = None


@dataclass(frozen=True)
class View:
    """An array of memory, or a part of it: name, first place, and sizes of what can still be indexed, of which the
    first may be known at run time only."""

    array: str
    start: int
    shape: tuple[int | Running, ...]


Value = Known | Running | Group | View


def kind_of(value: Any) -> Kind:
    """The kind of a known number."""
    return "bool" if isinstance(value, bool) else "int" if isinstance(value, int) else "float"


def is_number(value: Any) -> bool:
    """Whether a known value can be written as a number."""
    return isinstance(value, bool | int | float)


def plain(value: Any) -> Any:
    """Numbers of numpy as those of Python."""
    return value.item() if hasattr(value, "item") and getattr(value, "shape", None) == () else value


def known(value: Any) -> Value:
    """A value that is known, tuples with their parts."""
    value = plain(value)
    if isinstance(value, tuple):
        named = type(value) if hasattr(value, "_fields") else None
        return Group(tuple(known(item) for item in value), named)
    return Known(value)


def expression_of(value: Value) -> Expression:
    """A number as an expression; raises TypeError for what is none."""
    if isinstance(value, Running):
        return value.expression
    if isinstance(value, Known) and is_number(value.value):
        return Number(value.value, kind_of(value.value))
    raise TypeError(f"{value} is no number")


def leaves(value: Value, name: str = "") -> Iterator[tuple[str, Value]]:
    """All parts that are no groups, with names made of the fields on the way."""
    if not isinstance(value, Group):
        yield name, value
        return
    fields = getattr(value.type, "_fields", None) or [str(k + 1) for k in range(len(value.items))]
    for field, item in zip(fields, value.items, strict=True):
        yield from leaves(item, f"{name}_{field}" if name else field)


def rebuilt(value: Value, parts: Iterator[Value]) -> Value:
    """A group of the same form with other leaves, taken in order."""
    if isinstance(value, Group):
        return Group(tuple(rebuilt(item, parts) for item in value.items), value.type)
    return next(parts)


def form_of(value: Value) -> Any:
    """What a specialised function hangs on: all but the numbers that are known at run time only."""
    if isinstance(value, Group):
        return (value.type, *map(form_of, value.items))
    if isinstance(value, Running):
        return value.expression.kind
    if isinstance(value, View):
        return value
    one = value.value
    return ("known", kind_of(one), repr(one)) if is_number(one) else ("known", id(one))
