"""A term for what the effects of the library leave: described, put into the simulation, and kept where it helps."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from linid.arrays import Array
from linid.diagnosis.by_chance import by_chance
from linid.diagnosis.forecast import together, with_forecasts
from linid.diagnosis.foretold import RISEN
from linid.diagnosis.gap import Trace
from linid.diagnosis.held_out_tests import is_likely
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge
from linid.diagnosis.lead import Lead
from linid.diagnosis.means import Means
from linid.diagnosis.proposed.describe import described, in_the_model, with_formula
from linid.diagnosis.proposed.learned import Joined, effect_of, formula_instead, with_term
from linid.diagnosis.proposed.propose import LEAST_CLOSED, WORTH, Proposal
from linid.diagnosis.proposed.short_formula import FoundFormula, likely_formula, ranked_formulas, short_formula
from linid.diagnosis.refined_models import Attempt, Refining, measured_beside
from linid.diagnosis.report_data import Change, ProposedTerm, RecordingChange
from linid.diagnosis.select import Selection
from linid.identification.guess.effect_values import EffectColumns
from linid.identification.guess.scales import amplitude_range, look_out
from linid.identification.result import FitResult
from linid.parallel_tasks import in_parallel
from linid.physics.effects.registry import find_effect
from linid.recording.recording import Recording

# Of what a term takes from the error 0.1 s ahead of all held-out recordings together: what that of one may rise by, as
# where the friction that is identified anew beside it moves by some per cent.
SMALL_RISE = 0.05

Measured = dict[int, tuple[RecordingChange, Trace]]  # by the recording's place


@dataclass(frozen=True)
class Models:
    """What the effects of the library, or these and a term, make of all recordings: as a fit writes it, as the force
    balance has it, the gap measures of every recording with the traces behind them."""

    result: FitResult
    fitted: Fitted
    changes: tuple[RecordingChange, ...]
    traces: tuple[Trace, ...]


@dataclass(frozen=True)
class Sought:
    """A term that recordings ask for, described, and the model with it while it is refined.

    lead, proposal: that it is, and as the model has it; begun: that model by the force balance, and as `fit-motor`
    identifies it, to be called; None where no model can have the term.
    """

    lead: Lead
    proposal: Proposal
    term: ProposedTerm
    begun: tuple[Joined, Callable[[], Attempt]] | None


def sought_term(judge: Judge, found: Selection, lead: Lead, means: Means, refining: Refining) -> Sought:
    """A term described, and the model with it begun to be refined; found: the effects beside it."""
    problem, proposal = lead.problem, lead.proposal
    ranked = ranked_formulas(problem, proposal)
    formula = short_formula(problem, proposal, ranked)
    effects = _beside_which(found, lead.start)
    term = described(problem, proposal, lead.judged, known_columns(judge, found, means.jobs), formula, effects)
    better = None if formula is None else formula_instead(judge, lead.start, problem, proposal, formula)
    if better is not None:
        proposal = better
        term = with_formula(term, problem, proposal, lead.judged)
    term = replace(term, effect=effect_of(proposal.family))
    means.watch("term", 1, 3)
    likely = likely_formula(proposal, ranked) if better is None else None
    joined = _joined(judge, lead, proposal, None if better is None else formula, likely)
    if joined is None:
        return Sought(lead, proposal, term, None)
    term = replace(term, effect=joined.effect, short=joined.formula.said if joined.formula else term.short)
    return Sought(lead, proposal, term, (joined, refining.attempt(joined.fitted, judge.balance.memory)))


def lacking_term(
    sought: Sought, models: Models, recordings: Sequence[Recording], means: Means
) -> tuple[ProposedTerm, Models]:
    """A term in full, and the models with it where it is kept. models: with the effects found."""
    term = sought.term
    if sought.begun is None:
        means.watch("term", 3, 3)
        return term, models
    joined, refined = sought.begun
    attempt, measured = _tried(refined(), models, recordings, means)
    means.watch("term", 2, 3)
    beside = [change for change, _ in measured.values()]
    term = replace(term, measures=together(beside, [trace for _, trace in measured.values()], means.seed))
    problem, judged = sought.lead.problem, sought.lead.judged
    there = in_the_model(replace(term, kept=True), problem, sought.proposal, judged, joined.fitted.residual)
    kept = not _spoils(measured, models) and there.closed >= LEAST_CLOSED
    more = _with_the_rest(attempt, measured, joined.fitted, models, recordings, means) if kept else models
    means.watch("term", 3, 3)
    return (there if kept else term), more


def _tried(attempt: Attempt, models: Models, recordings: Sequence[Recording], means: Means) -> tuple[Attempt, Measured]:
    """A model with a term, and what it makes of the held-out recordings; taken further where it predicts worse."""
    held_out = [k for k, recording in enumerate(recordings) if recording.split == "held_out"]
    measured = _measures(attempt.result, models, recordings, held_out, means)
    if _spoils(measured, models) and not attempt.ended:
        attempt.go_on()
        measured = _measures(attempt.result, models, recordings, held_out, means)
    return attempt, measured


def _with_the_rest(
    attempt: Attempt, measured: Measured, fitted: Fitted, models: Models, recordings: Sequence[Recording], means: Means
) -> Models:
    """The models with a term that is kept, and what they make of all recordings. measured: of those held out."""
    after = attempt.kept()
    tried, kept = ([e.value for e in one.estimates] for one in (attempt.result, after))
    known = measured if kept == tried else {}  # a rival with another shape of the field may cost less
    known = known | _measures(after, models, recordings, [k for k in range(len(recordings)) if k not in known], means)
    changes, traces = zip(*(known[k] for k in range(len(recordings))), strict=True)
    return _changed(models, Models(after, fitted, changes, traces))


def _beside_which(found: Selection, start: Fitted) -> tuple[str, ...]:
    """The effects named beside a term, and those that were not for the little that they take of the gap."""
    named = tuple(name for name in start.model.effects if name not in found.base.model.effects)
    return (*named, *(part.name for part in found.dropped if is_likely(part))) if named else ()


def _joined(
    judge: Judge, lead: Lead, proposal: Proposal, formula: FoundFormula | None, likely: FoundFormula | None
) -> Joined | None:
    """The model with a term: of the curve or the formula that stands for it, or of the likeliest formula, which may
    explain more than a curve once the base has moved."""
    problem = lead.problem
    curve = formula is None and proposal is lead.proposal
    joined = lead.joined if curve else with_term(judge, lead.start, problem, proposal, formula)
    if likely is None:
        return joined
    instead = formula_instead(judge, lead.start, problem, proposal, likely, WORTH)
    other = None if instead is None else with_term(judge, lead.start, problem, instead, likely)
    options = [one for one in (joined, other) if one is not None]
    rows = judge.balance.split
    return min(options, key=lambda one: judge.fits.level(one.fitted.residual, one.fitted.floor, rows), default=None)


def worse_somewhere(changes: Sequence[RecordingChange], chances: Sequence[bool]) -> bool:
    """Whether some held-out recording is predicted worse with the term, by more than next to nothing of what the term
    mends in all of them together, and, where it mends more than a rise may be, by more than chance explains.

    chances: whether each one's rise may be chance (`by_chance`).
    """
    ahead = [(change.changes["ahead"], chance) for change, chance in zip(changes, chances, strict=True)]
    before, after = (math.hypot(*(getattr(one, name) for one, _ in ahead)) for name in ("before", "after"))
    won = before - after
    room = SMALL_RISE * won / math.sqrt(len(ahead)) if math.isfinite(won) and won > 0.0 else 0.0
    mends = before > RISEN * after
    return any(_rises(one, room) and not (mends and chance) for one, chance in ahead)


def _spoils(measured: Measured, models: Models) -> bool:
    """Whether some recording is predicted worse with the term; a rise may be chance only where windows tell."""
    chances = []
    for k, (change, trace) in measured.items():
        one, other = models.traces[k].ahead, trace.ahead
        windows = None if one is None or other is None else (one.end_error, other.end_error)
        chances.append(windows is not None and by_chance(*windows, change.changes["ahead"].floor))
    return worse_somewhere([change for change, _ in measured.values()], chances)


def known_columns(judge: Judge, found: Selection, jobs: int) -> dict[str, Array]:
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
    after: FitResult, models: Models, recordings: Sequence[Recording], chosen: Sequence[int], means: Means
) -> Measured:
    """The changes of the chosen recordings from the models without a term to one with it, and the traces behind."""
    measured = partial(measured_beside, tuple(recordings), models.changes, after, means.seed)
    return dict(in_parallel(measured, chosen, means.jobs, means.workers))


def _changed(models: Models, more: Models) -> Models:
    """The models with a term, their changes told from the base model's."""
    changes = []
    for old, new in zip(models.changes, more.changes, strict=True):
        both = {name: replace(one, before=old.changes[name].before) for name, one in new.changes.items()}
        changes.append(replace(new, changes=both))
    return replace(more, changes=with_forecasts(changes))


def _rises(ahead: Change, room: float) -> bool:
    """Whether an error 0.1 s ahead is larger with the term, beyond what noise and another fit explain and this in m."""
    return not ahead.after <= max(RISEN * ahead.before, ahead.floor, ahead.before + room)
