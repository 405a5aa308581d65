"""A fit's optimisation in stages: first candidates refined, the global search, least squares on part and all of the
data."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.acceleration import Acceleration
from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.from_scratch import search_from_scratch
from linid.identification.optimise.genetic import search
from linid.identification.optimise.irls import reweighted_least_squares
from linid.identification.optimise.least_squares import LeastSquaresFit, levenberg_marquardt
from linid.identification.optimise.search_state import SearchState
from linid.identification.result import Generation
from linid.identification.settings import PLAIN, SCRATCH, Ending, FitSettings, Hooks
from linid.identification.uncertainty.identifiability import without_effect
from linid.parallel_tasks import in_parallel
from linid.recording.recording import Recording

_PART_PRECISION, _PART_VALLEY_GAIN = 0.3, 1.2  # of the least squares that others go on from
_VALLEY_GAIN = 0.15
# Minima are rivals if they lie so far apart in the search box, and cost at most so many times the best.
APART, ALIKE = 0.02, 1.1


def search_from(
    problem: Problem, thinned: Problem, starts: Array, others: Array, settings: FitSettings, hooks: Hooks
) -> tuple[SearchState, str, tuple[str, ...]]:
    """The global search; returns its last state, why it stopped, and the names of parameters without effect.

    thinned: the problem of which the least squares go on; starts: (S, p) are refined first: what is left to the search
    is to look for other minima; others: (T, p) as they are. The plain genetic algorithm knows none of them.
    """
    cost = Cost(problem)
    silent = without_effect(problem.space, cost, starts[0])
    seeds = np.vstack([starts, others])
    alike: list[LeastSquaresFit] = []
    if settings.search.method == PLAIN:
        seeds = np.empty((0, seeds.shape[1]))
    elif hooks.resume is None:

        def told(done: int, value: float) -> None:
            if hooks.progress is not None:
                hooks.progress("first candidates", done, starts.shape[0], value)

        ahead = predicts(thinned)
        refined = refine_first_candidates(thinned if ahead else problem, cost, starts, settings.jobs, told)
        seeds = np.vstack([*(found.point for found in refined), seeds])
        least = min(found.cost for found in refined)
        alike = [found for found in refined if found.cost <= ALIKE * least]
        if not ahead:
            alike = [replace(found, offsets=np.empty(0), converged=False) for found in alike]

    def watch(state: SearchState) -> None:
        if hooks.save is not None:
            hooks.save(state)
        if hooks.progress is not None:
            hooks.progress(state.method, state.generation, settings.search.generations, state.best_cost)

    state, reason = search(
        cost,
        seeds,
        len(problem.space.parameters),
        settings.search,
        starts=alike,
        spent=cost.evaluations,
        resume=hooks.resume,
        watch=watch,
    )
    return state, reason, silent


def predicts(problem: Problem) -> bool:
    """Whether windows of driven runs are predicted: least squares then begin on what they go on with, the thinned
    problem. Free wheels alone are far off at first, and their start states better taken out linearly."""
    return any(isinstance(part, Ahead) for part in problem.parts)


def search_at_random(
    problem: Problem, recordings: Sequence[Recording], settings: FitSettings, hooks: Hooks
) -> tuple[SearchState, str, tuple[str, ...]]:
    """The search from scratch, as `search_from` gives it: no first candidates, no state to go on from."""
    found = search_from_scratch(problem, recordings, settings.search.seed, hooks.progress)
    history = [[float(g.generation), float(g.evaluations), g.best, g.median] for g in found.history]
    best = [float(x) for x in found.point]
    state = SearchState(
        SCRATCH, len(history), [best], [found.cost], best, found.cost, 0, found.evaluations, None, history=history
    )
    reason = f"{SCRATCH}: {len(history)} candidates polished (cost {found.cost:.4g})"
    return state, reason, without_effect(problem.space, Cost(problem), found.point)


def final_ending(settings: FitSettings) -> Ending:
    """When least squares on all data end."""
    return Ending(settings.least_squares_steps, settings.least_squares_precision, _VALLEY_GAIN)


def coarse_ending(settings: FitSettings) -> Ending:
    """When least squares end that others go on from."""
    return Ending(
        settings.least_squares_steps, max(settings.least_squares_precision, _PART_PRECISION), _PART_VALLEY_GAIN
    )


def refine_first_candidates(
    problem: Problem, cost: Cost, starts: Array, jobs: int = 1, watch: Callable[[int, float], None] | None = None
) -> list[LeastSquaresFit]:
    """Start candidates, starts (S, p), each refined, several at once.

    cost: counts the evaluations; watch: called with number and cost.
    """
    ending = Ending(20, _PART_PRECISION, _PART_VALLEY_GAIN)
    refined = []
    for found in _side_by_side(problem, cost, [_Start(row) for row in starts], jobs, ending=ending, final=False):
        refined.append(found)
        if watch is not None:
            watch(len(refined), found.cost)
    return refined


@dataclass(frozen=True)
class _Start:
    """Where least squares begin: search coordinates (p,), start offsets (k,), None: the measured ones, and whether
    they have ended there before."""

    point: Array
    offsets: Array | None = None
    settled: bool = False


def _side_by_side(
    problem: Problem, cost: Cost, starts: Sequence[_Start], jobs: int, *, ending: Ending, **options: Any
) -> Iterator[LeastSquaresFit]:
    """Least squares from each of several starts, as of `levenberg_marquardt`; cost: counts the evaluations of all."""
    begun = cost.evaluations

    def one(start: _Start, _: int) -> LeastSquaresFit:
        own = Cost(problem)  # which counts for itself: whatever the order, the numbers are the same
        own.evaluations = begun
        until = replace(ending, steps=0) if start.settled else ending
        return levenberg_marquardt(problem, own, start.point, start.offsets, ending=until, **options)

    for _, found in in_parallel(one, list(starts), jobs):
        cost.evaluations += found.evaluations - begun
        yield found


def _rivals(state: SearchState, best: Array) -> list[_Start]:
    """Where least squares begin after the search: the best candidate (p,), unless that lies by a first candidate that
    they have been at already, and those of the first candidates that lie apart from each other."""
    starts: list[_Start] = []
    for row, offsets, settled in zip(state.starts, state.start_offsets, state.settled, strict=True):
        start = _Start(np.array(row), np.array(offsets) if offsets else None, settled)
        if start.offsets is not None or not any(_near(start.point, other.point) for other in starts):
            starts.append(start)
    beside = [start for start in starts if _near(start.point, best)]
    if any(start.offsets is not None for start in beside):
        return starts
    return [_Start(best), *(start for start in starts if not _near(start.point, best))]


def _near(one: Array, two: Array) -> bool:
    """Whether search coordinates (p,) are of one minimum."""
    return float(np.max(np.abs(one - two))) <= APART


def least_squares_in_stages(
    stages: Sequence[Problem], state: SearchState, settings: FitSettings, hooks: Hooks
) -> LeastSquaresFit:
    """Least squares from the best candidate on the thinned problem first, then on all data.

    Rivals that the search could hardly tell apart are compared on the thinned problem. Without steps the best
    candidate stays as it is. Where windows are predicted, those that weigh the windows (`fit_by_trust`) bring it to its
    end.
    """
    evaluations = state.evaluations
    best = np.array(state.best)
    if settings.least_squares_steps == 0:
        stages = stages[-1:]
    elif all(isinstance(part, Acceleration) for part in stages[-1].parts):
        cost = Cost(stages[-1])
        best = reweighted_least_squares(cost, best, iterations=10, evaluations=15, tolerance=1e-6)
        evaluations += cost.evaluations
    starts = _rivals(state, best) if len(stages) > 1 else [_Start(best)]
    total = settings.least_squares_steps * len(stages)
    history: tuple[Generation, ...] = ()
    for number, problem in enumerate(stages):
        cost = Cost(problem)
        cost.evaluations = evaluations

        def watch(done: int, value: float, before: int = number * settings.least_squares_steps) -> None:
            if hooks.progress is not None:
                hooks.progress("least squares", before + done, total, value)

        last = number == len(stages) - 1
        to_the_end = last and not (settings.least_squares_steps and predicts(problem))
        ending = final_ending(settings) if to_the_end else coarse_ending(settings)
        alone = watch if len(starts) == 1 else None  # several would tell of themselves at once
        found = _side_by_side(problem, cost, starts, settings.jobs, ending=ending, watch=alone, final=to_the_end)
        solution = min(found, key=lambda result: result.cost)
        evaluations = cost.evaluations
        starts = [_Start(solution.point, solution.offsets)]
        # The thinned problem has a cost of its own, which must not be read against the next.
        stage = "least_squares" if last else "least_squares of a part"
        history += tuple(replace(row, stage=stage) for row in solution.history)
    return replace(solution, history=history)
