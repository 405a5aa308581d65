"""Tables of a scored challenge: for the console, and CSV for spreadsheets."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from linid.report.numbers import format_number
from linid.report.tables import console_table, write_csv

if TYPE_CHECKING:
    from rich.table import Table

    from linid.challenge.budget import Item
    from linid.challenge.rates import Rate
    from linid.challenge.score import Line, Score

LABELS = {
    "top_1": "single effects: named first",
    "top_3": "single effects: among the first three",
    "top_1_visible": "... where the true effect closes half of the gap: first",
    "top_3_visible": "... there: among the first three",
    "top_1_faint": "... where it closes 20 to 50 %: first",
    "named_but_wrong": "named, but wrong",
    "false_names": "nothing hidden: an effect named",
    "false_alarms": "nothing hidden: any alarm",
    "unknown_recall_visible": "outside the library, excess over 0.3 floors: called unknown",
    "unknown_recall": "outside the library: called unknown",
    "pairs_both_named": "pairs: both named",
    "pairs_both_visible": "... where each closes half of what the other leaves",
    "pairs_one_named": "pairs: one named, none wrong",
    "changed_first": "changed since commissioning: a cause named first",
    "changed_found": "... of all causes: named",
    "changed_wrong": "... of all names, also of unchanged axes: not there",
    "unchanged_alarms": "unchanged since commissioning: any alarm",
    "interval_coverage": "fresh gaps within their 95 % intervals",
    "failed": "diagnosis failed",
}
BUDGET_LABELS = {
    "found": "effects with at least 5 % of the gap: found",
    "found_visible": "... of at least 0.05 floors: found",
    "found_as_rival": "... of those found: only as a rival of the name",
    "absent": "names given: not there",
    "share_covered": "true shares within their 95 % intervals",
    "unexplained_close": "unexplained remainder within 5 % of the gap",
    "unexplained_covered": "... within its 95 % interval",
    "complete": "campaigns: all those found, nothing absent named",
    "none_right": "nothing hidden: said none",
}
PROPOSAL_LABELS = {
    "proposed": "one cause outside the library: a term proposed",
    "arguments_exact": "... its arguments are the cause's",
    "arguments_main": "... they have the main one, and are some of them, all, or more",
    "proposed_exact": "of the terms proposed there: arguments exact",
    "proposed_main": "... with the main one, some, all, or more",
    "proposed_where_none": "nothing hidden: a term proposed",
    "proposed_where_listed": "every cause listed, LuGre friction: a term proposed",
}
CAMPAIGN_COLUMNS = (
    "campaign",
    "kind",
    "hidden",
    "strength",
    "status",
    "named",
    "absent",
    "top_1",
    "top_3",
    "closure",
    "oracle_closure",
    "unexplained_less_true",
)
SHARE_COLUMNS = ("campaign", "kind", "effect", "strength", "true_share", "found_as", "rival", "share", "low", "high")
BUDGET_COLUMNS = ("group", "campaigns", "rate", "count", "total", "value", "low", "high")
BIN_COLUMNS = ("strength_low", "strength_high", "rate", "count", "total", "value", "low", "high")


def rate_text(rate: Rate) -> str:
    """`83 % (58 to 95)`; `-` without any."""
    if rate.total == 0:
        return "-"
    return f"{100 * rate.value:.0f} % ({100 * rate.low:.0f} to {100 * rate.high:.0f})"


def _short(rate: Rate) -> str:
    return f"{100 * rate.value:.0f} ({100 * rate.low:.0f}-{100 * rate.high:.0f})" if rate.total else "-"


def score_table(score: Score) -> Table:
    """The rates of a challenge with 95 % intervals, and its closures."""
    closures = (
        ("closure of the gap, median", "", score.closure),
        ("the same relative to the oracle's, median", f"of {score.relative_count}", score.relative_closure),
    )
    return _figures("Score of the challenge", LABELS, score.rates, closures)


def proposal_table(score: Score) -> Table:
    """Terms proposed for causes outside the library, with 95 % intervals."""
    told = score.proposals
    closures = (("closure relative to the true term's, median", f"of {told.count}", told.closure),)
    return _figures("Proposed terms", PROPOSAL_LABELS, told.rates, closures)


def _figures(
    title: str, labels: Mapping[str, str], rates: Mapping[str, Rate], closures: Iterable[tuple[str, str, float | None]]
) -> Table:
    """A table of rates by their labels, and of closures: label, count, value."""
    from rich.text import Text

    table = console_table(title)
    table.add_column("Figure", overflow="fold")
    table.add_column("Count", justify="right", no_wrap=True)
    table.add_column("Rate (95 % interval)", justify="right", no_wrap=True)
    for name, label in labels.items():
        rate = rates[name]
        table.add_row(Text(label), Text(f"{rate.count:g} of {rate.total}"), Text(rate_text(rate)))
    table.add_section()
    for label, count, value in closures:
        table.add_row(Text(label), Text(count), Text(_number(value)))
    return table


def bin_table(score: Score) -> Table:
    """Rates of single effects against strength."""
    from rich.text import Text

    table = console_table("Single effects by strength, % (95 % interval)")
    for title in ("Strength", "n", "Named first", "First three", "Wrong name", "Said none"):
        table.add_column(title, justify="right", no_wrap=True)
    for one in score.bins:
        cells = (
            f"{one.low:g} to {one.high:g}",
            str(one.top_1.total),
            *(_short(rate) for rate in (one.top_1, one.top_3, one.wrong, one.silent)),
        )
        table.add_row(*(Text(cell) for cell in cells))
    return table


def budget_table(score: Score) -> Table:
    """Budgets against true shares, by kind and kind of plant."""
    from rich.text import Text

    table = console_table("Budgets, % (95 % interval) of how many")
    table.add_column("Figure", overflow="fold")
    for group, one in score.budgets.items():
        table.add_column(f"{group} ({one.campaigns})", justify="right")
    for name, label in BUDGET_LABELS.items():
        rates = [one.rates[name] for one in score.budgets.values()]
        table.add_row(Text(label), *(Text(f"{_short(rate)} of {rate.total}" if rate.total else "-") for rate in rates))
    return table


def share_table(score: Score) -> Table:
    """Listed effects found against their true share of the gap, for each kind of campaigns."""
    from rich.text import Text

    table = console_table("Effects found by true share of the gap, % (95 % interval) of how many")
    table.add_column("Share of the gap", justify="right", no_wrap=True)
    for group in score.budgets:
        table.add_column(group, justify="right")
    for rows in zip(*(one.bins for one in score.budgets.values()), strict=True):
        cells = [f"{_short(one.found)} of {one.found.total}" if one.found.total else "-" for one in rows]
        table.add_row(Text(f"{100 * rows[0].low:g} to {100 * rows[0].high:g} %"), *(Text(cell) for cell in cells))
    return table


def write_score_csv(score: Score, folder: Path) -> tuple[Path, ...]:
    """Write campaigns.csv, one scored campaign per row; shares.csv, one hidden effect per row; budget.csv and
    strength.csv, one rate of one group or bin per row."""
    budgets = [
        [group, str(one.campaigns), *_rate_cells(name, rate)]
        for group, one in score.budgets.items()
        for name, rate in one.rates.items()
    ]
    bins = [
        [f"{one.low:g}", f"{one.high:g}", *_rate_cells(name, rate)]
        for one in score.bins
        for name, rate in (("top_1", one.top_1), ("top_3", one.top_3), ("wrong", one.wrong), ("said_none", one.silent))
    ]
    shares = [_share_cells(line, item) for line in score.lines for item in line.ledger.items]
    return (
        write_csv(folder / "campaigns.csv", CAMPAIGN_COLUMNS, [_campaign_cells(line) for line in score.lines]),
        write_csv(folder / "shares.csv", SHARE_COLUMNS, shares),
        write_csv(folder / "budget.csv", BUDGET_COLUMNS, budgets),
        write_csv(folder / "strength.csv", BIN_COLUMNS, bins),
    )


def _campaign_cells(line: Line) -> list[str]:
    """A row under CAMPAIGN_COLUMNS."""
    return [
        line.campaign,
        line.kind,
        " ".join(line.hidden),
        _number(line.strength),
        line.answer.status,
        " ".join(line.answer.named),
        " ".join(line.ledger.absent),
        _number(line.top_1),
        _number(line.top_3),
        _number(line.answer.closure),
        _number(line.answer.oracle),
        _number(line.ledger.unexplained),
    ]


def _share_cells(line: Line, item: Item) -> list[str]:
    """A row under SHARE_COLUMNS."""
    stated = item.entry.stated if item.entry else None
    return [
        line.campaign,
        line.kind,
        item.effect,
        _number(line.strengths.get(item.effect)),
        _number(item.share),
        item.entry.effect if item.entry else "",
        str(int(item.rival)),
        *map(_number, (stated.share, stated.low, stated.high) if stated else (None, None, None)),
    ]


def _rate_cells(name: str, rate: Rate) -> list[str]:
    """The cells from the rate's name on, of BUDGET_COLUMNS and BIN_COLUMNS."""
    return [name, f"{rate.count:g}", str(rate.total), *map(_number, (rate.value, rate.low, rate.high))]


def _number(value: float | None) -> str:
    return "" if value is None or math.isnan(value) else format_number(value, 3)
