"""A diagnosis on the console: the verdict in one sentence, the measures, the candidates, what to record next."""

from __future__ import annotations

from typing import TYPE_CHECKING

from linid.report.diagnosis_content import (
    STATUS_WORDS,
    before_words,
    changed,
    held_out,
    measure_lines,
    p_words,
    rank_lines,
    share_words,
    significant,
    totals,
)
from linid.report.tables import console_table

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table

    from linid.diagnosis.report_data import Diagnosis

MOST_ROWS = 8
_COLOURS = {"none": "green", "identified": "green", "ambiguous": "yellow", "unknown": "yellow"}


def diagnosis_console(diagnosis: Diagnosis) -> Group:
    """A summary that fits 80 columns, for `rich.print`."""
    from rich.console import Group
    from rich.text import Text

    verdict = diagnosis.verdict
    head = Text.assemble((STATUS_WORDS[verdict.status], f"bold {_COLOURS[verdict.status]}"), ". ", verdict.sentence)
    parts: list[Text | Table] = [head]
    parts += [Text(f"Warning: {warning}", style="yellow") for warning in diagnosis.warnings]
    parts += [Text(), _measures(diagnosis)]
    if diagnosis.candidates:
        parts += [Text(), _ranking(diagnosis)]
    depends = [f"{s.label} ({share_words(s)}, {p_words(s.p_value)})" for s in significant(diagnosis)]
    if depends:
        parts += [Text(), Text.assemble(("The residual depends on ", "bold"), ", ".join(depends), ".")]
    if verdict.next_experiment:
        parts += [Text(), Text.assemble(("What to record next: ", "bold"), verdict.next_experiment)]
    return Group(*parts)


def _measures(diagnosis: Diagnosis) -> Table:
    from rich.text import Text

    count = len(held_out(diagnosis))
    table = console_table(f"Gap on {count} held-out recording{'' if count == 1 else 's'}")
    table.add_column("Measure", no_wrap=True)
    after = changed(diagnosis)
    for title in (before_words(diagnosis).capitalize(), *(("After", "95 %") if after else ()), "Floor"):
        table.add_column(title, justify="right", no_wrap=True)
    if after:
        table.add_column("Closed", justify="right", no_wrap=True)
    for m in measure_lines(diagnosis, totals(diagnosis)):
        cells = (m.before, m.after, m.interval, m.floor, m.closed) if after else (m.before, m.floor)
        table.add_row(*(Text(cell) for cell in (f"{m.label} ({m.unit})", *cells)))
    return table


def _ranking(diagnosis: Diagnosis) -> Table:
    from rich.text import Text

    lines = rank_lines(diagnosis)
    table = console_table("Candidates")
    table.add_column("Effect", overflow="fold")
    for title in ("Screened", "Closed", "95 %"):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("")
    for line in lines[:MOST_ROWS]:
        word = {"cause": "named", "equivalent": "explains as much", "": ""}[line.role]
        style = "bold" if line.role else ""
        cells = (line.name, line.screened, line.closed, line.interval, word)
        table.add_row(*(Text(cell, style=style) for cell in cells))
    if len(lines) > MOST_ROWS:
        table.caption = Text(f"and {len(lines) - MOST_ROWS} more in diagnosis.md")
        table.caption_justify, table.caption_style = "left", ""
    return table
