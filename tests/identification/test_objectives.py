"""Which objective with which internal step each recording follows, and the derivatives of their residuals."""

from __future__ import annotations

import numpy as np
import pytest

from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.choose import FULL, Look, make_parts
from linid.identification.objectives.free_run import FreeRun
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.linearisation import Linearisation
from linid.identification.settings import FitSettings
from linid.identification.space.search_space import SearchParameter, SearchSpace
from linid.physics.model import Model
from tests.identification.stand import stand


@pytest.mark.parametrize(
    ("asked", "look", "expected"),
    [
        (None, FULL, (2, 5)),
        (8, FULL, (8, 8)),  # asked for: also above what predictions of a tenth of a second need
        (1, FULL, (1, 4)),
        (8, Look(coarse=True), (2, 8)),
    ],
)
def test_internal_steps_are_those_asked_for(asked: int | None, look: Look, expected: tuple[int, int]) -> None:
    recordings = stand(only=("freewheel_1", "moves_1")).recordings
    parts = make_parts(Model("sine"), recordings, FitSettings(substeps=asked), asked or 5, look=look)
    (ahead,) = (part for part in parts if isinstance(part, Ahead))
    (free,) = (part for part in parts if isinstance(part, FreeRun))
    assert (ahead.substeps, free.substeps) == expected


def test_a_coarse_look_weighs_driven_runs_beside_free_wheels_as_all_data_do() -> None:
    """Every fourth window alone would count a quarter, and the search end where free wheels rather than all data lead;
    where every fourth is all that is looked at, none counts for four: intervals are from what was looked at."""
    recordings = stand(only=("freewheel_1", "moves_1")).recordings
    model, settings = Model("sine"), FitSettings()
    space = SearchSpace(model, (), dict.fromkeys((p.name for p in model.parameters), 1.0))

    def counted(look: Look) -> list[float]:
        problem = Problem(space, make_parts(model, recordings, settings, 2, look=look))
        return [float(counts.sum()) for counts in problem.class_counts()]

    wheels, driven = counted(FULL)
    few_wheels, few_driven = counted(Look(thin=4, coarse=True))
    assert few_wheels == wheels
    assert few_driven == pytest.approx(driven, abs=4.0)
    assert counted(Look(thin=4))[1] == pytest.approx(driven / 4.0, abs=1.0)


def test_derivatives_carried_along_are_those_of_differences(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of free wheels and of windows of a motor, by parameters and start offsets. Differences jump where steps do."""
    campaign = stand(only=("freewheel_1", "freewheel_2", "sine_position_1"))
    model = Model("theta")
    free, driven = campaign.recordings[:2], campaign.recordings[2:]
    searched = ("force_constant", "electrical_wavenumber", "winding_displacement", "coulomb_force", "bristle_damping")
    bounds = tuple(SearchParameter(n, campaign.truth[n] / 2.0, campaign.truth[n] * 2.0, True) for n in searched[:4])
    space = SearchSpace(model, (*bounds, SearchParameter(searched[4], 0.05, 5.0, True)), dict(campaign.truth))
    problem = Problem(space, (FreeRun(model, free, 2, 1), Ahead(model, driven, 2, 1)))
    x = np.concatenate([np.array([0.5, 0.52, 0.48, 0.5, 0.4]), np.ones(problem.nuisances)])
    line = Linearisation(problem, Cost(problem))
    line.reweight(x)
    assert problem.carries_slopes
    base, slopes = line.tangent(x).dense
    assert np.array_equal(base, line.residuals(x))
    # By some of them alone they are the same numbers, and under other weights they need not be told again.
    wanted = np.array([True, False, True, False, False])
    some = Linearisation(problem, Cost(problem), wanted=wanted)
    some.weights = line.weights
    assert np.array_equal(some.jacobian(x)[:, :5], slopes[:, :5] * wanted)
    again = Linearisation(problem, Cost(problem), told=line.told)
    again.reweight(x)
    evaluations = again.cost.evaluations
    assert np.array_equal(again.tangent(x).dense[1], slopes) and again.cost.evaluations == evaluations
    monkeypatch.setattr(Problem, "carries_slopes", False)
    differences = line.jacobian(x, central=True)
    assert np.all(np.median(np.abs(slopes - differences), axis=0) <= 1e-5 * np.abs(differences).max(axis=0))
    far = np.linalg.norm(slopes - differences, axis=0) / np.linalg.norm(differences, axis=0)
    assert np.all(far < 2e-2)
