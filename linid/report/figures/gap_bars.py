"""The three gap measures of every recording beside their floors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.arrays import Array
from linid.errors import DataError
from linid.report.figures.common import shorten
from linid.report.latex import floor_note
from linid.report.numbers import format_number
from linid.report.style import ERROR, MEASURED, MEASURED_LIGHT, MUTED, caption, grid, new_figure, style
from linid.report.symbols import unit_label
from linid.report.tables import gap_units, per_mass

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.gap import RecordingGap

_LETTER_MM = 1.6  # a wide letter of the tick labels


def gap_figure(gaps: Sequence[RecordingGap], axis: str = "linear") -> Figure:
    """Per recording a bar from the floor (tick) to the measure (dot), logarithmic; held-out recordings filled. Raises
    DataError where there is none.
    """
    if not gaps:
        raise DataError("gap figure", "there is no recording to draw", "Give the gap of at least one recording.")
    ahead, force = gap_units(axis, per_mass(gaps))
    panels = (
        ("free run, NRMSE (%)", [100 * g.free_run for g in gaps], [100 * g.free_run_floor for g in gaps]),
        (f"0.1 s ahead, RMS ({ahead})", [1e6 * g.ahead for g in gaps], [1e6 * g.ahead_floor for g in gaps]),
        (f"residual force, RMS ({unit_label(force)})", [g.force for g in gaps], [g.force_floor for g in gaps]),
    )
    held_out = [g.split == "held_out" for g in gaps]
    with style():
        figure = new_figure(38.0 + 5.5 * len(gaps), "Gap between simulation and machine, per recording")
        names = [shorten(g.recording, 28) + ("*" if g.repeats else "") for g in gaps]
        text = f"Filled dot: held out. Hollow dot: fitted. Tick: floor. {floor_note(gaps)}"
        margins = (4.0 + _LETTER_MM * max(map(len, names)), 3.0, 10.5 + caption(figure, text), 8.0)
        row_of_axes: Any = grid(figure, 1, 3, margins=margins, gaps=(5.0, 0.0)).subplots(sharey=True)
        for axes, (label, values, floors) in zip(row_of_axes, panels, strict=True):
            _panel(axes, np.array(values, dtype=float), np.array(floors, dtype=float), held_out)
            axes.set_xlabel(label)
        first = row_of_axes[0]
        first.set_yticks(range(len(gaps)), names)
        first.set_ylim(len(gaps) - 0.4, -0.6)
    return figure


def _panel(axes: Any, values: Array, floors: Array, held_out: list[bool]) -> None:
    shown = np.concatenate([values, floors])
    shown = shown[np.isfinite(shown) & (shown > 0)]
    low, high = (float(shown.min()) / 1.6, float(shown.max())) if shown.size else (0.1, 1.0)
    high = max(high * (high / low) ** 0.45, 4.0 * high)  # room for the written values
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    for row, (value, floor, filled) in enumerate(zip(values, floors, held_out, strict=True)):
        if not np.isfinite(value):
            axes.text(low, row, " no value", va="center", fontsize=6.5, color=ERROR)
            continue
        end = max(float(value), low)
        if np.isfinite(floor):
            tick = max(float(floor), low)
            axes.plot([tick, end], [row, row], color=MEASURED_LIGHT, linewidth=1.6, zorder=2, solid_capstyle="butt")
            axes.plot([tick], [row], marker="|", markersize=7, markeredgewidth=1.2, color=MUTED, zorder=3)
        face = MEASURED if filled else "white"
        axes.plot([end], [row], marker="o", markersize=4, color=MEASURED, markerfacecolor=face, zorder=4)
        right = max(end, float(floor)) if np.isfinite(floor) else end
        axes.annotate(
            format_number(float(value)),
            (right, row),
            xytext=(5, 0),
            textcoords="offset points",
            va="center",
            fontsize=6.5,
        )
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.minorticks_off()
    axes.spines["left"].set_visible(False)
    _few_ticks(axes, low, high)


def _few_ticks(axes: Any, low: float, high: float) -> None:
    from matplotlib.ticker import FixedLocator, FuncFormatter

    decades = np.arange(np.ceil(np.log10(low)), np.floor(np.log10(high)) + 1)
    # Wide labels: five in a panel would touch.
    ticks = [10.0**d for d in decades[:: max(1, -(-len(decades) // 4))]]
    if len(ticks) < 2:
        start = np.floor(np.log10(low))
        ticks = [m * 10.0**d for d in (start, start + 1, start + 2) for m in (1, 2, 5) if low <= m * 10.0**d <= high]
    axes.xaxis.set_major_locator(FixedLocator(ticks))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: format_number(x, 2)))
