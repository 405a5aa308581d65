"""Own terms at many samples at once, as the stack machine has them sample by sample."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from linid.errors import LinidError
from linid.physics.effects.registry import find_effect
from linid.physics.model import ADDED_MASS, ELAPSED, WORK_SIZE, Model
from linid.physics.own_terms import layout
from linid.simulation.along_effects import Samples
from linid.simulation.own_over import AT_ONCE, own_sums
from linid.simulation.own_terms import own_sum
from tests.physics.own_terms.test_formula import CURVES, GIVEN, expressions

FRICTION = {"coulomb_force": 4.0, "static_force": 6.0, "stribeck_velocity": 0.02, "viscous_friction": 9.0, "mass": 2.0}


@njit
def at_once(p, on, part, push, samples, out):
    own_sums(p, on, part, push, samples, out)


@njit
def in_turn(p, on, part, push, samples, out):
    for k in range(out.size):
        out[k] = own_sum(p, on, part, push[k], samples.t_start + k * samples.dt, samples.y[k], samples.v[k])


def both(text: str, values: dict[str, float], count: int, seed: int, part: int) -> tuple[np.ndarray, np.ndarray]:
    """Sums at samples drawn within three units, at once and in turn."""
    model, random = Model("force", (text,)), np.random.default_rng(seed)
    p, vector = np.zeros(WORK_SIZE), model.vector(FRICTION | values)
    p[: vector.size], p[ELAPSED], p[ADDED_MASS] = vector, 4.0, 0.5
    y, v, push = random.uniform(-3.0, 3.0, (3, count))
    v[:: max(count // 3, 1)] = 0.0
    samples, out = Samples(0.4, 0.01, y, v, y, y, y), np.empty((2, count))
    at_once(p, model.mask, part, push, samples, out[0])
    in_turn(p, model.mask, part, push, samples, out[1])
    return out[0], out[1]


COUNTS = st.one_of(st.integers(1, 20), st.sampled_from([AT_ONCE - 1, AT_ONCE, AT_ONCE + 1, 3 * AT_ONCE + 5]))


@settings(max_examples=300, deadline=None)
@given(expressions, COUNTS, st.integers(0, 2**32 - 1), st.sampled_from([0, 1]))
def test_random_expressions_at_once_are_those_in_turn(text: str, count: int, seed: int, part: int) -> None:
    """Forces and levels of friction; but for the last bits of sine, cosine and exponential."""
    names = {name for name in GIVEN if name in text}
    whole = f"e: {text}" + "".join(f"; {name} in [-3, 3]" for name in sorted(names))
    try:
        term = find_effect(whole).own
    except LinidError:
        return
    if term.variables & set(layout.MEMORY_VARIABLES):
        return  # such are asked sample by sample
    values = {f"e_{name}": GIVEN.get(name, 1.0) for name in term.parameters}
    found, expected = both(whole, values, count, seed, part)
    if not any(name in text for name in ("sin", "cos", "exp")):
        np.testing.assert_array_equal(found, expected)
    else:  # functions of functions may hang on the last bits
        assert np.mean(np.isclose(found, expected, rtol=1e-6, atol=1e-6, equal_nan=True)) > 0.8


@pytest.mark.parametrize(("formula", "count"), CURVES[:3] + CURVES[4:])
def test_curves(formula: str, count: int) -> None:
    values = {f"e_{k + 1}": x for k, x in enumerate(np.random.default_rng(3).normal(size=count))}
    found, expected = both(f"e: {formula}", values, 2 * AT_ONCE + 3, 5, 0)
    np.testing.assert_array_equal(found, expected)
    assert np.ptp(found) > 0.1


@pytest.mark.parametrize(
    ("formula", "values"),
    [
        ("c_1 * cos(385 * y) + c_2 * sin(385 * y)", {"e_c_1": 0.3, "e_c_2": -0.7}),
        ("c_1 * sin(2e4 * y)", {"e_c_1": 0.3}),
        ("c_1 * exp(-0.5 * ((y - 0.3) / 0.4)**2) * F", {"e_c_1": 0.3}),
        ("c_1 * exp(300 * abs(y))", {"e_c_1": 1e-200}),
        ("c_1 * acceleration + c_2 * stribeck", {"e_c_1": 0.2, "e_c_2": 1.5}),
        ("c_1 * max(min(F, 1.5), -0.5) - c_2 * T", {"e_c_1": 0.2, "e_c_2": 1.5}),
    ],
)
def test_usual_formulas(formula: str, values: dict[str, float]) -> None:
    """To the last bits, beyond what vector instructions reach too; what is no number is none."""
    found, expected = both(f"e: {formula}", values, AT_ONCE + 40, 1, 0)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=2e-15)
    assert np.isnan(found).any() == ("exp(300" in formula)


def test_a_number_that_is_none_spoils_its_sample_alone() -> None:
    found, expected = both("e: c * sqrt(y)", {"e_c": 1.0}, 40, 2, 0)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(expected))
    assert 0 < np.isnan(found).sum() < 40
