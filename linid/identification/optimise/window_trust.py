"""Windows of a prediction weighed by what noise of the logged inputs does to them.

Where an axis breaks away or sticks within a window, noise of the current decides when: that prediction scatters ten
times as much as its neighbours, and all of it falls on the friction at rest. The residual does not show such a window,
for the fit follows it (weighted least squares by known variances: Aitken 1936, Proc. R. Soc. Edinb. 55). Noise and its
opposite do not cancel there: what is even in the noise moves the mean, so that least squares, to which an error is as
likely as its opposite, take it for friction at rest.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.input_noise import WhitenedAhead
from linid.identification.objectives.objective import Part
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.least_squares import LeastSquaresFit, levenberg_marquardt
from linid.identification.settings import Ending
from linid.identification.signals.motion import input_noise, with_inputs_moved

_PASSES = 2  # the plain optimum may itself hang on a window that noise throws about
_ALIKE = 0.7  # logarithm of two: weights that have changed by less lead nowhere else
_LEAST_COHERENT = 0.1  # weight of a window whose answer is all even: without others, it still leads somewhere
_PAIRS = 3  # of opposite draws of the noise: they tell a factor of ten, and half of it is enough


def fit_by_trust(
    problem: Problem, fit: LeastSquaresFit, ending: Ending, *, seed: int = 1
) -> tuple[Problem, LeastSquaresFit]:
    """The problem with its windows weighed, and the fit brought to its end there; both as they are, where all windows
    count alike. seed: of the draws."""
    weighed, before = problem, np.zeros(0)
    for _ in range(_PASSES):
        vector = problem.space.vectors(fit.point)[0]
        generator = np.random.default_rng([seed, 4])
        parts: tuple[Part, ...] = tuple(
            replace(part, trust=trust_of(part, vector, generator))
            if isinstance(part, Ahead) and not isinstance(part, WhitenedAhead)
            else part
            for part in problem.parts
        )
        trusts = [part.trust for part in parts if isinstance(part, Ahead) and part.trust is not None]
        trust = np.concatenate([np.ones(0), *trusts])
        if np.all(trust == 1.0) or (before.size and np.all(np.abs(np.log(trust / before)) < _ALIKE)):
            break
        weighed, before = Problem(problem.space, parts), trust
        found = levenberg_marquardt(weighed, Cost(weighed), fit.point, fit.offsets, ending=ending)
        counted = fit.evaluations + found.evaluations
        fit = replace(found, history=fit.history, evaluations=counted, cost=fit.cost)
    return weighed, fit


def trust_of(part: Ahead, vector: Array, generator: np.random.Generator) -> Array:
    """Weight (windows,), at most 1, of each window's residuals beside others of its class.

    vector: (VECTOR_SIZE,) near the truth. The noise's share of the class's usual power, by medians, is taken to differ
    between windows as the draws do; what else is in the residuals is the same for all. A window counts less, too, the
    less its answers to opposite draws are opposite: by the square of their correlation.
    """
    sizes = np.bincount(part.groups)
    none = np.zeros((1, 0))
    before = part.residuals(vector[None], none)[0]
    odd, even = np.zeros(sizes.size), np.zeros(sizes.size)
    draws = 0
    for _ in range(_PAIRS):
        moves = {r.name: input_noise(r, generator) for r in part.recordings}
        answers = []
        for sign in (1.0, -1.0):
            moved = replace(part, recordings=tuple(with_inputs_moved(r, sign * moves[r.name]) for r in part.recordings))
            if np.array_equal(moved.flat_first, part.flat_first):  # else noise has passed for a jump
                answers.append(moved.residuals(vector[None], none)[0] - before)
            del moved  # before the next one, as large, is made
        if len(answers) == 2:
            up, down = answers
            odd += np.bincount(part.groups, (0.5 * (up - down)) ** 2) / sizes
            even += np.bincount(part.groups, (0.5 * (up + down)) ** 2) / sizes
            draws += 1
    out = np.ones(sizes.size)
    noise = odd + even
    if not (draws and np.all(np.isfinite(noise)) and np.all(np.isfinite(before))):
        return out
    noise /= draws
    power = np.bincount(part.groups, before**2) / sizes
    classes = part.classes[np.flatnonzero(np.diff(part.groups, prepend=-1))]
    for one in np.unique(classes):
        mine = classes == one
        usual = float(np.median(noise[mine]))
        if usual > 0.0:
            share = min(usual / max(float(np.median(power[mine])), 1e-300), 1.0)
            out[mine] = 1.0 / np.sqrt(np.maximum(1.0 - share + share * noise[mine] / usual, 1.0))
    correlated = (odd - even) / np.maximum(odd + even, 1e-300)  # of an answer with minus that of the opposite noise
    coherent = np.maximum(np.maximum(correlated, 0.0) ** 2, _LEAST_COHERENT)
    return out * np.where(noise > 0.0, coherent, 1.0)
