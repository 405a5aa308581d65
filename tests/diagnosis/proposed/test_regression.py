"""The regression of a family beside the base: what the base can do stays the base's, and gains are those of rows that
were not fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.diagnosis.proposed.regression import FOLDS, Regression, Sums, split_of
from tests.diagnosis.proposed.axis import axis, family_of, rows_of


def test_base_parameters_are_unbiased_beside_a_term() -> None:
    """A base that is off by known steps gets them back beside a term that acts too, over seeds."""
    steps = np.array([0.02, 0.3, 0.2, 0.01])
    errors, spreads = [], []
    for seed in range(12):
        bare = axis(lambda p: 1.5 * np.exp(-(((p.rows.y - 0.35) / 0.02) ** 2)), seed)
        weight = bare.weights[0]
        problem = replace(bare, residual=bare.residual + bare.base @ steps / weight, ridge=np.full(4, 1e-6))
        family = family_of(problem, "position")
        alone = Regression(Sums(bare, 0.0), family_of(bare, "position")).solution()[1]
        errors.append(Regression(Sums(problem, 0.0), family).solution()[1] - alone - steps)
        spreads.append(alone)
    assert np.abs(np.mean(errors, axis=0)) == pytest.approx(0.0, abs=1e-3)
    # What is left to the base by the fit without the term comes to it: no more than that is moved.
    assert np.all(np.abs(np.mean(spreads, axis=0)) < 0.2)


def test_a_prior_holds_what_the_recordings_hardly_tell() -> None:
    """A base column like the term itself: with a narrow prior the term takes the force, with none they share it."""
    bare = axis(lambda p: -1.5 * p.rows.v**3)
    twin = (-(bare.rows.v**3) / bare.mass * bare.weights)[:, None]
    free = replace(bare, base=np.hstack([bare.base, twin]), ridge=np.append(bare.ridge, 1e-9))
    held = replace(free, ridge=np.append(bare.ridge, 1e6))
    took = {
        name: Regression(Sums(p, 0.0), family_of(p, "velocity")).solution()[1][-1]
        for name, p in (("free", free), ("held", held))
    }
    assert took["free"] > 0.5 and abs(took["held"]) < 1e-3


def test_few_recordings_are_left_out_by_parts() -> None:
    """Else what only one of them tells could never be shown to be predicted."""
    problem = rows_of(axis(None), np.isin(axis(None).rows.recording, (0, 1, 2)))
    split = split_of(problem, 0.0)
    fitted = np.unique(problem.rows.recording[~problem.held])
    assert fitted.size == 2 < FOLDS
    for fold in split.selecting:
        mine = split.fold == fold
        assert set(problem.rows.recording[mine]) == set(fitted)
        assert all(np.ptp(problem.rows.t[mine & (problem.rows.recording == k)]) < 0.6 for k in fitted)
    assert np.all(problem.held[split.fold == split.judging[0]])


def test_a_curve_is_no_line_drawn_on_where_nothing_was_fitted() -> None:
    """Fitted rows see the rise of a force at one place, the judging ones what comes after it too."""
    whole = axis(lambda p: 3.0 * np.exp(-(((p.rows.y - 0.3) / 0.04) ** 2)))
    problem = rows_of(whole, whole.held | (whole.rows.y < 0.27))
    regression = Regression(Sums(problem, 0.0), family_of(problem, "position"))
    coefficients, _ = regression.solution(0.01)
    curve = regression.family.columns @ coefficients * problem.mass
    beyond = problem.rows.y > 0.4
    assert np.max(np.abs(curve[beyond])) < 3.0


def test_gains_are_those_of_a_plain_ridge_regression() -> None:
    """By hand, with the same penalty, on the judging rows."""
    problem = axis(lambda p: np.sin(12.0 * p.rows.y))
    regression = Regression(Sums(problem, 0.0), family_of(problem, "position"))
    r, k = problem.base.shape[1], regression.family.columns.shape[1]
    matrix = np.hstack([problem.base, regression.family.columns * problem.weights[:, None] / regression.size])
    fitted, rest = ~problem.held, problem.rest
    left = []
    for size in (r, r + k):
        normal = matrix[fitted, :size].T @ matrix[fitted, :size]
        normal[:r, :r] += np.diag(problem.ridge**2)
        normal += (regression.best[0] * regression.rough + 1e-9 * np.eye(r + k))[:size, :size]
        x = np.linalg.solve(normal, matrix[fitted, :size].T @ rest[fitted])
        left.append(float(np.sum((rest[~fitted] - matrix[~fitted, :size] @ x) ** 2)))
    assert regression.closed() == pytest.approx((1.0 - left[1] / left[0]) / (1.0 - problem.floor), rel=1e-6)


@pytest.mark.parametrize("local", [0.0, 0.5])
def test_no_row_judges_that_was_fitted(local: float) -> None:
    problem = axis(None)
    split = split_of(problem, local)
    assert set(np.unique(split.fold)) == {*split.selecting, *split.judging}
    assert np.array_equal(np.isin(split.fold, split.judging), problem.held)
    assert len(split.selecting) == FOLDS
