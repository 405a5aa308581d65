"""The minimum that a fit ends in: freed of what noise of the inputs does to it, and compared with its rivals."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from linid.arrays import Array
from linid.identification.assemble import Task, assemble
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.input_noise import currents_in_common_push, fit_under_noise
from linid.identification.optimise.least_squares import LeastSquaresFit, levenberg_marquardt
from linid.identification.optimise.rivals import advantage, group_squares, on_the_plain, other_shape, weights_at
from linid.identification.optimise.search_state import SearchState
from linid.identification.optimise.stages import APART, coarse_ending, final_ending
from linid.identification.optimise.window_trust import fit_by_trust
from linid.identification.result import FitResult, Profile
from linid.identification.settings import FitSettings, Hooks
from linid.identification.shared_minima import shared, with_plain, with_twin
from linid.identification.uncertainty.covariance import Uncertainty, estimate_uncertainty
from linid.identification.uncertainty.profile import profile_likelihood
from linid.identification.uncertainty.simex import simex_corrected
from linid.identification.uncertainty.voltage_noise import without_voltage_noise
from linid.statistics import NORMAL_97_5

# Deviations by which freeing a rival of what noise of the inputs does to it changes how far it lies behind: 0.1 at most
# in six fits of campaigns of others, where the residuals need no whitening.
_CHANGED = 0.5


def best_minimum(
    task: Task, problem: Problem, state: SearchState, solution: LeastSquaresFit, hooks: Hooks
) -> FitResult:
    """The result of a fit from its solution by plain least squares, on all data.

    state: the last one of the search; intervals hold the rivals that cost statistically the same.
    """
    best = _found(task, problem, state, solution, hooks)
    if _is_plain(task, best):
        best = replace(best, result=with_plain(best.result, problem.space))
    return with_twin(_with_rivals(task, problem, state, best, hooks), problem.space)


@dataclass(frozen=True)
class _Found:
    """A minimum: the problem of which it is one, its linearisation there, its result, and whether its residuals are
    whitened."""

    problem: Problem
    solution: LeastSquaresFit
    result: FitResult
    white: bool

    @cached_property
    def _weighted(self) -> tuple[list[Array], Array]:
        """The weights (N,) of each part's residuals here, and the weighted squares (G,) by group."""
        weights = weights_at(self.problem, self.solution)
        return weights, group_squares(self.problem, self.solution, weights)

    def lead(self, problem: Problem, rival: LeastSquaresFit) -> float:
        """How much less this costs than a rival, in standard deviations; problem: that of the rival's residuals."""
        weights, squares = self._weighted
        return advantage(squares, group_squares(problem, rival, weights))


def _found(task: Task, problem: Problem, state: SearchState, solution: LeastSquaresFit, hooks: Hooks) -> _Found:
    """The minimum near a solution of plain least squares, freed of what noise of the inputs does to it."""
    settings, seed = task.settings, task.settings.search.seed
    own, added = problem, None
    if settings.least_squares_steps > 0 and currents_in_common_push(problem, solution.point):
        noisy = fit_under_noise(problem, solution, seed=seed)
        own, solution, added = noisy.problem, noisy.fit, noisy.feigned
    elif settings.least_squares_steps > 0:
        own, solution = fit_by_trust(problem, solution, final_ending(settings), seed=seed)
    if settings.least_squares_steps > 0:
        solution = without_voltage_noise(own, simex_corrected(own, solution, seed=seed))
    uncertainty = estimate_uncertainty(own, solution, seed=seed, known=added)
    profiles = _profiles(own, solution, uncertainty, settings, hooks)
    result = assemble(task, problem, state, solution, uncertainty)
    return _Found(own, solution, replace(result, profiles=profiles), added is not None)


def _is_plain(task: Task, best: _Found) -> bool:
    """Whether a shape of the field that seems to be told costs statistically what one costs that tells nothing.

    Towards wide magnets the last trace of the fifth harmonic goes, and with it the curvature that the interval is from.
    """
    told = any(e.name == "nome" and e.status == "fitted" for e in best.result.estimates)
    plain = on_the_plain(best.problem, best.solution) if told and task.settings.least_squares_steps else None
    if plain is None:
        return False
    held, point = plain
    found = levenberg_marquardt(
        held, Cost(held), point, best.solution.offsets, ending=final_ending(task.settings), final=False
    )
    return best.lead(held, found) < NORMAL_97_5


def _with_rivals(task: Task, problem: Problem, state: SearchState, best: _Found, hooks: Hooks) -> FitResult:
    """The result, and where another shape of the field costs statistically the same, what it shares with that."""
    # The back-EMF tells the shape by itself.
    start = None if problem.space.model.winding else other_shape(problem.space, best.solution.point)
    told = any(e.name == "nome" and e.status == "fitted" for e in best.result.estimates)
    if start is None or task.settings.least_squares_steps == 0 or not (best.white or told):
        return best.result
    start = _settled(task, problem, start, best)
    solution = replace(best.solution, point=start)
    if not best.white:
        solution = levenberg_marquardt(
            problem, Cost(problem), start, solution.offsets, ending=final_ending(task.settings)
        )
        if best.lead(problem, solution) > NORMAL_97_5 + _CHANGED:
            return best.result
    rival = _found(task, problem, state, replace(solution, history=best.solution.history), hooks)
    if float(np.max(np.abs(rival.solution.point - best.solution.point))) < APART:
        return best.result
    lead = best.lead(rival.problem, rival.solution)
    if lead > NORMAL_97_5:
        return best.result
    if lead < -NORMAL_97_5:
        return rival.result
    return shared(best.result, rival.result, problem.space)


def _settled(task: Task, problem: Problem, start: Array, best: _Found) -> Array:
    """A start (p,) with another shape of the field, all else fitted to that before the shape is free.

    Where the best one's residuals are whitened, under that: from where plain least squares leave the other parameters
    a free shape may run back to the best one's.
    """
    names = problem.space.names
    column = names.index("nome")
    nome = problem.space.values(start)["nome"]
    held = Problem(problem.space.holding({"nome": nome}), problem.parts)
    ending, offsets = coarse_ending(task.settings), best.solution.offsets
    found = levenberg_marquardt(held, Cost(held), np.delete(start, column), offsets, ending=ending, final=False)
    if best.white:
        found = fit_under_noise(held, found, seed=task.settings.search.seed).fit
    return np.insert(found.point, column, start[column])


def _profiles(
    problem: Problem, solution: LeastSquaresFit, uncertainty: Uncertainty, settings: FitSettings, hooks: Hooks
) -> tuple[Profile, ...]:
    """The profile likelihoods that the settings ask for."""
    out = []
    for name in settings.profiles:

        def watch(done: int, total: int, name: str = name) -> None:
            if hooks.progress is not None:
                hooks.progress(f"profile of {name}", done, total, solution.cost)

        out.append(profile_likelihood(problem, solution, uncertainty, name, watch=watch))
    return tuple(out)
