"""Least squares in rounds of frozen weights, for the force balance.

The robust weights of a force balance in which an effect is missing follow the residual wherever it goes: re-estimated
at every step (as `polish` does, ten times faster) they may lead to another minimum than when each round is brought to
its end first, and candidates are compared by minima that must be the same ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from linid.identification.polish import Linearisation
from linid.identification.problem import Cost, Problem

Array = NDArray[np.float64]
_SETTLED = 3e-4  # relative change of the cost between rounds


def polish_in_rounds(problem: Problem, genes: Array, *, rounds: int, evaluations: int, tolerance: float) -> Array:
    """Genes (p,) refined by scipy's bounded trust-region least squares.

    rounds: at most, each with weights of its own; evaluations: per round, at most; tolerance: relative change of cost
    or genes that ends a round. Of a problem without start offsets.
    """
    from scipy.optimize import least_squares

    line = Linearisation(problem, Cost(problem))
    x = np.clip(genes, 1e-9, 1.0 - 1e-9)
    best = line.reweight(x)
    for number in range(rounds):
        solution = least_squares(
            line.length, x, jac=line.rotated_jacobian, bounds=(np.zeros(line.p), np.ones(line.p)), x_scale="jac",
            max_nfev=evaluations, ftol=tolerance, xtol=tolerance, gtol=1e-12,
        )  # fmt: skip
        x = np.asarray(solution.x)
        current = line.reweight(x)
        gain = (best - current) / best
        best = min(best, current)
        if number > 0 and abs(gain) < max(_SETTLED, tolerance) and solution.status > 0:
            break
    return x
