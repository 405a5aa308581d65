"""Tables for the console (rich) and for spreadsheets (CSV); their LaTeX twins are in `linid.report.latex`."""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from linid.physics.wording import scaled_unit
from linid.report.files import csv_text, write_atomic
from linid.report.latex import floor_note, formula_notes, gap_latex, parameter_latex, tabled
from linid.report.numbers import Rounded, estimate_text, format_number, interval_text, round_estimate

if TYPE_CHECKING:
    from rich.table import Table

    from linid.diagnosis.gap import RecordingGap
    from linid.identification.result import Estimate, FitResult

__all__ = [
    "BatchRow",
    "batch_table_console",
    "console_table",
    "gap_latex",
    "gap_table_console",
    "identifiability_notes",
    "parameter_csv",
    "parameter_latex",
    "parameter_table_console",
    "table_text",
    "write_gap_csv",
]

PARAMETER_COLUMNS = ("name", "symbol", "value", "std", "low", "high", "unit", "status", "note")
GAP_COLUMNS = (
    "recording",
    "kind",
    "split",
    "free_run",
    "free_run_floor",
    "ahead",
    "ahead_floor",
    "force",
    "force_floor",
    "force_share",
    "repeats",
    "unit_ahead",
    "unit_force",
)


@dataclass(frozen=True)
class BatchRow:
    """One job of a batch: what it was, how it ended, how long it took, its key figure and where the results are."""

    job: str
    status: str
    seconds: float
    key_figure: str
    folder: str


def rounded(estimate: Estimate) -> Rounded:
    """The estimate rounded to the digits that its uncertainty supports."""
    return round_estimate(estimate.value, estimate.std, estimate.low, estimate.high, estimate.status)


def parameter_table_console(result: FitResult) -> Table:
    """Parameters, then derived quantities: value ± std, 95 % interval, unit, numbered notes below; fits 80 columns."""
    from rich.text import Text

    table = console_table(
        f"Parameters of the {result.model} model" + (" (forces per kilogram)" if result.per_mass else "")
    )
    table.add_column("Parameter", no_wrap=True)
    table.add_column("Symbol", no_wrap=True)
    table.add_column("Value ± std", justify="right", overflow="fold")
    table.add_column("95 % interval", justify="right", overflow="fold")
    table.add_column("Unit", no_wrap=True)
    notes: list[str] = []
    shown = tabled(result)
    noted = any(e.note for e in (*shown, *result.derived))
    if noted:
        table.add_column("Note", no_wrap=True)
    for group in (shown, result.derived):
        for estimate in group:
            if estimate.note:
                notes.append(estimate.note)
            value = rounded(estimate)
            cells = [
                Text(estimate.name),
                Text(estimate.symbol),
                Text(estimate_text(value), style=_STATUS_STYLE.get(estimate.status, "")),
                Text(interval_text(value)),
                Text(_unit(estimate.unit)),
            ]
            table.add_row(*cells, *([Text(f"{len(notes)})" if estimate.note else "")] if noted else []))
        if group is shown and result.derived:
            table.add_section()
    lines = [f"{number}) {note}" for number, note in enumerate(notes, 1)]
    _caption(table, lines + formula_notes(result) + identifiability_notes(result))
    return table


def identifiability_notes(result: FitResult) -> list[str]:
    """Sentences on what the data cannot tell apart, and the fit's warnings."""
    advised: dict[str, list[str]] = {}
    for first, second, correlation, advice in result.pairs:
        advised.setdefault(advice, []).append(f"{first} and {second} ({correlation:+.3f})")
    pairs = [
        f"Cannot be told apart (correlation): {', '.join(names)}.{f' Remedy: {advice}' if advice else ''}"
        for advice, names in advised.items()
    ]
    notes = pairs + [f"Warning: {warning}" for warning in result.warnings]
    notes += [result.search_check] if result.search_check else []
    if not result.converged:
        notes.append("The search did not converge: " + ("; ".join(result.stop_reasons) or "no reason given"))
    return notes


def gap_table_console(gaps: Sequence[RecordingGap], axis: str = "linear") -> Table:
    """The three measures of each recording, each beside its floor, by split; 80 columns do."""
    from rich.text import Text

    ahead_unit, force_unit = gap_units(axis, per_mass(gaps))
    table = console_table("Gap between simulation and machine, each measure beside its floor")
    table.padding = (0, 0)  # the box's own blank between columns is enough; nine columns are many
    table.add_column("Recording", overflow="fold", min_width=16)
    table.add_column("Kind", no_wrap=True)
    for title in (
        *("Free\nrun\n%", "\n\nfloor"),
        *(f"0.1 s\nahead\n{ahead_unit}", "\n\nfloor"),
        *(f"Force\nerror\n{force_unit}", "\n\nfloor"),
        "\n\n%",
    ):
        table.add_column(title, justify="right", no_wrap=True)
    split = ""
    for gap in gaps:
        if gap.split != split:
            table.add_section()
            table.add_row(Text({"fit": "fitted", "held_out": "held out"}.get(gap.split, gap.split), style="bold"))
            split = gap.split
        cells = (
            gap.recording + ("*" if gap.repeats else ""),
            gap.kind.replace("_", " "),
            *(_measure(100 * gap.free_run, 3), _measure(100 * gap.free_run_floor, 2)),
            *(_measure(1e6 * gap.ahead, 3), _measure(1e6 * gap.ahead_floor, 2)),
            *(_measure(gap.force, 3), _measure(gap.force_floor, 2)),
            _measure(100 * gap.force_share, 3),
        )
        table.add_row(*(Text(cell) for cell in cells))
    _caption(table, [floor_note(gaps)])
    return table


