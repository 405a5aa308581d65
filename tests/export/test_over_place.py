"""Terms over positions are what the effects' own functions say, one position at a time."""

from __future__ import annotations

import numpy as np
import pytest

from linid.export.over_place import term_over
from linid.physics.effects.registry import find_effect
from tests.simulation.axis_with_effects import SAMPLES

Y = np.linspace(-0.4, 0.4, 57)
CASES = [
    ("cogging", "force"),
    ("gravity", "force"),
    ("end_effect", "thrust"),
    ("force_ripple", "thrust"),
    ("position_dependent_friction", "friction"),
]


@pytest.mark.parametrize(("name", "term"), CASES)
def test_terms_over_positions(name: str, term: str) -> None:
    effect = find_effect(name)
    values = {p.name: p.default for p in effect.parameters} | SAMPLES[name]
    function = getattr(effect, term).py_func
    numbers = [values[p.name] for p in effect.parameters]
    expected = [function(0.0, float(y), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, *numbers) for y in Y]
    assert name == "gravity" or np.ptp(expected) > 0.0
    np.testing.assert_allclose(term_over(name, term, values, Y), expected, rtol=1e-13, atol=1e-15)


def test_values_that_are_not_named_are_the_usual_ones() -> None:
    effect = find_effect("gravity")
    values = {p.name: p.default for p in effect.parameters}
    np.testing.assert_array_equal(term_over("gravity", "force", {}, Y), term_over("gravity", "force", values, Y))


def test_positions_with_strides() -> None:
    values = {"friction_at_1": 0.5, "friction_at_11": 0.2}
    whole = term_over("position_dependent_friction", "friction", values, Y)
    np.testing.assert_array_equal(term_over("position_dependent_friction", "friction", values, Y[::2]), whole[::2])
