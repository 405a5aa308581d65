"""Effects of a fitted model, each with what its absence costs on held-out rows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from linid.diagnosis.held_out_tests import Part, is_trifle, stands
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge, compare
from linid.diagnosis.shares import shares_of
from linid.diagnosis.steps_of_selection import foretold_without, without_effect
from linid.parallel_tasks import in_parallel
from linid.physics.effects.registry import find_effect


def part_of(judge: Judge, base: Fitted, full: Fitted, name: str, jobs: int) -> Part:
    """An effect of a model with what its absence costs on the rows that can tell."""
    del jobs
    return _part(judge, base, full, name, without_effect(judge.fits, full, name))


def _part(judge: Judge, base: Fitted, full: Fitted, name: str, without: Fitted) -> Part:
    rows = judged(judge, full, name)
    evidence = compare(judge.fits, without, full, rows)
    whole = compare(judge.fits, base, full, rows)
    share = evidence.power / max(whole.power, abs(evidence.power), 1e-300)
    return Part(name, evidence, without, share, evidence.gain / max(whole.gain, abs(evidence.gain), 1e-300))


def judged(judge: Judge, full: Fitted, name: str) -> NDArray[np.bool_]:
    """The rows (n,) on which an effect of a model is tested: a moment shows in its own recordings or nowhere."""
    values = {**full.values, **full.preset}
    if find_effect(name).acts == "one":
        return judge.rows_of(name, values)
    return judge.rows(full.model.effects, values)


def weakest(judge: Judge, base: Fitted, full: Fitted, added: Sequence[str], jobs: int) -> Part | None:
    """The weakest effect of a model of those that fail the tests even by what slopes foretell, if it does fail."""
    foretold = in_parallel(lambda name, _: foretold_without(judge.fits, full, name), added, jobs)
    parts = [_part(judge, base, full, name, without) for name, without in foretold]
    for weak in sorted((p for p in parts if not stands(p)), key=lambda p: p.without.level):
        part = part_of(judge, base, full, weak.name, 1)
        if not stands(part):
            return part
    return None


def trifling(judge: Judge, base: Fitted, full: Fitted, parts: Sequence[Part]) -> list[Part]:
    """The effects of a model that stand the tests and take next to nothing of the gap."""
    if len(parts) < 2:  # alone, it is all there is
        return []
    portions = shares_of(judge, base, full, judge.seed).portions
    return [part for part in parts if is_trifle(part, portions[part.name].share)]
