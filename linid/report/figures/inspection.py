"""What was understood of a scope export: every channel over time, with marks where something is missing or was cut."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from linid.arrays import Array
from linid.report.style import ERROR, ERROR_LIGHT, MEASURED, MUTED, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST = 16  # panels
_PANEL_MM, _HEAD_MM = 22.0, 20.0
_MOST_MARKED = 500  # unreadable cells; more lines would cover the panel
_POINTS = 4000  # per panel: what a page can show; each stretch keeps its extremes


@dataclass(frozen=True)
class Panel:
    """One channel: x (n,) time in s or row number, y (n,) values; label: name, role and unit; read: whether used."""

    label: str
    x: Array
    y: Array
    read: bool


@dataclass(frozen=True)
class Marks:
    """gaps: (start, end) in s of missing samples; kept: (start, end) of what is used, None: all; unreadable: times of
    cells that are no number."""

    gaps: tuple[tuple[float, float], ...] = ()
    kept: tuple[float, float] | None = None
    unreadable: tuple[float, ...] = ()


def inspection_figure(title: str, panels: list[Panel], marks: Marks, x_label: str) -> Figure:
    """One panel per channel; channels beyond `_MOST` are counted in the title."""
    shown = sorted(panels, key=lambda p: not p.read)[:_MOST]
    more = f" ({len(panels) - len(shown)} more channels not shown)" if len(panels) > len(shown) else ""
    legend = _legend(marks)
    with style():
        figure = new_figure(_HEAD_MM + _PANEL_MM * max(len(shown), 1), f"{title}{more}")
        axes = figure.subplots(max(len(shown), 1), 1, sharex=True, squeeze=False)[:, 0]
        for ax, panel in zip(axes, shown, strict=False):
            x, y = _thinned(panel.x, panel.y)
            ax.plot(x, y, color=MEASURED if panel.read else MUTED, linewidth=0.7)
            ax.set_title(panel.label + ("" if panel.read else " (not used)"))
            for start, end in marks.gaps:
                ax.axvspan(start, end, color=ERROR_LIGHT, linewidth=0.0)
            for at in marks.unreadable[:_MOST_MARKED]:
                ax.axvline(at, color=ERROR, linewidth=0.5)
            if marks.kept is not None:
                for at in marks.kept:
                    ax.axvline(at, color=ERROR, linewidth=0.8, linestyle="--")
        axes[-1].set_xlabel(f"{x_label}\n{legend}" if legend else x_label)
    return figure


def _legend(marks: Marks) -> str:
    parts = []
    if marks.gaps:
        parts.append("shaded: samples missing")
    if marks.kept is not None:
        parts.append("between dashed lines: used")
    if marks.unreadable:
        parts.append("red lines: unreadable cells, interpolated")
    return "; ".join(parts)


def _thinned(x: Array, y: Array) -> tuple[Array, Array]:
    """At most `_POINTS` points with the extremes of each stretch."""
    n = x.size
    if n <= _POINTS:
        return x, y
    size = -(-n // (_POINTS // 2))
    whole = n // size * size
    blocks = np.where(np.isfinite(y[:whole]), y[:whole], 0.0).reshape(-1, size)
    starts = np.arange(0, whole, size)
    rows = np.sort(np.concatenate([starts + blocks.argmin(axis=1), starts + blocks.argmax(axis=1)]))
    return x[rows], y[rows]
