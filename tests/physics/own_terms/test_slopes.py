"""How a formula answers its variables and parameters, found on the way back through its program, against differences
of an independent interpreter."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from linid.errors import LinidError
from linid.physics.effects.registry import find_effect
from linid.physics.model import OWN_VARIABLES, RECORD, WORK_SIZE, Model
from linid.physics.own_terms import layout
from linid.physics.own_terms.expression import parse_formula
from linid.simulation.own_slopes import BY, own_slopes_of, put_answers
from tests.physics.own_terms.plain_interpreter import Interpreter
from tests.physics.own_terms.test_formula import CURVES, GIVEN, expressions, numbers

_SMOOTH = 0.02  # by how much both sides of a point may differ where it has a slope
_LARGEST = 1e4  # of what is compared: larger ones are poles


@njit
def answers(p, params, on, part):
    own = own_slopes_of(on, params, 0, 1.0)
    at = OWN_VARIABLES
    put_answers(p, on, part, p[at + 4], p[at], p[at + 2], p[at + 3], own)
    return own[BY : BY + WORK_SIZE]


def answers_of(text: str, values: dict[str, float], variables: dict[str, float]) -> dict[str, float]:
    """How a term answers its variables and its parameters, by their names in the formula."""
    model = Model("force", (text,))
    vector, p = model.vector(values), np.zeros(WORK_SIZE)
    p[: vector.size] = vector
    p[RECORD + 1] = variables["T"] - variables["t"]
    for k, name in enumerate(layout.VARIABLES):
        p[OWN_VARIABLES + k] = variables[name]
    on = model.mask & ~(layout.MEMORY_BIT | layout.ACCELERATION_BIT | layout.STRIBECK_BIT)
    parts = [answers(p.copy(), vector[None, :], on, part) for part in (0, 1)]
    by = parts[0] - parts[1] * np.sign(variables["v"])
    found = {name: float(by[OWN_VARIABLES + k]) for k, name in enumerate(layout.VARIABLES)}
    return found | {name.removeprefix("e_"): float(by[model.slot(name)]) for name in values}


def sides(formula: str, name: str, given: dict[str, float], numbers: list[float], at: dict[str, float]) -> list[float]:
    """Differences by a name to both sides, of an independent interpreter."""

    def value(x: float) -> float:
        if name.isdigit():
            other = [*numbers[: int(name) - 1], x, *numbers[int(name) :]]
            return Interpreter(formula, given, other)(at)
        known = at | {name: x} if name in at else at
        return Interpreter(formula, given | ({} if name in at else {name: x}), numbers)(known)

    x = numbers[int(name) - 1] if name.isdigit() else at.get(name, given.get(name, 0.0))
    step = 1e-6 * max(abs(x), 0.1)
    return [(value(x + side * step) - value(x)) / (side * step) for side in (1.0, -1.0)]


def compare(found: dict[str, float], formula: str, given: dict[str, float], numbers: list[float], at: dict[str, float]):
    """Compare wherever both sides of a point agree; returns by how many names."""
    compared = 0
    for name, mine in found.items():
        if name == "scale" or (name in at and name not in formula):
            continue
        up, down = sides(formula, name, given, numbers, at)
        size = max(abs(up), abs(down), 1e-3)
        if size < _LARGEST and abs(up - down) < _SMOOTH * size:
            assert mine == pytest.approx(0.5 * (up + down), abs=1.5 * _SMOOTH * size), name
            compared += 1
    return compared


@settings(max_examples=400, deadline=None)
@given(expressions, st.lists(numbers, min_size=len(layout.VARIABLES), max_size=len(layout.VARIABLES)))
def test_random_expressions_answer_what_differences_say(text: str, drawn: list[float]) -> None:
    at = dict(zip(layout.VARIABLES, drawn, strict=True))
    middle = Interpreter(text, GIVEN)(at)
    used = [name for name in GIVEN if any(node.name == name for node in parse_formula(text, "x")[0].walk())]
    whole = f"e: {text}" + "".join(f"; {name} in [-3, 3]" for name in used)
    try:
        term = find_effect(whole).own
    except LinidError:
        return
    if math.isfinite(middle) and abs(middle) < _LARGEST and at["v"] != 0.0:
        values = {f"e_{name}": GIVEN.get(name, 1.0) for name in term.parameters}
        compare(answers_of(whole, values, at), text, GIVEN, [], at)


WHOLE = [
    "c_1 * cos(90 * y) + c_2 * sin(90 * y) + v * (c_3 * sin(7 * T) + c_4 * cos(7 * T))",
    "F * (c_1 * sin(30 * y + v) + c_2 * cos(30 * y + v)) / (c_3 + 5)",
    "c_1 * abs(v) ** 1.5 * sqrt(abs(F)) + c_2 * tanh(travel / 0.05) * log(rest + 1)",
    "c_1 * (max(min(v, 0.3), -0.6) - 0.1) * exp(-since_reversal) - c_2 * min(slid, acceleration) * max(v, stribeck)",
]


@pytest.mark.parametrize("formula", WHOLE)
def test_every_variable_and_parameter_of_a_formula(formula: str) -> None:
    """All of them, at points where nothing has a corner."""
    generator = np.random.default_rng(3)
    names = sorted({f"c_{k}" for k in range(1, 5) if f"c_{k}" in formula})
    for _ in range(20):
        at = {name: float(generator.uniform(0.05, 1.0)) for name in layout.VARIABLES}
        at |= {"v": float(generator.uniform(-0.5, 0.25)), "T": 3.1, "t": 0.4}
        given = {name: float(generator.uniform(-2.0, 2.0)) for name in names}
        ranges = "; c_3 in [-3, 3]" if "c_3 +" in formula else ""
        found = answers_of(f"e: {formula}{ranges}", {f"e_{name}": x for name, x in given.items()}, at)
        used = [name for name in at if name in formula] + names
        assert compare(found, formula, given, [], at) >= len(used)


@pytest.mark.parametrize(("formula", "count"), CURVES)
def test_every_coefficient_and_argument_of_a_curve(formula: str, count: int) -> None:
    """Curves in the middle of their ranges, and beyond the ends, where they stay as they are there."""
    generator = np.random.default_rng(4)
    own = [float(x) for x in generator.normal(size=count)]
    values = {f"e_{k + 1}": x for k, x in enumerate(own)}
    for y, v in ((0.11, -0.4), (0.23, 0.6), (-0.3, 1.4), (0.5, -1.2)):
        at = {name: float(generator.uniform(0.1, 0.9)) for name in layout.VARIABLES} | {"y": y, "v": v}
        at |= {"F": float(generator.uniform(-15.0, 15.0))}
        assert compare(answers_of(f"e: {formula}", values, at), formula, {}, own, at) >= count + 1
