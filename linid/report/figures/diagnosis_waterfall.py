"""The gap as a waterfall: all of it, less what each effect causes, down to what no effect explains."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING, Any

from linid.report.diagnosis.budget import waterfall, waterfall_words
from linid.report.style import ACCENT, ERROR, MEASURED, MUTED, caption, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.report_data import Diagnosis
    from linid.report.diagnosis.budget import Step

GAP, REST = "#BDBDBD", "#E69F00"
_LINE = 34  # characters of a label


def colour(step: Step) -> str:
    """Grey the gap, blue an effect (green where rivals do as well, vermilion where it adds to the gap), amber the
    rest."""
    if step.kind != "effect":
        return GAP if step.kind == "gap" else REST
    if step.end > step.start:
        return ERROR
    return ACCENT if " or " in step.label else MEASURED


def limits(steps: tuple[Step, ...]) -> tuple[float, float]:
    """Ends of the axis in per cent that hold all bars and whiskers."""
    ends = [100.0 * e for s in steps for e in (s.start, s.end, s.low, s.high) if math.isfinite(e)]
    return max(-100.0, min(0.0, *ends)) - 2.0, min(200.0, max(100.0, *ends)) + 2.0


def waterfall_figure(diagnosis: Diagnosis) -> Figure:
    """Horizontal bars from the whole gap down to the floor, with the share of each and its 95 % whisker."""
    steps = waterfall(diagnosis)
    low, high = limits(steps)
    with style():
        figure = new_figure(36.0 + 8.5 * len(steps), f"Where the gap of {diagnosis.name} comes from")
        axes: Any = figure.subplots()
        for row, step in enumerate(steps):
            start, end = 100 * step.start, 100 * step.end
            axes.barh(row, end - start, left=start, height=0.62, color=colour(step), zorder=2)
            if step.reach > 0:
                axes.barh(
                    row,
                    100 * step.reach,
                    height=0.62,
                    facecolor="none",
                    edgecolor="white",
                    hatch="////",
                    linewidth=0,
                    zorder=3,
                )
            if math.isfinite(step.low) and math.isfinite(step.high):
                ends = [100 * step.low, 100 * step.high]
                axes.plot(ends, [row, row], color="black", linewidth=1.1, marker="|", markersize=5, zorder=4)
            if row + 1 < len(steps):
                place = end if step.kind == "effect" else start
                axes.plot([place, place], [row + 0.31, row + 0.69], color=MUTED, linewidth=0.7, zorder=1)
            text = step.words.replace(" [", "\n[") if step.kind != "gap" else step.words
            axes.text(high + 1.5, row, text, va="center", fontsize=7.5)
        axes.axvline(0.0, color=MUTED, linewidth=1.2, linestyle="--", zorder=1)
        axes.annotate(
            "floor",
            (0.0, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(2, 2),
            textcoords="offset points",
            fontsize=7,
            color=MUTED,
        )
        names = ["\n".join(textwrap.wrap(step.label, _LINE)) for step in steps]
        axes.set_yticks(range(len(steps)), names)
        axes.set_ylim(len(steps) - 0.4, -0.6)
        axes.set_xlim(low, high + 0.17 * (high - low))
        axes.set_xticks([x for x in range(-100, 201, 25) if low <= x <= high])
        axes.set_xlabel("share of the gap (%)")
        axes.grid(False, axis="y")
        axes.tick_params(axis="y", length=0)
        caption(figure, waterfall_words(diagnosis))
    return figure
