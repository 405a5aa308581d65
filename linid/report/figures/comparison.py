"""Measured and simulated motion of one recording (counterpart of the paper's Figs. 14 and 16)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from linid.report.figures.ahead import ahead_display, ahead_text, draw_ahead, draw_ahead_error, free_run_text
from linid.report.figures.common import (
    TIME_LABEL,
    draw_error,
    draw_pair,
    error_display,
    kind_and_split,
    legend_above,
    mark_breakdown,
    position_display,
    rms_text,
    shorten,
    velocity_display,
)
from linid.report.style import MEASURED, MODEL, caption, new_figure, stacked, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.gap import AheadPieces, Trace


def comparison_figure(trace: Trace) -> Figure:
    """Position, velocity and position error (model minus measured) of one recording over time.

    Driven recordings show the prediction restarted from the measured state every horizon, and the free run only while
    it keeps step: a driven axis has no spring, so that a free run which lost step says nothing more. Others show the
    free run.
    """
    with style():
        figure = new_figure(125.0)
        small_print = 0.0
        if trace.ahead is not None:
            text = f"{free_run_text(trace)} Error: every second prediction is drawn as a line."
            small_print = caption(figure, text)
        panels = stacked(figure, (3, 2, 2), caption_mm=small_print)
        if trace.ahead is None:
            _free_run(panels, trace)
        else:
            _restarted(panels, trace, trace.ahead)
        panels[0].set_title(f"{shorten(trace.recording, 40)} ({kind_and_split(trace)})")
        # above the middle panel, where no title is in its way
        legend_above(panels[1], handles=panels[0].get_legend_handles_labels()[0])
        panels[0].set_ylabel(f"position ({position_display([trace]).unit})")
        panels[1].set_ylabel(f"velocity ({velocity_display([trace]).unit})")
        panels[2].set_xlabel(TIME_LABEL)
    return figure


def _free_run(panels: Any, trace: Trace) -> None:
    top, middle, bottom = panels
    error = error_display([trace])
    draw_pair(top, trace.t, trace.y_measured, trace.y_simulated, position_display([trace]).factor)
    mark_breakdown(top, trace)
    factor = velocity_display([trace]).factor
    draw_pair(middle, trace.t, trace.velocity_measured, trace.velocity_simulated, factor)
    draw_error(bottom, trace.t, trace.y_measured, trace.y_simulated, error.factor)
    bottom.set_ylabel(f"error ({error.unit})")
    note = rms_text(trace)
    _say(bottom, f"model minus measured, {note}" if note else "")


def _restarted(panels: Any, trace: Trace, pieces: AheadPieces) -> None:
    top, middle, bottom = panels
    error = ahead_display(pieces, trace.axis)
    draw_ahead(top, trace, pieces, position_display([trace]).factor, free_run=True)
    factor = velocity_display([trace]).factor
    middle.plot(trace.t, trace.velocity_measured * factor, color=MEASURED, linewidth=2.4, zorder=2)
    limits = middle.get_ylim()
    middle.plot(pieces.t, pieces.v * factor, color=MODEL, linewidth=0.7, zorder=3)
    middle.set_ylim(limits)
    draw_ahead_error(bottom, pieces, error.factor)
    bottom.set_ylabel(f"error ({error.unit})")
    _say(bottom, f"model minus measured; points: {ahead_text(pieces, trace.axis)}")


def _say(axes: Any, text: str) -> None:
    axes.set_title(text, loc="right", fontweight="normal", fontsize=7.5)
