"""The search from random candidates alone: it ends where the fit from a regression's first values ends, or lower."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.errors import UsageError
from linid.identification.fit import fit
from linid.identification.objectives.choose import coarse_parts
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.force_balance import ForceBalance, decoded
from linid.identification.optimise.from_scratch import Archive, Goal, explored, moving_apart, search_from_scratch
from linid.identification.optimise.least_squares import LeastSquaresFit, levenberg_marquardt
from linid.identification.settings import Ending, FitSettings, Hooks, SearchSettings
from linid.identification.space.scratch import scratch_space
from linid.identification.verify import verified
from linid.physics.model import Model

from .stand import FREE_WHEELS, stand

SMALL = FitSettings(search=SearchSettings(population=16, generations=2))
NEAR = 1.01  # of the lowest known cost: the same minimum


def test_the_best_apart_are_the_best_of_each_valley() -> None:
    """Three valleys of different depth; the archive remembers every candidate of every generation."""

    def valleys(x: np.ndarray) -> np.ndarray:
        depth = [np.abs(x[:, 0] - centre) + height for centre, height in ((0.2, 0.02), (0.5, 0.0), (0.8, 0.01))]
        return np.min(depth, axis=0)

    archive = Archive(valleys)
    archive(np.linspace(0.0, 1.0, 101)[:, None])
    assert archive.apart(3, 0.1)[:, 0] == pytest.approx([0.5, 0.8, 0.2])
    found = explored(valleys, 1, (64, 6, 3), 0.1, seed=4)
    assert found[:, 0] == pytest.approx([0.5, 0.8, 0.2], abs=0.03)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_friction_from_scratch_ends_where_the_fit_does(seed: int) -> None:
    recordings = stand(only=FREE_WHEELS).recordings
    model = Model("friction")
    space = scratch_space(model, recordings, {}, SMALL)
    problem = Problem(space, coarse_parts(model, recordings, SMALL))
    usual = fit("friction", recordings, settings=SMALL)
    known = Cost(problem)(space.encode({e.name: e.value for e in usual.estimates}))[0]
    found = search_from_scratch(problem, recordings, seed)
    assert found.cost < NEAR * known
    assert found.history[0].best > found.cost and found.history[-1].best == found.cost


def test_the_balance_tells_pitch_and_windings_of_a_motor() -> None:
    """At the true pole pitch and spacing little is left, and the linear parameters are the true ones."""
    campaign = stand(only=("sine_position_1", "moves_1"))
    truth, recordings = campaign.truth, campaign.recordings
    space = scratch_space(Model("sine"), recordings, {"mass": truth["mass"]}, SMALL)
    balance = ForceBalance(recordings, space)
    low, high = 20.0, 1500.0
    point = np.array([np.log(222.0 / low) / np.log(high / low), 1.0 / 3.0])
    assert balance.values(point) == pytest.approx((222.0, 2.0 * np.pi / 3.0))
    found = decoded(balance, point, truth["mass"])
    assert found["force_constant"] == pytest.approx(30.0, rel=0.02)
    assert np.cos(found["commutation_offset"] - 2.0 * 0.768) > np.cos(0.15)
    assert found["coulomb_force"] == pytest.approx(truth["coulomb_force"], rel=0.2)
    at, beside = balance.cost(np.array([point, point + np.array([balance.share(20.0), 0.0])]))
    assert at < 0.05 < beside


def test_a_fit_says_whether_a_search_from_scratch_agrees() -> None:
    recordings = stand(only=FREE_WHEELS).recordings
    usual = fit("friction", recordings, settings=SMALL)
    assert usual.search_check == ""
    checked = fit("friction", recordings, settings=replace(SMALL, verify_search=True))
    assert "found the same minimum" in checked.search_check and "seed 2" in checked.search_check
    assert not [text for text in checked.warnings if "minimum" in text]
    assert checked.estimates == usual.estimates  # it only looks


def test_a_goal_ends_the_search_early_but_in_a_minimum() -> None:
    """With the cost of a known minimum it ends there sooner; what is out of reach is sought within the budget."""
    recordings = stand(only=FREE_WHEELS).recordings
    model = Model("friction")
    problem = Problem(scratch_space(model, recordings, {}, SMALL), coarse_parts(model, recordings, SMALL))
    whole = search_from_scratch(problem, recordings, 7)
    goal = NEAR * whole.cost
    early = search_from_scratch(problem, recordings, 7, goal=Goal(goal, goal, 10**9))
    assert early.cost <= 1.001 * whole.cost
    assert early.evaluations < 0.9 * whole.evaluations
    never = search_from_scratch(problem, recordings, 7, goal=Goal(0.5 * whole.cost, 0.5 * whole.cost, 1))
    assert len(never.history) == 2 and never.evaluations > early.evaluations


def test_of_candidates_that_move_alike_one_is_followed() -> None:
    """Half the friction and a hair more leave nearly the same residuals, twice the friction others."""
    recordings = stand(only=FREE_WHEELS).recordings
    model, truth = Model("friction"), stand(only=FREE_WHEELS).truth
    problem = Problem(scratch_space(model, recordings, {}, SMALL), coarse_parts(model, recordings, SMALL))
    cost = Cost(problem)

    def beside(**changes: float) -> LeastSquaresFit:
        values = {name: truth[name] for name in problem.space.names} | changes
        return levenberg_marquardt(problem, cost, problem.space.encode(values), ending=Ending(0), final=False)

    half, same, other = (0.5 * truth["coulomb_force"], 0.502 * truth["coulomb_force"], 2.0 * truth["coulomb_force"])
    fits = [beside(coulomb_force=x) for x in (half, same, other)]
    assert moving_apart(problem, fits, 3) == [fits[0], fits[2]]
    assert moving_apart(problem, fits, 1) == fits[:1]


def test_a_fit_at_another_minimum_is_told() -> None:
    """Bristles a hundred times too stiff, held there: the search from scratch, free to choose, ends lower."""
    recordings = stand(only=FREE_WHEELS).recordings
    stuck = fit("friction", recordings, settings=replace(SMALL, bounds={"bristle_stiffness": (1e6, 2e6)}))
    model = Model("friction")
    space = scratch_space(model, recordings, {}, replace(SMALL, bounds={"bristle_stiffness": (1e6, 2e6)}))
    told = verified(stuck, space, recordings, SMALL, Hooks())
    assert "found a lower minimum" in told.search_check and any("lower minimum" in text for text in told.warnings)


def test_scratch_is_a_method_of_fits_and_knows_no_effects() -> None:
    recordings = stand(only=FREE_WHEELS).recordings
    settings = replace(SMALL, search=SearchSettings(method="scratch", seed=5))
    result = fit("friction", recordings, settings=settings)
    truth = stand(only=FREE_WHEELS).truth
    assert result.converged and result.history[0].stage == "scratch"
    for name in ("mass", "coulomb_force", "viscous_friction", "bristle_stiffness"):
        estimate = next(e for e in result.estimates if e.name == name)
        assert abs(estimate.value - truth[name]) < 4.5 * estimate.std
    with pytest.raises(UsageError, match="knows no effects"):
        fit("friction", recordings, settings=settings, effects=("constant_force",))
