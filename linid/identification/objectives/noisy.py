"""Objectives asked again with noise added to the logged inputs, several draws at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from itertools import islice
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Integers
from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.free_run import FreeRun
from linid.identification.objectives.objective import Part
from linid.identification.objectives.problem import Problem
from linid.identification.signals.motion import input_levels, input_noise, with_inputs_moved
from linid.parallel_tasks import in_parallel
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs

Parts = tuple[Part, ...]
Draw = Sequence[Sequence[Recording]]  # the recordings of each part
Answer = TypeVar("Answer")
# Residuals, above which draws take turns: each holds packed inputs of its own, some ten times as many numbers.
_LONG = 500_000


@dataclass(frozen=True)
class Driven:
    """What of a problem noise of the inputs reaches. problem: of the parts with driven recordings; places: of these
    among all; rows: (N,) which residuals are theirs; columns: (q,) their unknowns among all search coordinates and
    offsets.
    """

    problem: Problem
    places: tuple[int, ...]
    rows: NDArray[np.bool_]
    columns: Integers


def driven(problem: Problem) -> Driven:
    """The parts of a problem that noise of the inputs reaches: free wheels have none."""
    places = tuple(k for k, part in enumerate(problem.parts) if any(r.kind != "free_wheel" for r in part.recordings))
    p, at = len(problem.space.parameters), len(problem.space.parameters)
    rows, columns = [], [np.arange(p)]
    for k, part in enumerate(problem.parts):
        rows.append(np.full(part.classes.size, k in places))
        if k in places:
            columns.append(np.arange(at, at + part.nuisances))
        at += part.nuisances
    parts = tuple(problem.parts[k] for k in places)
    return Driven(replace(problem, parts=parts), places, np.concatenate(rows), np.concatenate(columns))


def answers_under_noise(
    parts: Parts, draws: Iterator[Draw], ask: Callable[[Parts], Answer], jobs: int
) -> Iterator[Answer]:
    """ask(parts) of the objectives over their recordings with noise in the inputs, in order; what it is given is let go
    of before the next.

    jobs: threads.
    """

    def one(draw: Draw, _: int) -> Answer:
        return ask(tuple(under_noise(part, recordings) for part, recordings in zip(parts, draw, strict=True)))

    at_once = 1 if sum(part.classes.size for part in parts) > _LONG else jobs
    while drawn := list(islice(draws, at_once)):
        yield from (answer for _, answer in in_parallel(one, drawn, jobs))


def under_noise(part: Part, recordings: Sequence[Recording]) -> Part:
    """The objective over its own recordings with noise added to their inputs: only these are packed anew."""
    if all(one is other for one, other in zip(part.recordings, recordings, strict=True)):
        return part
    if isinstance(part, Ahead | FreeRun):  # whose inputs only the simulation takes
        moved = copy(part)
        moved.recordings = tuple(recordings)
        moved.simulator = replace(part.simulator, inputs=pack_inputs(recordings))
        return moved
    return replace(part, recordings=tuple(recordings))  # type: ignore[type-var]


def opposite_draws(parts: Parts, pairs: int, generator: np.random.Generator) -> Iterator[Draw]:
    """Recordings with noise added to their inputs, and with the same noise taken off, in turn."""
    levels = {r.name: input_levels(r) for part in parts for r in part.recordings}
    for _ in range(pairs):
        noise = {r.name: input_noise(r, generator, levels[r.name]) for part in parts for r in part.recordings}
        for sign in (1.0, -1.0):
            yield [[with_inputs_moved(r, sign * noise[r.name]) for r in part.recordings] for part in parts]
