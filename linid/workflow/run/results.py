"""Writing what a fit or a validation found: MODEL, tables, convergence, gaps and figures."""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.report.files import finite
from linid.report.result_files import result_files
from linid.workflow.run.run_folder import write_text

if TYPE_CHECKING:
    from linid.diagnosis.gap import RecordingGap
    from linid.identification.result import FitResult
    from linid.interface.campaign import FoundCoastDown
    from linid.interface.results import Fit, Gaps
    from linid.interface.settings import Settings
    from linid.workflow.run.reporter import Reporter

# The library that cuts fonts for PDF figures warns about their dates.
logging.getLogger("fontTools").setLevel(logging.ERROR)

GAP_FILE = "gaps.json"


def write_fit(result: FitResult, folder: Path) -> None:
    """parameters.json (the MODEL), .csv, .tex, convergence.csv, and what other packages add."""
    for file in result_files():
        text = file.text(result)
        if text:
            write_text(folder / file.name, text)


def write_gaps(gaps: Sequence[RecordingGap], folder: Path, axis: str) -> None:
    """gaps.csv, gaps.tex and gaps.json (full precision)."""
    from linid.report.latex import gap_latex
    from linid.report.tables import write_gap_csv

    write_gap_csv(gaps, folder / "gaps.csv", axis)
    write_text(folder / "gaps.tex", gap_latex(gaps, axis))
    write_text(folder / GAP_FILE, json.dumps({"axis": axis, "gaps": gap_rows(gaps)}, indent=1) + "\n")


def gap_rows(gaps: Sequence[RecordingGap]) -> list[dict[str, Any]]:
    """Gap measures as JSON-able rows in SI units; what is not a number becomes null."""
    return [finite(asdict(gap)) for gap in gaps]


def read_gaps(folder: Path) -> tuple[RecordingGap, ...]:
    """The gaps that an earlier run wrote."""
    from linid.diagnosis.gap import RecordingGap

    rows: list[dict[str, Any]] = json.loads((folder / GAP_FILE).read_text(encoding="utf-8"))["gaps"]
    return tuple(RecordingGap(**_numbers(row)) for row in rows)


def _numbers(row: dict[str, Any]) -> dict[str, Any]:
    return {name: math.nan if value is None else value for name, value in row.items()}


def parameter_rows(result: FitResult) -> list[dict[str, Any]]:
    """Parameters as JSON-able rows in SI units."""
    return [finite(asdict(estimate)) for estimate in (*result.estimates, *result.derived)]


def write_fit_pictures(
    found: Fit, measured: Gaps, folder: Path, settings: Settings, reporter: Reporter, jobs: int
) -> None:
    """figures/: the fitted recordings; figures/held_out/: those that were not fitted."""
    from linid.report.figures.write import fit_drawings, inside, validation_drawings, write_drawings

    fitted = [t for t in measured.traces if t.split == "fit"]
    held_out = [t for t in measured.traces if t.split == "held_out"]
    drawings = fit_drawings(
        found.result, fitted, {trace.recording: trace.inputs for trace in fitted if trace.inputs is not None}
    )
    if held_out:
        drawings += inside("held_out", validation_drawings([g for g in measured if g.split == "held_out"], held_out))
    write_drawings(
        drawings,
        folder / "figures",
        formats=settings.figure_formats,
        processes=jobs,
        progress=lambda done, total, stem: reporter.step("figures", done, total),
    )


def write_coast_downs(found: Sequence[FoundCoastDown], folder: Path, settings: Settings) -> None:
    """figures/coast_down_NAME: where each free wheel was cut."""
    from linid.report.figures.coast_down import coast_down_figure
    from linid.report.files import file_stems
    from linid.report.style import save

    stems = file_stems(f.recording.name for f in found)
    for item, stem in zip(found, stems, strict=True):
        coast = item.coast_down
        figure = coast_down_figure(item.recording, coast.t_start, coast.t_end, coast.candidates)
        save(figure, folder / "figures" / f"coast_down_{stem}", settings.figure_formats)
