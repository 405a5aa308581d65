"""From a tree to the numbers of a program: each argument before what acts on it."""

from __future__ import annotations

from collections.abc import Mapping

from linid.physics.own_terms import layout
from linid.physics.own_terms.node import Node

_UNARY = {"-x": layout.NEGATIVE, **layout.ONE_ARGUMENT}
_BINARY = {**layout.OPERATORS, **layout.TWO_ARGUMENTS}
_NAMED = ("variable", "parameter")


def program_of(tree: Node, places: Mapping[str, int]) -> list[float]:
    """The program of a formula: numbers in SI units and dimensionless codes. Source: linid's own form.

    places: in the vector, of variables, of parameters by the names in the formula, and of coefficients by number.
    """
    value = _number(tree)
    if value is not None:
        return [float(layout.NUMBER), value]
    if tree.kind in _NAMED:
        return [float(layout.LOAD), float(places[tree.name])]
    ramp = _ramp(tree, places)
    if ramp:
        return ramp
    if tree.kind in _BINARY:
        return _of_two(tree, places)
    out = [number for one in tree.args for number in program_of(one, places)]
    if tree.coefficients:
        return [*out, *_curve(tree, places[str(tree.first)])]
    return [*out, float(_UNARY[tree.kind])]


def _number(tree: Node) -> float | None:
    """The number that a tree is; None where it is more than that."""
    if tree.kind == "number":
        return tree.value
    inner = _number(tree.args[0]) if tree.kind == "-x" else None
    return None if inner is None else -inner


def _of_two(tree: Node, places: Mapping[str, int]) -> list[float]:
    """An operation on two numbers, the second one behind its code where that is no operation itself."""
    wave = _wave(tree)
    if wave:
        return [*program_of(wave[0], places), float(layout.WAVE), *(float(places[name]) for name in wave[1:])]
    first, second = tree.args
    if tree.kind in layout.EITHER_WAY and (_number(first) is not None or first.kind in _NAMED):
        first, second = second, first
    code, out, value = _BINARY[tree.kind], program_of(first, places), _number(second)
    if value is not None:
        return [*out, float(code + layout.WITH_NUMBER), value]
    if second.kind in _NAMED:
        return [*out, float(code + layout.WITH_LOAD), float(places[second.name])]
    return [*out, *program_of(second, places), float(code)]


def _wave(tree: Node) -> tuple[Node, str, str] | None:
    """The angle of a wave and the names of its amplitudes: one times the sine plus one times the cosine of one angle,
    which together take little longer than one of them; None for anything else."""
    sides = [one.of_wave for one in tree.args] if tree.kind == "+" else []
    found = {kind: (angle, name) for kind, angle, name in filter(None, sides)}
    if len(found) < 2 or found["sin"][0] != found["cos"][0]:
        return None
    return found["sin"][0], found["sin"][1], found["cos"][1]


def _ramp(tree: Node, places: Mapping[str, int]) -> list[float]:
    """A straight piece of a polyline in one operation: slope * (max(min(x, high), low) - start); else nothing."""
    slope = _number(tree.args[0]) if tree.kind == "*" else None
    if slope is None:
        return []
    rest, start = _without_start(tree.args[1])
    if rest.kind != "max" or rest.args[0].kind != "min" or rest.args[0].args[0].kind not in _NAMED:
        return []
    place = places[rest.args[0].args[0].name]
    low, high = _number(rest.args[1]), _number(rest.args[0].args[1])
    if low is None or high is None:
        return []
    return [float(layout.RAMP), float(place), low, high, start, slope]


def _without_start(tree: Node) -> tuple[Node, float]:
    """What a number is subtracted from, and that number; all of a tree and 0, where it is nothing of the sort."""
    start = _number(tree.args[1]) if tree.kind == "-" else None
    return (tree, 0.0) if start is None else (tree.args[0], start)


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
