"""Every formula of the dictionary, written as an own term, is the force that was fitted."""

from __future__ import annotations

import numpy as np
import pytest

from linid.arrays import Array
from linid.diagnosis.proposed.arguments import arguments_of
from linid.diagnosis.proposed.dictionary import formulas
from linid.diagnosis.proposed.family import Family, added_level
from linid.diagnosis.proposed.leftover import Leftover
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.waves import wave_families
from linid.physics.own_terms.layout import VARIABLES
from linid.physics.own_terms.own_term import parse_term
from linid.physics.own_terms.values import formula_values
from tests.diagnosis.proposed.axis import CREEPING, axis, family_of

MOVING = 0.02  # m/s, above which a bristle's friction is that of the sign


def variables(problem: Problem) -> dict[str, Array]:
    known = {one.plain.symbol: one.plain.values for one in arguments_of(problem).values()}
    known["stribeck"] = problem.stribeck
    return {name: known[name] for name in VARIABLES}


FORMS = (
    "velocity",
    "motor_force",
    "force_size x direction",
    "speed x motor force",
    "position",
    "position x direction",
    "position x motor force",
    "position x velocity",
    "travel x direction",
    "rest_time x direction",
    "rest_time and slid x direction",
    "acceleration",
    "acceleration x direction",
    "campaign_time x direction",
    "time x motor force",
    "one direction",
)


@pytest.mark.parametrize("form", ["force_size x direction", "position x direction", "one direction"])
def test_friction_that_scales_the_stribeck_curve_is_written_so(form: str) -> None:
    problem = axis(None, creeping=CREEPING)
    family = family_of(problem, form)
    assert family.scaled
    for formula in (one for one in formulas(problem, family) if one.name != "a wave each way"):  # which is a force
        theta = formula.starts[0] if formula.starts.size else np.zeros(0)
        assert "*stribeck*sign(v)" in formula.own(theta)
    check(problem, family)
    added = added_level(problem, family)
    if added is not None:
        assert not any("stribeck" in one.own(one.starts[0]) for one in formulas(problem, added))
        check(problem, added)


def check(problem: Problem, family: Family) -> None:
    given = variables(problem)
    moving = (np.abs(problem.rows.v) > MOVING) & np.isfinite(given["travel"])
    for formula in formulas(problem, family):
        theta = formula.starts[len(formula.starts) // 2]
        columns = formula.columns(theta)[moving] * problem.mass[moving, None]
        text = formula.own(theta)
        term = parse_term(f"learned: {text}")
        assert set(term.parameters) == {f"c_{k}" for k in range(1, columns.shape[1] + 1)}, (family.form, text)
        values = {f"c_{k}": 0.7 + k for k in range(1, columns.shape[1] + 1)}
        force = np.zeros(columns.shape[0])
        for node, factor in ((term.part(False), 1.0), (term.part(True), -np.sign(problem.rows.v[moving]))):
            if node is not None:
                force += factor * formula_values(node, {name: one[moving] for name, one in given.items()}, values)
        expected = columns @ np.array(list(values.values()))
        np.testing.assert_allclose(force, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max() + 1e-12, err_msg=text)


@pytest.mark.parametrize("form", FORMS)
def test_a_formula_is_what_was_fitted(form: str) -> None:
    problem = axis(lambda p: np.sin(10.0 * p.rows.y))
    check(problem, family_of(problem, form))


def test_formulas_of_waves() -> None:
    problem = axis(
        lambda p: np.sin(60.0 * p.rows.y + 3.0 * p.rows.v) + np.sin(70.0 * p.rows.t) * (np.abs(p.rows.v) > 0.3)
    )
    tried = 0
    for family in wave_families(problem, arguments_of(problem), Leftover(problem).of_rows):
        if not family.local:
            check(problem, family)
            tried += 1
    assert tried > 2
