"""A proposed term in the simulation: the compiled own term gives the rows what the regression's columns say."""

from __future__ import annotations

import numpy as np
import pytest

from linid.diagnosis.base import Base, fit_base_model, numbered
from linid.diagnosis.means import Means
from linid.diagnosis.proposed.arguments import arguments_of
from linid.diagnosis.proposed.family import Family, families, per_recording
from linid.diagnosis.proposed.learned import effect_of, named
from linid.diagnosis.proposed.problem import Problem, problem_of
from linid.diagnosis.proposed.waves import _family, _sorts
from tests.diagnosis.test_controls import driven
from tests.simulation.axis_with_effects import AXIS

WAVENUMBER = 25.0  # rad/m: what is shorter, the rows' bumps average
FORMS = (
    "constant",
    "one direction",
    "position",
    "velocity",
    "position x direction",
    "speed x direction",
    "travel x direction",
    "position x motor force",
    "position x velocity",
    "position and velocity",
    "position and speed x direction",
    "force_size x direction",
    "since_reversal",
    "acceleration",
    "acceleration x direction",
    "campaign_time",
    "wave: force",
    "wave: friction",
    "wave: motor force",
    "wave: velocity",
    "wave: phase by direction",
    "wave: phase by velocity",
)


@pytest.fixture(scope="module")
def base() -> Base:
    known = {"force_constant": AXIS["force_constant"], "mass": AXIS["mass"]}
    return fit_base_model(numbered(driven(0.0)), "force", known, Means(1, seed=1), [])


@pytest.fixture(scope="module")
def problem(base: Base) -> Problem:
    return problem_of(base.judge, base.fitted, 1)


def family_of(problem: Problem, form: str) -> Family:
    arguments = arguments_of(problem)
    if form.startswith("wave: "):
        position = arguments["position"]
        sort = next(s for s in _sorts(problem, position) if s.form == form.removeprefix("wave: "))
        return _family(problem, arguments, position, sort, (WAVENUMBER,))
    return next(one for one in families(problem, arguments) if one.form == form)


@pytest.mark.parametrize("form", FORMS)
def test_the_kernels_term_is_the_regressions_columns(base: Base, problem: Problem, form: str) -> None:
    family = family_of(problem, form)
    text = effect_of(family)
    assert text.startswith("learned: ")
    size = 0.02 * AXIS["coulomb_force"] / np.max(np.abs(family.columns * problem.mass[:, None]))
    coefficients = size * np.random.default_rng(2).uniform(0.5, 1.5, family.columns.shape[1])
    model = base.fitted.model.with_effects((text,))
    values = {**base.fitted.values, **named(text, coefficients)}
    left = base.judge.balance.residuals(model, model.vector(values)[None, :])[0]
    moving = ~problem.rows.standstill & (np.abs(problem.rows.v) > 0.02)
    told, wanted = (problem.residual - left)[moving], (family.columns @ coefficients)[moving]
    assert float(np.corrcoef(told, wanted)[0, 1]) > 0.97 or np.std(wanted) < 1e-3 * np.abs(np.mean(wanted))
    assert float(told @ wanted) / float(wanted @ wanted) == pytest.approx(1.0, abs=0.1)


def test_what_no_formula_can_say_has_no_term(problem: Problem) -> None:
    assert {effect_of(family) for family in per_recording(problem, 0.25)} == {""}
