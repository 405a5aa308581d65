"""Write all figures of a diagnosis into a folder, under stable names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
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
from linid.report.style import save

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.report_data import Diagnosis


def write_diagnosis_figures(diagnosis: Diagnosis, folder: Path, *, formats: Sequence[str] = ("png",)) -> list[Path]:
    """Write what shows a diagnosis; figures that have nothing to show are left out. Returns the files in order."""
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
    for trace, stem in zip(diagnosis.traces, stems, strict=True):
        jobs.append((f"residual_{stem}", partial(residual_trace_figure, trace=trace)))
    return [path for stem, draw in jobs for path in save(draw(diagnosis), Path(folder) / stem, formats)]
