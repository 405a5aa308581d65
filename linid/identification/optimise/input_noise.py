"""The fit under the noise of the logged phase currents: residuals whitened, and what the noise adds taken off.

Where the windings do not stand 120 degrees apart, what the three currents' noise has in common pushes too, and
commutated currents leave directions in which the motor's parameters are told weakly: least squares then lowers the
noise's push at the truth's expense (errors in variables).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.input_noise import CurrentPush, Feigned, WhitenedAhead, feigned, whitened
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.least_squares import LeastSquaresFit, levenberg_marquardt
from linid.identification.optimise.linearisation import Linearisation
from linid.identification.settings import Ending
from linid.identification.space.search_space import BOX_STD

_COMMON = 0.3  # of one winding's force by a current that all three share, from which on its noise counts
_PASSES = 2  # of whitening: the first one is at the plain optimum
# Of the least squares before the last pass, and in it: what is left, the rounds of the correction do.
_NEARER, _NEAR = Ending(20, 0.3, 1.2), Ending(20, 0.1, 0.4)
_ROUNDS = 3  # of the correction
_MOST_MOVE = 0.05  # of the search box in a round
_SETTLED = 1e-3  # of the weighted square that a round promises to gain: one standard deviation weighs 1


@dataclass(frozen=True)
class NoisyFit:
    """A fit under the currents' noise. problem: its whitened one; feigned: what noise adds at the fit."""

    problem: Problem
    fit: LeastSquaresFit
    feigned: Feigned


def currents_in_common_push(problem: Problem, point: Array) -> bool:
    """Whether a current that all three windings share gives a force (star with 120 degrees: none). point: (p,)."""
    model = problem.space.model
    if not model.phases or not any(isinstance(part, Ahead) for part in problem.parts):
        return False
    names = {parameter.name for parameter in model.parameters}
    if "winding_displacement" not in names or model.winding:
        return False
    vector = problem.space.vectors(point)[0]
    angle = model.turns * float(vector[model.slot("winding_displacement")])
    return abs(1.0 + 2.0 * math.cos(angle)) > _COMMON


def fit_under_noise(problem: Problem, fit: LeastSquaresFit, *, seed: int = 1, steps: int = Ending.steps) -> NoisyFit:
    """The fit, from that by plain least squares, under the noise of the currents. seed: of the draws of noise; steps:
    of least squares at most, in each pass."""
    place = next(k for k, part in enumerate(problem.parts) if isinstance(part, Ahead))
    plain = problem.parts[place]
    assert isinstance(plain, Ahead)
    push = CurrentPush(plain)
    for number in range(_PASSES):
        vector = problem.space.vectors(fit.point)[0]
        part = whitened(plain, vector, push(vector[None])[0], np.random.default_rng([seed, 3]))
        white = replace(problem, parts=(*problem.parts[:place], part, *problem.parts[place + 1 :]))
        last = number == _PASSES - 1
        ending = _NEAR if last else _NEARER
        ending = replace(ending, steps=min(ending.steps, steps))
        found = levenberg_marquardt(white, Cost(white), fit.start, ending=ending, final=last)
        counted = fit.evaluations + found.evaluations
        fit = replace(found, history=fit.history, evaluations=counted, cost=fit.cost, converged=found.converged)
    corrected, added = _corrected(white, place, part, push, fit)
    return NoisyFit(white, corrected, added)


def _corrected(
    problem: Problem, place: int, part: WhitenedAhead, push: CurrentPush, fit: LeastSquaresFit
) -> tuple[LeastSquaresFit, Feigned]:
    """The fit moved to where the residuals' gradient is what noise alone makes of it."""
    x = np.concatenate([fit.point, fit.offsets])
    p = fit.point.size
    line = Linearisation(problem, Cost(problem), weights=fit.weights)
    prior = np.diag(np.where(np.arange(x.size) < p, BOX_STD**-2, 1e-12))
    residuals, jacobian = fit.residuals, fit.jacobian
    for _ in range(_ROUNDS):
        added = feigned(part, push, problem.space, x[:p], line.weights[place], line.rows(x)[place][0])
        gap = -jacobian.T @ residuals
        gap[:p] += added.excess.sum(axis=0)
        move = np.linalg.solve(jacobian.T @ jacobian + prior, gap)
        move *= min(1.0, _MOST_MOVE / max(float(np.max(np.abs(move[:p]))), 1e-300))
        if float(gap @ move) < _SETTLED:
            break
        x = x + move
        x[:p] = np.clip(x[:p], 0.0, 1.0)
        residuals, jacobian = line.residuals(x), line.jacobian(x)
    return replace(fit, point=x[:p], offsets=x[p:], residuals=residuals, jacobian=jacobian, moved_from=None), added
