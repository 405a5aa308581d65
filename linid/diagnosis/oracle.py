"""What a diagnosis that knew the effects would reach: the yardstick for the one that does not."""

from __future__ import annotations

from collections.abc import Sequence

from linid.diagnosis.base import fit_base_model, numbered
from linid.diagnosis.screen import Screening
from linid.diagnosis.select import Confirmed, fit_effects, judged
from linid.identification.result import ModelKind
from linid.recording.recording import Recording


def oracle(
    recordings: Sequence[Recording], kind: ModelKind, effects: Sequence[str], known: dict[str, float],
    *, jobs: int = 1, seed: int = 1,
) -> tuple[Confirmed, dict[str, float]] | None:  # fmt: skip
    """The base model with exactly these effects, fitted and judged like any candidate; None if one makes no sense here.

    recordings: both splits; known: SI values that are not identified. Also returned: per effect the closure of what the
    others leave (of a single one: of the whole excess).
    """
    recordings = numbered(recordings)
    base, judge = fit_base_model(recordings, kind, known, jobs, seed, [], lambda stage, done, total: None)
    screening = Screening(base, recordings, known, jobs)
    found = fit_effects(judge, screening, base, effects)
    if found is None:
        return None
    together = judged(judge, base, found)
    if len(effects) == 1:
        return together, {effects[0]: together.closure}
    each = {}
    for effect in effects:
        others = fit_effects(judge, screening, base, [name for name in effects if name != effect])
        each[effect] = float("nan") if others is None else judged(judge, others, found).closure
    return together, each
