"""The term that recordings ask for, beside the effects found or, where these only lend themselves, in their stead."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

from linid.diagnosis.base import Base
from linid.diagnosis.descent import SETTLING
from linid.diagnosis.held_out_tests import LEAST_CLOSED as LEAST_CLOSED_SHARE
from linid.diagnosis.held_out_tests import TO_THE_FLOOR, Part, stands_clearly
from linid.diagnosis.instead import (
    are_its_shape,
    does_without_effects,
    is_hopeless,
    leave_next_to_nothing,
    leaves_no_more,
    of_the_arguments,
)
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge
from linid.diagnosis.means import Means
from linid.diagnosis.parts import part_of
from linid.diagnosis.proposed.family import Family
from linid.diagnosis.proposed.learned import Joined, effect_of, with_term
from linid.diagnosis.proposed.problem import Problem, problem_of
from linid.diagnosis.proposed.propose import AS_GOOD, WORTH, Proposal, judged_families, propose, tested
from linid.diagnosis.proposed.regression import Regression, closed_share, held_squares
from linid.diagnosis.select import Selection
from linid.diagnosis.shares import judged_rows
from linid.diagnosis.steps_of_selection import without_effect
from linid.diagnosis.verdict import leaves_nothing
from linid.physics.effects.registry import find_effect


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
    alone = _alone(judge, found, beside, means.seed)
    if alone is not None and _instead_of_effects(found, alone, beside):
        return alone
    for part in passing(found):
        lasting = alone if len(found.parts) == 1 else lead_beside(judge, part.without, means.seed)
        if lasting is not None and _as_good_as_passing(found, part, lasting, beside):
            return lasting
    return None if beside is None else _without_the_weak(judge, found, beside, means.seed)


def _alone(judge: Judge, found: Selection, beside: Lead | None, seed: int) -> Lead | None:
    """The term that recordings ask for in the stead of all effects; None where they ask for none, or where these and
    the best term beside them leave too little for that."""
    problem = problem_of(judge, found.base, seed)
    if leave_next_to_nothing(_left(problem, found.best), _left_by(beside, False)):
        return None
    return _lead_in(problem, judged_families(problem), judge, found.base)


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
    return _lead_in(problem, judged_families(problem), judge, start)


def _lead_in(problem: Problem, judged: Sequence[Regression], judge: Judge, start: Fitted) -> Lead | None:
    """The term that a problem asks for; None where it asks for none. judged: its families; start: whose problem it
    is."""
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
    return _lead_in(problem, judged_families(problem, _is_a_force), base.judge, start)


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
