"""A factor that bends: what acts at one place, where the motor pushes hard, in recordings that push harder still."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linid.diagnosis.proposed.bent import bent
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.propose import judged_families, propose
from linid.diagnosis.proposed.regression import Regression, Sums
from linid.diagnosis.proposed.words import sentence
from linid.physics.own_terms.own_term import parse_term
from linid.physics.own_terms.values import formula_values
from tests.diagnosis.proposed.axis import axis, family_of, rows_of

HARD = 0.7  # quantile of the motor force's size, up to which the fitted rows go


def giving_way(p: Problem) -> np.ndarray:
    """Costs up to 2 N at 0.3 m, from about 4 N of motor force on."""
    push = (p.push / 4.0) ** 3
    return np.asarray(-2.0 * np.exp(-0.5 * ((p.rows.y - 0.3) / 0.02) ** 2) * push / (1.0 + np.abs(push)))


def gently_fitted() -> Problem:
    """An axis whose fitted rows have less motor force than the judging ones."""
    problem = axis(giving_way)
    size = np.abs(problem.push)
    return rows_of(problem, problem.held | (size < np.quantile(size, HARD)))


def test_a_bent_factor_predicts_recordings_that_push_harder() -> None:
    problem = gently_fitted()
    sums = Sums(problem, 0.0)
    straight = Regression(sums, family_of(problem, "position x motor force"))
    found = bent(problem, straight)
    assert found is not None and found.family.arguments == ("position", "motor_force")
    assert 1.0 - found.closed() < 0.5 * (1.0 - straight.closed())
    proposal = propose(problem, judged_families(problem))
    assert proposal is not None and proposal.arguments == ("position", "motor_force")
    assert proposal.family.form.endswith(", bent") and proposal.closed > 0.95
    assert "on position and motor force (not in proportion to it)" in sentence(problem, proposal, (), 0.9, 1.0)


def test_its_formula_is_what_was_fitted() -> None:
    problem = gently_fitted()
    found = bent(problem, Regression(Sums(problem, 0.0), family_of(problem, "position x motor force")))
    assert found is not None
    tree = parse_term(f"learned: {found.family.formula}").part(False)
    assert tree is not None
    coefficients = found.solution()[0]
    values = {str(k): float(one) for k, one in enumerate(coefficients, 1)}
    force = formula_values(tree, {"y": problem.rows.y, "F": problem.push}, values)
    expected = found.family.columns @ coefficients * problem.mass
    np.testing.assert_allclose(force, expected, atol=1e-4 * np.abs(expected).max())


def test_a_straight_factor_stays_where_nothing_bends() -> None:
    problem = axis(lambda p: 0.1 * np.exp(-0.5 * ((p.rows.y - 0.3) / 0.04) ** 2) * p.push)
    proposal = propose(problem, judged_families(problem))
    assert proposal is not None and "bent" not in proposal.family.form


def test_only_motor_force_and_velocity_bend_and_once() -> None:
    problem = axis(giving_way)
    sums = Sums(problem, 0.0)
    straight = Regression(sums, family_of(problem, "position x motor force"))
    found = bent(problem, straight)
    assert found is not None and bent(problem, found) is None
    held_alone = replace(problem, push=np.where(problem.held, problem.push, 0.0))
    assert bent(held_alone, straight) is None  # no fitted row has a force
    for form in ("position", "position x direction", "velocity"):
        assert bent(problem, Regression(sums, family_of(problem, form))) is None
