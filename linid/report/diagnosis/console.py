"""A diagnosis on the console: where, which, how far; the budget, the measures, what to record next."""

from __future__ import annotations

from typing import TYPE_CHECKING

from linid.report.diagnosis.budget import budget_lines, closed_words, rest_words, where_words
from linid.report.diagnosis.changes import change_words
from linid.report.diagnosis.compensation import compensation_words
from linid.report.diagnosis.content import before_words, changed, findings, held_out, scale_words
from linid.report.diagnosis.measures import measure_lines, measure_remarks
from linid.report.diagnosis.proposal import TERM_TITLE, headline, term_lines, term_measures
from linid.report.diagnosis.words import in_print
from linid.report.tables import console_table

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    from linid.diagnosis.report_data import Diagnosis

_COLOURS = {"none": "green", "explained": "green", "partly explained": "yellow", "unknown": "yellow"}


def diagnosis_console(diagnosis: Diagnosis) -> Group:
    """A summary that fits 80 columns, for `rich.print`."""
    from rich.console import Group
    from rich.text import Text

    diagnosis = in_print(diagnosis)
    verdict = diagnosis.verdict
    status = (headline(diagnosis), f"bold {_COLOURS[verdict.status]}")
    parts: list[Text | Table] = [Text.assemble((diagnosis.name, "bold"), ": ", status, ". ", verdict.sentence)]
    if diagnosis.given:
        parts.append(Text(change_words(diagnosis), style="bold"))
    parts += [Text(f"Warning: {warning}", style="yellow") for warning in diagnosis.warnings]
    parts += [Text(f"Warning: {text}", style="yellow") for text in _data_warnings(diagnosis)]
    parts += [Text(), Text.assemble(("Where: ", "bold"), where_words(diagnosis), ".")]
    parts += [Text.assemble(("How far: ", "bold"), closed_words(diagnosis))]
    if diagnosis.budget.entries:
        parts += [Text(), _budget(diagnosis)]
    if rest_words(diagnosis):
        parts.append(Text(rest_words(diagnosis)))
    parts += [Text(line.label + ": " + line.worsens) for line in budget_lines(diagnosis) if line.worsens]
    if scale_words(diagnosis):
        parts.append(Text(scale_words(diagnosis)))
    parts += _term(diagnosis)
    if diagnosis.measures:
        parts += [Text(), _measures(diagnosis)]
        parts += [Text(one) for one in measure_remarks(diagnosis, diagnosis.measures)]
    if compensation_words(diagnosis):
        parts += [Text(), Text.assemble(("What it costs: ", "bold"), compensation_words(diagnosis))]
    if verdict.next_experiment:
        parts += [Text(), Text.assemble(("What to record next: ", "bold"), verdict.next_experiment)]
    return Group(*parts)


def _data_warnings(diagnosis: Diagnosis) -> list[str]:
    return [f"{who}: {text}." for level, who, text in findings(diagnosis) if level == "warning"]


def _budget(diagnosis: Diagnosis) -> Table:
    from rich.text import Text

    table = console_table("Budget of the gap")
    table.add_column("Effect", overflow="fold")
    for title in ("Share", "95 %", "Alone", "Missed\nwithout"):
        table.add_column(title, justify="right", no_wrap=True)
    for line in budget_lines(diagnosis):
        cells = (line.label, line.share, line.interval or "-", line.alone, line.missed)
        table.add_row(*(Text(cell) for cell in cells))
    return table


def _term(diagnosis: Diagnosis) -> list[Text | Table]:
    """What is proposed for what no effect explains, on lines of their own."""
    from rich.text import Text

    if diagnosis.proposal is None:
        return []
    parts: list[Text | Table] = [Text(), Text.assemble((f"{TERM_TITLE}: ", "bold"), diagnosis.proposal.sentence)]
    for line in term_lines(diagnosis):
        words = " ".join(word for word in (line.lead, line.code, line.text) if word)
        parts.append(Text.assemble((f"{line.title}: ", "bold"), words))
    lines = term_measures(diagnosis)
    if lines:
        table = console_table("The term, on held-out recordings")
        table.add_column("Measure", no_wrap=True)
        for title in ("Without", "With", "Floor", "To the\nfloor"):
            table.add_column(title, justify="right", no_wrap=True)
        for m in lines:
            cells = (f"{m.label.split(',')[0]} ({m.unit})", m.before, m.after, m.floor, m.state)
            table.add_row(*(Text(cell) for cell in cells))
        parts.append(table)
    return parts


def _measures(diagnosis: Diagnosis) -> Table:
    from rich.text import Text

    count = len(held_out(diagnosis))
    table = console_table(f"Errors (RMS) on {count} held-out recording{'' if count == 1 else 's'}")
    table.add_column("Measure", no_wrap=True)
    after = changed(diagnosis)
    for title in (before_words(diagnosis).capitalize(), *(("After", "95 %") if after else ()), "Floor"):
        table.add_column(title, justify="right", no_wrap=True)
    if after:
        table.add_column("To the\nfloor", justify="right", no_wrap=True)
    for m in measure_lines(diagnosis, diagnosis.measures):
        cells = (m.before, m.after, m.interval, m.floor, m.state) if after else (m.before, m.floor)
        table.add_row(*(Text(cell) for cell in (f"{m.label.split(',')[0]} ({m.unit})", *cells)))
    return table
