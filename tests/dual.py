"""Numbers that carry their derivatives: the kernel's own source, run with them in plain Python, gives its own."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np


class Dual:
    """A value and its derivatives (K,). Source: automatic differentiation in forward mode (Wengert 1964)."""

    __slots__ = ("by", "value")
    __array_ufunc__ = None  # numpy's numbers leave the operation to this class

    def __init__(self, value: float, by: Any) -> None:
        self.value, self.by = value, by

    def __float__(self) -> float:
        return self.value

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.by)

    def __abs__(self) -> Dual:
        return -self if self.value < 0.0 else self

    def __add__(self, other: Any) -> Dual:
        return Dual(self.value + float(other), self.by + slopes_of(other))

    def __sub__(self, other: Any) -> Dual:
        return Dual(self.value - float(other), self.by - slopes_of(other))

    def __rsub__(self, other: Any) -> Dual:
        return Dual(float(other) - self.value, -self.by)

    def __mul__(self, other: Any) -> Dual:
        return Dual(self.value * float(other), self.by * float(other) + self.value * slopes_of(other))

    def __truediv__(self, other: Any) -> Dual:
        ratio = self.value / float(other)
        return Dual(ratio, (self.by - ratio * slopes_of(other)) / float(other))

    def __rtruediv__(self, other: Any) -> Dual:
        return Dual(float(other) / self.value, -float(other) / self.value**2 * self.by)

    def __pow__(self, other: Any) -> Dual:
        power = self.value ** float(other)
        by_exponent = power * math.log(self.value) * slopes_of(other) if self.value > 0.0 else 0.0
        return Dual(power, float(other) * self.value ** (float(other) - 1.0) * self.by + by_exponent)

    def __rpow__(self, other: float) -> Dual:
        power = other**self.value
        return Dual(power, power * math.log(other) * self.by)

    __radd__, __rmul__ = __add__, __mul__


def _compared(name: str) -> Callable[[Dual, Any], bool]:
    return lambda one, other: bool(getattr(one.value, name)(float(other)))


for _name in ("__lt__", "__le__", "__gt__", "__ge__", "__eq__", "__ne__"):
    setattr(Dual, _name, _compared(_name))


def slopes_of(x: Any) -> Any:
    """The derivatives (K,) of a number; 0 of one that carries none."""
    return x.by if isinstance(x, Dual) else 0.0


def _function(plain: Callable[[float], float], slope: Callable[[float], float]) -> Callable[[Any], Any]:
    return lambda x: Dual(plain(x.value), slope(x.value) * x.by) if isinstance(x, Dual) else plain(x)


def _copysign(x: Any, sign: Any) -> Any:
    return x if math.copysign(1.0, float(x)) == math.copysign(1.0, float(sign)) else -x


DUAL_MATH = SimpleNamespace(
    exp=_function(math.exp, math.exp),
    log=_function(math.log, lambda x: 1.0 / x),
    sqrt=_function(math.sqrt, lambda x: 0.5 / math.sqrt(x)),
    sin=_function(math.sin, math.cos),
    cos=_function(math.cos, lambda x: -math.sin(x)),
    copysign=_copysign,
    isnan=lambda x: math.isnan(float(x)),
    pi=math.pi,
    inf=math.inf,
)
DUAL_ARRAYS = SimpleNamespace(
    zeros=lambda shape: np.zeros(shape, dtype=object), nan=np.nan, int64=int, floor=lambda x: float(np.floor(float(x)))
)


def duals(values: Any, by: Any) -> Any:
    """Values of any shape as an array of duals; by: of the same shape with K derivatives behind."""
    out = np.empty(np.shape(values), dtype=object)
    for place in np.ndindex(out.shape):
        out[place] = Dual(float(np.asarray(values)[place]), np.asarray(by)[place])
    return out
