"""Writing what a fit or a validation found: MODEL, tables, convergence, gaps and figures."""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.report.files import finite
from linid.report.result_files import result_files
from linid.workflow.run.run_folder import write_text

if TYPE_CHECKING:
    from linid.diagnosis.gap import RecordingGap
    from linid.identification.result import FitResult
    from linid.interface.campaign import Campaign, FoundCoastDown
    from linid.interface.results import Fit, Gaps
    from linid.report.figures.write import Drawing
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request

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


def fit_pictures(found: Fit, measured: Gaps, campaign: Campaign) -> list[Drawing]:
    """What shows a fit: the fitted recordings, and in a folder `held_out` those that were not fitted."""
    from linid.report.figures.write import fit_drawings, inside, validation_drawings, worst_recordings

    worst = worst_recordings(measured)
    fitted = [t for t in measured.traces if t.split == "fit"]
    held_out = [t for t in measured.traces if t.split == "held_out"]
    splines = {trace.recording: trace.inputs for trace in fitted if trace.inputs is not None}
    drawings = _coast_downs(campaign, worst) + fit_drawings(found.result, fitted, splines, worst)
    if held_out:
        gaps = [g for g in measured if g.split == "held_out"]
        drawings += inside("held_out", validation_drawings(gaps, held_out, worst))
    return drawings


def validation_pictures(measured: Gaps, campaign: Campaign) -> list[Drawing]:
    """What shows a validation: the measures, and the recordings that were validated."""
    from linid.report.figures.write import validation_drawings, worst_recordings

    worst = worst_recordings(measured)
    return _coast_downs(campaign, worst) + validation_drawings(measured.gaps, measured.traces, worst)


def draw(pictures: Callable[[], list[Drawing]], folder: Path, request: Request, reporter: Reporter) -> None:
    """figures/: as many of the drawings as the settings ask for, with progress; pictures: gives all of them."""
    from linid.report.figures.drawing_process import Order, Ordered

    settings = request.settings
    order = Order(pictures, settings.figures, folder / "figures", settings.figure_formats, request.jobs)
    Ordered(order).files(lambda done, total, stem: reporter.step("figures", done, total))


def _coast_downs(campaign: Campaign, worst: Collection[str]) -> list[Drawing]:
    """coast_down_NAME: where each free wheel was cut; a wrong cut shows in the worst recordings."""
    from linid.report.figures.coast_down import coast_down_figure
    from linid.report.figures.write import Drawing
    from linid.report.files import file_stems

    def drawing(found: FoundCoastDown, stem: str) -> Drawing:
        coast = found.coast_down
        return Drawing(
            f"coast_down_{stem}",
            lambda: coast_down_figure(found.recording, coast.t_start, coast.t_end, coast.candidates),
            few=found.recording.name in worst,
        )

    found = campaign.coast_downs
    return [drawing(one, stem) for one, stem in zip(found, file_stems(f.recording.name for f in found), strict=True)]
