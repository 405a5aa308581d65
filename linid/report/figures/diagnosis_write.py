"""Write all figures of a diagnosis into a folder, under stable names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from linid.report.diagnosis_content import significant, totals
from linid.report.figures.diagnosis_traces import residual_trace_figure
from linid.report.figures.diagnosis_where import (
    curves_figure,
    pole_pair_figure,
    residual_map_figure,
    shares_figure,
    spectrum_figure,
)
from linid.report.figures.diagnosis_which import measures_figure, ranking_figure
from linid.report.files import file_stems
from linid.report.style import save, save_pages

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.report_data import Diagnosis

Progress = Callable[[int, int], None]


def write_diagnosis_figures(
    diagnosis: Diagnosis, folder: Path, *, formats: Sequence[str] = ("png",), progress: Progress | None = None
) -> list[Path]:
    """Write what shows a diagnosis; figures that have nothing to show are left out. Returns the files in order.

    The residuals of all recordings share one PDF, a page each. progress: called with figures done and their number.
    """
    jobs: list[tuple[str, Callable[[Diagnosis], Figure]]] = []
    if totals(diagnosis):
        jobs.append(("measures", measures_figure))
    if diagnosis.candidates:
        jobs.append(("ranking", ranking_figure))
    if diagnosis.where:
        jobs.append(("shares", shares_figure))
    if significant(diagnosis):
        jobs.append(("coordinates", curves_figure))
    if diagnosis.traces:
        jobs.append(("position_velocity", residual_map_figure))
        if diagnosis.field_wavenumber is not None:
            jobs.append(("pole_pair", pole_pair_figure))
        jobs.append(("spectrum", spectrum_figure))
    stems = file_stems(trace.recording for trace in diagnosis.traces)
    number = len(jobs) + len(stems)

    def told(done: int) -> None:
        if progress is not None:
            progress(done, number)

    paths: list[Path] = []
    for done, (stem, draw) in enumerate(jobs, 1):
        paths += save(draw(diagnosis), Path(folder) / stem, formats)
        told(done)
    residuals: list[Figure] = []
    for trace, stem in zip(diagnosis.traces, stems, strict=True):
        figure = residual_trace_figure(diagnosis, trace)
        paths += save(figure, Path(folder) / f"residual_{stem}", [one for one in formats if one != "pdf"])
        residuals.append(figure)
        told(len(jobs) + len(residuals))
    if residuals and "pdf" in formats:
        paths.append(save_pages(residuals, Path(folder) / "residuals"))
    return paths
