"""A simulated motion that nothing measured lies beside: position, velocity and the currents that the voltages drive."""

from __future__ import annotations

from typing import TYPE_CHECKING

from linid.report.display import display_unit, peak
from linid.report.figures.common import TIME_LABEL, legend_above, shorten
from linid.report.style import MODEL, PHASES, new_figure, stacked, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.gap import Trace


def unmeasured_figure(trace: Trace) -> Figure:
    """Position, velocity and phase currents of one simulation over time."""
    position = display_unit("position", trace.axis, peak(trace.y_simulated))
    velocity = display_unit("velocity", trace.axis, peak(trace.velocity_simulated))
    with style():
        figure = new_figure(125.0)
        top, middle, bottom = stacked(figure, (3, 2, 2))
        top.plot(trace.t, trace.y_simulated * position.factor, color=MODEL, linewidth=0.9)
        middle.plot(trace.t, trace.velocity_simulated * velocity.factor, color=MODEL, linewidth=0.9)
        if trace.phase_currents is not None:
            for j, (row, colour) in enumerate(zip(trace.phase_currents, PHASES, strict=True)):
                bottom.plot(trace.t, row, color=colour, linewidth=0.8, label=f"$I_{j + 1}$")
            legend_above(bottom)
        top.set_title(f"{shorten(trace.recording, 40)}: simulated by its voltages")
        top.set_ylabel(f"position ({position.unit})")
        middle.set_ylabel(f"velocity ({velocity.unit})")
        bottom.set_ylabel("current (A)")
        bottom.set_xlabel(TIME_LABEL)
    return figure
