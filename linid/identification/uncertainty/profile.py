"""Profile likelihoods: how the fit worsens when one parameter is held and all others are fitted again."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.errors import UsageError
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.irls import at_frozen_weights
from linid.identification.optimise.least_squares import LeastSquaresFit
from linid.identification.optimise.linearisation import Linearisation
from linid.identification.result import Profile
from linid.identification.space.search_space import SearchSpace
from linid.identification.uncertainty.covariance import Uncertainty
from linid.statistics import CHI_SQUARED_95, TINY

_STANDARD_DEVIATIONS = (0.75, 1.5, 2.25, 3.0)  # at which the profile is computed, on both sides
_FIRST_REACH = 2.25  # standard deviations, where the way to the end of an interval begins
_FAR_BEYOND, _HALVINGS = (
    2.0,
    3,
)  # times the limit, from where its root is no line any more and the end is sought between
_EVALUATIONS = 8
_TOLERANCE, _COARSE_TOLERANCE = 1e-8, 1e-5  # of the sum of squares and of coordinates
_LIMIT = math.sqrt(CHI_SQUARED_95)


def profile_likelihood(
    problem: Problem,
    fit: LeastSquaresFit,
    uncertainty: Uncertainty,
    name: str,
    *,
    watch: Callable[[int, int], None] | None = None,
) -> Profile:
    """Profile of one fitted parameter (Venzon and Moolgavkar 1988, Appl. Statist. 37), others re-optimised.

    The rise of the weighted sum of squares is scaled by the ratio of naive to robust variance, so that residuals
    correlated in time do not make the profile too narrow. watch(done, total) is called after each point.
    """
    walk = _Walk(problem, fit, uncertainty, name)
    least, scale = float(fit.residuals @ fit.residuals), _scale(fit, uncertainty, walk.column)
    points = {walk.centre: 0.0}
    total = 2 * len(_STANDARD_DEVIATIONS)
    for side in (-1.0, 1.0):
        x = walk.start
        for reach in _STANDARD_DEVIATIONS:
            coordinate = walk.at(side * reach)
            if walk.inside(coordinate):
                squares, x = walk.refitted(coordinate, x, _TOLERANCE)
                points[coordinate] = max(0.0, (squares - least) * scale)
            if watch is not None:
                watch(len(points) - 1, total)
    point = np.array(sorted(points))
    worse = np.array([points[coordinate] for coordinate in point])
    values = _si_values(problem.space, fit.point, walk.column, point)
    low, high = _crossing(values, worse, -1), _crossing(values, worse, 1)
    return Profile(name, tuple(values.tolist()), tuple(worse.tolist()), low, high)


def valley_end(
    problem: Problem,
    fit: LeastSquaresFit,
    uncertainty: Uncertainty,
    name: str,
    side: float,
    behind: Callable[[Array, Array], float],
) -> Array:
    """How far one parameter may go to one side (-1 or 1), all others fitted again, until that costs significantly more,
    or to its bound: all search coordinates there (p,).

    behind: how far a fit, its search coordinates (p,) and offsets (k,), lies behind in standard deviations. Along a
    flat valley the curvature where a fit ended tells little of that, and it may end anywhere.
    """
    walk = _Walk(problem, fit, uncertainty, name)
    x, reach, p = walk.start, side * _FIRST_REACH, fit.point.size
    end, before = fit.point, min(behind(fit.point, fit.offsets), _LIMIT)
    while walk.inside(walk.at(reach)):
        _, x = walk.refitted(walk.at(reach), x, _COARSE_TOLERANCE)
        there = np.insert(x[: p - 1], walk.column, walk.at(reach))
        now = behind(there, x[p - 1 :])
        if not now < _LIMIT:
            return np.asarray(end + (_LIMIT - before) / max(now - before, TINY) * (there - end))
        end, before, reach = there, now, 2.0 * reach
    return end


def _scale(fit: LeastSquaresFit, uncertainty: Uncertainty, column: int) -> float:
    """Naive over robust variance of one parameter, by which a sum of squares becomes a likelihood ratio."""
    # 1/naive variance is what the column keeps when all others are regressed out.
    others = np.delete(fit.jacobian, column, axis=1)
    others = others / np.maximum(np.linalg.norm(others, axis=0), 1e-300)
    own = fit.jacobian[:, column]
    left = own - others @ np.linalg.lstsq(others, own, rcond=1e-10)[0]
    return 1.0 / (float(left @ left) * float(uncertainty.search_covariance[column, column]))


class _Walk:
    """One parameter held at values beside the one that was fitted, with the weights of the fit."""

    def __init__(self, problem: Problem, fit: LeastSquaresFit, uncertainty: Uncertainty, name: str) -> None:
        self.problem, self.fit, self.column = problem, fit, problem.space.names.index(name)
        self._cost = Cost(problem)
        self._deviation = float(np.sqrt(uncertainty.search_covariance[self.column, self.column]))
        self.centre = float(fit.point[self.column])
        self.start = np.concatenate([np.delete(fit.point, self.column), fit.offsets])

    def at(self, deviations: float) -> float:
        """The search coordinate so many standard deviations beside the fitted one."""
        return self.centre + deviations * self._deviation

    @staticmethod
    def inside(coordinate: float) -> bool:
        """Whether a search coordinate is clear of the bounds."""
        return 1e-6 < coordinate < 1.0 - 1e-6

    def refitted(self, coordinate: float, x: Array, tolerance: float) -> tuple[float, Array]:
        """The sum of squares with the parameter held at a search coordinate, and all others there, fitted from x
        (p - 1 + k,); tolerance: relative change that ends it."""
        held = Problem(_without(self.problem.space, self.fit.point, self.column, coordinate), self.problem.parts)
        line = Linearisation(held, self._cost, weights=self.fit.weights)
        within = np.clip(x, *line.bounds)  # corrections for noise may have moved a start state a little beyond
        solution = at_frozen_weights(line, within, evaluations=_EVALUATIONS, tolerance=tolerance)
        return 2.0 * float(solution.cost), np.asarray(solution.x)


def check_profile(space: SearchSpace, name: str) -> None:
    """Raise UsageError when a parameter is not among the fitted ones."""
    if name not in space.names:
        raise UsageError(
            f"--profile {name}", "is not a fitted parameter of this model", f"Choose from: {', '.join(space.names)}"
        )


def _si_values(space: SearchSpace, point: Array, column: int, values: Array) -> Array:
    """SI values of one parameter for several of its search coordinates, all others as fitted."""
    rows = np.repeat(point[None, :], values.size, axis=0)
    rows[:, column] = values
    return np.asarray(space.vectors(rows)[:, space.model.slot(space.names[column])])


def _without(space: SearchSpace, point: Array, column: int, coordinate: float) -> SearchSpace:
    """The search space with one parameter held at a search coordinate."""
    name = space.names[column]
    value = float(_si_values(space, point, column, np.array([coordinate]))[0])
    others = tuple(g for g in space.parameters if g.name != name)
    return replace(space, parameters=others, fixed={**space.fixed, name: value})


def _crossing(values: Array, statistic: Array, side: int) -> float:
    """Value at which sqrt(statistic), nearly straight on each side, crosses the limit; nan if it does not."""
    best = int(np.argmin(statistic))
    root = np.sqrt(statistic)
    k = best
    while 0 <= k + side < values.size:
        if root[k + side] >= _LIMIT:
            share = (_LIMIT - root[k]) / (root[k + side] - root[k])
            return float(values[k] + share * (values[k + side] - values[k]))
        k += side
    return float("nan")
