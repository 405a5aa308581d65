"""A fit's optimisation in stages: first candidates refined, the global search, least squares on part and all of the
data."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.acceleration import Acceleration
from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.from_scratch import search_from_scratch
from linid.identification.optimise.genetic import search
from linid.identification.optimise.irls import reweighted_least_squares
from linid.identification.optimise.least_squares import FIRST_DAMPING, LeastSquaresFit, Start, levenberg_marquardt
from linid.identification.optimise.search_state import SearchState
from linid.identification.result import Generation
from linid.identification.settings import PLAIN, SCRATCH, Ending, FitSettings, Hooks
from linid.identification.uncertainty.identifiability import without_effect
from linid.parallel_tasks import in_parallel
from linid.recording.recording import Recording

_PART_PRECISION, _PART_VALLEY_GAIN = 0.3, 1.2  # of the least squares that others go on from
_VALLEY_GAIN = 0.15
# Of least squares on first candidates: on the problem of the search near their minima, on the thinned problem only as
# far as tells valleys apart: along one, all data lead on. There each window counts for four.
_NEAR = Ending(20, _PART_PRECISION, _PART_VALLEY_GAIN)
_FIRST = replace(_NEAR, precision=12.0, valley_gain=40.0)
# Minima are rivals if they lie so far apart in the search box, and cost at most so many times the best.
APART, ALIKE = 0.02, 1.1


def search_from(
    problem: Problem, thinned: Problem | None, starts: Array, others: Array, settings: FitSettings, hooks: Hooks
) -> tuple[SearchState, str, tuple[str, ...]]:
    """The global search; returns its last state, why it stopped, and the names of parameters without effect.

    starts: (S, p) are refined first, on the thinned problem of which the least squares go on or, where that is None, on
    that of the search: what is left to this is to look for other minima; others: (T, p) as they are. The plain genetic
    algorithm knows none of them.
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

        own, ending = (problem, _NEAR) if thinned is None else (thinned, _FIRST)
        refined = refine_first_candidates(own, cost, starts, settings.jobs, told, ending)
        seeds = np.vstack([*(found.point for found in refined), seeds])
        least = min(found.cost for found in refined)
        alike = [found for found in refined if found.cost <= ALIKE * least]
        if thinned is None:
            alike = [replace(found, offsets=np.empty(0)) for found in alike]

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
    """Whether windows of driven runs are predicted, which are weighed at the end (`fit_by_trust`)."""
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
    problem: Problem,
    cost: Cost,
    starts: Array,
    jobs: int = 1,
    watch: Callable[[int, float], None] | None = None,
    ending: Ending = _NEAR,
) -> list[LeastSquaresFit]:
    """Start candidates, starts (S, p), each refined, several at once.

    cost: counts the evaluations; watch: called with number and cost; ending: of each.
    """
    refined = []
    for found in _side_by_side(problem, cost, [Start(row) for row in starts], jobs, ending=ending, final=False):
        refined.append(found)
        if watch is not None:
            watch(len(refined), found.cost)
    return refined


def _side_by_side(
    problem: Problem, cost: Cost, starts: Sequence[Start], jobs: int, **options: Any
) -> Iterator[LeastSquaresFit]:
    """Least squares from each of several starts, as of `levenberg_marquardt`; cost: counts the evaluations of all."""
    begun = cost.evaluations

    def one(start: Start, _: int) -> LeastSquaresFit:
        own = Cost(problem)  # which counts for itself: whatever the order, the numbers are the same
        own.evaluations = begun
        return levenberg_marquardt(problem, own, start, **options)

    for _, found in in_parallel(one, list(starts), jobs):
        cost.evaluations += found.evaluations - begun
        yield found


