"""A term for what the effects of the library leave: proposed, put into the simulation, and kept where it helps."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

from linid.arrays import Array
from linid.diagnosis.balance import Memory
from linid.diagnosis.base import Base
from linid.diagnosis.descent import SETTLING
from linid.diagnosis.forecast import together, with_forecasts
from linid.diagnosis.foretold import RISEN
from linid.diagnosis.gap import Trace
from linid.diagnosis.held_out_tests import LEAST_CLOSED as LEAST_CLOSED_SHARE
from linid.diagnosis.held_out_tests import TO_THE_FLOOR, Part, is_likely, stands_clearly
from linid.diagnosis.instead import are_its_shape, does_without_effects, is_hopeless, leaves_no_more, of_the_arguments
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge
from linid.diagnosis.means import Means
from linid.diagnosis.parts import part_of
from linid.diagnosis.proposed.describe import described, in_the_model, with_formula
from linid.diagnosis.proposed.family import Family
from linid.diagnosis.proposed.learned import Joined, effect_of, formula_instead, with_term
from linid.diagnosis.proposed.problem import Problem, problem_of
from linid.diagnosis.proposed.propose import AS_GOOD, LEAST_CLOSED, WORTH, Proposal, judged_families, propose, tested
from linid.diagnosis.proposed.regression import Regression, closed_share, held_squares
from linid.diagnosis.proposed.short_formula import FoundFormula, likely_formula, ranked_formulas, short_formula
from linid.diagnosis.refined_models import Attempt, measured_beside
from linid.diagnosis.report_data import Change, ProposedTerm, RecordingChange
from linid.diagnosis.select import Selection
from linid.diagnosis.shares import judged_rows
from linid.diagnosis.steps_of_selection import without_effect
from linid.diagnosis.verdict import leaves_nothing
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
class Lead:
    """A term that recordings ask for. problem: on which it was found; judged: all families, the best first; start: the
    model beside which it acts; judge: of both."""

    problem: Problem
    judged: tuple[Regression, ...]
    proposal: Proposal
    start: Fitted
    judge: Judge

    @cached_property
    def joined(self) -> Joined | None:
        """The model with the term's curve; None where no model can have it."""
        return with_term(self.judge, self.start, self.problem, self.proposal, None)

    @cached_property
    def closes(self) -> float:
        """Share of the excess that the term closes in the model, base and effects identified anew beside it; as found
        where no model can have it."""
        if self.joined is None:
            return self.proposal.closed
        return 1.0 - _left(self.problem, self.joined.fitted)


def lead_of(base: Base, found: Selection, unexplained: float, means: Means) -> Lead | None:
    """The term that the recordings ask for, beside all effects found or, where effects of the library only lend
    themselves to something else, in their stead; None where they ask for none.

    unexplained: share of the gap that the effects leave.
    """
    judge = base.judge
    rows = judged_rows(judge, found.best)
    excess = judge.excess(found.best.residual, rows)
    if leaves_nothing(excess, judge.fits.level(found.best.residual, found.best.floor, rows), unexplained):
        return None
    means.watch("term", 0, 3)
    lead = _first_lead(base, found, means)
    return None if lead is None else with_fewer_arguments(lead)


def _first_lead(base: Base, found: Selection, means: Means) -> Lead | None:
    """The term that the recordings ask for beside the models as they are."""
    judge = base.judge
    beside = lead_beside(judge, found.best, means.seed)
    cancelled = _cancelled(base, found, means.seed)
    if cancelled is not None and _level_with(judge, cancelled) < _level_with(judge, beside):
        return cancelled
    if not found.parts:
        return beside
    alone = lead_beside(judge, found.base, means.seed)
    if alone is not None and _instead_of_effects(found, alone, beside):
        return alone
    for part in passing(found):
        lasting = alone if len(found.parts) == 1 else lead_beside(judge, part.without, means.seed)
        if lasting is not None and _as_good_as_passing(found, part, lasting, beside):
            return lasting
    return None if beside is None else _without_the_weak(judge, found, beside, means.seed)


def _instead_of_effects(found: Selection, alone: Lead, beside: Lead | None) -> bool:
    """Whether a term alone does without the named effects, as found or in the model, where what it does at rest and at
    reversals shows; beside: the best term beside them."""
    by_effects = _left(alone.problem, found.best)
    its_shape = of_the_arguments(found.best.model.effects, alone.proposal.arguments)
    if are_its_shape(by_effects, its_shape):
        return False  # before models with the terms are fitted
    return _leaves_little(alone, by_effects, beside, partial(does_without_effects, its_shape=its_shape))


