"""The stages of a fit: which candidates least squares begin from, and which one goes on to all data."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.search_state import SearchState
from linid.identification.optimise.stages import _best_start, _rivals, least_squares_in_stages
from linid.identification.settings import FitSettings, Hooks
from linid.identification.signals.motion import Motion
from linid.identification.space.search_space import SearchSpace
from linid.physics.model import Model
from linid.physics.parameter import Parameter


def state(best: list[float], starts: list[list[float]], offsets: list[list[float]]) -> SearchState:
    return SearchState("genetic", 1, [], [], best, 0.1, 0, 5, None, starts=starts, start_offsets=offsets)


def test_a_first_candidate_stands_for_the_best_one_beside_it() -> None:
    kept = _rivals(state([0.5, 0.51], [[0.5, 0.5], [0.1, 0.9]], [[1.0], [2.0]]), np.array([0.5, 0.51]))
    assert [(start.point.tolist(), start.offsets.tolist()) for start in kept if start.offsets is not None] == [
        ([0.5, 0.5], [1.0]),
        ([0.1, 0.9], [2.0]),
    ]
    assert len(kept) == 2


def test_a_best_one_of_its_own_comes_beside_them() -> None:
    kept = _rivals(state([0.8, 0.5], [[0.5, 0.5]], [[1.0]]), np.array([0.8, 0.5]))
    assert [start.offsets is None for start in kept] == [True, False]
    assert kept[0].point.tolist() == [0.8, 0.5]


def test_of_like_candidates_that_are_yet_to_be_refined_there_is_one() -> None:
    kept = _rivals(state([0.5, 0.5], [[0.5, 0.51], [0.2, 0.2], [0.2, 0.21]], [[], [], []]), np.array([0.5, 0.5]))
    assert [start.point.tolist() for start in kept] == [[0.5, 0.5], [0.2, 0.2]]
    assert all(start.offsets is None for start in kept)


@dataclass
class Valleys:
    """Residuals of two unknowns with minima near 0.25 and 0.75 of the first; left: whether the former is deeper."""

    left: bool
    recordings: tuple[()] = ()
    name: str = "valleys"
    nuisances: int = 0
    robust: bool = False
    floor: float = 1e-9
    classes: np.ndarray = field(default_factory=lambda: np.zeros(40, dtype=np.int64))
    groups: np.ndarray = field(default_factory=lambda: np.arange(40, dtype=np.int64))
    group_recording: np.ndarray = field(default_factory=lambda: np.zeros(40, dtype=np.int64))
    signal: np.ndarray = field(default_factory=lambda: np.ones(40))
    motion: Motion = field(default_factory=lambda: Motion(*np.zeros((6, 1))))

    def residuals(self, params: Array, offsets: Array) -> Array:
        x, y = params[:, 0], params[:, 1]
        out = np.full((params.shape[0], 40), 1e-3)
        out[:, 0], out[:, 1] = 40.0 * (x - 0.25) * (x - 0.75), y - 0.5
        out[:, 2] = 0.1 * (x if self.left else 1.0 - x)
        return out


class Box(SearchSpace):
    """Two unknowns whose values are their search coordinates."""

    def vectors(self, point: Array) -> Array:
        return np.atleast_2d(point)


def problem(left: bool) -> Problem:
    parameters = tuple(Parameter(name, name, "1", 0.0, 1.0, 0.5) for name in ("a", "b"))
    space = Box.__new__(Box)
    object.__setattr__(space, "parameters", parameters)
    object.__setattr__(space, "model", Model("friction"))
    return Problem(space, (Valleys(left),))  # type: ignore[arg-type]


def test_all_data_say_which_candidate_is_the_best() -> None:
    thinned, whole = problem(True), problem(False)
    found = state([0.3, 0.6], [[0.7, 0.4]], [[]])
    settings = FitSettings(least_squares_steps=30)
    spent = Cost(whole)
    start, history = _best_start(
        thinned, whole, spent, _rivals(found, np.array([0.3, 0.6])), settings, lambda done, value: None
    )
    assert history and all(row.stage == "least_squares of a part" for row in history)
    assert abs(start.point[0] - 0.75) < 0.02  # the thinned problem alone would have taken the other
    assert Cost(thinned)(np.array([0.25, 0.5]))[0] < Cost(thinned)(start.point)[0]
    solution = least_squares_in_stages([thinned, whole], found, settings, Hooks())
    assert [row.stage for row in solution.history][-1] == "least_squares"
    assert abs(solution.point[0] - 0.75) < 0.02 and solution.evaluations > found.evaluations
