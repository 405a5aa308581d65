"""Counterparts of the paper's tables: each number as printed, as it can be meant, and as found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from linid.identification.result import Estimate, FitResult
from linid.report.files import csv_text
from linid.report.latex import estimate_math
from linid.report.numbers import estimate_text, interval_text
from linid.report.symbols import latex_escape, symbol_math, unit_label, unit_math
from linid.report.tables import rounded
from linid.reproduction.printed import Printed


@dataclass(frozen=True)
class TableRow:
    """A parameter of a table: as printed, the stand's own value in SI (None: not known), and as found."""

    printed: Printed
    true: float | None
    estimate: Estimate

    @property
    def as_printed(self) -> str:
        """The printed number with its unit."""
        unit = "" if self.printed.unit == "-" else f" {self.printed.unit}"
        return f"{self.printed.value:.4g}{unit}"

    @property
    def found(self) -> str:
        """The estimate with the digits that its uncertainty supports."""
        return estimate_text(rounded(self.estimate))

    @property
    def interval(self) -> str:
        """Its 95 % interval."""
        return interval_text(rounded(self.estimate))

    @property
    def unit(self) -> str:
        """SI unit of all but the printed number."""
        return unit_label(self.estimate.unit)


@dataclass(frozen=True)
class Table:
    """A counterpart of a table. title: with its number."""

    title: str
    rows: tuple[TableRow, ...]


def table(title: str, printed: Sequence[Printed], result: FitResult, truth: Mapping[str, float]) -> Table:
    """The paper's numbers beside those of a fit; truth: SI values of the stand, as far as they are known."""
    estimates = {e.name: e for e in result.estimates}
    return Table(title, tuple(TableRow(one, truth.get(one.name), estimates[one.name]) for one in printed))


def table_csv(made: Table) -> str:
    """Every number exact, SI but for the printed one."""
    header: tuple[str, ...] = ("name", "symbol", "printed", "printed_unit", "meant", "stand")
    header += ("found", "std", "low", "high", "unit", "status")
    rows = []
    for row in made.rows:
        e = row.estimate
        paper = (row.printed.symbol, row.printed.value, row.printed.unit, row.printed.si)
        rows.append((e.name, *paper, row.true, e.value, e.std, e.low, e.high, e.unit, e.status))
    return csv_text(header, rows)


def table_latex(made: Table) -> str:
    """A booktabs tabular with the digits that the uncertainties support."""
    lines = [
        "% needs \\usepackage{booktabs}",
        r"\begin{tabular}{@{}lllllll@{}}",
        r"\toprule",
        r"Parameter & Symbol & Printed & Meant, SI & Of the stand & Found & Unit \\",
        r"\midrule",
    ]
    for row in made.rows:
        e, printed = row.estimate, row.printed
        cells = (
            latex_escape(e.name.replace("_", " ")),
            f"${symbol_math(printed.symbol)}$",
            latex_escape(row.as_printed),
            f"${printed.si:.5g}$",
            "" if row.true is None else f"${row.true:.5g}$",
            estimate_math(rounded(e)),
            "--" if e.unit in ("", "1") else f"${unit_math(e.unit)}$",
        )
        lines.append(" & ".join(cells) + r" \\")
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}"]) + "\n"
