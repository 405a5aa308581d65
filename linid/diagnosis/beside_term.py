"""Effects that show only once a term stands in the model: what the library's form of a cause leaves had hidden them."""

from __future__ import annotations

from dataclasses import replace

from linid.diagnosis.backward import revived
from linid.diagnosis.base import Base
from linid.diagnosis.descent import SETTLING
from linid.diagnosis.held_out_tests import LIKELY, is_trifle, stands_clearly
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge
from linid.diagnosis.lead import Lead, lead_beside, term_as_it_is
from linid.diagnosis.parts import part_of
from linid.diagnosis.screen import Screening
from linid.diagnosis.select import Selection
from linid.diagnosis.shares import judged_rows, shares_of
from linid.diagnosis.steps_of_selection import without_effect
from linid.diagnosis.verdict import leaves_nothing

MOST = 3  # effects sought beside a term


def with_hidden_effects(
    base: Base, screening: Screening, found: Selection, lead: Lead, unexplained: float
) -> tuple[Selection, Lead]:
    """The selection with the effects that stand their tests beside a term, and the term found anew beside them all.

    The largest cause seldom has just the library's form, and what that leaves may be many times a second cause; a term
    takes it up, if it closes most of that. unexplained: share of the gap that the effects leave. As they were where
    nothing more stands.
    """
    judge, joined = base.judge, lead.joined if lead.proposal.closed >= LIKELY else None
    if joined is None:
        return found, lead
    given = term_as_it_is(judge, joined)
    full = _extended(judge, screening, given, unexplained * (1.0 - lead.proposal.closed))
    names = [name for name in full.model.effects if name not in given.model.effects]
    parts = [part_of(judge, given, full, name, 1) for name in names]
    parts = [part for part in parts if stands_clearly(part)]
    if parts:
        portions = shares_of(judge, found.base, full, judge.seed).portions
        parts = [part for part in parts if not is_trifle(part, portions[part.name].share)]
    names = [part.name for part in parts]
    if not names:
        return found, lead
    best = _without_term(judge, lead.start, full, names)
    anew = lead_beside(judge, best, lead.problem.seed)
    if anew is None:
        return found, lead
    more = tuple(replace(p, without=without_effect(judge.fits, best, p.name)) for p in parts)
    dropped = tuple(part for part in found.dropped if part.name not in names)
    return replace(found, best=best, parts=(*found.parts, *more), dropped=dropped), anew


def _extended(judge: Judge, screening: Screening, full: Fitted, unexplained: float) -> Fitted:
    """A model with a term and all effects that stand the tests beside it, while it leaves something."""
    for _ in range(MOST):
        rows = judged_rows(judge, full)
        level = judge.fits.level(full.residual, full.floor, rows)
        more = None
        if not leaves_nothing(judge.excess(full.residual, rows), level, unexplained):
            more = revived(judge, screening, full)
        if more is None:
            break
        full = more
    return full


def _without_term(judge: Judge, start: Fitted, full: Fitted, names: list[str]) -> Fitted:
    """The model with some more effects, as it is with a term beside them, fitted again without that."""
    model = start.model.with_effects((*start.model.effects, *names))
    own = {p.name for p in model.parameters}
    values, preset = ({k: x for k, x in some.items() if k in own} for some in (full.values, full.preset))
    return judge.fits.fit(model, values, preset, full.recordings, SETTLING)
