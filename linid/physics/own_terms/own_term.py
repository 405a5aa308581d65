"""An own term: what its text says, checked and taken apart.

The text says all: "my_drag: -c * v * abs(v) ** p; p in [1, 3]" is a name, a formula, and the ranges of parameters. It
gives a force on the mass in N (rotary: N m). A product with the factor sign(v) is a level of friction instead, which
the bristle turns into a force, also at rest.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from linid.errors import ConfigError
from linid.physics.own_terms import layout
from linid.physics.own_terms.expression import parse_formula
from linid.physics.own_terms.node import Node
from linid.physics.own_terms.program import stack_needed
from linid.physics.own_terms.summands import SCALE, Summand, amplitudes_of, has_amplitude, sum_of, summands_of
from linid.physics.own_terms.units import amplitude_unit

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,29}\Z")
_RANGE = re.compile(r"\s*([A-Za-z][A-Za-z0-9_]*)\s+in\s+\[\s*([^,\s\]]+)\s*,\s*([^,\s\]]+)\s*\]\s*\Z")
_LARGEST = 1e15


@dataclass(frozen=True)
class OwnTerm:
    """name: short; formula: canonical text; ranges: (name, low, high) in SI of parameters that have some; summands:
    the products of the formula, with the implicit scale where one has no amplitude.

    parameters: by their names in the formula, coefficients of curves by number; amplitudes: those that enter linearly.
    """

    name: str
    formula: str
    ranges: tuple[tuple[str, float, float], ...]
    summands: tuple[Summand, ...]
    parameters: tuple[str, ...]
    amplitudes: tuple[str, ...]

    @property
    def text(self) -> str:
        """Name, formula and ranges: the whole term."""
        return f"{self.name}: {self.formula}" + "".join(
            f"; {name} in [{_shown(low)}, {_shown(high)}]" for name, low, high in self.ranges
        )

    def part(self, friction: bool) -> Node | None:
        """The tree of its force in N, or of its level of friction in N; None if there is none."""
        mine = [one for one in self.summands if one.friction == friction]
        return sum_of(mine) if mine else None

    @property
    def variables(self) -> frozenset[str]:
        """The variables that the formula depends on, the direction of a friction apart."""
        trees = [node for one in self.summands for node in (*one.factors, *one.divisors)]
        return frozenset(node.name for tree in trees for node in tree.walk() if node.kind == "variable")

    @property
    def bits(self) -> int:
        """What it switches on in a simulation."""
        out = layout.MEMORY_BIT if self.variables & set(layout.MEMORY_VARIABLES) else 0
        if "acceleration" in self.variables:
            out |= layout.ACCELERATION_BIT
        if "stribeck" in self.variables:
            out |= layout.STRIBECK_BIT
        if self.variables & set(layout.TIMES):
            out |= layout.TIME_BIT
        for one in self.summands:
            out |= layout.LEVEL_BIT if one.friction else layout.FORCE_BIT
        if self.variables & {"F", "acceleration"}:
            out |= layout.LOAD_BIT if out & layout.LEVEL_BIT else 0
            out |= layout.PUSH_BIT if out & layout.FORCE_BIT else 0
        return out

    def range_of(self, parameter: str) -> tuple[float, float] | None:
        """The range that a parameter was given, SI. Source: the term's text."""
        return next(((low, high) for name, low, high in self.ranges if name == parameter), None)

    def multiplier(self, amplitude: str) -> tuple[Summand, ...]:
        """The products that an amplitude multiplies, without it (of a curve: without the curve)."""
        out = []
        for one in self.summands:
            others = tuple(node for node in one.factors if not _is(node, amplitude))
            if len(others) < len(one.factors):
                out.append(Summand(one.sign, others, one.divisors, one.friction))
        return tuple(out)

    def unit(self, amplitude: str) -> str:
        """SI unit of an amplitude, "SI" where it is not known."""
        units = {amplitude_unit(one.factors, one.divisors) for one in self.multiplier(amplitude)}
        return units.pop() if len(units) == 1 else "SI"


def _is(node: Node, name: str) -> bool:
    if node.kind == "parameter":
        return node.name == name
    return bool(node.coefficients) and name.isdigit() and 0 <= int(name) - node.first < node.coefficients


