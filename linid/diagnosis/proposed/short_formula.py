"""A short formula for a proposed term, where one predicts rows that it was not fitted to as well as the curve."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from linid.arrays import Array
from linid.diagnosis.proposed.dictionary import Formula, formulas
from linid.diagnosis.proposed.family import Family
from linid.diagnosis.proposed.leftover import Leftover
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.propose import WORTH, Proposal
from linid.diagnosis.proposed.regression import Regression
from linid.diagnosis.report_data import ShortFormula

REFINED = 6  # formulas whose numbers are searched beyond the grid
JUDGED = 4  # of those by AICc that are judged against the curve
EVALUATIONS, STEPS_ANEW = 25, 6
SIMPLER = 0.02  # of what the likeliest takes away: what else takes this much, with fewer numbers, comes first
CHANCE = 0.05  # a formula is worse than the curve if resampled blocks say so in all but this share
AS_GOOD = 0.02, 0.1  # of the curve's gain: a loss that never matters, and one that matters beyond chance or not
_RESAMPLES = 400
_FLAT = 1e-6  # keeps the normal equations of amplitudes regular


@dataclass(frozen=True)
class Fitted:
    """A formula with its numbers. theta: (q,); squares: what is left of the fitted rows, weighted; numbers: how many
    are fitted, amplitudes and theta; rank: its place in the dictionary."""

    formula: Formula
    theta: Array
    squares: float
    numbers: int
    rank: int

    @property
    def roughness(self) -> Array:
        """Of its amplitudes (k, k), which have none."""
        return _FLAT * np.eye(self.numbers - self.theta.size)


@dataclass(frozen=True)
class FoundFormula:
    """A formula that takes the place of a family's curve: with its numbers, and as it is said."""

    family: Family
    fit: Fitted
    said: ShortFormula

    def anew(self, problem: Problem, columns: Callable[[str], Array]) -> FoundFormula:
        """The same with the numbers that suit a problem best, from those it has.

        columns(effect): (n, k) m/s^2 per unit amplitude that the own term gives the rows in the simulation.
        """
        named = next(one for one in formulas(problem, self.family) if one.name == self.fit.formula.name)
        shown = replace(named, columns=lambda theta: columns(named.own(theta)))
        fit = _Search(problem).refined(replace(self.fit, formula=shown, squares=math.inf), STEPS_ANEW)
        return replace(self, fit=fit, said=replace(self.said, effect=fit.formula.own(fit.theta)))

    def put(self, amplitudes: Array, closed: float) -> FoundFormula:
        """The same with its amplitudes (k,) in N and the share that it closes, as it is said."""
        text = self.fit.formula.words(amplitudes, self.fit.theta)
        return replace(self, said=replace(self.said, text=text, closed=min(closed, 1.0)))


def short_formula(problem: Problem, proposal: Proposal, ranked: Sequence[Fitted]) -> FoundFormula | None:
    """The best formula by AICc that predicts left-out recordings as well as the curve, if any.

    ranked: `ranked_formulas` of the same.
    """
    curve = proposal.regression
    folds = curve.sums.split
    for fit in ranked[:JUDGED]:
        regression = _regressed(proposal, fit)
        if all(as_good(problem.seed, curve, regression, some) for some in (folds.selecting, folds.judging)):
            return _said(proposal, fit, regression)
    return None


def likely_formula(proposal: Proposal, ranked: Sequence[Fitted]) -> FoundFormula | None:
    """The likeliest formula if a model can have it and it closes a good part of what the curve does: a curve also
    imitates how far the base is pulled, which a formula cannot before the base has moved.

    ranked: `ranked_formulas` of the same.
    """
    if not ranked:
        return None
    found = _said(proposal, ranked[0], _regressed(proposal, ranked[0]))
    return found if found.said.effect and found.said.closed >= WORTH * proposal.closed else None


def ranked_formulas(problem: Problem, proposal: Proposal) -> list[Fitted]:
    """Formulas of the dictionary with the arguments of a proposal, the likeliest by AICc first."""
    if proposal.family.local:
        return []
    search = _Search(problem)
    tried = [search.gridded(formula, k) for k, formula in enumerate(formulas(problem, proposal.family))]
    tried.sort(key=lambda fit: fit.squares)
    refined = [search.refined(fit, EVALUATIONS) for fit in tried[:REFINED] if math.isfinite(fit.squares)]
    return _in_order(refined, search, search.effective_rows(proposal.regression))


def _regressed(proposal: Proposal, fit: Fitted) -> Regression:
    family = Family(proposal.arguments, fit.formula.name, fit.formula.columns(fit.theta), fit.roughness)
    return Regression(proposal.regression.sums, family)