def _as_good_as_passing(found: Selection, part: Part, lasting: Lead, beside: Lead | None) -> bool:
    """Whether a term in the place of an effect of single moments or recordings leaves no more than all effects and the
    best term beside them, as found or in the model; a term of the effect's arguments is its shape."""
    if of_the_arguments((part.name,), lasting.proposal.arguments):
        return False
    return _leaves_little(lasting, _left(lasting.problem, found.best), beside, leaves_no_more)


def _leaves_little(lead: Lead, by_effects: float, beside: Lead | None, is_little: Callable[..., bool]) -> bool:
    """Whether what a term leaves is little beside what effects leave, and of that the best term beside them; as found,
    or in the model where that may turn it."""
    as_found = _left_by(lead, False), by_effects, _left_by(beside, False)
    if is_little(*as_found):
        return True
    return not is_hopeless(*as_found) and is_little(_left_by(lead, True), by_effects, _left_by(beside, True))


def _left_by(lead: Lead | None, in_model: bool) -> float:
    """Share of the excess that a term leaves, as found or in the model; without one all."""
    if lead is None:
        return 1.0
    return 1.0 - (lead.closes if in_model else lead.proposal.closed)


def passing(found: Selection) -> list[Part]:
    """The effects of single moments or recordings that leave something: what always acts may look like one where it is
    strongest."""
    able = [part for part in found.parts if find_effect(part.name).per_recording]
    return [part for part in able if part.evidence.closed < TO_THE_FLOOR]


def with_effects_of(found: Selection, start: Fitted) -> Selection:
    """The selection with the effects that another model keeps, where a term does better in the others' stead."""
    kept = tuple(part for part in found.parts if part.name in start.model.effects)
    gone = tuple(part for part in found.parts if part not in kept)
    rivals = {name: others for name, others in found.rivals.items() if name in start.model.effects}
    return replace(found, best=start, parts=kept, dropped=(*found.dropped, *gone), rivals=rivals)


def lead_beside(judge: Judge, start: Fitted, seed: int) -> Lead | None:
    """The term that recordings ask for beside a model; None where they ask for none."""
    problem = problem_of(judge, start, seed)
    judged = judged_families(problem)
    proposal = propose(problem, judged)
    return None if proposal is None else Lead(problem, tuple(judged), proposal, start, judge)


def with_fewer_arguments(lead: Lead) -> Lead:
    """A lead, or the best with some of its arguments alone that closes as much once the base has moved beside it.

    A base that was fitted without a force along the way puts the motor's field elsewhere to imitate it, by more than
    its slopes there reach: what it then leaves depends on the motor's force too.
    """
    mine, gain = set(lead.proposal.arguments), lead.proposal.gain
    for one in lead.judged:
        if set(one.family.arguments) < mine and one.best[1] >= WORTH * gain and effect_of(one.family):
            proposal = tested(lead.problem, one, tries=1)
            fewer = None if proposal is None else replace(lead, proposal=proposal)
            return lead if fewer is None or fewer.closes < AS_GOOD * lead.closes else fewer
    return lead


def _cancelled(base: Base, found: Selection, seed: int) -> Lead | None:
    """The force that a loop's input cancels, sought from where a regression beside a free periodic force puts the
    base; None where no loop does so, or an effect is such a force.

    What takes the input's thrust away, or only passes, would hide what is cancelled.
    """
    fits = base.judge.fits
    if not fits.coordinates.limits or any(find_effect(part.name).force is not None for part in found.parts):
        return None
    start = fits.at(found.base.model, base.rivals[0], {}, found.base.recordings)
    problem = problem_of(base.judge, start, seed)
    judged = judged_families(problem, _is_a_force)
    proposal = propose(problem, judged)
    return None if proposal is None else Lead(problem, tuple(judged), proposal, start, base.judge)


def _is_a_force(family: Family) -> bool:
    """Whether a family is a force on the mass, as the free one is beside which the base was put: no thrust and no
    friction, nothing that only passes."""
    return not family.passing and not family.wanders and not {"motor_force", "direction"} & set(family.arguments)


def _level_with(judge: Judge, lead: Lead | None) -> float:
    """The criterion on held-out rows of the model with a term, infinite where no model can have it."""
    joined = None if lead is None else lead.joined
    if joined is None:
        return math.inf
    return judge.fits.level(joined.fitted.residual, joined.fitted.floor, judge.balance.split)


