"""Free wheels by added mass: displacement and velocity with the model (counterpart of the paper's Figs. 9 to 11)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from linid.arrays import Array
from linid.errors import DataError
from linid.report.display import Display, display_unit, every, peak
from linid.report.figures.common import TIME_LABEL, shorten
from linid.report.style import ERROR, MEASURED, MODEL, MUTED, caption, grid, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.gap import Trace

_MARKERS = ("o", "s", "^", "D", "v", "P")
_DASHES = ("-", "--", ":", "-.", (0, (5, 1, 1, 1)), (0, (1, 3)))
_POINTS = 45
_LEGEND_LINE = 0.1  # of the axes' height
_STOPPED = 2e-3  # of the travel: what is left to go when a free wheel counts as stopped
_BEYOND_STOP = 1.4  # how far past the stop is drawn
_FAR_OFF = 1.6  # times the measured span: a simulation that goes further is cut off
_LEGEND_LINES = 3  # more would take the curves' room


def free_wheel_displacement_figure(traces: Sequence[Trace]) -> Figure:
    """Displacement since release, in the direction of travel: points measured, line model, error below. Raises
    DataError where there is none.
    """
    return _figure(traces, "position", "Free wheels: displacement in the direction of travel", "displacement")


def free_wheel_velocity_figure(traces: Sequence[Trace]) -> Figure:
    """Velocity in the direction of travel: points differentiated position, line model, error below. Raises DataError
    where there is none.
    """
    return _figure(traces, "velocity", "Free wheels: velocity in the direction of travel", "velocity")


def direction(trace: Trace) -> float:
    """+1 or -1: which way the recording travels."""
    return -1.0 if trace.y_measured[-1] < trace.y_measured[0] else 1.0


def _end_of_interest(trace: Trace) -> float:
    """Time since release that is worth drawing, s: until the stop and a share beyond."""
    away = np.abs(trace.y_measured - trace.y_measured[-1]) > _STOPPED * np.ptp(trace.y_measured)
    t = trace.t - trace.t[0]
    stop = float(t[np.flatnonzero(away)[-1]]) if away.any() else float(t[-1])
    return min(_BEYOND_STOP * stop, float(t[-1])) or 1.0


def until_rest(trace: Trace) -> Trace:
    """The motion of a trace (samples in SI, as before) until the stop and a share beyond, without its currents."""
    few = slice(int(np.searchsorted(trace.t - trace.t[0], _end_of_interest(trace), side="right")))
    names = ("t", "y_measured", "y_simulated", "velocity_measured", "velocity_simulated")
    cut: dict[str, Any] = {name: getattr(trace, name)[few] for name in names}
    return replace(trace, phase_currents=None, drive_input=None, **cut)


def _lines(trace: Trace, quantity: str) -> tuple[Array, Array]:
    sign = direction(trace)
    if quantity == "velocity":
        return sign * trace.velocity_measured, sign * trace.velocity_simulated
    return sign * (trace.y_measured - trace.y_measured[0]), sign * (trace.y_simulated - trace.y_measured[0])


def _figure(traces: Sequence[Trace], quantity: Literal["position", "velocity"], title: str, label: str) -> Figure:
    if not traces:
        raise DataError("free-wheel figure", "there is no free wheel to draw", "Give at least one free-wheel trace.")
    groups: dict[float, list[Trace]] = {}
    for trace in sorted(traces, key=lambda one: one.added_mass):
        groups.setdefault(trace.added_mass, []).append(trace)
    axis = traces[0].axis
    pairs = [_lines(trace, quantity) for trace in traces]
    main = display_unit(quantity, axis, max(peak(measured) for measured, _ in pairs))
    largest = max(min(peak(simulated - measured), peak(measured)) for measured, simulated in pairs)
    error = display_unit(quantity, axis, largest)
    columns = {1: 1, 2: 2, 4: 2}.get(len(groups), 3)
    rows = -(-len(groups) // columns)
    source = "differentiated position" if quantity == "velocity" else "measured"
    with style():
        figure = new_figure(12.0 + 85.0 * rows, title)
        text = f"Points: {source}, down-sampled. Line: model. Error: model minus measured. Long rests are cut."
        margins = (17.0, 3.0, 10.5 + caption(figure, text), 12.0)
        cells = grid(figure, rows, columns, margins=margins, gaps=(12.0, 17.0))
        first: tuple[Any, Any] | None = None
        for index, (mass, group) in enumerate(groups.items()):
            row, column = divmod(index, columns)
            pair = cells[row, column].subgridspec(2, 1, height_ratios=[2.4, 1.0], hspace=0.1)
            top = figure.add_subplot(pair[0], sharey=first[0] if first else None)
            bottom = figure.add_subplot(pair[1], sharex=top, sharey=first[1] if first else None)
            first = first or (top, bottom)
            _panel(top, bottom, group, quantity, (main, error), columns)
            unit = "kg m²" if axis == "rotary" else "kg"
            top.set_title(f"added {'inertia' if axis == 'rotary' else 'mass'} {mass:g} {unit}")
            top.tick_params(labelbottom=False)
            bottom.set_xlabel(TIME_LABEL)
            if column == 0:
                top.set_ylabel(f"{label} ({main.unit})")
                bottom.set_ylabel(f"error ({error.unit})")
        if first is not None:
            share = 0.03 + _LEGEND_LINE * max(_legend_lines(group, columns) or 1 for group in groups.values())
            low, high = first[0].get_ylim()
            first[0].set_ylim(low, high + (high - low) * share / (1.0 - share))
        figure.align_ylabels()
    return figure


def _legend_columns(columns: int) -> int:
    return {1: 3, 2: 2}.get(columns, 1)


def _legend_lines(group: list[Trace], columns: int) -> int:
    """Lines of a panel's legend above its curves; 0 if there is no room for one."""
    lines = -(-len(group) // _legend_columns(columns))
    return lines if lines <= _LEGEND_LINES and len(group) <= len(_MARKERS) else 0


def _panel(
    top: Any, bottom: Any, group: list[Trace], quantity: str, units: tuple[Display, Display], columns: int
) -> None:
    main, error = units
    bottom.axhline(0.0, color=MUTED, linewidth=0.5, zorder=1)
    end = max(_end_of_interest(trace) for trace in group)
    top.set_xlim(-0.03 * end, end)
    for index, trace in enumerate(group):
        measured, simulated = _lines(trace, quantity)
        t = trace.t - trace.t[0]
        few = every(int(np.searchsorted(t, end)) + 1, _POINTS)
        top.plot(t, simulated * main.factor, color=MODEL, linewidth=0.9, zorder=2)
        top.plot(
            t[few],
            measured[few] * main.factor,
            linestyle="none",
            color=MEASURED,
            zorder=3,
            marker=_MARKERS[index % len(_MARKERS)],
            markeredgewidth=0.6,
            markerfacecolor=MEASURED if index % 2 == 0 else "white",
            label=trace.recording,
        )
        bottom.plot(
            t,
            (simulated - measured) * error.factor,
            color=ERROR,
            linewidth=0.8,
            zorder=2,
            linestyle=_DASHES[index % len(_DASHES)],
        )
        if not np.isfinite(simulated).all():
            first = float(t[int(np.argmax(~np.isfinite(simulated)))])
            top.axvline(first, color=ERROR, linewidth=0.8, linestyle=":")
    span = max(peak(_lines(trace, quantity)[0]) for trace in group)
    if span > 0 and max(peak(_lines(trace, quantity)[1]) for trace in group) > _FAR_OFF * span:
        top.set_ylim(-0.1 * span * main.factor, _FAR_OFF * span * main.factor)
        bottom.set_ylim(-span * error.factor, span * error.factor)
    if _legend_lines(group, columns):
        names = [shorten(trace.recording, 20) for trace in group]
        top.legend(
            *(top.get_legend_handles_labels()[0], names),
            loc="upper right",
            markerscale=1.4,
            borderaxespad=0.1,
            ncols=_legend_columns(columns),
            handletextpad=0.2,
        )
    else:
        top.text(0.99, 0.99, f"{len(group)} recordings", transform=top.transAxes, ha="right", va="top", fontsize=7.5)
