"""Objectives asked again with noise added to the logged inputs, several draws at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from linid.identification.objectives.objective import Part
from linid.identification.signals.motion import input_noise, with_inputs_moved
from linid.parallel_tasks import in_parallel
from linid.recording.recording import Recording

Parts = tuple[Part, ...]
Draw = Sequence[Sequence[Recording]]  # the recordings of each part
Answer = TypeVar("Answer")
# Residuals, above which draws take turns: each holds packed inputs of its own, some ten times as many numbers.
_LONG = 500_000


def answers_under_noise(
    parts: Parts, draws: Iterable[Draw], ask: Callable[[Parts], Answer], jobs: int
) -> Iterator[Answer]:
    """ask(parts) of the objectives over other recordings, in order; what it is given is let go of before the next.

    jobs: threads.
    """

    def one(draw: Draw, _: int) -> Answer:
        moved = zip(parts, draw, strict=True)
        return ask(tuple(replace(part, recordings=tuple(recordings)) for part, recordings in moved))  # type: ignore[type-var]

    if sum(part.classes.size for part in parts) > _LONG:
        yield from (one(draw, jobs) for draw in draws)
        return
    for _, answer in in_parallel(one, list(draws), jobs):
        yield answer


def opposite_draws(parts: Parts, pairs: int, generator: np.random.Generator) -> Iterator[Draw]:
    """Recordings with noise added to their inputs, and with the same noise taken off, in turn."""
    for _ in range(pairs):
        noise = {r.name: input_noise(r, generator) for part in parts for r in part.recordings}
        for sign in (1.0, -1.0):
            yield [[with_inputs_moved(r, sign * noise[r.name]) for r in part.recordings] for part in parts]


def same_rows(parts: Parts, others: Parts) -> bool:
    """Whether both have the same residuals: noise may pass for a jump, which leaves some out."""
    return all(one.classes.size == two.classes.size for one, two in zip(parts, others, strict=True))