def is_own(text: str) -> bool:
    """Whether the name of an effect is the text of an own term."""
    return ":" in text


def own_text(name: str, value: str | Mapping[str, object]) -> str:
    """The text of a term in a mapping's form: {my_drag: formula} or {my_drag: {formula: ..., p: [1, 3]}}; raises
    ConfigError for another form.
    """
    if isinstance(value, str):
        return f"{name}: {value}"
    place = f"effects.{name}"
    if not isinstance(value, Mapping) or not isinstance(value.get("formula"), str):
        raise ConfigError(
            place, f"is {str(value)[:60]}", 'Write NAME: "formula", or NAME: {formula: "...", p: [1, 3]}.'
        )
    out = f"{name}: {value['formula']}"
    for key, pair in value.items():
        if key == "formula":
            continue
        if not isinstance(pair, list | tuple) or len(pair) != 2:
            raise ConfigError(f"{place}.{key}", f"is {str(pair)[:60]}, not a range", f"Write {key}: [low, high].")
        out += f"; {key} in [{pair[0]}, {pair[1]}]"
    return out


def parse_term(text: str) -> OwnTerm:
    """The term that a text says; raises ConfigError for one that says none."""
    name, _, rest = text.partition(":")
    name = name.strip()
    place = f"effect {name[:40]!r}"
    if not _NAME.match(name):
        raise ConfigError(place, "is no name for a term", "Take up to 30 letters, digits and underscores.")
    formula, *clauses = rest.split(";")
    tree, canonical = parse_formula(formula, place)
    ranges = tuple(_range(one, place) for one in clauses)
    summands = summands_of(tree, place)
    names = _parameters(summands)
    _check_ranges(ranges, names, place)
    given = frozenset(one for one, _, _ in ranges)
    amplitudes = amplitudes_of(summands, given, place)
    lacking = [one for one in summands if not has_amplitude(one, amplitudes)]
    if lacking and SCALE in names:
        raise ConfigError(place, f"needs the name {SCALE!r} for what has no factor", "Call that parameter otherwise.")
    if lacking:
        scale = Node("parameter", name=SCALE)
        summands = tuple(
            Summand(one.sign, (scale, *one.factors), one.divisors, one.friction) if one in lacking else one
            for one in summands
        )
        names, amplitudes = (*names, SCALE), (*amplitudes, SCALE)
    term = OwnTerm(name, canonical, ranges, summands, names, amplitudes)
    deepest = max(stack_needed(one) for one in (term.part(False), term.part(True)) if one is not None)
    if deepest > layout.STACK:
        raise ConfigError(place, f"needs {deepest} numbers at once, at most {layout.STACK}", "Simplify the formula.")
    return term


def _parameters(summands: tuple[Summand, ...]) -> tuple[str, ...]:
    names: dict[str, None] = {}
    for one in summands:
        for node in (inner for tree in (*one.factors, *one.divisors) for inner in tree.walk()):
            if node.kind == "parameter":
                names[node.name] = None
            names.update(dict.fromkeys(str(node.first + k) for k in range(node.coefficients)))
    return tuple(names)


def _range(clause: str, place: str) -> tuple[str, float, float]:
    found = _RANGE.match(clause)
    try:
        if found is None:
            raise ValueError
        low, high = float(found[2]), float(found[3])
    except ValueError:
        raise ConfigError(place, f"has {clause.strip()[:40]!r} after its formula", "Write ; p in [1, 3].") from None
    if not -_LARGEST < low < high < _LARGEST:
        raise ConfigError(place, f"gives {found[1]} the range {low:g} to {high:g}", "Give the lower end first.")
    return found[1], low, high


def _check_ranges(ranges: tuple[tuple[str, float, float], ...], names: tuple[str, ...], place: str) -> None:
    seen: set[str] = set()
    for name, _, _ in ranges:
        if name in seen:
            raise ConfigError(place, f"gives {name} two ranges", "Keep one of them.")
        if name not in names:
            raise ConfigError(place, f"gives a range for {name}, which its formula lacks", "Take it out.")
        seen.add(name)


def _shown(x: float) -> str:
    return f"{x:g}" if math.isclose(float(f"{x:g}"), x, rel_tol=0.0, abs_tol=0.0) else repr(x)
