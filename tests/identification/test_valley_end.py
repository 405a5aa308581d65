"""How far a parameter may go until the data refuse it, wherever in the valley a fit stopped."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from linid.arrays import Array
from linid.identification import minima
from linid.identification.fit import fit
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise import linearisation
from linid.identification.optimise.least_squares import LeastSquaresFit, Start, levenberg_marquardt
from linid.identification.optimise.linearisation import Linearisation
from linid.identification.settings import FitSettings, SearchSettings
from linid.identification.uncertainty.profile import _scale, profile_likelihood, valley_end
from linid.statistics import NORMAL_97_5

from .stand import FREE_WHEELS, stand

NAME = "viscous_friction"
SMALL = FitSettings(search=SearchSettings(population=24, generations=4), jobs=2, profiles=(NAME,))


def stopped_beside(problem: Problem, solution: LeastSquaresFit, by: float) -> LeastSquaresFit:
    """The fit with one search coordinate so far beside its minimum, and all others fitted again."""
    column = problem.space.names.index(NAME)
    point = solution.point.copy()
    point[column] += by
    held = Problem(problem.space.holding({NAME: problem.space.values(point)[NAME]}), problem.parts)
    rest = levenberg_marquardt(held, Cost(held), Start(np.delete(point, column), solution.offsets), final=False)
    x = np.concatenate([np.insert(rest.point, column, point[column]), rest.offsets])
    line = Linearisation(problem, Cost(problem), weights=solution.weights)
    residuals, jacobian = line.residuals(x), line.jacobian(x)
    return replace(solution, point=x[: point.size], offsets=rest.offsets, residuals=residuals, jacobian=jacobian)


def test_the_ends_of_a_valley_are_those_of_the_profile_wherever_a_fit_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[Any, ...]] = []
    monkeypatch.setattr(minima, "profile_likelihood", lambda *given, watch: asked.append(given))
    fit("friction", stand(only=FREE_WHEELS).recordings, settings=SMALL)
    ((problem, solution, uncertainty, name),) = asked
    profile, column = profile_likelihood(problem, solution, uncertainty, name), problem.space.names.index(name)
    deviation = (profile.high - profile.low) / (2.0 * NORMAL_97_5)

    line = Linearisation(problem, Cost(problem), weights=solution.weights)
    scale = _scale(solution, uncertainty, column)

    def behind(point: Array, offsets: Array) -> float:
        squares = line.residuals(np.concatenate([point, offsets]))
        return math.sqrt(max(float(squares @ squares - solution.residuals @ solution.residuals) * scale, 0.0))

    def ends(one: LeastSquaresFit) -> list[float]:
        found = [valley_end(problem, one, uncertainty, name, side, behind) for side in (-1.0, 1.0)]
        return [problem.space.values(end)[name] for end in found]

    assert ends(solution) == pytest.approx([profile.low, profile.high], abs=0.1 * deviation)
    for by in (-1.5, 1.5):
        step = by * float(np.sqrt(uncertainty.search_covariance[column, column]))
        low, high = ends(stopped_beside(problem, solution, step))
        assert [low, high] == pytest.approx([profile.low, profile.high], abs=0.3 * deviation)
    # A start state that a correction for noise has moved beyond its bounds is no reason to fail.
    monkeypatch.setattr(linearisation, "_OFFSET_LIMIT", 0.999 * float(np.max(np.abs(solution.offsets))))
    assert ends(solution) == pytest.approx([profile.low, profile.high], abs=deviation)
