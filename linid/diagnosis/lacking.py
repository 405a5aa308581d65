"""A term for what the effects of the library leave: proposed, put into the simulation, and kept where it helps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

from linid.arrays import Array
from linid.diagnosis.forecast import together, with_forecasts
from linid.diagnosis.gap import Trace
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge
from linid.diagnosis.means import Means
from linid.diagnosis.parallel_tasks import in_parallel
from linid.diagnosis.proposed.describe import described
from linid.diagnosis.proposed.learned import effect_of, with_term
from linid.diagnosis.proposed.problem import Problem, problem_of
from linid.diagnosis.proposed.propose import judged_families, propose
from linid.diagnosis.refined_models import measured_alone, refined_model
from linid.diagnosis.report_data import Change, ProposedTerm, RecordingChange
from linid.diagnosis.select import Selection
from linid.identification.guess.effect_values import EffectColumns
from linid.identification.guess.scales import amplitude_range, look_out
from linid.identification.result import FitResult
from linid.physics.effects.registry import find_effect
from linid.recording.recording import Recording

RISEN = 1.03  # of an error 0.1 s ahead: by less, identifying the model anew moves it from one recording to another


@dataclass(frozen=True)
class Models:
    """What the effects of the library, or these and a term, make of all recordings: as a fit writes it, as the force
    balance has it, the gap measures of every recording with the traces behind them."""

    result: FitResult
    fitted: Fitted
    changes: tuple[RecordingChange, ...]
    traces: tuple[Trace, ...]


def lacking_term(
    judge: Judge, found: Selection, models: Models, recordings: Sequence[Recording], means: Means
) -> tuple[ProposedTerm, Models] | None:
    """The term that the recordings ask for beside all effects found, and the models with it where it is kept; None
    where they ask for none.

    models: with the effects found.
    """
    means.watch("term", 0, 3)
    problem = problem_of(judge, found.best, means.seed)
    judged = judged_families(problem)
    proposal = propose(problem, judged)
    if proposal is None:
        means.watch("term", 3, 3)
        return None
    term = described(problem, proposal, judged, known_columns(judge, found, problem, means.jobs))
    term = replace(term, effect=effect_of(proposal.family))
    means.watch("term", 1, 3)
    one = with_term(judge, found.best, problem, proposal)
    if one is None:
        means.watch("term", 3, 3)
        return term, models
    fitted = [r for r in recordings if r.split == "fit"]
    after = refined_model(one, fitted, means, judge.balance.memory)
    means.watch("term", 2, 3)
    more = _changed(models, Models(after, one, *_measures(after, recordings, means)))
    term = replace(term, measures=together(_beside(models, more), more.traces, means.seed))
    means.watch("term", 3, 3)
    if any(_rises(change) for change in _beside(models, more) if change.split == "held_out"):
        return term, models
    return replace(term, kept=True), more


def known_columns(judge: Judge, found: Selection, problem: Problem, jobs: int) -> dict[str, Array]:
    """What each known effect that makes sense here does to the rows, (n, amplitudes) in m/s^2 per unit, by name."""
    balance, base = judge.balance, found.base
    outlook = look_out(base.model, [r for r in balance.recordings if r.split == "fit"], base.values)
    columns = EffectColumns(
        base.model.kind, base.values, balance.recordings, jobs, balance.part(base.model), base.model.law
    )
    out = {}
    for screened in found.screened:
        effect = find_effect(screened.name)
        names = [p for p in effect.parameters if p.name in screened.trial.amplitudes]
        if effect.per_recording or not names:
            continue
        scale, mass = judge.fits.coordinates.force_scale, base.values["mass"]
        sizes = {p.name: amplitude_range(p, outlook, scale, mass)[1] for p in names}
        out[effect.name] = columns.of(effect, [dict(screened.trial.values)], sizes).astype(float)
    return out


def _measures(
    after: FitResult, recordings: Sequence[Recording], means: Means
) -> tuple[tuple[RecordingChange, ...], tuple[Trace, ...]]:
    measured = partial(measured_alone, tuple(recordings), after, means.seed)
    found = [one for _, one in in_parallel(measured, range(len(recordings)), means.jobs, means.workers)]
    changes, traces = zip(*found, strict=True)
    return changes, traces


def _changed(models: Models, more: Models) -> Models:
    """The models with a term, their changes told from the base model's."""
    changes = []
    for old, new in zip(models.changes, more.changes, strict=True):
        both = {name: Change(old.changes[name].before, one.after, one.floor) for name, one in new.changes.items()}
        changes.append(replace(new, changes=both))
    return replace(more, changes=with_forecasts(changes))


def _beside(models: Models, more: Models) -> tuple[RecordingChange, ...]:
    """Changes from the models without a term to those with it."""
    out = []
    for old, new in zip(models.changes, more.changes, strict=True):
        both = {name: replace(one, before=old.changes[name].after) for name, one in new.changes.items()}
        out.append(replace(new, changes=both))
    return tuple(out)


def _rises(change: RecordingChange) -> bool:
    """Whether a recording is predicted worse with the term, beyond what noise and another fit explain."""
    ahead = change.changes["ahead"]
    return not ahead.after <= max(RISEN * ahead.before, ahead.floor)
