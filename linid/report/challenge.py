"""Tables of a scored challenge: for the console, and CSV for spreadsheets."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from linid.report.numbers import format_number
from linid.report.tables import console_table, write_csv

if TYPE_CHECKING:
    from rich.table import Table

    from linid.challenge.score import Rate, Score

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
    "interval_coverage": "fresh gaps within their 95 % intervals",
    "failed": "diagnosis failed",
}
CAMPAIGN_COLUMNS = (
    "campaign", "kind", "hidden", "strength", "status", "named", "group", "first_three", "top_1", "top_3",
    "named_but_wrong", "closure", "oracle_closure",
)  # fmt: skip
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
    from rich.text import Text

    table = console_table("Score of the challenge")
    table.add_column("Figure", overflow="fold")
    table.add_column("Count", justify="right", no_wrap=True)
    table.add_column("Rate (95 % interval)", justify="right", no_wrap=True)
    for name, label in LABELS.items():
        rate = score.rates[name]
        table.add_row(Text(label), Text(f"{rate.count:g} of {rate.total}"), Text(rate_text(rate)))
    table.add_section()
    table.add_row(Text("closure of the gap, median"), "", Text(_number(score.closure)))
    table.add_row(
        Text("the same relative to the oracle's, median"), Text(f"of {score.relative_count}"),
        Text(_number(score.relative_closure)),
    )  # fmt: skip
    return table


def bin_table(score: Score) -> Table:
    """Rates of single effects against strength."""
    from rich.text import Text

    table = console_table("Single effects by strength, % (95 % interval)")
    for title in ("Strength", "n", "Named first", "First three", "Wrong name", "Said none"):
        table.add_column(title, justify="right", no_wrap=True)
    for one in score.bins:
        cells = (f"{one.low:g} to {one.high:g}", str(one.top_1.total), *(
            _short(rate) for rate in (one.top_1, one.top_3, one.wrong, one.silent)
        ))  # fmt: skip
        table.add_row(*(Text(cell) for cell in cells))
    return table


def write_score_csv(score: Score, folder: Path) -> tuple[Path, Path]:
    """Write campaigns.csv, one scored campaign per row, and strength.csv, one rate of one bin per row."""
    rows = [
        [
            line.campaign, line.kind, " ".join(line.hidden), _number(line.strength), line.answer.status,
            " ".join(line.answer.named), " ".join(line.answer.group), " ".join(line.answer.ranking[:3]),
            _number(line.top_1), _number(line.top_3), str(int(line.wrong)), _number(line.answer.closure),
            _number(line.answer.oracle),
        ]
        for line in score.lines
    ]  # fmt: skip
    bins = [
        [f"{one.low:g}", f"{one.high:g}", name, f"{rate.count:g}", str(rate.total), *map(
            _number, (rate.value, rate.low, rate.high)
        )]
        for one in score.bins
        for name, rate in (("top_1", one.top_1), ("top_3", one.top_3), ("wrong", one.wrong), ("said_none", one.silent))
    ]  # fmt: skip
    return (
        write_csv(folder / "campaigns.csv", CAMPAIGN_COLUMNS, rows),
        write_csv(folder / "strength.csv", BIN_COLUMNS, bins),
    )


def _number(value: float | None) -> str:
    return "" if value is None or math.isnan(value) else format_number(value, 3)
