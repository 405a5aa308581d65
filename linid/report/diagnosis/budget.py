"""The budget in words: shares of the gap, the steps of the waterfall, what is left."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from linid.diagnosis.report_data import MEASURES
from linid.report.diagnosis.content import (
    force_display,
    force_word,
    interval_percent,
    number,
    percent,
    share_words,
    sigma_words,
    significant,
)
from linid.report.diagnosis.measures import MeasureLine, measure_lines
from linid.report.diagnosis.proposal import proposed_words, term_closed_words
from linid.report.numbers import estimate_text, interval_text
from linid.report.symbols import symbol_parts, unit_label
from linid.report.tables import rounded

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis, Entry
    from linid.identification.result import Estimate

_MOST_COORDINATES = 3


@dataclass(frozen=True)
class ParameterLine:
    """A parameter in words; symbol: letter and subscript; unit: '' if it has none."""

    name: str
    symbol: tuple[str, str]
    value: str
    interval: str
    unit: str
    note: str


@dataclass(frozen=True)
class BudgetLine:
    """One line of the budget in words; label: the effect, or `A or B` where rivals do as well."""

    label: str
    share: str
    interval: str
    certainty: str
    alone: str
    missed: str
    measures: tuple[MeasureLine, ...]
    worsens: str
    parameters: tuple[ParameterLine, ...]
    combinations: tuple[str, ...]
    note: str


@dataclass(frozen=True)
class Step:
    """One bar of the waterfall, shares of the gap: from start to end; low, high: ends of its whisker (nan: none).

    kind: gap, effect or rest; words: its share and interval; reach: of the rest, how much the proposed term closes or,
    without one, smooth functions reach.
    """

    kind: Literal["gap", "effect", "rest"]
    label: str
    start: float
    end: float
    low: float
    high: float
    words: str
    reach: float = 0.0


def label(entry: Entry) -> str:
    """`cogging`, or `cogging or force_ripple` where rivals explain as much."""
    return " or ".join((entry.effect, *entry.rivals))


def has_gap(diagnosis: Diagnosis) -> bool:
    """Whether there is a gap whose shares mean something."""
    return diagnosis.verdict.status != "none" and diagnosis.budget.excess_before > 0.0


def waterfall(diagnosis: Diagnosis) -> tuple[Step, ...]:
    """The bars from the whole gap down to what no effect explains; none where there is no gap."""
    if not has_gap(diagnosis):
        return ()
    budget, level, nan = diagnosis.budget, 1.0, math.nan
    steps = [Step("gap", "gap of the base model", 1.0, 0.0, nan, nan, "100 %")]
    for entry in budget.entries:
        words = f"{percent(entry.share)} {interval_percent(entry.low, entry.high)}".strip()
        end = level - (entry.share if math.isfinite(entry.share) else 0.0)
        steps.append(Step("effect", label(entry), level, end, level - entry.high, level - entry.low, words))
        level = end
    rest, low, high = budget.unexplained, budget.unexplained_low, budget.unexplained_high
    reach = reached(diagnosis) * rest if math.isfinite(reached(diagnosis) * rest) else 0.0
    words = f"{percent(rest)} {interval_percent(low, high)}".strip()
    start = rest if math.isfinite(rest) else level
    return (*steps, Step("rest", "unexplained", start, 0.0, low, high, words, max(reach, 0.0)))


def reached(diagnosis: Diagnosis) -> float:
    """Share of the rest that the proposed term closes or, without one, that smooth functions reach."""
    return diagnosis.budget.ceiling if diagnosis.proposal is None else diagnosis.proposal.closed


def gap_words(diagnosis: Diagnosis) -> str:
    """What the whole gap and its floor are, and in whose order it is shared out."""
    budget, force = diagnosis.budget, force_display(diagnosis)
    before, floor = (f"{number(x * force.factor)} {force.unit}" for x in (budget.before, budget.floor))
    text = (
        f"100 %: mean square of the {force_word(diagnosis.axis)} that the base model misses ({before} RMS) above its "
        f"floor ({floor} RMS, 0 %), held-out rows."
    )
    return text + (" Each share is the mean over all orders of adding the effects." if budget.entries else "")


def waterfall_words(diagnosis: Diagnosis) -> str:
    """How to read the waterfall: what 100 % and 0 % are, and what whiskers, colours and hatching mean."""
    budget, text = diagnosis.budget, gap_words(diagnosis)
    text += " Whiskers: 95 %." if budget.entries else ""
    if any(entry.rivals for entry in budget.entries):
        text += " Green: any of the named would do."
    if math.isfinite(reached(diagnosis)) and budget.unexplained > 0:
        what = "smooth functions of pairs of coordinates reach"
        text += f" Hatched: part of the rest that {what if diagnosis.proposal is None else 'the proposed term closes'}."
    return text


def closed_words(diagnosis: Diagnosis) -> str:
    """How far the gap closes, in one sentence, and one more on a proposed term; the definition of closed that all
    tables share."""
    return f"{_budget_closed_words(diagnosis)} {term_closed_words(diagnosis)}".strip()


def _budget_closed_words(diagnosis: Diagnosis) -> str:
    budget, force = diagnosis.budget, force_display(diagnosis)
    before, after, floor = (number(x * force.factor) for x in (budget.before, budget.after, budget.floor))
    word = force_word(diagnosis.axis)
    if not has_gap(diagnosis):
        return f"Missed {word} {before} {force.unit} RMS at a floor of {floor} {force.unit}: no gap to close."
    if not budget.entries:
        return f"0 % of the gap closes: missed {word} {before} {force.unit} RMS, floor {floor} {force.unit}."
    interval = interval_percent(budget.closed_low, budget.closed_high)
    return (
        f"{percent(budget.closed)}{f' {interval}' if interval else ''} of the gap closes: missed {word} {before} "
        f"{force.unit} RMS before, {after} {force.unit} after, floor {floor} {force.unit}."
    )


def which_words(diagnosis: Diagnosis) -> str:
    """The effects with their shares on one line."""
    if not diagnosis.budget.entries:
        words = "no effect is missing" if not has_gap(diagnosis) else "no effect of the library has evidence"
    else:
        words = ", ".join(f"{label(entry)} ({percent(entry.share)})" for entry in diagnosis.budget.entries)
    return words + proposed_words(diagnosis)


def where_words(diagnosis: Diagnosis) -> str:
    """What the residual depends on, on one line."""
    found = significant(diagnosis)[:_MOST_COORDINATES]
    if not found:
        return "the residual depends on none of the coordinates beyond chance"
    shares = [share_words(s) for s in found]
    shares[0] += " of the residual's variance"
    return ", ".join(f"{s.label} ({share})" for s, share in zip(found, shares, strict=True))


def rest_words(diagnosis: Diagnosis) -> str:
    """One sentence on what no effect explains; empty if there is nothing to say."""
    budget = diagnosis.budget
    if not has_gap(diagnosis) or not math.isfinite(budget.unexplained):
        return ""
    interval = interval_percent(budget.unexplained_low, budget.unexplained_high)
    text = f"Unexplained: {percent(budget.unexplained)}{f' {interval}' if interval else ''} of the gap."
    if budget.depends_on and diagnosis.proposal is None:  # a term says it better: its arguments were tested together
        text += f" It depends on {', '.join(budget.depends_on)}."
    if math.isfinite(budget.ceiling):
        text += f" Smooth functions of pairs of coordinates reach {percent(max(budget.ceiling, 0.0))} of it."
    return text


def budget_lines(diagnosis: Diagnosis) -> tuple[BudgetLine, ...]:
    """The budget's entries in words."""
    lines = []
    spoken = {"free_run": "the free run", "ahead": "0.1 s ahead", "force": f"the residual {force_word(diagnosis.axis)}"}
    for entry in diagnosis.budget.entries:
        worse = [spoken[name] for name in MEASURES if name in entry.worsens]
        lines.append(
            BudgetLine(
                label(entry),
                percent(entry.share),
                interval_percent(entry.low, entry.high),
                sigma_words(entry.certainty),
                percent(entry.first_in),
                percent(entry.last_in),
                measure_lines(diagnosis, entry.measures),
                f"It makes {' and '.join(worse)} worse." if worse else "",
                tuple(_parameter(one) for one in entry.parameters),
                entry.combinations,
                entry.note,
            )
        )
    return tuple(lines)


def _parameter(estimate: Estimate) -> ParameterLine:
    value = rounded(estimate)
    return ParameterLine(
        estimate.name.replace("_", " "),
        symbol_parts(estimate.symbol),
        estimate_text(value),
        interval_text(value),
        "" if estimate.unit == "1" else unit_label(estimate.unit),
        estimate.note,
    )
