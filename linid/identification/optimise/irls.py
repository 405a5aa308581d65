"""Least squares in rounds of frozen weights, for the force balance.

The robust weights of a force balance in which an effect is missing follow the residual wherever it goes: re-estimated
at every step (as `levenberg_marquardt` does, ten times faster) they may lead to another minimum than when each round
is brought to its end first, and candidates are compared by minima that must be the same ones.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.problem import Cost
from linid.identification.optimise.linearisation import Linearisation

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

_SETTLED = 3e-4  # relative change of the cost between rounds


def at_frozen_weights(line: Linearisation, x: Array, *, evaluations: int, tolerance: float) -> OptimizeResult:
    """Least squares from x (p + k,), search coordinates and offsets, within the box, with the weights as they are.

    evaluations: at most; tolerance: relative change of the cost or of x that ends it.
    """
    from scipy.optimize import least_squares

    return least_squares(
        line.length,
        x,
        jac=line.rotated_jacobian,
        bounds=line.bounds,
        x_scale="jac",
        max_nfev=evaluations,
        ftol=tolerance,
        xtol=tolerance,
        gtol=1e-12,
    )


def reweighted_least_squares(cost: Cost, point: Array, *, iterations: int, evaluations: int, tolerance: float) -> Array:
    """Search coordinates (p,) refined by scipy's bounded trust-region least squares.

    rounds: at most, each with weights of its own; evaluations: per round, at most; tolerance: relative change of cost
    or search coordinates that ends a round. point: (p,) to begin with; cost: of a problem without start offsets.
    """
    line = Linearisation(cost.problem, cost)
    x = np.clip(point, 1e-9, 1.0 - 1e-9)
    best = line.reweight(x)
    for number in range(iterations):
        solution = at_frozen_weights(line, x, evaluations=evaluations, tolerance=tolerance)
        x = np.asarray(solution.x)
        current = line.reweight(x)
        gain = (best - current) / best
        best = min(best, current)
        if number > 0 and abs(gain) < max(_SETTLED, tolerance) and solution.status > 0:
            break
    return x
