"""Windows of a prediction weighed by what noise of the logged inputs does to them.

Where an axis breaks away or sticks within a window, noise of the current decides when: that prediction scatters ten
times as much as its neighbours, and all of it falls on the friction at rest. The residual does not show such a window,
for the fit follows it (weighted least squares by known variances: Aitken 1936, Proc. R. Soc. Edinb. 55).
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.input_noise import WhitenedAhead
from linid.identification.objectives.noisy import Parts, answers_under_noise, opposite_draws
from linid.identification.objectives.objective import Part
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.least_squares import LeastSquaresFit, levenberg_marquardt
from linid.identification.settings import Ending

_PAIRS = 3  # of opposite draws of the noise: they tell a factor of ten, and half of it is enough


def fit_by_trust(
    problem: Problem, fit: LeastSquaresFit, ending: Ending, *, seed: int = 1, jobs: int = 1
) -> tuple[Problem, LeastSquaresFit]:
    """The problem with its windows weighed, as it is where all count alike, and the fit brought to its end there; a fit
    without windows has ended before. seed: of the draws; jobs: threads."""
    vector = problem.space.vectors(fit.point)[0]
    generator = np.random.default_rng([seed, 4])
    parts: tuple[Part, ...] = tuple(
        _weighed(part, trust_of(part, vector, generator, jobs))
        if isinstance(part, Ahead) and not isinstance(part, WhitenedAhead)
        else part
        for part in problem.parts
    )
    trusts = [part.trust for part in parts if isinstance(part, Ahead) and part.trust is not None]
    if not trusts:
        return problem, fit
    alike = all(float(trust.min()) == 1.0 for trust in trusts)
    weighed = problem if alike else Problem(problem.space, parts)
    found = levenberg_marquardt(weighed, Cost(weighed), replace(fit.start, told=fit.told), ending=ending)
    counted = fit.evaluations + found.evaluations
    # What these steps lessen is another cost, that of the weighed windows: the history is of the plain one.
    return weighed, replace(found, history=fit.history, evaluations=counted, cost=fit.cost)


def _weighed(part: Ahead, trust: Array) -> Ahead:
    """The same objective, with a weight (windows,) of each window: nothing else of it hangs on that."""
    moved = copy(part)
    moved.trust = trust
    return moved


def trust_of(part: Ahead, vector: Array, generator: np.random.Generator, jobs: int = 1) -> Array:
    """Weight (windows,), at most 1, of each window's residuals beside others of its class.

    vector: (VECTOR_SIZE,) near the truth. The noise's share of the class's usual power, by medians, is taken to differ
    between windows as the draws do; what else is in the residuals is the same for all.
    """
    sizes = np.bincount(part.groups)
    none = np.zeros((1, 0))
    before = part.residuals(vector[None], none)[0]
    drawn = opposite_draws((part,), _PAIRS, generator)

    def powers(parts: Parts) -> Array:
        (moved,) = parts
        return np.bincount(part.groups, (moved.residuals(vector[None], none)[0] - before) ** 2) / sizes

    noise: Array = sum(answers_under_noise((part,), drawn, powers, jobs), np.zeros(sizes.size))
    out = np.ones(sizes.size)
    if not (np.all(np.isfinite(noise)) and np.all(np.isfinite(before))):
        return out
    noise /= 2 * _PAIRS
    power = np.bincount(part.groups, before**2) / sizes
    classes = part.classes[np.flatnonzero(np.diff(part.groups, prepend=-1))]
    for one in np.unique(classes):
        mine = classes == one
        usual = float(np.median(noise[mine]))
        if usual > 0.0:
            share = min(usual / max(float(np.median(power[mine])), 1e-300), 1.0)
            out[mine] = 1.0 / np.sqrt(np.maximum(1.0 - share + share * noise[mine] / usual, 1.0))
    return out
