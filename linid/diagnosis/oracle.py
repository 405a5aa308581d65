"""What a diagnosis that knew the effects would reach: the yardstick for the one that does not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from linid.diagnosis.base import fit_base_model, numbered
from linid.diagnosis.held_out_tests import Part
from linid.diagnosis.means import Means
from linid.diagnosis.screen import Screening
from linid.diagnosis.select import fit_effects, part_of
from linid.diagnosis.shares import Shares, shares_of
from linid.identification.result import ModelKind
from linid.recording.recording import Recording


@dataclass(frozen=True)
class Oracle:
    """A model with the true effects: the shares of the gap that they close, and what each one's absence costs."""

    shares: Shares
    parts: tuple[Part, ...]


def oracle(
    recordings: Sequence[Recording],
    kind: ModelKind,
    effects: Sequence[str],
    known: dict[str, float],
    *,
    jobs: int = 1,
    seed: int = 1,
) -> Oracle | None:
    """The base model with exactly these effects, fitted and judged like any other; None if one makes no sense here.

    recordings: both splits; known: SI values that are not identified.
    """
    recordings = numbered(recordings)
    base = fit_base_model(recordings, kind, known, Means(jobs, seed=seed), [])
    screening = Screening(base.judge.fits, base.fitted, jobs)
    found = fit_effects(base, screening, effects)
    if found is None:
        return None
    parts = tuple(part_of(base.judge, base.fitted, found, name, jobs) for name in found.model.effects)
    return Oracle(shares_of(base.judge, base.fitted, found, seed), parts)
