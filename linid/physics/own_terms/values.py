"""What a formula gives, by numpy: for ranges of amplitudes and for pictures; simulations read its program instead."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from linid.arrays import Array
from linid.physics.own_terms.basis import basis_columns
from linid.physics.own_terms.node import Node

_ONE = {
    "-x": np.negative,
    "abs": np.abs,
    "sign": np.sign,
    "sin": np.sin,
    "cos": np.cos,
    "exp": np.exp,
    "log": np.log,
    "sqrt": np.sqrt,
    "tanh": np.tanh,
}
_TWO = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "**": np.power,
    "min": np.minimum,
    "max": np.maximum,
}


def formula_values(node: Node, variables: Mapping[str, Array], parameters: Mapping[str, float]) -> Array:
    """Values (N,) of a formula in its SI unit, nan or infinite where it has none. Source: the formula itself.

    variables: (N,) each by name, SI; parameters: SI values by the names in the formula, coefficients of curves by their
    numbers ("1", "2" ...).
    """
    with np.errstate(all="ignore"):
        return np.asarray(_value(node, variables, parameters), dtype=float)


def constant_value(node: Node) -> float:
    """The value of a formula without variables and parameters, in its SI unit. Source: the formula itself."""
    return float(formula_values(node, {}, {}))


def _value(node: Node, variables: Mapping[str, Array], parameters: Mapping[str, float]) -> Array | float:
    if node.kind == "number":
        return np.float64(node.value)
    if node.kind == "variable":
        return variables[node.name]
    if node.kind == "parameter":
        return np.float64(parameters[node.name])
    args = [_value(one, variables, parameters) for one in node.args]
    if node.coefficients:
        arrays = [np.atleast_1d(np.asarray(x, dtype=float)) for x in args]
        coefficients = np.array([parameters[str(node.first + k)] for k in range(node.coefficients)])
        return np.asarray(basis_columns(node.kind, node.numbers, *np.broadcast_arrays(*arrays)) @ coefficients)
    result: Array = _ONE[node.kind](args[0]) if len(args) == 1 else _TWO[node.kind](args[0], args[1])
    return result
