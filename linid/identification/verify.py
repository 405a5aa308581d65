"""Whether an independent search from random candidates finds the minimum of a fit again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from linid.identification.objectives.choose import coarse_parts
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.from_scratch import Goal, free_wheel_parts, polished_to_the_end, search_from_scratch
from linid.identification.result import FitResult
from linid.identification.settings import FitSettings, Hooks
from linid.identification.space.scratch import scratch_space
from linid.identification.space.search_space import SearchSpace
from linid.recording.recording import Recording

_SAME = 0.01  # relative difference of costs: less is the same minimum
_CANDIDATES = 20_000  # at most, twice those of a whole search from scratch


def verified(
    result: FitResult, space: SearchSpace, recordings: Sequence[Recording], settings: FitSettings, hooks: Hooks
) -> FitResult:
    """The fit with a line on whether a search from scratch, on the coarse look at the data, ends at its minimum.

    space: of the fit, whose result is brought to its nearest minimum on that look first. A lower one is a warning too.
    """
    if space.model.effects:
        return replace(result, search_check="Not verified: a search from scratch knows no effects.")
    parts = coarse_parts(space.model, recordings, settings)
    own = Problem(space, parts)
    start = space.encode({e.name: e.value for e in result.estimates})
    cost = Cost(own)
    settled = polished_to_the_end(own, cost, start)
    reached = min(float(cost(start)[0]), settled.cost)
    wheels = free_wheel_parts(own)
    of_wheels = float(Cost(Problem(space, wheels))(settled.point)[0]) if wheels else 0.0
    seed = settings.search.seed + 1
    problem = Problem(scratch_space(space.model, recordings, space.fixed, settings), parts)
    goal = Goal((1.0 + _SAME) * reached, (1.0 + _SAME) * of_wheels, _CANDIDATES)
    found = search_from_scratch(problem, recordings, seed, hooks.progress, goal)
    ratio = found.cost / reached
    who = f"an independent search from random candidates (seed {seed})"
    if ratio < 1.0 - _SAME:
        text = f"{who} found a lower minimum, at {ratio:.3g} times this fit's cost: fit with --method scratch"
        return replace(result, search_check=_sentence(text), warnings=(*result.warnings, text))
    if ratio > 1.0 + _SAME:
        return replace(result, search_check=_sentence(f"{who} ended higher, at {ratio:.3g} times this fit's cost"))
    return replace(result, search_check=_sentence(f"{who} found the same minimum, at {ratio:.4f} times the cost"))


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:] + "."
