"""The minimum that a fit ends in: freed of what noise of the inputs does to it, and compared with its rivals."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from linid.arrays import Array
from linid.identification.assemble import Task, assemble
from linid.identification.objectives.input_noise import Feigned
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.input_noise import currents_in_common_push, fit_under_noise
from linid.identification.optimise.least_squares import LeastSquaresFit, levenberg_marquardt
from linid.identification.optimise.rivals import advantage, group_squares, on_the_plain, other_shape
from linid.identification.optimise.search_state import SearchState
from linid.identification.optimise.stages import APART, coarse_ending, final_ending
from linid.identification.optimise.window_trust import fit_by_trust
from linid.identification.result import FitResult, Profile
from linid.identification.settings import FitSettings, Hooks
from linid.identification.shared_minima import shared, with_plain, with_twin
from linid.identification.uncertainty.covariance import Uncertainty, estimate_uncertainty
from linid.identification.uncertainty.profile import profile_likelihood, valley_end
from linid.identification.uncertainty.simex import simex_corrected
from linid.identification.uncertainty.voltage_noise import without_voltage_noise
from linid.statistics import NORMAL_97_5

# Deviations by which freeing a rival of what noise of the inputs does to it changes how far it lies behind: 0.1 at most
# in six fits of campaigns of others, where the residuals need no whitening.
_CHANGED = 0.5
_SHAPE = "nome"  # of the field


@dataclass(frozen=True)
class Freed:
    """A minimum freed of what noise of the inputs does to it. problem: of which it is one; added: what the noise feigns
    of whitened residuals, None of others."""

    problem: Problem
    solution: LeastSquaresFit
    added: Feigned | None


def best_minimum(
    task: Task,
    problem: Problem,
    state: SearchState,
    solution: LeastSquaresFit,
    hooks: Hooks,
    freed: Freed | None = None,
) -> FitResult:
    """The result of a fit from its solution by plain least squares, on all data.

    state: the last one of the search; intervals hold the rivals that cost statistically the same; freed: the minimum
    near the solution, where that is known.
    """
    with ThreadPoolExecutor(1, "rival") as pool:
        # What noise does to the best one moves its rival little, unless residuals are whitened: both at once.
        white = task.settings.least_squares_steps > 0 and currents_in_common_push(problem, solution.point)
        beside = None if white or task.settings.jobs < 2 else pool.submit(_plain_rival, task, problem, solution)
        best = _found(task, problem, state, freed or freed_of_noise(task, problem, solution), hooks)
        if _is_plain(task, best):
            best = replace(best, result=with_plain(best.result, problem.space))
        told = any(e.name == _SHAPE and e.status == "fitted" for e in best.result.estimates)
        rival = None
        if white:
            rival = _white_rival(task, problem, best)
        elif told:
            rival = _plain_rival(task, problem, solution) if beside is None else beside.result()
    result = best.result if rival is None else _beside_rival(task, problem, state, best, rival, hooks)
    return with_twin(result, problem.space)


@dataclass(frozen=True)
class _Found:
    """A minimum: the problem of which it is one, its linearisation there, its result, and whether its residuals are
    whitened."""

    problem: Problem
    solution: LeastSquaresFit
    uncertainty: Uncertainty
    result: FitResult
    white: bool

    @cached_property
    def _squares(self) -> Array:
        """The weighted squares (G,) of the residuals by group."""
        return group_squares(self.problem, self.solution, self.solution.weights)

    def lead(self, problem: Problem, rival: LeastSquaresFit) -> float:
        """How much less this costs than a rival, in standard deviations; problem: that of the rival's residuals."""
        return advantage(self._squares, group_squares(problem, rival, self.solution.weights))

    def end_of_valley(self, rival: _Found) -> dict[str, float]:
        """SI values at the end of a rival's valley of shapes of the field that cost statistically what this one does,
        on the side where this one does not lie: a fit ends somewhere along a flat one."""
        side = 1.0 if rival.result.value(_SHAPE) > self.result.value(_SHAPE) else -1.0

        def behind(point: Array, offsets: Array) -> float:
            return self.lead(rival.problem, replace(rival.solution, point=point, offsets=offsets))

        end = valley_end(rival.problem, rival.solution, rival.uncertainty, _SHAPE, side, behind)
        return rival.problem.space.values(end)


def freed_of_noise(task: Task, problem: Problem, solution: LeastSquaresFit) -> Freed:
    """The minimum near a solution of plain least squares, freed of what noise of the inputs does to it."""
    settings, seed = task.settings, task.settings.search.seed
    own, added = problem, None
    if settings.least_squares_steps > 0 and currents_in_common_push(problem, solution.point):
        noisy = fit_under_noise(problem, solution, seed=seed, steps=settings.least_squares_steps)
        own, solution, added = noisy.problem, noisy.fit, noisy.feigned
    elif settings.least_squares_steps > 0:
        own, solution = fit_by_trust(problem, solution, final_ending(settings), seed=seed, jobs=settings.jobs)
    if settings.least_squares_steps > 0:
        solution = without_voltage_noise(own, simex_corrected(own, solution, seed=seed, jobs=settings.jobs))
    return Freed(own, solution, added)


