"""The lines of a budget: every named effect with its share, parameters, measures, and what became of the others."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from linid.diagnosis.combinations import effect_combinations
from linid.diagnosis.joint import Fitted
from linid.diagnosis.means import Means
from linid.diagnosis.measures import measure_gaps
from linid.diagnosis.report_data import MEASURES, Change, Entry, Tried
from linid.diagnosis.select import Selection
from linid.diagnosis.shares import Shares
from linid.identification.result import FitResult
from linid.identification.uncertainty.estimates import plain_estimates
from linid.parallel_tasks import in_parallel
from linid.physics.effects.registry import find_effect
from linid.recording.recording import Recording


def entries_of(
    found: Selection,
    shares: Shares,
    after: FitResult,
    recordings: Sequence[Recording],
    changes: Mapping[str, Change],
    means: Means,
) -> tuple[Entry, ...]:
    """The budget's lines, the largest share first; changes: of the measures by all effects together."""
    held = [r for r in recordings if r.split == "held_out"]
    models = [found.best, *(part.without for part in found.parts)] if len(found.parts) > 1 else []
    told = in_parallel(lambda one, _: measured(after, one, held, means.seed, recordings), models, means.jobs)
    best, *others = [measures for _, measures in told] or [{}]
    out = []
    for place, part in enumerate(found.parts):
        portion = shares.portions[part.name]
        own = {p.name for p in find_effect(part.name).parameters}
        parameters = tuple(e for e in after.estimates if e.name in own)
        if len(found.parts) == 1:  # what it does is what all do
            measures = dict(changes)
        else:
            measures = {name: Change(others[place][name], best[name], changes[name].floor) for name in MEASURES}
        out.append(
            Entry(
                effect=part.name,
                rivals=tuple(name for name, _ in found.rivals.get(part.name, ())),
                share=portion.share,
                low=portion.low,
                high=portion.high,
                first_in=portion.first_in,
                last_in=portion.last_in,
                certainty=part.evidence.certainty,
                parameters=parameters,
                combinations=effect_combinations(after, part.name),
                measures=measures,
            )
        )
    return tuple(sorted(out, key=lambda entry: -entry.share))


def measured(
    after: FitResult, fitted: Fitted, held: Sequence[Recording], seed: int, among: Sequence[Recording]
) -> dict[str, float]:
    """The three measures over held-out recordings, RMS over them, of a model as the force balance has it."""
    result = replace(after, effects=fitted.model.effects, estimates=plain_estimates(fitted.model, fitted.values))
    gaps, _ = measure_gaps(result, held, seed=seed, among=among, floors=False)
    out = {}
    for name in MEASURES:
        values = np.nan_to_num([getattr(gap, name) for gap in gaps], nan=np.inf)
        out[name] = float(np.sqrt(np.mean(np.square(values))))
    return out


def tried_effects(found: Selection) -> tuple[Tried, ...]:
    """All effects that make sense here, with what became of them."""
    named = {part.name: part for part in found.parts}
    dropped = {part.name: part for part in found.dropped}
    rivals = {name for group in found.rivals.values() for name, _ in group}
    explained = {s.name: max(s.trial.explained, 0.0) for s in found.screened}
    out = []
    for name in dict.fromkeys((*named, *dropped, *explained)):
        part = named.get(name) or dropped.get(name)
        outcome = "named" if name in named else "rival" if name in rivals else "dropped" if part else "screened"
        evidence = (part.evidence.certainty, part.evidence.closed) if part else (math.nan, math.nan)
        out.append(Tried(name, explained.get(name, math.nan), outcome, *evidence))  # type: ignore[arg-type]
    return tuple(out)
