"""A formula's program against an independent interpreter; what is no formula is refused in words."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from linid.errors import LinidError
from linid.physics.effects.registry import canonical, find_effect
from linid.physics.model import OWN_STACK, OWN_VARIABLES, RECORD, WORK_SIZE, Model, own_places
from linid.physics.own_terms import layout
from linid.physics.own_terms.expression import parse_formula
from linid.physics.own_terms.program import program_of
from linid.physics.own_terms.values import formula_values
from linid.simulation.own_terms import own_sum
from tests.physics.own_terms.plain_interpreter import Interpreter


@njit
def summed(p, on, part, push, t, y, v):
    return own_sum(p, on, part, push, t, y, v)


def kernel_value(text: str, values: dict[str, float], variables: dict[str, float], part: int = 0) -> float:
    """What the compiled simulation makes of a term; the variables of the memory are put where it keeps them."""
    model = Model("force", (text,))
    p = np.zeros(WORK_SIZE)
    vector = model.vector(values)
    p[: vector.size] = vector
    p[RECORD + 1] = variables["T"] - variables["t"]
    for k, name in enumerate(layout.VARIABLES):
        p[OWN_VARIABLES + k] = variables[name]
    on = model.mask & ~(layout.MEMORY_BIT | layout.ACCELERATION_BIT | layout.STRIBECK_BIT)
    return float(summed(p, on, part, variables["F"], variables["t"], variables["y"], variables["v"]))


VARIABLES = {"t": 0.3, "T": 7.3, "y": 0.11, "v": -0.4, "F": 12.0}
VARIABLES |= {"travel": 0.05, "since_reversal": 0.2, "rest": 1.5, "slid": 0.02, "acceleration": 1.7, "stribeck": 1.2}
numbers = st.floats(-3.0, 3.0, allow_nan=False).map(lambda x: round(x, 3))
leaves = st.one_of(
    numbers.map(lambda x: f"({x})"), st.sampled_from([*layout.VARIABLES, "pi"]), st.sampled_from(["b", "q", "k0"])
)


def deeper(inner):
    one = st.sampled_from(list(layout.ONE_ARGUMENT))
    two = st.sampled_from(list(layout.TWO_ARGUMENTS))
    operator = st.sampled_from(["+", "-", "*", "/", "**"])
    return st.one_of(
        st.builds(lambda a, f, b: f"({a} {f} {b})", inner, operator, inner),
        st.builds(lambda a: f"(-{a})", inner),
        st.builds(lambda f, a: f"{f}({a})", one, inner),
        st.builds(lambda f, a, b: f"{f}({a}, {b})", two, inner, inner),
    )


expressions = st.recursive(leaves, deeper, max_leaves=8)
GIVEN = {"b": 0.7, "q": -1.3, "k0": 2.1}
_RANGES = "".join(f"; {name} in [-3, 3]" for name in GIVEN)


@settings(max_examples=300, deadline=None)
@given(expressions, st.lists(numbers, min_size=len(layout.VARIABLES), max_size=len(layout.VARIABLES)))
def test_random_expressions_give_what_an_independent_interpreter_gives(text: str, drawn: list[float]) -> None:
    variables = dict(zip(layout.VARIABLES, drawn, strict=True))
    used = [name for name in GIVEN if any(node.name == name for node in parse_formula(text, "x")[0].walk())]
    whole = f"e: {text}" + "".join(f"; {name} in [-3, 3]" for name in used)
    try:
        term = find_effect(whole).own
    except LinidError as error:  # linear in two parameters that have a range each is fine; too many products are not
        assert "products" in error.fact, error
        return
    values = {f"e_{name}": GIVEN.get(name, 1.0) for name in term.parameters}
    force = kernel_value(whole, values, variables)
    level = kernel_value(whole, values, variables, 1)
    expected = Interpreter(text, GIVEN)(variables)
    total = force - level * np.sign(variables["v"])
    if math.isfinite(expected) and abs(expected) < 1e12 and math.isfinite(total):
        assert total == pytest.approx(expected, rel=1e-7, abs=1e-7 * max(1.0, abs(expected)))
    by_numpy = formula_values(
        parse_formula(text, "x")[0], {name: np.array([x]) for name, x in variables.items()}, GIVEN
    )
    if math.isfinite(expected):
        assert np.broadcast_to(by_numpy, (1,))[0] == pytest.approx(expected, rel=1e-9, abs=1e-12)


STRAIGHT = [
    ("1.5 * (max(min(v, 0.3), -0.2) - -0.2)", 1),
    ("-0.7 * max(min(y, 0.25), 0.1)", 1),
    ("2 * (min(F, 5) - 3)", 4),  # without its other end no piece of a polyline
    ("1.5 * (max(min(v, 0.3), -0.2) - 0.1) + 2 * (max(min(v, 0.9), 0.3) - 0.3)", 3),
    ("3 + v", 2),
    ("3 - v", 2),
    ("-(2) - v * (y + 1)", 5),
    ("min(v, max(F, y))", 3),
]


@pytest.mark.parametrize(("formula", "operations"), STRAIGHT)
def test_numbers_and_places_stand_behind_the_operations_that_take_them(formula: str, operations: int) -> None:
    """Fewer operations, and the same numbers to the bit."""
    program = program_of(parse_formula(formula, "x")[0], {name: k for k, name in enumerate(layout.VARIABLES)})
    place, count = 0, 0
    while place < len(program):
        code = int(program[place])
        count += 1
        place += 6 if code == layout.RAMP else 2 if code <= layout.NUMBER or code > layout.MAX else 1
    assert (place, count) == (len(program), operations)
    for v in (-2.0, -0.2, -0.05, 0.0, 0.3, 0.5, 2.0, math.nan):
        variables = VARIABLES | {"v": v, "y": 0.4 * v, "F": 10.0 * v}
        expected = Interpreter(formula, {})(variables)
        assert kernel_value(f"e: c * ({formula})", {"e_c": 1.0}, variables) == pytest.approx(
            expected, rel=0.0, abs=0.0, nan_ok=True
        )


CURVES = [
    ("spline(y, -0.1, 0.3, 7)", 7),
    ("periodic(y, 2 * pi / 40, 5)", 5),
    ("spline2(y, -0.1, 0.3, 5, v, -1, 1, 4)", 20),
    ("v * spline(abs(F), 0, 20, 4) - periodic(y + 0.01 * v, 0.03, 6) * travel", 10),
    ("spline(y, -0.1, 0.3, 4) + spline(v, -1, 1, 6)", 10),
]


@pytest.mark.parametrize(("formula", "count"), CURVES)
def test_curves_are_the_b_splines_of_scipy(formula: str, count: int) -> None:
    generator = np.random.default_rng(3)
    coefficients = generator.normal(size=count).tolist()
    values = {f"e_{k + 1}": x for k, x in enumerate(coefficients)}
    plain = Interpreter(formula, {}, coefficients)
    for _ in range(60):
        variables = VARIABLES | {"y": generator.uniform(-0.3, 0.5), "v": generator.uniform(-1.5, 1.5)}
        assert kernel_value(f"e: {formula}", values, variables) == pytest.approx(plain(variables), rel=1e-11, abs=1e-12)


def test_a_fixed_sum_is_one_factor_of_many_products() -> None:
    """A factor of 12 summands times 12 amplitudes: 144 products, and too long a program, if it were expanded."""
    factor = " + ".join(f"{0.1 * k:g} * max(min(F, {k + 1}), {k})" for k in range(12))
    waves = " + ".join(f"a_{k} * cos({7 * k} * y)" for k in range(12))
    text, values = f"({factor}) * ({waves})", {f"a_{k}": 0.3 + k for k in range(12)}
    assert len(find_effect(f"e: {text}").own.summands) == 12
    got = kernel_value(f"e: {text}", {f"e_{name}": value for name, value in values.items()}, VARIABLES)
    assert got == pytest.approx(Interpreter(text, values)(VARIABLES), rel=1e-12)


def test_curves_at_their_ends_and_where_there_is_no_number() -> None:
    values = {f"e_{k}": float(k) for k in range(1, 6)}
    for y in (-0.1, 0.3, 0.3 - 1e-17, 1e300, -1e300):
        expected = Interpreter("spline(y, -0.1, 0.3, 5)", {}, list(values.values()))(VARIABLES | {"y": y})
        assert kernel_value("e: spline(y, -0.1, 0.3, 5)", values, VARIABLES | {"y": y}) == pytest.approx(expected)
    for text in ("e: spline(log(y), 0, 1, 5)", "e: periodic(log(y), 1, 5)", "e: periodic(1 / (y + 1), 1, 5)"):
        assert math.isnan(kernel_value(text, values, VARIABLES | {"y": -1.0}))
    surface = {f"e_{k}": 1.0 for k in range(1, 17)}
    assert math.isnan(kernel_value("e: spline2(y, 0, 1, 4, log(y), 0, 1, 4)", surface, VARIABLES | {"y": -1.0}))


BAD = [
    ("e: c * unknown(v)", "unknown function"),
    ("e: c * sin(v, y)", "sin takes 1"),
    ("e: c * min(v)", "min takes 2"),
    ("e: c * sin(x=v)", "sin takes 1"),
    ("e: c * sin(*v)", "sin takes 1"),
    ("e: c * v.real", "not part of a formula"),
    ("e: c * v[0]", "not part of a formula"),
    ("e: c * (v < 1)", "not part of a formula"),
    ("e: c if v else y", "not part of a formula"),
    ("e: [c for c in v]", "not part of a formula"),
    ("e: (c := v)", "not part of a formula"),
    ("e: c * v % 2", "not part of a formula"),
    ("e: c * v ^ 2", "not part of a formula"),
    ("e: c and v", "not part of a formula"),
    ("e: __import__('os').system('x')", "unknown function"),
    ("e: c * 'v'", "no number"),
    ("e: c * True", "no number"),
    ("e: c * 1j", "no number"),
    ("e: c * 1e999", "no number"),
    ("e: c * " + "9" * 400, "no formula"),
    ("e: c *", "no formula"),
    ("e:", "no formula"),
    ("e: c * v\nimport os", "no formula"),
    ("e: c * sign", "without arguments"),
    ("e: c * a", "acceleration"),
    ("e: c * _x", "parameter"),
    ("e: c * \u00b5", "parameter"),
    ("e: " + "(" * 300 + "c" + ")" * 300, "no formula"),
    ("e: c" + " + v" * 400, "characters"),
    ("e: c * " + "sin(" * 45 + "v" + ")" * 45, "nested"),
    ("e: (c1 + v) * " + " * ".join(f"({x} + sign(v))" for x in ("y", "t", "v", "F", "T", "1")), "products"),
    ("e: c * v ** p", "not linear in the parameter p"),
    ("e: c * d * v", "multiplies c and d"),
    ("e: c * spline(y, 0, 1, 5)", "multiplies c and a spline"),
    ("e: exp(spline(y, 0, 1, 5))", "not linear in a curve"),
    ("e: spline(spline(y, 0, 1, 5), 0, 1, 5)", "curve inside"),
    ("e: spline(y, 1, 0, 5)", "range 1 to 0"),
    ("e: spline(y, 0, b, 5)", "not fixed"),
    ("e: spline(y, 0, log(0), 5)", "no number"),
    ("e: spline(y, 0, 1, 3)", "3 coefficients"),
    ("e: spline(y, 0, 1, 5.5)", "5.5 coefficients"),
    ("e: spline2(y, 0, 1, 50, v, 0, 1, 50)", "numbers"),
    ("e: c * v; p in [1, 2]", "lacks"),
    ("e: c * v ** p; p in [2, 1]", "range 2 to 1"),
    ("e: c * v ** p; p in [1, x]", "after its formula"),
    ("e: c * v ** p; p in [1, 2]; p in [1, 3]", "two ranges"),
    ("e: c * v; __import__('os')", "after its formula"),
    ("e: y + scale * v", "scale"),
    ("1e: c * v", "no name"),
    ("e f: c * v", "no name"),
    (": c * v", "no name"),
    ("cogging: c * v", "taken"),
    ("load: -friction * abs(F) * sign(v)", "taken"),
    ("coulomb: force * v", "taken"),
]


@pytest.mark.parametrize(("text", "fact"), BAD)
def test_what_is_no_term_is_refused_with_place_fact_and_remedy(text: str, fact: str) -> None:
    with pytest.raises(LinidError) as found:
        Model("force", (text,))
    assert fact in str(found.value) and found.value.place and found.value.remedy


def test_models_with_too_much_are_refused() -> None:
    three = ("e: c * v", "f: c * y", "g: c * y ** 2")
    assert Model("force", three).mask == Model("force", three[:1]).mask
    for more, fact in ((("h: c * F",), "at most 3"), (("e: d * y",), "share the name"), (("e_1: c * y",), None)):
        names = (*three[:2], *more) if fact != "at most 3" else (*three, *more)
        if fact is None:
            assert len(Model("force", names).effects) == 3
        else:
            with pytest.raises(LinidError, match=fact):
                Model("force", names)
    with pytest.raises(LinidError, match="share the name"):
        Model("force", ("e: d_c * y", "e_d: c * v"))


@settings(max_examples=300, deadline=None)
@given(st.one_of(st.text(max_size=60), st.text("cvy+-*/()1.,; in[]sp", max_size=40)))
def test_random_texts_raise_nothing_but_the_projects_errors(text: str) -> None:
    try:
        names = canonical((f"e:{text}",))
    except LinidError as error:
        assert error.place and error.fact and error.remedy
        return
    assert canonical(names) == names
    own_places(names)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("d:-c*v*abs( v )", "d: -c * v * abs(v)"),
        (" d : (c*v)", "d: c * v"),
        ("d: c*v**p ; p in [1,3.5]", "d: c * v ** p; p in [1, 3.5]"),
        ("d: c*exp(-y/L);L in [1e-4 , 0.1]", "d: c * exp(-y / L); L in [0.0001, 0.1]"),
    ],
)
def test_texts_have_one_canonical_form(text: str, wanted: str) -> None:
    assert canonical((text,)) == Model("force", (text,)).effects == (wanted,)
    assert find_effect(text) == find_effect(wanted) and find_effect(text).name == wanted


@pytest.mark.parametrize(
    ("formula", "amplitudes", "level", "units"),
    [
        ("-c * v * abs(v)", ("c",), None, ("N s^2/m^2",)),
        ("-c * abs(F) * sign(v)", ("c",), 0.3 * 12.0, ("1",)),
        ("-sign(v) * (b + c * y)", ("b", "c"), 0.2 + 0.3 * 0.11, ("N", "N/m")),
        ("c * sign(v) * y - b * v", ("c", "b"), -0.3 * 0.11, ("N/m", "N s/m")),
        ("c * tanh(v / w); w in [0.1, 2]", ("c",), None, ("N",)),
        ("c * w * v; w in [0.1, 2]", ("c",), None, ("SI",)),
        ("3 * sin(20 * y)", ("scale",), None, ("N",)),
        ("c * v + exp(-y / L); L in [0.1, 2]", ("c", "scale"), None, ("N s/m", "N")),
        ("c * sqrt(rest) / travel", ("c",), None, ("N m/s^0.5",)),
    ],
)
def test_friction_amplitudes_and_units(
    formula: str, amplitudes: tuple[str, ...], level: float | None, units: tuple[str, ...]
) -> None:
    term = find_effect(f"e: {formula}").own
    assert term.amplitudes == amplitudes
    assert tuple(term.unit(name) for name in amplitudes) == units
    values = {"e_b": 0.2, "e_c": 0.3, "e_w": 0.5, "e_L": 0.7, "e_scale": 1.0}
    values = {name: x for name, x in values.items() if name.removeprefix("e_") in term.parameters}
    assert kernel_value(f"e: {formula}", values, VARIABLES, 1) == pytest.approx(level or 0.0)
    plain = Interpreter(formula.split(";")[0], {name.removeprefix("e_"): x for name, x in values.items()})
    force = kernel_value(f"e: {formula}", values, VARIABLES)
    # Friction opposes the motion, which goes down here.
    assert force + (level or 0.0) == pytest.approx(plain(VARIABLES))


def test_the_stack_is_as_deep_as_is_said() -> None:
    assert WORK_SIZE == OWN_STACK + layout.STACK
    deepest = layout.STACK - 2  # beside c and the last t
    fits = f"e: c * sin({'t + (' * deepest}t{')' * deepest})"
    assert kernel_value(fits, {"e_c": 1.0}, VARIABLES) == pytest.approx(math.sin((deepest + 1) * 0.3))
    with pytest.raises(LinidError, match="numbers at once"):
        Model("force", (f"e: c * sin({'t + (' * (deepest + 1)}t{')' * (deepest + 1)})",))