def batch_table_console(rows: Iterable[BatchRow | Mapping[str, object]]) -> Table:
    """Summary of a batch; a row is a BatchRow or a mapping with its field names."""
    from rich.text import Text

    table = console_table("Batch")
    table.add_column("Job", overflow="fold")
    table.add_column("Status", no_wrap=True)
    table.add_column("Seconds", justify="right", no_wrap=True)
    table.add_column("Key figure", overflow="fold")
    table.add_column("Folder", overflow="fold")
    for given in rows:
        row = given if isinstance(given, BatchRow) else BatchRow(**given)  # type: ignore[arg-type]
        colour = {"done": "green", "failed": "red", "error": "red"}.get(row.status, "")
        table.add_row(
            Text(row.job),
            Text(row.status, style=colour),
            Text(f"{row.seconds:.1f}"),
            Text(str(row.key_figure)),
            Text(str(row.folder)),
        )
    return table


def table_text(table: Table, width: int = 80) -> str:
    """The table as plain text of at most `width` columns, without colours."""
    from rich.console import Console

    stream = io.StringIO()
    Console(file=stream, width=width, color_system=None, force_terminal=False).print(table)
    return "\n".join(line.rstrip() for line in stream.getvalue().splitlines()) + "\n"


def parameter_csv(result: FitResult) -> str:
    """CSV of all parameters, then the derived quantities (status `derived`), in full precision.

    Columns: name, symbol, value, std, low, high, unit, status, note. Numbers read back with `float` to the same bits;
    empty where there is none. How many digits mean something is for the std to say (the LaTeX table rounds by it).
    """
    rows = [_csv_row(e, e.status) for e in result.estimates]
    rows += [_csv_row(e, "derived" if e.status == "fitted" else e.status) for e in result.derived]
    return csv_text(PARAMETER_COLUMNS, rows)


def write_gap_csv(gaps: Sequence[RecordingGap], path: Path, axis: str = "linear") -> Path:
    """Write the gap measures in SI units (shares as fractions, not per cent), in full precision."""
    si_ahead = "rad" if axis == "rotary" else "m"
    si_force = gap_units(axis, per_mass(gaps))[1]
    rows = []
    for gap in gaps:
        numbers = [_exact(getattr(gap, column)) for column in GAP_COLUMNS[3:10]]
        rows.append([gap.recording, gap.kind, gap.split, *numbers, str(gap.repeats), si_ahead, si_force])
    return write_csv(path, GAP_COLUMNS, rows)


def gap_units(axis: str, per_mass: bool = False) -> tuple[str, str]:
    """Display units of the `ahead` and `force` measures; per_mass: of a model that knows no mass."""
    ahead, force = ("µrad", "N m") if axis == "rotary" else ("µm", "N")
    return ahead, scaled_unit(force, axis, "kg" if per_mass else "")


def per_mass(gaps: Sequence[RecordingGap]) -> bool:
    """Whether the forces of gaps are per kilogram (rotary: kg m^2)."""
    return any(gap.per_mass for gap in gaps)


_STATUS_STYLE = {"fixed": "dim", "not_identifiable": "yellow", "at_bound": "yellow"}


def console_table(title: str) -> Table:
    """An empty table in the look of all console tables."""
    from rich import box
    from rich.table import Table

    return Table(
        title=title,
        title_justify="left",
        title_style="bold",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        padding=(0, 1, 0, 0),
        show_edge=False,
    )


def _caption(table: Table, lines: list[str]) -> None:
    from rich.text import Text

    if lines:
        table.caption = Text("\n".join(lines))
        table.caption_justify = "left"
        table.caption_style = ""


def _measure(value: float, digits: int) -> str:
    text = format_number(value, digits)
    return "-" if text == "nan" else text


def _unit(unit: str) -> str:
    return "-" if unit in ("", "1") else unit


def _csv_row(estimate: Estimate, status: str) -> list[str]:
    numbers = [_exact(number) for number in (estimate.value, estimate.std, estimate.low, estimate.high)]
    return [estimate.name, estimate.symbol, *numbers, estimate.unit, status, estimate.note]


def _exact(number: float) -> str:
    return "" if math.isnan(number) else repr(float(number))


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[str]]) -> Path:
    """Write a table as CSV; returns where. Raises OSError where that cannot be written."""
    return write_atomic(Path(path), csv_text(header, rows).encode("utf-8"))
