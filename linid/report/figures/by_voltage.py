"""A motor that phase voltages alone drive: motion and currents, measured and simulated (eqs. 31 and 39)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.errors import DataError
from linid.report.display import display_unit, envelope, rms
from linid.report.figures.common import TIME_LABEL, draw_pair, error_display, position_display, shorten
from linid.report.numbers import format_number
from linid.report.style import ERROR, MODEL, MUTED, PHASES, grid, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.arrays import Array
    from linid.diagnosis.gap import Trace

_STRETCH = 0.4  # s at the end of a recording, in which single turns of the field are seen
_HEIGHTS = (3.0, 2.0, 2.0, 3.0)


@dataclass(frozen=True)
class ByVoltage:
    """trace: of a free run by voltages, with its simulated currents; voltages, currents: as logged, (3, n) V and A."""

    trace: Trace
    voltages: Array
    currents: Array


def by_voltage_figure(cases: Sequence[ByVoltage], title: str) -> Figure:
    """A column per recording: position, error, and at its end phase voltages and currents. Raises DataError without
    recordings."""
    if not cases:
        raise DataError("figure by voltages", "there is no run to draw", "Give runs by phase voltages.")
    with style():
        figure = new_figure(158.0)
        figure.text(0.01, 0.99, title, fontsize=9.5, fontweight="bold", va="top")
        margins, gaps = (15.0, 3.0, 11.0, 18.0), (17.0, 13.0)
        cells = grid(figure, 4, len(cases), margins=margins, gaps=gaps, heights=_HEIGHTS).subplots(squeeze=False)
        for case, panels in zip(cases, np.asarray(cells).T, strict=True):
            _motion(panels[0], panels[1], case.trace)
            _phases(panels[2], panels[3], case)
        handles = [*cells[0][0].get_lines()[:2], *cells[2][0].get_lines()[:3]]
        labels = [str(handle.get_label()) for handle in handles]
        figure.legend(handles, labels, loc="upper right", bbox_to_anchor=(0.99, 0.965), ncols=5, borderaxespad=0.0)
    return figure


def _motion(top: Any, bottom: Any, trace: Trace) -> None:
    position, error = position_display([trace]), error_display([trace])
    off = trace.y_simulated - trace.y_measured
    draw_pair(top, trace.t, trace.y_measured, trace.y_simulated, position.factor)
    bottom.axhline(0.0, color=MUTED, linewidth=0.5, zorder=1)
    bottom.plot(*envelope(trace.t, off * error.factor), color=ERROR, linewidth=0.8)
    top.set_title(shorten(trace.recording, 30), fontsize=8, loc="left")
    size = display_unit("position", trace.axis, rms(off))
    said = f"error, RMS {format_number(rms(off) * size.factor)} {size.unit}"
    bottom.set_title(said, fontsize=7, loc="left", fontweight="normal", pad=2.0)
    for axes, label in ((top, f"position ({position.unit})"), (bottom, f"error ({error.unit})")):
        axes.set_xlim(float(trace.t[0]), float(trace.t[-1]))
        axes.set_ylabel(label, fontsize=7.5)
    bottom.set_xlabel(TIME_LABEL, fontsize=7.5, labelpad=1.0)


def _phases(top: Any, bottom: Any, case: ByVoltage) -> None:
    """Logged voltages, and logged (wide) and simulated (thin, black) currents of the last stretch."""
    t = case.trace.t
    late = t >= t[-1] - _STRETCH
    simulated = case.trace.phase_currents
    assert simulated is not None
    rows = zip(PHASES, case.voltages, case.currents, simulated, strict=True)
    for number, (colour, voltage, measured, model) in enumerate(rows, 1):
        top.plot(t[late], voltage[late], color=colour, linewidth=0.9, label=f"phase {number}")
        bottom.plot(t[late], measured[late], color=colour, linewidth=2.4, zorder=2)
        bottom.plot(t[late], model[late], color=MODEL, linewidth=0.7, zorder=3)
    off = format_number(1e3 * rms(simulated - case.currents))
    bottom.set_title(f"currents, RMS error {off} mA", fontsize=7, loc="left", fontweight="normal", pad=2.0)
    for axes, label in ((top, "voltage (V)"), (bottom, "current (A)")):
        axes.axhline(0.0, color=MUTED, linewidth=0.5, zorder=1)
        axes.set_xlim(float(t[late][0]), float(t[-1]))
        axes.set_ylabel(label, fontsize=7.5)
    top.set_title(f"the last {_STRETCH:g} s: imposed voltages", fontsize=7, loc="left", fontweight="normal", pad=2.0)
    bottom.set_xlabel(TIME_LABEL, fontsize=7.5, labelpad=1.0)
