"""Scoring answers to a suite against its keys: rates of each group, and points.

An effect that has at least 5 % of the gap is to be named; naming a weaker one is neither asked for nor wrong
(`linid.challenge.budget`). A campaign gives from 0 to 1 point:

    points = named / (to be named + wrong)

wrong: names that are not there, and the word of an unlisted cause where every cause is listed. Where no effect is to be
named, silence is right: 1 / (1 + wrong), and for an unlisted cause this only where it is told. No answer gives 0.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median

from linid.challenge.answers import FAILED, Answer, BudgetEntry, Stated
from linid.challenge.budget import Ledger, ledger, score_budgets
from linid.challenge.files import Key
from linid.challenge.outside import DEPENDS_ON, OUTSIDE
from linid.challenge.proposals import cause_of, grade
from linid.challenge.rates import Rate, rate
from linid.challenge.submission import CampaignAnswer

EVERY = "all"


@dataclass(frozen=True)
class EntryLine:
    """One scored campaign. said: None where there is no answer; ledger: the names against the key; astray: an unlisted
    cause is told where every cause is listed; points: 0 to 1."""

    campaign: str
    group: str
    key: Key
    said: CampaignAnswer | None
    ledger: Ledger
    astray: bool
    points: float


@dataclass(frozen=True)
class GroupScore:
    """Rates of one group, by name (see `group_score`). width: median width of the intervals of shares that account for
    a hidden effect, in shares of the gap; None without any."""

    campaigns: int
    rates: dict[str, Rate]
    width: float | None


@dataclass(frozen=True)
class EntryScore:
    """Scores by group, those of all campaigns first, and the campaigns one by one."""

    groups: dict[str, GroupScore]
    lines: tuple[EntryLine, ...]


def score_entry(
    keys: Mapping[str, Key], groups: Mapping[str, str], answers: Mapping[str, CampaignAnswer]
) -> EntryScore:
    """Score answers by campaign; groups: campaign -> group. A campaign without an answer scores as none."""
    lines = tuple(entry_line(name, groups[name], key, answers.get(name)) for name, key in keys.items())
    each = dict.fromkeys(line.group for line in lines)
    scored = {group: group_score([line for line in lines if line.group == group]) for group in each}
    return EntryScore({EVERY: group_score(lines), **scored}, lines)


def answer_of(said: CampaignAnswer | None) -> Answer:
    """An entrant's answer as the scoring of diagnoses takes it; none at all: `failed`."""
    if said is None:
        return Answer(FAILED)
    entries = tuple(
        BudgetEntry(name, (), Stated(stated.share, stated.low, stated.high) if stated else Stated())
        for name, stated in ((name, said.shares.get(name)) for name in said.effects)
    )
    if not entries:
        return Answer("unknown" if said.unknown else "none")
    return Answer("partly explained" if said.unknown else "explained", entries)


def entry_line(name: str, group: str, key: Key, said: CampaignAnswer | None) -> EntryLine:
    """Score one campaign."""
    account = ledger(key, answer_of(said))
    outside = bool(set(key.effects) & set(OUTSIDE))
    # What the library's friction law misses of another one is an unlisted cause, too.
    astray = said is not None and said.unknown and not outside and key.law == "lugre"
    asked = [item for item in account.items if item.matters]
    named = sum(item.entry is not None for item in asked)
    wrong = len(account.absent) + astray
    if said is None or (outside and not said.unknown):
        points = 0.0
    elif asked:
        points = named / (len(asked) + wrong)
    else:
        points = 1 / (1 + wrong)
    return EntryLine(name, group, key, said, account, astray, points)


def group_score(lines: Sequence[EntryLine]) -> GroupScore:
    """Rates of some campaigns.

    answered: campaigns with an answer; points: their mean; named: of the effects to be named; wrong: names that are
    not there, of all given; false_alarms: any cause told, of campaigns with nothing hidden; told: unlisted causes told;
    astray: told where every cause is listed; covered: true shares within the stated intervals; arguments: of the
    unlisted causes', named; arguments_wrong: of those named, not theirs; arguments_exact, arguments_main: of
    campaigns with one such cause, exactly its arguments, and with its main one some of them, all, or more; law:
    friction laws right, of those stated.
    """
    budget = score_budgets([(line.key, answer_of(line.said)) for line in lines]).rates
    nothing = [line.said for line in lines if not line.key.effects]
    outside = [line for line in lines if set(line.key.effects) & set(OUTSIDE)]
    listed = [line for line in lines if line not in outside and line.key.law == "lugre"]
    asked = [(line.said, _arguments(line.key)) for line in outside]
    spoken = [(said.arguments, truth) for said, truth in asked if said is not None and said.arguments]
    causes = [(line.said, cause) for line in lines if (cause := cause_of(line.key)) is not None]
    grades = [grade(said.arguments if said is not None else (), DEPENDS_ON[cause]) for said, cause in causes]
    laws = [(line.said.law, line.key.law) for line in lines if line.said is not None and line.said.law is not None]
    rates = {
        "answered": _rate(line.said is not None for line in lines),
        "points": rate(line.points for line in lines),
        "named": budget["found"],
        "wrong": budget["absent"],
        "false_alarms": _rate(said is not None and (said.unknown or bool(said.effects)) for said in nothing),
        "told": _rate(line.said is not None and line.said.unknown for line in outside),
        "astray": _rate(line.astray for line in listed),
        "covered": budget["share_covered"],
        "arguments": _rate(name in said for said, truth in spoken for name in truth),
        "arguments_wrong": _rate(name not in truth for said, truth in spoken for name in said),
        "arguments_exact": _rate(one == "exact" for one in grades),
        "arguments_main": _rate(one != "wrong" for one in grades),
        "law": _rate(stated == true for stated, true in laws),
    }
    return GroupScore(len(lines), rates, _width(lines))


def _arguments(key: Key) -> set[str]:
    return {name for effect in key.effects for name in DEPENDS_ON.get(effect, ())}


def _width(lines: Sequence[EntryLine]) -> float | None:
    stated = [item.entry.stated for line in lines for item in line.ledger.items if item.entry is not None]
    widths = [one.high - one.low for one in stated if one.low is not None and one.high is not None]
    return median(widths) if widths else None


def _rate(marks: Iterable[bool]) -> Rate:
    return rate(float(mark) for mark in marks)
