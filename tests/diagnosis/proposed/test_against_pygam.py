"""The estimate of a curve against an independent implementation of P-splines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.diagnosis.proposed.curve import term_curve
from linid.diagnosis.proposed.estimate import estimated
from linid.diagnosis.proposed.regression import Regression
from tests.diagnosis.proposed.axis import axis, proposal_of

SIZE = 14


@pytest.mark.parametrize("penalty", [1e-3, 1e-1])
def test_a_curve_is_that_of_pygam(penalty: float) -> None:
    """Same splines, same penalty, no base: the same curve, by Servén and Brummitt's pyGAM."""
    pygam = pytest.importorskip("pygam", reason="the oracle needs pygam: pip install pygam")
    with_base = axis(lambda p: np.sin(12.0 * p.rows.y), noise=0.3)
    inside = 0.01  # pygam's splines reach from the least to the largest place, ours to all but a few
    low, high = np.quantile(with_base.rows.y[~with_base.held], [inside, 1.0 - inside])
    rows = replace(with_base.rows, y=np.clip(with_base.rows.y, low, high))
    none = np.zeros((rows.y.size, 0))
    problem = replace(with_base, rows=rows, base=none, ridge=np.zeros(0))
    proposal = proposal_of(problem, "position")
    regression = proposal.regression
    regression.__dict__["best"] = penalty, 0.5
    curve = term_curve(problem, replace(proposal, regression=regression))
    assert curve is not None
    fitted = ~problem.held
    oracle = pygam.LinearGAM(
        pygam.s(0, n_splines=SIZE, lam=_as_pygam(regression, penalty)), fit_intercept=False, tol=1e-9, max_iter=500
    )
    oracle.fit(rows.y[fitted, None], (problem.residual * problem.mass)[fitted])
    known = np.isfinite(curve.value)
    expected = oracle.predict(curve.axes[0].x[:, None])
    np.testing.assert_allclose(curve.value[known], expected[known], atol=2e-3)
    assert estimated(problem, regression).coefficients.shape == (SIZE,)


def _as_pygam(regression: Regression, penalty: float) -> float:
    """The penalty per squared second difference of coefficients in newtons, per row of weight 1."""
    family, weights = regression.family, regression.sums.weights
    trace = float(np.trace(family.roughness)) / SIZE
    mass = float(regression.sums.problem.mass[0])
    return penalty * weights.size / SIZE / trace * regression.size**2 * mass**2 / float(weights[0]) ** 2
