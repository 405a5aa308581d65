"""Measured and simulated motion of one recording (counterpart of the paper's Figs. 14 and 16)."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
from linid.report.style import new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.gap import Trace


def comparison_figure(trace: Trace) -> Figure:
    """Position, velocity and position error (simulated minus measured) of one recording over time."""
    position, velocity, error = position_display([trace]), velocity_display([trace]), error_display([trace])
    with style():
        figure = new_figure(125.0)
        top, middle, bottom = figure.subplots(3, 1, sharex=True, gridspec_kw={"height_ratios": [3, 2, 2]})
        draw_pair(top, trace.t, trace.y_measured, trace.y_simulated, position.factor)
        mark_breakdown(top, trace)
        top.set_title(f"{shorten(trace.recording, 48)} ({kind_and_split(trace)})")
        top.set_ylabel(f"position ({position.unit})")
        legend_above(top)
        draw_pair(middle, trace.t, trace.velocity_measured, trace.velocity_simulated, velocity.factor)
        middle.set_ylabel(f"velocity ({velocity.unit})")
        draw_error(bottom, trace.t, trace.y_measured, trace.y_simulated, error.factor)
        bottom.set_ylabel(f"error ({error.unit})")
        note = rms_text(trace)
        bottom.set_title(
            f"model minus measured, {note}" if note else "", loc="right", fontweight="normal", fontsize=7.5
        )
        bottom.set_xlabel(TIME_LABEL)
        figure.align_ylabels()
    return figure