def _said(proposal: Proposal, fit: Fitted, regression: Regression) -> FoundFormula:
    text = fit.formula.words(regression.solution(0.0)[0], fit.theta)
    said = ShortFormula(text, min(regression.closed(0.0), 1.0), fit.numbers, fit.formula.own(fit.theta))
    return FoundFormula(proposal.family, fit, said)


class _Search:
    """Fits of formulas to the fitted rows beside the base; amplitudes follow from theta (variable projection: Golub
    and Pereyra 1973, SIAM J. Numer. Anal. 10, 413)."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.leftover = Leftover(problem)
        self.mine, self.rest = self.leftover.mine, self.leftover.rest
        self.rows = self.mine.size

    def left(self, formula: Formula, theta: Array) -> Array:
        """What base and formula leave (n + r,), weighted."""
        return self.leftover.beside(formula.columns(theta))

    def gridded(self, formula: Formula, rank: int) -> Fitted:
        """The best start of a formula."""
        squares = [float(np.sum(self.left(formula, theta) ** 2)) for theta in formula.starts]
        best = int(np.argmin(squares)) if squares else 0
        theta = formula.starts[best] if squares else np.zeros(0)
        amplitudes = formula.columns(theta).shape[1]
        return Fitted(formula, theta, min(squares, default=math.inf), amplitudes + theta.size, rank)

    def refined(self, fit: Fitted, evaluations: int) -> Fitted:
        """A formula with its numbers between the starts."""
        if fit.theta.size == 0:
            return fit
        from scipy.optimize import least_squares  # takes long to load

        logs = np.array(fit.formula.logs)
        scales = np.where(logs, 0.1, 0.05 * np.maximum(np.ptp(fit.formula.starts, axis=0), 1e-9))

        def theta_of(u: Array) -> Array:
            shift = np.clip(u * scales, -20.0, 20.0)
            return np.where(logs, np.abs(fit.theta) * np.exp(np.where(logs, shift, 0.0)), fit.theta + u * scales)

        found = least_squares(
            lambda u: self.left(fit.formula, theta_of(u)),
            np.zeros(fit.theta.size),
            diff_step=1e-3,
            max_nfev=evaluations,
        )
        squares = 2.0 * float(found.cost)
        return replace(fit, theta=theta_of(found.x), squares=squares) if squares < fit.squares else fit

    def effective_rows(self, regression: Regression) -> float:
        """How many independent rows the fitted ones are worth, by how sums over blocks of what is left scatter."""
        coefficients, steps = regression.solution()
        problem = self.problem
        term = regression.family.columns[self.mine] @ coefficients * problem.weights[self.mine]
        left = problem.rest[self.mine] - problem.base[self.mine] @ steps - term
        numbers = np.unique(problem.rows.block[self.mine], return_inverse=True)[1]
        sums = np.bincount(numbers, left)
        together = float(np.sum(sums**2)) / max(float(np.sum(left**2)), 1e-300)
        return self.rows / max(together, 1.0)


def _in_order(fits: list[Fitted], search: _Search, count: float) -> list[Fitted]:
    """The likeliest by AICc first, but before it simpler ones that take nearly as much away.

    count: independent rows.
    """
    by_aicc = sorted(fits, key=lambda fit: _aicc(fit, search.rows, count))
    if not by_aicc:
        return []
    best = by_aicc[0].squares
    most = best + SIMPLER * (float(np.sum(search.rest**2)) - best)
    alike = [fit for fit in by_aicc if fit.squares <= most]
    simple = sorted(alike, key=lambda fit: (fit.numbers, fit.rank))
    return simple + [fit for fit in by_aicc if fit.squares > most]


def _aicc(fit: Fitted, rows: int, count: float) -> float:
    """Akaike's criterion for few rows (Hurvich and Tsai 1989, Biometrika 76, 297); count: independent rows."""
    p = fit.numbers + 1
    return count * math.log(max(fit.squares / rows, 1e-300)) + 2.0 * p + 2.0 * p * (p + 1) / max(count - p - 1, 1.0)


def as_good(seed: int, curve: Regression, formula: Regression, folds: tuple[int, ...]) -> bool:
    """Whether a formula predicts some folds that it is not fitted to as well as the curve, but for chance."""
    base, with_curve = curve.block_squares(folds)
    with_formula = formula.block_squares(folds, 0.0)[1]
    gain, lost = float(np.sum(base - with_curve)), with_formula - with_curve
    worse = float(lost.sum())
    if worse <= AS_GOOD[0] * gain:
        return True
    generator = np.random.default_rng(seed)
    draws = generator.multinomial(lost.size, np.full(lost.size, 1.0 / lost.size), _RESAMPLES)
    return worse <= AS_GOOD[1] * gain and float(np.quantile(draws @ lost, CHANCE)) <= 0.0
