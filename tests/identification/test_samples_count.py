"""Whether each sample of a free run counts or each group: where the model is right, and where it is not."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from linid.identification.objectives.objective import independent_along
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.least_squares import LeastSquaresFit, Start, levenberg_marquardt
from linid.identification.settings import Ending
from linid.identification.signals.motion import Motion
from linid.identification.space.search_space import SearchParameter, SearchSpace
from linid.physics.model import Model

Array = NDArray[np.float64]
SAMPLES, GROUPS = 4000, 100
MODEL = Model("friction")
FORCE = MODEL.slot("coulomb_force")
SPACE = SearchSpace(MODEL, (SearchParameter("coulomb_force", 1.0, 4.0, False),), {})


class Straight:
    """Residuals pattern * (force - wanted) + noise: a straight line of one parameter."""

    name, recordings, nuisances, floor, robust = "straight", (), 0, 0.0, False

    def __init__(self, pattern: Array, wanted: float, noise: Array) -> None:
        self.pattern, self.wanted, self.noise = pattern, wanted, noise
        size = pattern.size
        self.classes = np.zeros(size, dtype=np.int64)
        self.groups = np.arange(size) // (size // GROUPS)
        self.group_recording = np.zeros(GROUPS, dtype=np.int64)
        self.signal = np.ones(size)
        at, zero = np.zeros(3), np.zeros(3)
        self.motion = Motion(at, at, zero, np.ones(3, dtype=np.bool_), np.ones(1), np.ones(1))

    def residuals(self, params: Array, offsets: Array) -> Array:
        return np.asarray(self.pattern * (params[:, FORCE, None] - self.wanted) + self.noise)


class FreeRunLike(Straight):
    """The same, of which each sample counts where nothing but noise is left."""

    def independent(self, residuals: Array, slopes: Array | None = None) -> Array:
        return np.array([independent_along(residuals)])


def problem_of(wanted: float, strength: float, seed: int) -> Problem:
    """A free run that wants a force of 2 N, beside windows that want another, by their strength in 1/N."""
    generator = np.random.default_rng(seed)
    slow = np.sqrt(2.0) * np.sin(np.pi * np.arange(SAMPLES) / SAMPLES)
    free = FreeRunLike(slow, 2.0, generator.normal(size=SAMPLES))
    windows = Straight(np.full(GROUPS, strength), wanted, generator.normal(size=GROUPS))
    return Problem(SPACE, (free, windows))  # type: ignore[arg-type]


def fitted(problem: Problem, force: float, *, by_groups: bool = False) -> tuple[float, LeastSquaresFit]:
    """Force in N that least squares find from one in N, and how."""
    start = Start(SPACE.encode({"coulomb_force": force}), by_groups=by_groups)
    fit = levenberg_marquardt(problem, Cost(problem), start, ending=Ending(steps=30))
    return float(SPACE.vectors(fit.point)[0][FORCE]), fit


@pytest.mark.parametrize("seed", range(5))
def test_a_free_run_does_not_leave_all_else_behind(seed: int) -> None:
    """Of a model that is wrong the free run would be left white, and the windows ten times beyond their noise."""
    problem = problem_of(3.0, 10.0, seed)
    cost = Cost(problem)

    def of_force(force: float) -> float:
        return float(cost(SPACE.encode({"coulomb_force": force})[None])[0])

    least = minimize_scalar(of_force, bounds=(1.0, 4.0), method="bounded")
    force, fit = fitted(problem, 2.2)
    assert fit.by_groups
    assert force == pytest.approx(float(least.x), abs=0.02) and abs(force - 3.0) < 0.1
    assert fit.cost == pytest.approx(float(least.fun), rel=1e-3)


def test_where_the_model_is_right_all_samples_count() -> None:
    """Each with its information: 4000 of a free run and 100 of the windows, or half and half if groups count."""
    forces: dict[bool, list[float]] = {False: [], True: []}
    back = 0
    for seed in range(200):
        problem = problem_of(2.0, 1.0, seed)
        for by_groups, found in forces.items():
            force, fit = fitted(problem, 2.3, by_groups=by_groups)
            found.append(force)
            back += fit.by_groups and not by_groups
    spread = {key: float(np.std(found)) for key, found in forces.items()}
    assert back <= 2
    assert spread[False] == pytest.approx(1.0 / np.sqrt(SAMPLES + GROUPS), rel=0.15)
    assert spread[True] == pytest.approx(0.5 * np.sqrt(1.0 / SAMPLES + 1.0 / GROUPS), rel=0.15)
    assert float(np.mean(forces[False])) == pytest.approx(2.0, abs=0.005)
