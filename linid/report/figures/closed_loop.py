"""An axis in closed loop: commanded and followed position, following error and current."""

from __future__ import annotations

from typing import TYPE_CHECKING

from linid.arrays import Array
from linid.report.display import display_unit, peak
from linid.report.figures.common import TIME_LABEL, legend_above, shorten
from linid.report.style import MEASURED, MODEL, MUTED, new_figure, stacked, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.simulation.closed_loop import ClosedLoop


def closed_loop_figure(
    name: str,
    run: ClosedLoop,
    axis: str,
    measured: Array | None = None,
    limit: float = 0.0,
    measured_current: Array | None = None,
) -> Figure:
    """Position, following error and q-current over time.

    name: of the recording; axis: linear or rotary; measured: (n,) position in m, where the machine's own is known;
    measured_current: (n,) A, its q-current likewise; limit: of the current, A, drawn where the run comes near it.
    """
    position = display_unit("position", axis, peak(run.reference))
    with style():
        figure = new_figure(125.0)
        top, middle, bottom = stacked(figure, (3, 2, 2))
        top.plot(run.t, run.reference * position.factor, color=MUTED, linewidth=2.4, label="commanded", zorder=1)
        courses = [] if measured is None else [(measured, MEASURED, 1.6, "measured")]
        courses += [(run.y, MODEL, 0.8, "simulated")]
        error = display_unit("position", axis, peak(*(run.reference - y for y, *_ in courses)))
        for y, colour, width, label in courses:
            top.plot(run.t, y * position.factor, color=colour, linewidth=width, label=label)
            middle.plot(run.t, (run.reference - y) * error.factor, color=colour, linewidth=width)
        if measured_current is not None:
            bottom.plot(run.t, measured_current, color=MEASURED, linewidth=1.6, label="measured")
        bottom.plot(run.t, run.current, color=MODEL, linewidth=0.8)
        if limit and peak(run.current) > 0.8 * limit:
            for sign in (-1.0, 1.0):
                bottom.axhline(sign * limit, color=MUTED, linewidth=0.8, linestyle="--")
        top.set_title(f"{shorten(name, 40)}: in closed loop")
        handles = top.get_legend_handles_labels()[0]
        legend_above(middle, handles=handles + (bottom.get_legend_handles_labels()[0] if measured is None else []))
        top.set_ylabel(f"position ({position.unit})")
        middle.set_ylabel(f"following error ({error.unit})")
        bottom.set_ylabel("q-current (A)")
        bottom.set_xlabel(TIME_LABEL)
    return figure
