"""A proposed term as a diagnosis reports it: curve, formula, resemblances and words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.diagnosis.proposed.curve import term_curve
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.propose import Proposal
from linid.diagnosis.proposed.regression import Regression, closed_draws, closed_share, held_squares
from linid.diagnosis.proposed.resembling import refined_by, resemblances
from linid.diagnosis.proposed.short_formula import FoundFormula
from linid.diagnosis.proposed.words import next_experiment, not_on, sentence, term_labels
from linid.diagnosis.report_data import ProposedTerm

_RESAMPLES = 1000
_LIMITS = 0.025, 0.975


def described(
    problem: Problem,
    proposal: Proposal,
    judged: Sequence[Regression],
    columns: Mapping[str, Array],
    formula: FoundFormula | None,
    effects: Sequence[str],
) -> ProposedTerm:
    """A proposal in full, but for what its simulation shows (kept, measures).

    judged: the best families, that with the largest gain first; columns: (n, k) in m/s^2 of the known effects that make
    sense for these recordings, by name; formula: that says the curve as well; effects: beside which the term acts.
    """
    low, high = closed_interval(proposal)
    without = not_on(problem, proposal, judged)
    return ProposedTerm(
        arguments=proposal.arguments,
        not_on=term_labels(problem, without),
        closed=proposal.closed,
        low=low,
        high=high,
        p_value=proposal.p_value,
        curve=term_curve(problem, proposal),
        short=None if formula is None else formula.said,
        resembles=resemblances(problem, proposal, columns),
        refines=refined_by(effects, proposal.arguments),
        effect=proposal.family.formula,
        kept=False,
        measures={},
        sentence=sentence(problem, proposal, without, low, high),
        next_experiment=next_experiment(problem, proposal),
    )


def with_formula(
    term: ProposedTerm, problem: Problem, proposal: Proposal, judged: Sequence[Regression]
) -> ProposedTerm:
    """A described term whose regression is that of its short formula: what it closes is told anew.

    proposal: with the regression of the formula.
    """
    return _told_anew(term, problem, proposal, judged, closed_interval(proposal))


def in_the_model(
    term: ProposedTerm, problem: Problem, proposal: Proposal, judged: Sequence[Regression], residual: Array
) -> ProposedTerm:
    """A described term that a model has: what it closes there, base and effects identified anew beside it, is told.

    residual: (n,) m/s^2 of that model.
    """
    had, left = (held_squares(problem, one) for one in (problem.residual, residual))
    closed = min(closed_share(problem, had, left), 1.0)
    interval = _interval(closed_draws(problem, had, left, _RESAMPLES), closed)
    short = None if term.short is None else replace(term.short, closed=closed)
    return _told_anew(replace(term, short=short), problem, replace(proposal, closed=closed), judged, interval)


def _told_anew(
    term: ProposedTerm,
    problem: Problem,
    proposal: Proposal,
    judged: Sequence[Regression],
    interval: tuple[float, float],
) -> ProposedTerm:
    low, high = interval
    words = sentence(problem, proposal, not_on(problem, proposal, judged), low, high)
    return replace(term, closed=proposal.closed, low=low, high=high, sentence=words)


def closed_interval(proposal: Proposal) -> tuple[float, float]:
    """95 % interval of the share of the excess that a term closes on the judging rows, by resampled blocks; within 0
    and 1, about the share itself."""
    return _interval(proposal.regression.closed_draws(_RESAMPLES), proposal.closed)


def _interval(draws: Array, closed: float) -> tuple[float, float]:
    low, high = np.quantile(draws, _LIMITS).tolist()
    return float(np.clip(min(low, closed), 0.0, 1.0)), float(np.clip(max(high, closed), 0.0, 1.0))
