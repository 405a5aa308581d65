"""Measured drive inputs and the splines that excite the model (counterpart of the paper's Figs. 12 and 13)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.arrays import Array
from linid.report.display import envelope
from linid.report.figures.common import TIME_LABEL, legend_above, shorten
from linid.report.style import MUTED, PHASES, SHADE, new_figure, stacked, style
from linid.report.symbols import unit_label

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Spline = Callable[[Array], Array]
_ZOOM_SAMPLES = 40
_FINER = 20


def currents_figure(
    name: str,
    t: Array,
    currents: Array,
    spline: Spline | None = None,
    zoom: tuple[float, float] | None = None,
    labels: Sequence[str] = (),
    unit: str = "A",
) -> Figure:
    """Whole record above, a zoom with samples and spline below.

    t: (n,) s; currents: (k, n) in `unit`, k up to 3; spline: maps (m,) s to (k, m); zoom: (start, end) in s, else the
    liveliest 40 samples; labels: k names, else I_1 ...
    """
    currents = np.atleast_2d(currents)
    names = list(labels) or ([f"$I_{j + 1}$" for j in range(len(currents))] if len(currents) > 1 else ["input"])
    start, end = zoom or liveliest(t, currents)
    inside = (t >= start) & (t <= end)
    fine = np.linspace(start, end, _FINER * max(int(inside.sum()), 2))
    with style():
        figure = new_figure(105.0)
        top, bottom = stacked(figure, (1, 1), apart=True)
        for row, colour, label in zip(currents, PHASES, names, strict=False):
            top.plot(*envelope(t, row), color=colour, linewidth=0.8, label=label)
            bottom.plot(t[inside], row[inside], "o", color=colour, markersize=3.0, zorder=3)
        if spline is not None:
            for row, colour in zip(np.atleast_2d(spline(fine)), PHASES, strict=False):
                bottom.plot(fine, row, color=colour, linewidth=0.9, zorder=2)
        top.axvspan(start, end, facecolor=SHADE, edgecolor=MUTED, linewidth=0.5, zorder=0)
        quantity = "current" if unit == "A" else "input"
        top.set_title(f"{shorten(name, 48)}: drive {quantity}")
        legend_above(top)
        bottom.set_title("Shaded stretch: " + ("samples (points) and spline (lines)" if spline else "samples"))
        for axes in (top, bottom):
            _zero_line(axes, currents)
            axes.set_ylabel(f"{quantity} ({unit_label(unit)})")
            axes.set_xlabel(TIME_LABEL)
    return figure


def liveliest(t: Array, currents: Array, samples: int = _ZOOM_SAMPLES) -> tuple[float, float]:
    """The stretch of `samples` samples in which the inputs change most, as (start, end) in s. t: (n,) s;
    currents: (3, n) A, or (1, n) of one input.
    """
    if len(t) <= samples:
        return float(t[0]), float(t[-1])
    change = np.abs(np.diff(currents, axis=1)).sum(axis=0)
    total = np.concatenate(([0.0], np.cumsum(change)))
    moved = total[samples - 1 :] - total[: -(samples - 1)]
    start = int(np.argmax(moved))
    return float(t[start]), float(t[start + samples - 1])


def _zero_line(axes: Any, currents: Array) -> None:
    if np.nanmin(currents) <= 0.0 <= np.nanmax(currents):
        low, high = axes.get_ylim()
        if low <= 0.0 <= high:
            axes.axhline(0.0, color=MUTED, linewidth=0.5, zorder=1)
