"""An interpreter of formulas that shares nothing with linid's: Python's tree, Python's floats, scipy's B-splines."""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping

import numpy as np
from scipy.interpolate import BSpline

_OPERATORS = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: a**b,
}
_FUNCTIONS = {
    "abs": abs,
    "sign": lambda x: float(np.sign(x)),
    "sin": math.sin,
    "cos": math.cos,
    "exp": math.exp,
    "log": math.log,
    "sqrt": math.sqrt,
    "tanh": math.tanh,
    "min": min,
    "max": max,
}


class Interpreter:
    """The value of one formula; parameters: by their names in it; coefficients: of its curves, by number."""

    def __init__(self, formula: str, parameters: Mapping[str, float], coefficients: list[float] | None = None) -> None:
        self.tree = ast.parse(formula, mode="eval").body
        self.parameters = {**parameters, "pi": math.pi}
        self.coefficients = coefficients or []

    def __call__(self, variables: Mapping[str, float]) -> float:
        """nan where Python has no real value."""
        self.names = {**self.parameters, **variables}
        self.used = 0
        try:
            value = self._value(self.tree)
        except (ValueError, OverflowError, ZeroDivisionError):
            return math.nan
        return math.nan if isinstance(value, complex) else float(value)

    def _value(self, node):
        if isinstance(node, ast.Constant):
            return float(node.value)
        if isinstance(node, ast.Name):
            return self.names[node.id]
        if isinstance(node, ast.UnaryOp):
            return -self._value(node.operand) if isinstance(node.op, ast.USub) else self._value(node.operand)
        if isinstance(node, ast.BinOp):
            value = _OPERATORS[type(node.op)](self._value(node.left), self._value(node.right))
            if isinstance(value, complex):
                raise ValueError
            return value
        arguments = [self._value(one) for one in node.args]
        curve = getattr(self, f"_{node.func.id}", None)
        return curve(*arguments) if curve else _FUNCTIONS[node.func.id](*arguments)

    def _taken(self, count):
        self.used += int(count)
        return np.array(self.coefficients[self.used - int(count) : self.used])

    @staticmethod
    def _clamped(x, low, high, coefficients):
        n = coefficients.shape[0]
        step = (high - low) / (n - 3)
        knots = low + step * np.arange(-3, n + 1)
        return BSpline(knots, coefficients, 3)(min(max(x, low), high))

    def _spline(self, x, low, high, n):
        return float(self._clamped(x, low, high, self._taken(n)))

    def _spline2(self, x, low, high, n, x2, low2, high2, n2):
        rows = self._taken(n * n2).reshape(int(n), int(n2))
        return float(self._clamped(x2, low2, high2, self._clamped(x, low, high, rows)))

    def _periodic(self, x, period, n):
        c = self._taken(n)
        wrapped = np.concatenate([c, c[:3]])
        return float(self._clamped(x % period, 0.0, period, wrapped))
