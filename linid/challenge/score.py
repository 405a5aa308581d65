"""Scoring a diagnosis against the sealed keys: verdicts of single effects, pairs and none, and budgets of all.

Rules: a single effect counts 1 when the entry with the largest share has its name, and one half when that entry has
one rival (a name that these recordings cannot tell apart) which is it. A name counts as wrong when neither it nor one
of its rivals is hidden (`linid.challenge.budget`). Of an axis that has changed since commissioning, the entry with the
largest share is to be one of the causes, by its own name.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from linid.challenge.answers import FAILED, Answer
from linid.challenge.budget import BudgetScore, Ledger, groups, ledger
from linid.challenge.files import Key
from linid.challenge.proposals import ProposalScore, score_proposals
from linid.challenge.rates import Rate, rate

BINS = (0.05, 0.1, 0.2, 0.5, 1.0)
# Share of the held-out excess that the true effects must close for an effect to count as visible, or as faint.
VISIBLE, FAINT = 0.5, 0.2
# Held-out excess, in floors, from which an effect outside the library matters.
MATTERS = 0.3


@dataclass(frozen=True)
class Line:
    """One scored campaign. strength: of the weakest hidden effect, strengths: of each; top_1, top_3: 0, 1/2 or 1 (None
    where the rule does not apply); wrong: a name was given that is not in the key; ledger: the budget against the key.
    """

    campaign: str
    kind: str
    hidden: tuple[str, ...]
    strength: float | None
    answer: Answer
    top_1: float | None
    top_3: float | None
    wrong: bool
    ledger: Ledger
    strengths: dict[str, float]


@dataclass(frozen=True)
class Bin:
    """Rates of the campaigns whose strength lies in [low, high)."""

    low: float
    high: float
    top_1: Rate
    top_3: Rate
    wrong: Rate
    silent: Rate


@dataclass(frozen=True)
class Score:
    """All figures of a scored challenge. confusion: (rows, columns, counts): key against verdict; budgets: by group;
    proposals: terms for causes outside the library."""

    lines: tuple[Line, ...]
    rates: dict[str, Rate]
    bins: tuple[Bin, ...]
    confusion: tuple[tuple[str, ...], tuple[str, ...], tuple[tuple[float, ...], ...]]
    closure: float | None
    relative_closure: float | None
    relative_count: int
    budgets: dict[str, BudgetScore]
    proposals: ProposalScore


def score_line(name: str, key: Key, answer: Answer) -> Line:
    """Score one campaign."""
    hidden = set(key.effects)
    account = ledger(key, answer)
    top_1 = top_3 = None
    if key.kind == "single":
        first = answer.entries[0] if answer.entries else None
        half = 0.5 if first is not None and len(first.rivals) == 1 and hidden <= set(first.rivals) else 0.0
        top_1 = 1.0 if first is not None and {first.effect} == hidden else half
        top_3 = 1.0 if hidden <= set(answer.named[:3]) else top_1
    elif key.kind == "pair":
        top_1 = 1.0 if set(answer.named) == hidden else 0.0
        top_3 = 1.0 if hidden <= set(answer.named[:3]) else top_1
    elif key.kind == "changed":
        top_1 = float(bool(answer.named) and answer.named[0] in hidden)
        top_3 = float(bool(hidden & set(answer.named[:3])))
    return Line(
        name,
        key.kind,
        key.effects,
        key.weakest,
        answer,
        top_1,
        top_3,
        bool(account.absent),
        account,
        dict(key.strength),
    )


def score(keys: Mapping[str, Key], answers: Mapping[str, Answer], bins: Sequence[float] = BINS) -> Score:
    """Score all campaigns; bins: edges of strength."""
    lines = tuple(score_line(name, key, answers[name]) for name, key in keys.items())
    singles = _of(lines, "single")
    pairs = _of(lines, "pair")
    none = _of(lines, "none")
    unknown = _of(lines, "unknown")
    rates = {
        "top_1": rate(_marks(singles, lambda x: x.top_1)),
        "top_3": rate(_marks(singles, lambda x: x.top_3)),
        "top_1_visible": rate(_marks(_reached(singles, VISIBLE, math.inf), lambda x: x.top_1)),
        "top_3_visible": rate(_marks(_reached(singles, VISIBLE, math.inf), lambda x: x.top_3)),
        "top_1_faint": rate(_marks(_reached(singles, FAINT, VISIBLE), lambda x: x.top_1)),
        "named_but_wrong": rate(_marks(lines, lambda x: x.wrong)),
        "false_alarms": rate(_marks(none, lambda x: x.answer.status not in ("none", FAILED))),
        "false_names": rate(_marks(none, lambda x: bool(x.answer.entries))),
        "unknown_recall_visible": rate(
            _marks((x for x in unknown if (x.answer.excess or 0.0) >= MATTERS), lambda x: x.answer.status == "unknown")
        ),
        "unknown_recall": rate(_marks(unknown, lambda x: x.answer.status == "unknown")),
        "pairs_both_named": rate(_marks(pairs, lambda x: x.top_1)),
        "pairs_both_visible": rate(
            _marks((x for x in pairs if (x.answer.weakest or 0.0) >= VISIBLE), lambda x: x.top_1)
        ),
        "pairs_one_named": rate(
            _marks(pairs, lambda x: x.top_1 == 0 and bool(set(x.answer.named) & set(x.hidden)) and not x.wrong)
        ),
        **_since_commissioning(lines),
        "interval_coverage": _coverage(lines),
        "failed": rate(_marks(lines, lambda x: x.answer.status == FAILED)),
    }
    hiding = [line for line in lines if line.hidden]
    closures = [line.answer.closure for line in hiding if line.answer.closure is not None]
    relative = [
        line.answer.closure / line.answer.oracle
        for line in hiding
        if line.answer.closure is not None and line.answer.oracle is not None and line.answer.oracle > 0
    ]
    return Score(
        lines,
        rates,
        tuple(_bins(singles, bins)),
        confusion(lines),
        median(closures) if closures else None,
        median(relative) if relative else None,
        len(relative),
        groups(keys, answers),
        score_proposals(keys, answers),
    )


def _since_commissioning(lines: Sequence[Line]) -> dict[str, Rate]:
    """Rates of axes that were recorded twice: as commissioned, and later, changed or not."""
    changed, unchanged = _of(lines, "changed"), _of(lines, "unchanged")
    causes = [cause in line.answer.named for line in changed for cause in line.hidden]
    names = [entry.effect in line.ledger.absent for line in (*changed, *unchanged) for entry in line.answer.entries]
    return {
        "changed_first": rate(_marks(changed, lambda x: x.top_1)),
        "changed_found": rate(map(float, causes)),
        "changed_wrong": rate(map(float, names)),
        "unchanged_alarms": rate(_marks(unchanged, lambda x: x.answer.status not in ("none", FAILED))),
    }


def confusion(lines: Sequence[Line]) -> tuple[tuple[str, ...], tuple[str, ...], tuple[tuple[float, ...], ...]]:
    """Key against verdict for all campaigns but those with several causes; what is outside the library is one row
    `unknown`.

    A verdict of several names counts in equal parts for each.
    """
    cells: dict[tuple[str, str], float] = {}
    for line in lines:
        if line.kind in ("pair", "crowd") or len(line.hidden) > 1:
            continue
        row = line.hidden[0] if line.kind in ("single", "changed") else line.kind
        said = line.answer.named or (line.answer.status,)
        for name in said:
            cells[row, name] = cells.get((row, name), 0.0) + 1 / len(said)
    last = ("none", "unchanged", "unknown", "partly explained", "explained", FAILED)
    rows = sorted({row for row, _ in cells} - set(last)) + [n for n in last if any(r == n for r, _ in cells)]
    said_names = sorted({c for _, c in cells} | {r for r, _ in cells} - set(last) - set(last))
    columns = [n for n in said_names if n not in last] + [n for n in last if any(c == n for _, c in cells) or n in rows]
    counts = tuple(tuple(cells.get((row, column), 0.0) for column in columns) for row in rows)
    return tuple(rows), tuple(columns), counts


def _of(lines: Sequence[Line], kind: str) -> list[Line]:
    return [line for line in lines if line.kind == kind]


def _reached(lines: Iterable[Line], low: float, high: float) -> list[Line]:
    """Campaigns in which the true effects close a share of the excess in [low, high)."""
    return [x for x in lines if x.answer.oracle is not None and low <= x.answer.oracle < high]


def _marks(lines: Iterable[Line], mark: Callable[[Line], Any]) -> list[float]:
    return [float(mark(line)) for line in lines]


def _coverage(lines: Sequence[Line]) -> Rate:
    covered = sum(line.answer.covered for line in lines)
    total = sum(line.answer.fresh for line in lines)
    return rate([1.0] * covered + [0.0] * (total - covered))


def _bins(singles: Sequence[Line], edges: Sequence[float]) -> Iterable[Bin]:
    """Bins of strength; what lies below the first or above the last edge joins the outermost bin."""
    for i in range(len(edges) - 1):
        low = -math.inf if i == 0 else edges[i]
        high = math.inf if i == len(edges) - 2 else edges[i + 1]
        inside = [x for x in singles if x.strength is not None and low <= x.strength < high]
        yield Bin(
            edges[i],
            edges[i + 1],
            rate(_marks(inside, lambda x: x.top_1)),
            rate(_marks(inside, lambda x: x.top_3)),
            rate(_marks(inside, lambda x: x.wrong)),
            rate(_marks(inside, lambda x: x.answer.status == "none")),
        )
