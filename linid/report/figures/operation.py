"""Cases of operation: position, velocity and error of two models (counterpart of the paper's Figs. 14 to 17)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.errors import DataError
from linid.report.display import display_unit, envelope, peak
from linid.report.figures.ahead import ahead_text
from linid.report.figures.common import TIME_LABEL, position_display, shorten, velocity_display
from linid.report.style import ACCENT, MEASURED, MODEL, MUTED, WIDTH_MM, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.gap import AheadPieces, Trace

_TOP, _BOTTOM, _LEFT, _RIGHT = 12.0, 4.0, 3.0, 3.0  # margins in mm
_CELL, _LABELS = 84.0, 13.0  # height of a case, room for its labels
_PANELS = ((49.0, 27.0), (29.5, 17.0), (9.0, 15.0))  # of a case: from its lower edge, height
_POINTS = 4000
_LOOKS: tuple[dict[str, Any], ...] = (  # of the model that is shown, and of the other
    {"color": MODEL, "linewidth": 0.8, "zorder": 4},
    {"color": ACCENT, "linewidth": 1.8, "zorder": 3},  # an edge of it is seen where both are alike
)


def operation_figure(traces: Sequence[Trace], others: Sequence[Trace], names: tuple[str, str], title: str) -> Figure:
    """Per case the measured motion, two models restarted from it every 0.1 s, and how far these are off.

    traces, others: of the same driven recordings, by the model that is shown and by another one; names: of the models.
    Raises DataError without traces, or where they show no prediction ahead.
    """
    pieces = [(one.ahead, other.ahead) for one, other in zip(traces, others, strict=True)]
    if not pieces or any(ahead is None for pair in pieces for ahead in pair):
        raise DataError("operation figure", "there is no prediction to draw", "Give traces of driven recordings.")
    height = _TOP + _BOTTOM + _CELL * -(-len(pieces) // 2)
    with style():
        figure = new_figure(height)
        figure.set_layout_engine(None)
        figure.text(0.01, 1 - 2.0 / height, title, fontsize=9.5, fontweight="bold", va="top")
        ahead = pieces[0][0]
        note = f"Each model begins anew from the measured state every {ahead.horizon:.3g} s." if ahead else ""
        note += " Error: predicted minus measured position; RMS: of its ends."
        figure.text(0.01, 1 - 7.0 / height, note, fontsize=7, color=MUTED, va="top")
        for index, (trace, pair) in enumerate(zip(traces, pieces, strict=True)):
            panels = [figure.add_axes(box) for box in _boxes(index, height)]
            _case(panels, trace, [one for one in pair if one is not None], names)
        handles, labels = figure.axes[0].get_legend_handles_labels()
        place = (1.0 - 2.0 / WIDTH_MM, 1 - 1.0 / height)
        figure.legend(handles, labels, loc="upper right", bbox_to_anchor=place, ncols=3, borderaxespad=0.0)
    return figure


def _boxes(index: int, height: float) -> list[tuple[float, float, float, float]]:
    """(left, bottom, width, height) in figure fractions of a case's panels; two cases side by side."""
    row, column = divmod(index, 2)
    cell = (WIDTH_MM - _LEFT - _RIGHT) / 2
    left, width = _LEFT + column * cell + _LABELS, cell - _LABELS - 2.5
    bottom = height - _TOP - (row + 1) * _CELL
    return [(left / WIDTH_MM, (bottom + low) / height, width / WIDTH_MM, tall / height) for low, tall in _PANELS]


def _case(panels: list[Any], trace: Trace, pieces: list[AheadPieces], names: tuple[str, str]) -> None:
    position, velocity = position_display([trace]), velocity_display([trace])
    error = display_unit("position", trace.axis, max(peak(one.end_error) for one in pieces))
    top, middle, bottom = panels
    measured = {"color": MEASURED, "linewidth": 3.4, "zorder": 2}
    top.plot(*envelope(trace.t, trace.y_measured * position.factor), label="measured", **measured)
    middle.plot(*envelope(trace.t, trace.velocity_measured * velocity.factor), **measured)
    limits = middle.get_ylim()  # the differentiated position's; a prediction's first speeds may be wild
    bottom.axhline(0.0, color=MUTED, linewidth=0.5, zorder=1)
    for one, look, name in zip(pieces, _LOOKS, names, strict=True):
        top.plot(*envelope(one.t, one.y * position.factor, _POINTS), label=name, **look)
        middle.plot(*envelope(one.t, one.v * velocity.factor, _POINTS), **look)
        bottom.plot(*envelope(one.t, one.error * error.factor, _POINTS), **look)
    middle.set_ylim(limits)
    top.set_title(shorten(trace.recording, 42), fontsize=7.5, loc="left")
    said = "; ".join(
        f"{name} {ahead_text(one, trace.axis).split(', ')[-1]}" for one, name in zip(pieces, names, strict=True)
    )
    bottom.set_title(said, fontsize=7, loc="left", fontweight="normal", pad=2.0)
    units = (f"position ({position.unit})", f"velocity ({velocity.unit})", f"error ({error.unit})")
    for axes, label in zip(panels, units, strict=True):
        axes.set_xlim(float(trace.t[0]), float(trace.t[-1]))
        axes.set_ylabel(label, fontsize=7.5)
        axes.tick_params(labelsize=7, pad=2, labelbottom=axes is bottom, bottom=axes is bottom)
        axes.yaxis.set_label_coords(-10.5 / (np.asarray(axes.get_position().width) * WIDTH_MM), 0.5)
    bottom.set_xlabel(TIME_LABEL, fontsize=7.5, labelpad=1.5)
