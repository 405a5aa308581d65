"""Tables of a scored submission, for the console and as JSON-able values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from linid.challenge.entry_score import EVERY
from linid.report.files import finite
from linid.report.tables import console_table

if TYPE_CHECKING:
    from rich.table import Table

    from linid.challenge.entry_score import EntryLine, EntryScore
    from linid.challenge.rates import Rate

LABELS = {
    "answered": "Answered",
    "points": "Points",
    "named": "Named of hidden",
    "wrong": "Wrong of named",
    "false_alarms": "False alarms",
    "told": "Unlisted causes told",
    "astray": "... told where none is",
    "arguments": "Arguments named",
    "arguments_wrong": "... wrong",
    "arguments_exact": "Arguments exact",
    "arguments_main": "... with the main one",
    "covered": "Shares in their intervals",
    "law": "Friction law right",
}
NAMES, UNLISTED, STATED = tuple(LABELS)[:5], tuple(LABELS)[5:11], tuple(LABELS)[11:]


def entry_tables(score: EntryScore, entrant: str) -> tuple[Table, ...]:
    """Rates by group, in % with 95 % intervals: points and names, then unlisted causes, shares and laws if stated."""
    tables = [_table(score, NAMES, f"Score of {entrant}: % (95 % interval) of how many")]
    if any(score.groups[EVERY].rates[name].total for name in UNLISTED):
        tables.append(_table(score, UNLISTED, "Unlisted causes"))
    if any(score.groups[EVERY].rates[name].total for name in STATED):
        tables.append(_table(score, STATED, "What was stated besides"))
    return tuple(tables)


def _table(score: EntryScore, names: Sequence[str], title: str) -> Table:
    from rich.text import Text

    table = console_table(title)
    table.add_column("Group", no_wrap=True)
    for name in names:
        table.add_column(LABELS[name], justify="right")
    if "covered" in names:
        table.add_column("Median width", justify="right")
    for group, one in score.groups.items():
        if any(one.rates[name].total for name in names):
            cells = [_cell(one.rates[name]) for name in names]
            cells += [f"{one.width or 0.0:.2g}" if one.rates["covered"].total else "-"] * ("covered" in names)
            table.add_row(*map(Text, (group, *cells)))
    return table


def _cell(rate: Rate) -> str:
    if rate.total == 0:
        return "-"
    return f"{100 * rate.value:.0f} ({100 * rate.low:.0f}-{100 * rate.high:.0f})\nof {rate.total}"


def entry_body(score: EntryScore) -> dict[str, Any]:
    """All figures of a scored submission as JSON-able values; what is not a number becomes null."""
    groups = {
        group: {
            "campaigns": one.campaigns,
            "rates": {name: {**asdict(rate), "value": rate.value} for name, rate in one.rates.items()},
            "share_interval_width": one.width,
        }
        for group, one in score.groups.items()
    }
    body: dict[str, Any] = finite({"schema": 1, "groups": groups, "campaigns": [_line(one) for one in score.lines]})
    return body


def _line(line: EntryLine) -> dict[str, Any]:
    said = line.said
    return {
        "campaign": line.campaign,
        "group": line.group,
        "hidden": list(line.key.effects),
        "law": line.key.law,
        "effects": None if said is None else list(said.effects),
        "unknown": None if said is None else said.unknown,
        "wrong": [*line.ledger.absent, *(["unknown"] if line.astray else [])],
        "missed": [item.effect for item in line.ledger.items if item.matters and item.entry is None],
        "points": line.points,
    }