def _found(task: Task, problem: Problem, state: SearchState, freed: Freed, hooks: Hooks) -> _Found:
    """A minimum with its intervals. problem: of plain least squares."""
    settings, seed = task.settings, task.settings.search.seed
    own, solution, added = freed.problem, freed.solution, freed.added
    uncertainty = estimate_uncertainty(own, solution, seed=seed, known=added, jobs=settings.jobs)
    profiles = _profiles(own, solution, uncertainty, settings, hooks)
    result = assemble(task, problem, state, solution, uncertainty)
    return _Found(own, solution, uncertainty, replace(result, profiles=profiles), added is not None)


def _is_plain(task: Task, best: _Found) -> bool:
    """Whether a shape of the field that seems to be told costs statistically what one costs that tells nothing.

    Towards wide magnets the last trace of the fifth harmonic goes, and with it the curvature that the interval is from.
    """
    told = any(e.name == _SHAPE and e.status == "fitted" for e in best.result.estimates)
    plain = on_the_plain(best.problem, best.solution) if told and task.settings.least_squares_steps else None
    if plain is None:
        return False
    held, point = plain
    start = replace(best.solution.start, point=point, damping=None)
    found = levenberg_marquardt(held, Cost(held), start, ending=final_ending(task.settings), final=False)
    return best.lead(held, found) < NORMAL_97_5


def _beside_rival(
    task: Task, problem: Problem, state: SearchState, best: _Found, solution: LeastSquaresFit, hooks: Hooks
) -> FitResult:
    """The result, and where another shape of the field costs statistically the same, what it shares with that.
    solution: of the rival, before it is freed of what noise of the inputs does to it."""
    if not best.white and best.lead(problem, solution) > NORMAL_97_5 + _CHANGED:
        return best.result
    freed = freed_of_noise(task, problem, replace(solution, history=best.solution.history))
    rival = _found(task, problem, state, freed, hooks)
    if float(np.max(np.abs(rival.solution.point - best.solution.point))) < APART:
        return best.result
    lead = best.lead(rival.problem, rival.solution)
    if lead > NORMAL_97_5:
        return best.result
    if lead < -NORMAL_97_5:
        return rival.result
    return shared(best.result, rival.result, problem.space, [best.end_of_valley(rival)])


def _plain_rival(task: Task, problem: Problem, best: LeastSquaresFit) -> LeastSquaresFit | None:
    """The solution by plain least squares with another shape of the field than the best one's; None without such."""
    settled = _settled(task, problem, best)
    if settled is None:
        return None
    point = _with_shape(problem, settled.fit.point, settled.shape)
    start = replace(best.start, point=point, damping=None)
    ending = coarse_ending(task.settings)  # what `_found` brings to its end, if it comes to that
    return levenberg_marquardt(problem, Cost(problem), start, ending=ending, final=False)


def _white_rival(task: Task, problem: Problem, best: _Found) -> LeastSquaresFit | None:
    """Where another shape of the field begins, where the best one's residuals are whitened; None without such.

    All else is fitted under the same whitening: from where plain least squares leave it a free shape may run back to
    the best one's.
    """
    settled = _settled(task, problem, best.solution)
    if settled is None:
        return None
    settings = task.settings
    seed, steps = settings.search.seed, settings.least_squares_steps
    found = fit_under_noise(settled.problem, settled.fit, seed=seed, steps=steps).fit
    return replace(best.solution, point=_with_shape(problem, found.point, settled.shape))


class _Settled(NamedTuple):
    """All but the field's shape fitted by plain least squares. problem: which holds the shape; shape: its search
    coordinate."""

    problem: Problem
    fit: LeastSquaresFit
    shape: float


def _settled(task: Task, problem: Problem, best: LeastSquaresFit) -> _Settled | None:
    """All else fitted to another shape of the field than the best one's; None where there is none, or where the
    back-EMF tells the shape."""
    space = problem.space
    shaped = None if space.model.winding else other_shape(space, best.point)
    if shaped is None or task.settings.least_squares_steps == 0:
        return None
    column = space.names.index(_SHAPE)
    held = Problem(space.holding({_SHAPE: space.values(shaped)[_SHAPE]}), problem.parts)
    start, ending = replace(best.start, point=np.delete(shaped, column), damping=None), coarse_ending(task.settings)
    found = levenberg_marquardt(held, Cost(held), start, ending=ending, final=False)
    return _Settled(held, found, float(shaped[column]))


def _with_shape(problem: Problem, point: Array, shape: float) -> Array:
    """Search coordinates (p,) of all parameters, given those without the shape (p - 1,) and the shape's."""
    return np.insert(point, problem.space.names.index(_SHAPE), shape)


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
