"""All recordings of a validation on one page (counterpart of the paper's Figs. 15 and 17)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from linid.errors import DataError
from linid.report.display import rms
from linid.report.figures.common import (
    TIME_LABEL,
    breakdown,
    draw_error,
    draw_pair,
    error_display,
    mark_breakdown,
    position_display,
)
from linid.report.style import new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.gap import Trace
    from linid.report.display import Display

_WITH_ERROR = 9  # above this many recordings the error strips give way


def overview_figure(traces: Sequence[Trace], title: str = "Measured (blue) and simulated (black) position") -> Figure:
    """Small multiples of measured and simulated position; up to nine recordings also show the error below."""
    if not traces:
        raise DataError("overview figure", "there is no recording to draw", "Give at least one trace.")
    traces = list(traces)
    position, error = position_display(traces), error_display(traces)
    strips = len(traces) <= _WITH_ERROR
    columns = _columns(len(traces))
    rows = -(-len(traces) // columns)
    with style():
        figure = new_figure(12.0 + rows * (58.0 if strips else 33.0), title)
        cells = figure.add_gridspec(rows, columns)
        for index, trace in enumerate(traces):
            cell = cells[index // columns, index % columns]
            last = index + columns >= len(traces)
            if strips:
                _with_strip(figure, cell, trace, position, error)
            else:
                axes = figure.add_subplot(cell)
                _panel(axes, trace, position, error)
                axes.tick_params(labelsize=6.5)
                axes.set_xlabel(TIME_LABEL if last else "", fontsize=7)
                axes.set_ylabel(f"({position.unit})" if index % columns == 0 else "", fontsize=7)
        if not strips:
            figure.supylabel(f"position ({position.unit})", fontsize=8)
        figure.align_ylabels()
    return figure


def _columns(count: int) -> int:
    return next(columns for limit, columns in ((1, 1), (4, 2), (9, 3), (10**9, 4)) if count <= limit)


def _with_strip(figure: Any, cell: Any, trace: Trace, position: Display, error: Display) -> None:
    inner = cell.subgridspec(2, 1, height_ratios=[3, 1.3])
    axes = figure.add_subplot(inner[0])
    below = figure.add_subplot(inner[1], sharex=axes)
    _panel(axes, trace, position, error)
    axes.set_ylabel(f"position ({position.unit})")
    axes.tick_params(labelbottom=False)
    draw_error(below, trace.t, trace.y_measured, trace.y_simulated, error.factor)
    below.set_ylabel(f"error ({error.unit})")
    below.set_xlabel(TIME_LABEL)


def _panel(axes: Any, trace: Trace, position: Display, error: Display) -> None:
    draw_pair(axes, trace.t, trace.y_measured, trace.y_simulated, position.factor)
    size = rms(trace.y_simulated - trace.y_measured) * error.factor
    note = "diverged" if size != size else f"RMS error {size:.3g} {error.unit}"
    axes.set_title(f"{trace.recording}\n", fontsize=7.5)
    axes.text(0.0, 1.02, note, transform=axes.transAxes, fontsize=7, va="bottom", color="#444444")
    if breakdown(trace) is not None and size == size:
        mark_breakdown(axes, trace)
