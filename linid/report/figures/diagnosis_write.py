"""All figures of a diagnosis, under stable names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

from linid.report.diagnosis.budget import waterfall
from linid.report.diagnosis.content import shown_pairs, significant
from linid.report.diagnosis.term_view import term_view
from linid.report.figures.diagnosis_measures import measures_figure
from linid.report.figures.diagnosis_pairs import pairs_figure
from linid.report.figures.diagnosis_term import term_figure
from linid.report.figures.diagnosis_traces import residual_trace_figure
from linid.report.figures.diagnosis_waterfall import waterfall_figure
from linid.report.figures.diagnosis_where import (
    curves_figure,
    pole_pair_figure,
    residual_map_figure,
    shares_figure,
    spectrum_figure,
)
from linid.report.figures.write import Drawing
from linid.report.files import file_stems
from linid.report.residual_views import worst_first

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.report_data import Diagnosis


_FEW = ("waterfall", "proposed_term", "measures", "shares")  # which effects, how far they close, where the gap lies


def diagnosis_drawings(diagnosis: Diagnosis, formats: Sequence[str] = ("png",)) -> list[Drawing]:
    """What shows a diagnosis, of files in these formats; figures that have nothing to show are left out.

    The residuals of all recordings share one PDF, a page each; the worst one is among the few.
    """
    wanted: list[tuple[str, Callable[[Diagnosis], Figure]]] = []
    if waterfall(diagnosis):
        wanted.append(("waterfall", waterfall_figure))
    if term_view(diagnosis) is not None:
        wanted.append(("proposed_term", term_figure))
    if diagnosis.measures:
        wanted.append(("measures", measures_figure))
    if diagnosis.where:
        wanted.append(("shares", shares_figure))
    if significant(diagnosis):
        wanted.append(("coordinates", curves_figure))
    if shown_pairs(diagnosis):
        wanted.append(("pairs", pairs_figure))
    if diagnosis.traces:
        wanted.append(("position_velocity", residual_map_figure))
        if diagnosis.field_wavenumber is not None:
            wanted.append(("pole_pair", pole_pair_figure))
        wanted.append(("spectrum", spectrum_figure))
    drawings = [Drawing(stem, partial(draw, diagnosis), few=stem in _FEW) for stem, draw in wanted]
    worst = worst_first(diagnosis.traces)[:1]
    others = [one for one in formats if one != "pdf"]
    for trace, stem in zip(diagnosis.traces, file_stems(t.recording for t in diagnosis.traces), strict=True):
        few = any(trace is one for one in worst)
        draw_trace = partial(residual_trace_figure, diagnosis, trace)
        if "pdf" in formats:
            drawings.append(Drawing(f"residual_{stem}", draw_trace, "residuals", few=few))
        if others:
            drawings.append(Drawing(f"residual_{stem}", draw_trace, formats=others, few=few))
    return drawings
