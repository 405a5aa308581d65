"""The baselines are capable: on campaigns of the hidden plant they find mass, pole pitch, and effects that show."""

from __future__ import annotations

import math

import numpy as np
import pytest

from linid.challenge.create import make_challenge
from linid.challenge.make import Plan
from tests.benchmarks.baselines.columns import Base, Rows, base_of, rows_of, solve
from tests.benchmarks.baselines.methods import METHODS, stepwise


@pytest.fixture(scope="module")
def strong(tmp_path_factory: pytest.TempPathFactory) -> tuple[Rows, Base, dict[str, float]]:
    """A campaign with strong load-dependent friction, which regression can see."""
    folder = tmp_path_factory.mktemp("strong") / "made"
    plan = Plan(3, effects=("load_dependent_friction",), kinds=("single",), strength=(0.8, 1.0))
    truth = make_challenge(plan, 1, folder)["axis_0001"].base
    rows = rows_of(folder / "axis_0001" / "campaign.yaml")
    return rows, base_of(rows), truth


def test_the_base_finds_mass_and_pole_pitch(strong: tuple[Rows, Base, dict[str, float]]) -> None:
    rows, base, truth = strong
    assert base.mass == pytest.approx(truth["mass"], rel=0.03)
    wavenumber = float(np.polyfit(rows.y, base.angle, 1)[0])
    electrical = truth["electrical_wavenumber"]
    # A theta motor's wavenumber is half the field's.
    assert min(abs(wavenumber / electrical - k) for k in (1, 2)) < 2e-3
    assert math.isfinite(float(np.std(base.target))) and np.std(base.target) < 0.1 * np.std(base.thrust)


def test_stepwise_regression_names_what_shows(strong: tuple[Rows, Base, dict[str, float]]) -> None:
    rows, base, _ = strong
    assert "load_dependent_friction" in stepwise(rows, base)["effects"]
    assert list(METHODS) == ["stepwise regression", "LASSO", "Gaussian process", "SINDy"]


def test_least_squares_leaves_out_columns_that_are_not_there() -> None:
    random = np.random.default_rng(2)
    design = np.vstack([random.normal(size=(2, 50)), np.zeros(50)])
    found, left = solve(design, 2.0 * design[0] - design[1])
    assert found == pytest.approx([2.0, -1.0, 0.0]) and left < 1e-20
