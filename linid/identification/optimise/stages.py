"""A fit's optimisation in stages: first candidates refined, the global search, least squares on part and all of the
data."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.acceleration import Acceleration
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
    problem: Problem, starts: Array, others: Array, settings: FitSettings, hooks: Hooks
) -> tuple[SearchState, str, tuple[str, ...]]:
    """The global search; returns its last state, why it stopped, and the names of parameters without effect.

    starts: (S, p) are refined first: what is left to the search is to look for other minima; others: (T, p) as they
    are. The plain genetic algorithm knows none of them.
    """
    cost = Cost(problem)
    silent = without_effect(problem.space, cost, starts[0])
    seeds = np.vstack([starts, others])
    solution = None
    if settings.search.method == PLAIN:
        seeds = np.empty((0, seeds.shape[1]))
    elif hooks.resume is None:

        def told(done: int, value: float) -> None:
            if hooks.progress is not None:
                hooks.progress("first candidates", done, starts.shape[0], value)

        solution = refine_first_candidates(problem, cost, starts, settings.jobs, told)
        seeds = np.vstack([solution, seeds])
        values = cost(solution)
        solution = solution[values <= ALIKE * np.min(values)]

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
        starts=solution,
        spent=cost.evaluations,
        resume=hooks.resume,
        watch=watch,
    )
    return state, reason, silent


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
) -> Array:
    """Start candidates, starts (S, p), each refined on the problem of the search, (S, p), several at once.

    watch: called with number and cost.
    """
    ending = Ending(20, _PART_PRECISION, _PART_VALLEY_GAIN)
    points = []
    for found in _side_by_side(problem, cost, starts, jobs, ending=ending, final=False):
        points.append(found.point)
        if watch is not None:
            watch(len(points), found.cost)
    return np.array(points)


def _side_by_side(
    problem: Problem, cost: Cost, points: Sequence[Array] | Array, jobs: int, **options: Any
) -> Iterator[LeastSquaresFit]:
    """Least squares from each of several points, as of `levenberg_marquardt`; cost: counts the evaluations of all."""
    begun = cost.evaluations

    def one(point: Array, _: int) -> LeastSquaresFit:
        own = Cost(problem)  # which counts for itself: whatever the order, the numbers are the same
        own.evaluations = begun
        return levenberg_marquardt(problem, own, point, **options)

    for _, found in in_parallel(one, list(points), jobs):
        cost.evaluations += found.evaluations - begun
        yield found


def least_squares_in_stages(
    stages: Sequence[Problem], state: SearchState, settings: FitSettings, hooks: Hooks
) -> LeastSquaresFit:
    """Least squares from the best candidate on the thinned problem first, then on all data.

    Rivals that the coarse look could hardly tell apart are compared on the thinned problem. Without steps the best
    candidate stays as it is.
    """
    point = np.array(state.best)
    evaluations = state.evaluations
    if settings.least_squares_steps == 0:
        stages = stages[-1:]
    elif all(isinstance(part, Acceleration) for part in stages[-1].parts):
        cost = Cost(stages[-1])
        point = reweighted_least_squares(cost, point, iterations=10, evaluations=15, tolerance=1e-6)
        evaluations += cost.evaluations
    offsets = None
    total = settings.least_squares_steps * len(stages)
    history: tuple[Generation, ...] = ()
    for number, problem in enumerate(stages):
        cost = Cost(problem)
        cost.evaluations = evaluations

        def watch(done: int, value: float, before: int = number * settings.least_squares_steps) -> None:
            if hooks.progress is not None:
                hooks.progress("least squares", before + done, total, value)

        last = number == len(stages) - 1
        ending = final_ending(settings) if last else coarse_ending(settings)
        rivals = [point]
        if number == 0 and not last:
            rivals += [x for x in map(np.array, state.starts) if np.max(np.abs(x - point)) > APART]
        alone = watch if len(rivals) == 1 else None  # several would tell of themselves at once
        found = _side_by_side(
            problem, cost, rivals, settings.jobs, offsets=offsets, ending=ending, watch=alone, final=last
        )
        solution = min(found, key=lambda result: result.cost)
        evaluations = cost.evaluations
        point, offsets = solution.point, solution.offsets
        # The thinned problem has a cost of its own, which must not be read against the next.
        stage = "least_squares" if last else "least_squares of a part"
        history += tuple(replace(row, stage=stage) for row in solution.history)
    return replace(solution, history=history)
