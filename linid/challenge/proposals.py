"""Scoring a proposed term: whether it depends on what the cause outside the library truly depends on.

A grade is `exact` where the arguments are those of the cause, `related` where they have the main one and are some of
them or more than them, else `wrong`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from statistics import median

from linid.challenge.answers import FAILED, Answer
from linid.challenge.files import Key
from linid.challenge.outside import CAUSES
from linid.challenge.rates import Rate, rate

RATES = (
    "proposed",
    "arguments_exact",
    "arguments_main",
    "proposed_exact",
    "proposed_main",
    "proposed_where_none",
    "proposed_where_listed",
)


@dataclass(frozen=True)
class ProposalScore:
    """rates: see `score_proposals`; closure: median of what proposals close over what the true term closes, of so many
    (count); None without any."""

    rates: dict[str, Rate]
    closure: float | None
    count: int


def grade(said: Collection[str], truth: Sequence[str]) -> str:
    """`exact`, `related` or `wrong`; truth: arguments, the main one first."""
    stated, true = set(said), set(truth)
    if stated == true:
        return "exact"
    return "related" if truth[0] in stated and (stated < true or stated > true) else "wrong"


def cause_of(key: Key) -> str | None:
    """The only cause outside the library of a campaign; None where there is none, or more than one."""
    outside = [name for name in key.effects if name in CAUSES]
    return outside[0] if len(outside) == 1 else None


def closed_of(answer: Answer) -> float | None:
    """Share of the gap that the budget and, of what it leaves, the proposal close; None where no share is stated."""
    if answer.proposal is None or answer.proposal.closed is None:
        return None
    named = min(max(answer.closure or 0.0, 0.0), 1.0) if answer.entries else 0.0
    return named + (1.0 - named) * answer.proposal.closed


def score_proposals(keys: Mapping[str, Key], answers: Mapping[str, Answer]) -> ProposalScore:
    """Score the proposed terms of a challenge's diagnoses.

    Of campaigns with one cause outside the library: proposed, a term is; arguments_exact, they are the cause's;
    arguments_main, they have its main one and are some of them, they themselves, or more. proposed_exact,
    proposed_main: the same of those with a proposal alone. proposed_where_none, proposed_where_listed: a term is
    proposed where nothing is hidden, and, as another cause than those named, where every cause is listed and friction
    is LuGre's. Closures are compared where the cause acts alike in all recordings, and the true term closes something.
    """
    pairs = [(key, answers[name]) for name, key in keys.items() if answers[name].status != FAILED]
    outside = [(CAUSES[cause], answer) for key, answer in pairs if (cause := cause_of(key)) is not None]
    grades = [
        (None if answer.proposal is None else grade(answer.proposal.arguments, cause.arguments))
        for cause, answer in outside
    ]
    given = [one for one in grades if one is not None]
    nothing = [answer for key, answer in pairs if not key.effects and key.law == "lugre"]
    listed = [
        answer for key, answer in pairs if key.effects and not set(key.effects) & set(CAUSES) and key.law == "lugre"
    ]
    reached = [(closed_of(answer), answer.oracle) for cause, answer in outside if cause.repeats]
    ratios = [own / best for own, best in reached if own is not None and best is not None and best > 0]
    rates = {
        "proposed": rate([float(one is not None) for one in grades]),
        "arguments_exact": rate([float(one == "exact") for one in grades]),
        "arguments_main": rate([float(one in ("exact", "related")) for one in grades]),
        "proposed_exact": rate([float(one == "exact") for one in given]),
        "proposed_main": rate([float(one != "wrong") for one in given]),
        "proposed_where_none": rate([float(answer.proposal is not None) for answer in nothing]),
        "proposed_where_listed": rate([float(answer.another_cause) for answer in listed]),
    }
    return ProposalScore(rates, median(ratios) if ratios else None, len(ratios))
