"""The bias that noise of the logged inputs leaves in a fit, estimated by adding as much noise once more.

Where the axis sticks or reverses, the model answers noise in its inputs nonlinearly: a dithered bristle creeps. The
machine felt no such noise. The answer's mean is even in the noise, so pairs of opposite draws give it almost exactly
(simulation and extrapolation: Cook and Stefanski 1994, J. Am. Stat. Assoc. 89).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.noisy import Parts, answers_under_noise, driven, opposite_draws
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.least_squares import LeastSquaresFit
from linid.identification.optimise.linearisation import Linearisation
from linid.identification.space.search_space import BOX_STD
from linid.identification.uncertainty import field_phase

_PAIRS = 6


def simex_corrected(problem: Problem, fit: LeastSquaresFit, *, seed: int = 1, jobs: int = 1) -> LeastSquaresFit:
    """The fit moved by what the noise of its inputs has shifted it, to first order.

    Pole pitch and field phase stay: their residuals have no first order. seed: of the draws; jobs: threads.
    """
    reached = driven(problem)
    if not reached.places:
        return fit
    generator = np.random.default_rng([seed, 2])
    x = np.concatenate([fit.point, fit.offsets])
    line = Linearisation(problem, Cost(problem), weights=fit.weights)
    plain = line.residuals(x)
    bias = np.zeros_like(plain)
    draws = opposite_draws(reached.problem.parts, _PAIRS, generator)

    def answer(parts: Parts) -> Array:
        weights = [fit.weights[k] for k in reached.places]
        noisy = Linearisation(Problem(problem.space, parts), line.cost, weights=weights)
        return noisy.residuals(x[reached.columns])

    for residuals in answers_under_noise(reached.problem.parts, draws, answer, jobs):
        bias[reached.rows] += (residuals - plain[reached.rows]) / (2.0 * _PAIRS)
    p = fit.point.size
    pair = field_phase.columns(problem.space) or ()
    moved = np.array([column for column in range(x.size) if column not in pair])
    jacobian = fit.jacobian[:, moved]
    information = jacobian.T @ jacobian
    information[np.diag_indices_from(information)] += np.where(moved < p, 1.0 / BOX_STD**2, 1e-12)
    shift = np.zeros_like(x)
    shift[moved] = np.linalg.solve(information, jacobian.T @ bias)
    point = np.clip(fit.point + shift[:p], 0.0, 1.0)
    residuals = fit.residuals + fit.jacobian @ shift
    moved_from = fit.linearised_at
    return replace(fit, point=point, offsets=fit.offsets + shift[p:], residuals=residuals, moved_from=moved_from)
