"""From a tree to the numbers of a program: each argument before what acts on it."""

from __future__ import annotations

from collections.abc import Mapping

from linid.physics.own_terms import layout
from linid.physics.own_terms.node import Node

_UNARY = {"-x": layout.NEGATIVE, **layout.ONE_ARGUMENT}
_BINARY = {**layout.OPERATORS, **layout.TWO_ARGUMENTS}


def program_of(tree: Node, places: Mapping[str, int]) -> list[float]:
    """The program of a formula: numbers in SI units and dimensionless codes. Source: linid's own form.

    places: in the vector, of variables, of parameters by the names in the formula, and of coefficients by number.
    """
    if tree.kind == "number":
        return [float(layout.NUMBER), tree.value]
    if tree.kind in ("variable", "parameter"):
        return [float(layout.LOAD), float(places[tree.name])]
    out = [number for one in tree.args for number in program_of(one, places)]
    if tree.coefficients:
        return [*out, *_curve(tree, places[str(tree.first)])]
    code = _UNARY[tree.kind] if len(tree.args) == 1 else _BINARY[tree.kind]
    return [*out, float(code)]


def _curve(tree: Node, place: int) -> list[float]:
    numbers = tree.numbers
    if tree.kind == "periodic":
        period, n = numbers
        return [float(layout.PERIODIC), float(place), n / period, n]
    spans = [numbers[k : k + 3] for k in range(0, len(numbers), 3)]
    ranges = [(low, (n - 3.0) / (high - low), n) for low, high, n in spans]
    code = layout.SPLINE if tree.kind == "spline" else layout.SURFACE
    return [float(code), float(place), *(x for one in ranges for x in one)]


def stack_needed(tree: Node) -> int:
    """How many numbers the program of a formula holds at once."""
    if not tree.args:
        return 1
    return max(k + stack_needed(one) for k, one in enumerate(tree.args))
