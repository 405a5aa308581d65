"""Profile likelihoods: how the fit worsens when one parameter is held and all others are fitted again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.errors import UsageError
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.irls import at_frozen_weights
from linid.identification.optimise.least_squares import LeastSquaresFit, Linearisation
from linid.identification.result import Profile
from linid.identification.space.search_space import SearchSpace
from linid.identification.uncertainty.covariance import Uncertainty
from linid.statistics import CHI_SQUARED_95

_STANDARD_DEVIATIONS = (0.75, 1.5, 2.25, 3.0)  # at which the profile is computed, on both sides
_EVALUATIONS = 8


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
    names = problem.space.names
    column = names.index(name)
    p = len(names)
    full = Linearisation(problem, Cost(problem))
    full.reweight(np.concatenate([fit.point, fit.offsets]))
    least = float(fit.residuals @ fit.residuals)
    # 1/naive variance is what the column keeps when all others are regressed out.
    others = np.delete(fit.jacobian, column, axis=1)
    others = others / np.maximum(np.linalg.norm(others, axis=0), 1e-300)
    own = fit.jacobian[:, column]
    left = own - others @ np.linalg.lstsq(others, own, rcond=1e-10)[0]
    deviation = float(np.sqrt(uncertainty.search_covariance[column, column]))
    scale = 1.0 / (float(left @ left) * deviation**2)
    free = np.delete(np.arange(p), column)
    centre = float(fit.point[column])
    points = {centre: 0.0}
    total = 2 * len(_STANDARD_DEVIATIONS)
    for side in (-1.0, 1.0):
        x = np.concatenate([fit.point[free], fit.offsets])
        for reach in _STANDARD_DEVIATIONS:
            coordinate = centre + side * reach * deviation
            if 1e-6 < coordinate < 1.0 - 1e-6:
                held = Problem(_without(problem.space, fit.point, column, coordinate), problem.parts)
                line = Linearisation(held, full.cost)
                line.weights = full.weights
                solution = at_frozen_weights(line, x, evaluations=_EVALUATIONS, tolerance=1e-8)
                x = np.asarray(solution.x)
                points[coordinate] = max(0.0, (2.0 * float(solution.cost) - least) * scale)
            if watch is not None:
                watch(len(points) - 1, total)
    point = np.array(sorted(points))
    statistic = np.array([points[coordinate] for coordinate in point])
    values = _si_values(problem.space, fit.point, column, point)
    low, high = _crossing(values, statistic, -1), _crossing(values, statistic, 1)
    return Profile(name, tuple(values.tolist()), tuple(statistic.tolist()), low, high)


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
    limit = float(np.sqrt(CHI_SQUARED_95))
    k = best
    while 0 <= k + side < values.size:
        if root[k + side] >= limit:
            share = (limit - root[k]) / (root[k + side] - root[k])
            return float(values[k] + share * (values[k + side] - values[k]))
        k += side
    return float("nan")
