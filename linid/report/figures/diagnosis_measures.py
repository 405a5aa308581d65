"""How far the three measures shrink, recording by recording."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from linid.diagnosis.report_data import MEASURES
from linid.report.diagnosis.content import after_words, before_words, changed, held_out
from linid.report.diagnosis.measures import measure_display, measure_labels
from linid.report.display import log_limits
from linid.report.figures.common import shorten
from linid.report.style import ERROR, MEASURED, MEASURED_LIGHT, MUTED, caption, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.report_data import Change, Diagnosis


def measures_figure(diagnosis: Diagnosis) -> Figure:
    """Measures of every held-out recording and of all together: before, after and floor, logarithmic."""
    together = diagnosis.measures
    rows = [("all together", together), *((one.recording, one.changes) for one in held_out(diagnosis))]
    shown = [measure for measure in MEASURES if measure in together]
    with style():
        figure = new_figure(44.0 + 5.5 * len(rows), "Held-out recordings before and after")
        panels: Any = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
        for axes, measure in zip(panels, shown, strict=True):
            display = measure_display(diagnosis, measure)
            axes.set_xscale("log")
            sizes = [c[measure] for _, c in rows if measure in c]
            ends = [x for c in sizes for x in (c.before, c.after, c.floor, c.low, c.high)]
            axes.set_xlim(*log_limits(x * display.factor for x in ends))
            for row, (_, changes) in enumerate(rows):
                if measure in changes:
                    _dumbbell(axes, row, changes[measure], display.factor, changed(diagnosis))
            _readable_ticks(axes)
            axes.set_xlabel(f"{measure_labels(diagnosis.axis)[measure]} ({display.unit})")
            axes.grid(False, axis="y")
            axes.tick_params(axis="y", length=0)
        panels[0].set_yticks(range(len(rows)), [shorten(name, 28) for name, _ in rows])
        panels[0].get_yticklabels()[0].set_fontweight("bold")
        panels[0].set_ylim(len(rows) - 0.4, -0.6)
        after = f" Filled blue: {after_words(diagnosis)}." if changed(diagnosis) else ""
        interval = (
            " Thick line: 95 % for a new recording, above for all together."
            if any(c.low > 0 for c in together.values())
            else ""
        )
        words = f"Hollow: {before_words(diagnosis)}.{after} Tick: floor of noise and repeats.{interval}"
        caption(figure, words)
    return figure


def _dumbbell(axes: Any, row: int, change: Change, factor: float, after: bool) -> None:
    before, now, floor = (factor * x for x in (change.before, change.after, change.floor))
    if floor > 0:
        axes.plot([floor], [row], marker="|", markersize=8, markeredgewidth=1.4, color=MUTED, zorder=3)
        axes.plot([floor, max(before, floor)], [row, row], color="#D9D9D9", linewidth=1.4, zorder=1)
    if after:
        if 0 < change.low <= change.high:
            axes.plot(
                [factor * change.low, factor * change.high], [row, row], color=MEASURED_LIGHT, linewidth=3, zorder=2
            )
        axes.plot([now], [row], marker="o", markersize=4.5, color=MEASURED, zorder=5)
    axes.plot([before], [row], marker="o", markersize=4.5, color=ERROR, markerfacecolor="white", zorder=4)


def _readable_ticks(axes: Any) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axes.get_xlim()
    decades = math.log10(high / low)
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if decades < 1.2 else (1, 3) if decades < 2.2 else (1,)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
