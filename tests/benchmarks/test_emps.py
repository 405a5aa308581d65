"""The open-loop range of EMPS counts what it says, on a machine with a closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.physics.model import Model
from tests.benchmarks.emps import EFFECTS, draws_of, friction_level, open_loop, score
from tests.diagnosis.machine import COULOMB, MASS, Noise, drift, recording, result


def test_draws_have_the_covariance_of_the_fit() -> None:
    deviations, correlation = np.array([0.02, 0.05]), np.array([[1.0, 0.6], [0.6, 1.0]])
    fitted = replace(
        result(),
        fitted=("mass", "coulomb_force"),
        correlation=correlation,
        covariance=correlation * np.outer(deviations, deviations),
    )
    model = Model("force")
    drawn = draws_of(fitted, 4000)[:, [model.slot("mass"), model.slot("coulomb_force")]]
    np.testing.assert_allclose(np.mean(drawn, axis=0), [MASS, COULOMB], rtol=2e-3)
    np.testing.assert_allclose(np.std(drawn, axis=0), deviations, rtol=0.05)
    assert np.corrcoef(drawn.T)[0, 1] == pytest.approx(0.6, abs=0.03)


def test_the_open_loop_error_is_that_of_the_force_that_is_missing() -> None:
    one = recording(extra=0.1)
    errors = open_loop(
        Model("force"), Model("force").vector({e.name: e.value for e in result().estimates})[None, :], one, 0.4, 2
    )
    np.testing.assert_allclose(errors[0], -drift(one.t, 0.1), atol=1e-6)
    assert score(errors)[0] == pytest.approx(1e3 * float(np.sqrt(np.mean(drift(one.t, 0.1) ** 2))), rel=1e-4)


def test_a_friction_that_stands_higher_is_found_in_newtons() -> None:
    fitted = replace(result(), effects=EFFECTS)
    change, error = friction_level(fitted, recording(extra=-0.15, noise=Noise(1e-7, 1e-3), duration=20.0))
    assert change == pytest.approx(0.15, rel=0.02) and error < 0.01
