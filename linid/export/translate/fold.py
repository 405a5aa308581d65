"""Operations on values: worked out where all is known, written down where not."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np

from linid.export.translate.tree import Expression, Kind, Number, Operation
from linid.export.translate.values import Known, Running, Value, expression_of, is_number, known, plain

_BINARY: dict[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "//": operator.floordiv,
    "%": operator.mod,
    "**": operator.pow,
    "<<": operator.lshift,
    ">>": operator.rshift,
    "&": operator.and_,
    "|": operator.or_,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}
COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")
_WHOLE = ("//", "%", "<<", ">>", "&", "|")
# Functions of numbers: how the other languages call them is each writer's business.
FUNCTIONS: dict[Any, tuple[str, Kind]] = {
    math.exp: ("exp", "float"),
    math.expm1: ("expm1", "float"),
    math.log: ("log", "float"),
    math.sin: ("sin", "float"),
    math.cos: ("cos", "float"),
    math.tan: ("tan", "float"),
    math.tanh: ("tanh", "float"),
    math.atan: ("atan", "float"),
    math.atan2: ("atan2", "float"),
    math.sqrt: ("sqrt", "float"),
    math.copysign: ("copysign", "float"),
    math.isnan: ("isnan", "bool"),
    math.floor: ("floor_int", "int"),
    np.floor: ("floor", "float"),
    round: ("round", "int"),
    int: ("int", "int"),
    float: ("float", "float"),
    np.int64: ("int", "int"),
    abs: ("abs", "float"),
    min: ("min", "float"),
    max: ("max", "float"),
}
_KEEPS_KIND = ("abs", "min", "max")


def _joined(kinds: list[Kind]) -> Kind:
    return "float" if "float" in kinds else "int"


def binary(name: str, left: Value, right: Value) -> Value:
    """An operation on two numbers; raises TypeError for one of whole numbers that is given others."""
    if isinstance(left, Known) and isinstance(right, Known):
        try:
            return known(plain(_BINARY[name](left.value, right.value)))
        except ZeroDivisionError:
            return Known(float(np.float64(left.value) / np.float64(right.value)))
    a, b = expression_of(left), expression_of(right)
    simple = _simpler(name, a, b)
    if simple is not None:
        return simple
    kind: Kind = "bool" if name in COMPARISONS else "float" if name == "/" else _joined([a.kind, b.kind])
    if name in _WHOLE and kind != "int":
        raise TypeError(f"{name} of numbers that are not whole")
    return Running(Operation(name, (a, b), kind))


def _simpler(name: str, a: Expression, b: Expression) -> Value | None:
    """Products with one and sums with nothing, which leave every number what it is."""
    if a.kind == b.kind == "int":
        return _simpler_whole(name, a, b)
    one, zero = Number(1.0, "float"), Number(0.0, "float")
    if name == "*" and a == one and b.kind == "float":
        return Running(b)
    if name in ("*", "/") and b == one and a.kind == "float":
        return Running(a)
    if name in ("+", "-") and b == zero and a.kind == "float":
        return Running(a)
    if name == "+" and a == zero and b.kind == "float":
        return Running(b)
    return None


def _simpler_whole(name: str, a: Expression, b: Expression) -> Value | None:
    """The same of whole numbers; known ones of a sum are added up behind."""
    if name == "*" and Number(1, "int") in (a, b):
        return Running(b if a == Number(1, "int") else a)
    if name != "+":
        return None
    if isinstance(a, Number):
        a, b = b, a
    if b == Number(0, "int"):
        return Running(a)
    if isinstance(b, Number) and isinstance(a, Operation) and a.name == "+" and isinstance(a.arguments[1], Number):
        total = Number(int(a.arguments[1].value) + int(b.value), "int")
        return Running(Operation("+", (a.arguments[0], total), "int"))
    return None


def negated(value: Value) -> Value:
    """Minus a number."""
    if isinstance(value, Known):
        return Known(-value.value)
    e = expression_of(value)
    return Running(Operation("neg", (e,), "float" if e.kind == "float" else "int"))


def inverted(value: Value) -> Value:
    """Not a truth."""
    if isinstance(value, Known):
        return Known(not value.value)
    return Running(Operation("not", (expression_of(value),), "bool"))


def library(function: Any, arguments: list[Value]) -> Value:
    """A function of the mathematical library; raises KeyError for one that has no counterpart."""
    name, kind = FUNCTIONS[function]
    if all(isinstance(one, Known) and is_number(one.value) for one in arguments):
        return known(plain(function(*(one.value for one in arguments))))  # type: ignore[union-attr]
    parts = [expression_of(one) for one in arguments]
    if name in _KEEPS_KIND:
        kind = _joined([part.kind for part in parts])
    if name in ("int", "float") and parts[0].kind == name:
        return Running(parts[0])
    out: Expression = parts[0]
    if name in ("min", "max"):
        for part in parts[1:]:
            out = Operation(name, (out, part), kind)
        return Running(out)
    return Running(Operation(name, tuple(parts), kind))