def _without_the_weak(judge: Judge, found: Selection, lead: Lead, seed: int) -> Lead:
    """A lead without the effects that close next to nothing of the way to the floor and that nobody misses beside a
    term, or that do not stand with it in the model: what is in no library lends them a little of what it does."""
    weak = [part for part in found.parts if part.evidence.closed < LEAST_CLOSED_SHARE]
    for part in sorted(weak, key=lambda one: one.evidence.closed):
        start = part.without if lead.start is found.best else without_effect(judge.fits, lead.start, part.name)
        instead = lead_beside(judge, start, seed)
        if instead is None:
            continue
        one, with_it = instead.proposal, _left(instead.problem, lead.start) * (1.0 - lead.proposal.closed)
        missed = 1.0 - one.closed - (one.closed - one.low) > with_it
        if not missed or not _stands_beside(judge, instead, found.best, part.name):
            lead = instead
    return lead


def _stands_beside(judge: Judge, lead: Lead, best: Fitted, name: str) -> bool:
    """Whether an effect of a model stands the tests with the term of a lead in it."""
    if lead.joined is None:
        return True
    given = term_as_it_is(judge, lead.joined)
    model = given.model.with_effects((*given.model.effects, name))
    preset = {k: x for k, x in best.preset.items() if k in {p.name for p in model.parameters}} | given.preset
    full = judge.fits.fit(model, {**best.values, **given.values}, preset, best.recordings, SETTLING)
    return stands_clearly(part_of(judge, given, full, name, 1))


def term_as_it_is(judge: Judge, joined: Joined) -> Fitted:
    """A model with a term of which nothing is searched any more."""
    one = joined.fitted
    term = {p.name: one.values[p.name] for p in find_effect(joined.effect).parameters}
    return judge.fits.at(one.model, one.values, {**one.preset, **term}, one.recordings)


def _left(problem: Problem, best: Fitted) -> float:
    """Share of a problem's excess on the judging rows that another model leaves."""
    had, left = (held_squares(problem, one) for one in (problem.residual, best.residual))
    return max(1.0 - closed_share(problem, had, left), 0.0)


def lacking_term(
    judge: Judge, found: Selection, lead: Lead, models: Models, recordings: Sequence[Recording], means: Means
) -> tuple[ProposedTerm, Models]:
    """A term in full, and the models with it where it is kept. models: with the effects found."""
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
        means.watch("term", 3, 3)
        return term, models
    term = replace(term, effect=joined.effect, short=joined.formula.said if joined.formula else term.short)
    attempt, measured = _tried(joined, models, recordings, means, judge.balance.memory)
    means.watch("term", 2, 3)
    beside = [change for change, _ in measured.values()]
    term = replace(term, measures=together(beside, [trace for _, trace in measured.values()], means.seed))
    there = in_the_model(replace(term, kept=True), problem, proposal, lead.judged, joined.fitted.residual)
    kept = not worse_somewhere(beside) and there.closed >= LEAST_CLOSED
    more = _with_the_rest(attempt, measured, joined.fitted, models, recordings, means) if kept else models
    means.watch("term", 3, 3)
    return (there if kept else term), more


def _tried(
    joined: Joined, models: Models, recordings: Sequence[Recording], means: Means, memory: Memory
) -> tuple[Attempt, Measured]:
    """A model with a term refined, and what it makes of the held-out recordings."""
    fitted = [r for r in recordings if r.split == "fit"]
    held_out = [k for k, recording in enumerate(recordings) if recording.split == "held_out"]
    attempt = Attempt(joined.fitted, fitted, means, memory)
    measured = _measures(attempt.result, models, recordings, held_out, means)
    if worse_somewhere([change for change, _ in measured.values()]) and not attempt.ended:
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


def worse_somewhere(changes: Sequence[RecordingChange]) -> bool:
    """Whether some held-out recording is predicted worse with the term, by more than next to nothing of what the term
    mends in all of them together."""
    ahead = [change.changes["ahead"] for change in changes if change.split == "held_out"]
    won = math.hypot(*(change.before for change in ahead)) - math.hypot(*(change.after for change in ahead))
    room = SMALL_RISE * won / math.sqrt(len(ahead)) if math.isfinite(won) and won > 0.0 else 0.0
    return any(_rises(change, room) for change in ahead)


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
