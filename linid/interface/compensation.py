"""The feed-forward that `linid export --to twincat` writes, as the diagnosis judges it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from linid.diagnosis.compensation import FeedForward
    from linid.diagnosis.diagnose import Found
    from linid.identification.result import FitResult
    from linid.recording import Recording
    from linid.simulation.controller import Controller


def exported_feed_forward(recordings: Sequence[Recording]) -> FeedForward:
    """The function block of TwinCAT. recordings: whose stroke its tables span, as in `linid export`."""
    from linid.diagnosis.compensation import FeedForward
    from linid.export.target import Exported
    from linid.export.targets.twincat.along import feed_forward_along
    from linid.export.targets.twincat.form import kept

    def of(result: FitResult) -> Exported:
        return Exported(result, "axis", recordings=tuple(recordings))

    return FeedForward(lambda result, y, v, a: feed_forward_along(of(result), y, v, a)[1], lambda one: kept(of(one)))


def compensated(found: Found, recordings: Sequence[Recording], controller: Controller | None, jobs: int = 1) -> Found:
    """What was found, with what its effects cost and a feed-forward saves. jobs: threads, never change a result."""
    from linid.diagnosis.compensation import compensation

    told = compensation(
        found.before,
        found.after,
        recordings,
        exported_feed_forward(recordings),
        controller,
        seed=found.diagnosis.seed,
        jobs=jobs,
    )
    return replace(found, diagnosis=replace(found.diagnosis, compensation=told))