def _rivals(state: SearchState, best: Array) -> list[Start]:
    """Where least squares begin after the search: the best candidate (p,), unless that lies by a first candidate that
    they have been at already, and those of the first candidates that lie apart from each other."""
    starts: list[Start] = []
    for row, offsets in zip(state.starts, state.start_offsets, strict=True):
        start = Start(np.array(row), np.array(offsets) if offsets else None)
        if start.offsets is not None or not any(_near(start.point, other.point) for other in starts):
            starts.append(start)
    beside = [start for start in starts if _near(start.point, best)]
    if any(start.offsets is not None for start in beside):
        return starts
    return [Start(best), *(start for start in starts if not _near(start.point, best))]


def _near(one: Array, two: Array) -> bool:
    """Whether search coordinates (p,) are of one minimum."""
    return float(np.max(np.abs(one - two))) <= APART


def least_squares_in_stages(
    stages: Sequence[Problem], state: SearchState, settings: FitSettings, hooks: Hooks
) -> LeastSquaresFit:
    """Least squares on all data, the last of one or two stages, from the best candidate.

    Candidates that least squares have not been at begin on the thinned problem, the first of two stages; which one is
    the best shows on all data. Without steps the best candidate stays as it is. Where windows are predicted, those that
    weigh them (`fit_by_trust`) bring it to its end.
    """
    problem, steps = stages[-1], settings.least_squares_steps
    spent = Cost(problem)
    spent.evaluations = state.evaluations
    best = np.array(state.best)
    if steps and all(isinstance(part, Acceleration) for part in problem.parts):
        best = reweighted_least_squares(spent, best, iterations=10, evaluations=15, tolerance=1e-6)

    def watching(begun: int) -> Callable[[int, float], None]:
        def watch(done: int, value: float) -> None:
            if hooks.progress is not None:
                hooks.progress("least squares", begun + done, steps * len(stages), value)

        return watch

    start = Start(best, damping=FIRST_DAMPING)
    history: tuple[Generation, ...] = ()
    if steps and len(stages) > 1:
        start, history = _best_start(stages[0], problem, spent, _rivals(state, best), settings, watching(0))
    to_the_end = not (steps and predicts(problem))
    solution = levenberg_marquardt(
        problem,
        spent,
        start,
        ending=final_ending(settings) if to_the_end else coarse_ending(settings),
        final=to_the_end,
        keep=not to_the_end,
        watch=watching(steps * (len(stages) - 1)),
    )
    # The thinned problem has a cost of its own, which must not be read against the next.
    return replace(solution, history=history + _named("least_squares", solution))


def _best_start(
    thinned: Problem,
    problem: Problem,
    spent: Cost,
    starts: Sequence[Start],
    settings: FitSettings,
    watch: Callable[[int, float], None],
) -> tuple[Start, tuple[Generation, ...]]:
    """The start that costs least on all data (`problem`), once least squares have been at each on the thinned problem,
    and its history there. spent: counts the evaluations."""
    fresh = [start for start in starts if start.offsets is None]
    cost = Cost(thinned)
    ending = coarse_ending(settings)
    if len(fresh) < len(starts):  # beside those that they have been at, as far as tells valleys apart
        ending = replace(_FIRST, steps=min(_FIRST.steps, ending.steps))
    found = list(
        _side_by_side(
            thinned,
            cost,
            fresh,
            settings.jobs,
            ending=ending,
            watch=watch if len(fresh) == 1 else None,  # several would tell of themselves at once
            final=False,
        )
    )
    spent.evaluations += cost.evaluations
    ready: list[tuple[Start, tuple[Generation, ...]]] = [(start, ()) for start in starts if start.offsets is not None]
    ready += [(one.start, _named("least_squares of a part", one)) for one in found]
    if len(ready) == 1:
        return ready[0]

    def of_all(start: Start) -> float:
        spent.evaluations += 1
        assert start.offsets is not None
        return float(spent.of_residuals(problem.residuals(start.point[None], start.offsets[None]))[0])

    return min(ready, key=lambda one: of_all(one[0]))


def _named(stage: str, found: LeastSquaresFit) -> tuple[Generation, ...]:
    """A fit's history under the name of a stage."""
    return tuple(replace(row, stage=stage) for row in found.history)
