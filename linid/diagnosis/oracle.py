"""What a diagnosis that knew the effects would reach: the yardstick for the one that does not."""

from __future__ import annotations

from collections.abc import Sequence

from linid.diagnosis.alone import PER_RECORDING
from linid.diagnosis.base import fit_base_model, numbered
from linid.diagnosis.confirm import fit_together
from linid.diagnosis.screen import Screening
from linid.diagnosis.select import Confirmed, judged, scales_between
from linid.identification.result import ModelKind
from linid.recording.recording import Recording


def oracle(
    recordings: Sequence[Recording], kind: ModelKind, effects: Sequence[str], known: dict[str, float],
    *, jobs: int = 1, seed: int = 1,
) -> Confirmed | None:  # fmt: skip
    """The base model with exactly these effects, fitted and judged like any candidate; None if one makes no sense here.

    recordings: both splits; known: SI values that are not identified.
    """
    recordings = numbered(recordings)
    base, judge = fit_base_model(recordings, kind, known, jobs, seed, [], lambda stage, done, total: None)
    screening = Screening(base, recordings, known, jobs)
    found = {s.name: s.trial for s in screening.screen(base, scales_between(judge, base), only=effects)}
    if set(found) != set(effects):
        return None
    alone = any(name in PER_RECORDING for name in effects)
    chosen = [r for r in recordings if alone or r.split == "fit"]
    together = fit_together(judge.balance, base, [(name, found[name]) for name in effects], known, chosen, jobs)
    return judged(judge, base, together, 0.0)
