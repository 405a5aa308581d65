"""All recordings of a validation on one page (counterpart of the paper's Figs. 15 and 17)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from linid.errors import DataError
from linid.report.figures.ahead import ahead_display, ahead_text, draw_ahead, draw_ahead_error
from linid.report.figures.common import (
    TIME_LABEL,
    breakdown,
    draw_error,
    draw_pair,
    error_display,
    position_display,
    rms_text,
    shorten,
)
from linid.report.style import ERROR, WIDTH_MM, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.gap import Trace

_WITH_ERROR = 9  # above this many recordings the error strips give way
_TOP, _BOTTOM, _LEFT, _RIGHT = 6.0, 3.0, 2.0, 3.0  # margins in mm


@dataclass(frozen=True)
class _Grid:
    """Panels laid out in mm: matplotlib's own layout engines let many nested panels overlap."""

    rows: int
    columns: int
    strips: bool

    @property
    def row_height(self) -> float:
        return 62.0 if self.strips else 34.0

    @property
    def height(self) -> float:
        return _TOP + _BOTTOM + self.rows * self.row_height

    def boxes(self, index: int) -> list[tuple[float, float, float, float]]:
        """(left, bottom, width, height) in figure fractions of a recording's panel and, if any, its error strip."""
        row, column = divmod(index, self.columns)
        cell = (WIDTH_MM - _LEFT - _RIGHT) / self.columns
        labels = 13.0 if self.strips else 9.5
        left, width = _LEFT + column * cell + labels, cell - labels - 2.5
        bottom = _BOTTOM + (self.rows - 1 - row) * self.row_height
        stack = [(26.0, 27.0), (9.0, 13.5)] if self.strips else [(8.0, 18.0)]
        return [
            (left / WIDTH_MM, (bottom + low) / self.height, width / WIDTH_MM, tall / self.height) for low, tall in stack
        ]


def overview_figure(traces: Sequence[Trace], title: str = "Measured (blue) and simulated (black) position") -> Figure:
    """Small multiples of measured and simulated position; up to nine recordings also show the error below.

    Driven recordings show the prediction restarted from the measured state, free wheels the free run.
    Raises DataError if there is no trace.
    """
    if not traces:
        raise DataError("overview figure", "there is no recording to draw", "Give at least one trace.")
    traces = list(traces)
    position = position_display(traces)
    columns = next(columns for limit, columns in ((1, 1), (4, 2), (9, 3), (10**9, 4)) if len(traces) <= limit)
    grid = _Grid(-(-len(traces) // columns), columns, len(traces) <= _WITH_ERROR)
    with style():
        figure = new_figure(grid.height)
        figure.set_layout_engine(None)
        figure.text(0.01, 1 - 2.0 / grid.height, title, fontsize=9.5, fontweight="bold", va="top")
        for index, trace in enumerate(traces):
            panels = [figure.add_axes(box) for box in grid.boxes(index)]
            edge = index % columns == 0
            _position(panels[0], trace, position.factor, columns)
            panels[0].set_ylabel(f"position ({position.unit})" if edge else "")
            if grid.strips:
                panels[1].sharex(panels[0])
                panels[0].tick_params(labelbottom=False)
                panels[1].set_ylabel(f"error ({_error(panels[1], trace)})")
            last = index + columns >= len(traces)
            panels[-1].set_xlabel(TIME_LABEL if grid.strips or last else "")
            for axes in panels:
                _compact(axes, small=columns > 3)
                axes.yaxis.set_label_coords(-10.5 / _width_mm(axes), 0.5)
        if columns > 3:
            _shorten_labels(figure)
    return figure


def _error(axes: Any, trace: Trace) -> str:
    """Draw the error of a recording in its own unit, which is returned."""
    if trace.ahead is not None:
        display = ahead_display(trace.ahead, trace.axis)
        draw_ahead_error(axes, trace.ahead, display.factor)
        return display.unit
    display = error_display([trace])
    draw_error(axes, trace.t, trace.y_measured, trace.y_simulated, display.factor)
    return display.unit


def _position(axes: Any, trace: Trace, factor: float, columns: int) -> None:
    failure = None
    if trace.ahead is not None:
        draw_ahead(axes, trace, trace.ahead, factor, free_run=False)
        note = ahead_text(trace.ahead, trace.axis)
    else:
        draw_pair(axes, trace.t, trace.y_measured, trace.y_simulated, factor)
        failure = breakdown(trace)
        if failure is not None:
            axes.axvline(failure[0], color=ERROR, linewidth=0.8, linestyle=":")
        note = rms_text(trace) if failure is None else failure[1]
    name = shorten(trace.recording, {1: 80, 2: 42, 3: 25}.get(columns, 19))
    colour = "#444444" if failure is None else ERROR
    axes.annotate(
        name,
        (0, 1),
        xycoords="axes fraction",
        xytext=(0, 11),
        textcoords="offset points",
        fontsize=7.5,
        fontweight="bold",
        annotation_clip=False,
    )
    axes.annotate(
        note,
        (0, 1),
        xycoords="axes fraction",
        xytext=(0, 3),
        textcoords="offset points",
        fontsize=7,
        color=colour,
        annotation_clip=False,
    )


def _compact(axes: Any, small: bool) -> None:
    from matplotlib.ticker import MaxNLocator

    axes.tick_params(labelsize=6.5 if small else 7, pad=2)
    axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    axes.xaxis.labelpad = 1.5


def _shorten_labels(figure: Any) -> None:
    # Narrow panels have no room for the word; the page's title says that it is the position.
    for axes in figure.axes:
        if axes.get_ylabel():
            axes.set_ylabel(axes.get_ylabel().removeprefix("position "), fontsize=7)
            axes.yaxis.set_label_coords(-7.8 / _width_mm(axes), 0.5)


def _width_mm(axes: Any) -> float:
    return float(axes.get_position().width) * WIDTH_MM
