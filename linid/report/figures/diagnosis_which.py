"""Which effect explains the gap, and how far it then shrinks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from linid.diagnosis.report_data import MEASURES
from linid.report.diagnosis_content import (
    MEASURE_WORDS,
    after_words,
    before_words,
    changed,
    held_out,
    interval_percent,
    measure_display,
    percent,
    ranked,
    role,
    totals,
)
from linid.report.display import log_limits
from linid.report.figures.common import shorten
from linid.report.style import ACCENT, ERROR, MEASURED, MEASURED_LIGHT, MUTED, caption, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.report_data import Change, Diagnosis

MOST_CANDIDATES = 15


def ranking_figure(diagnosis: Diagnosis) -> Figure:
    """Candidates with screened share (light) and confirmed closure with its 95 % interval (dark)."""
    rows = ranked(diagnosis)[:MOST_CANDIDATES]
    left_out = len(diagnosis.candidates) - len(rows)
    with style():
        figure = new_figure(38.0 + 7.0 * len(rows), "Which effect explains the gap")
        axes: Any = figure.subplots()
        for row, one in enumerate(rows):
            part = role(diagnosis, one)
            colour = {"cause": MEASURED, "equivalent": ACCENT}.get(part, MUTED)
            if math.isfinite(one.explained):
                axes.barh(row, max(0.0, 100 * one.explained), height=0.72, color="#E4E4E4", zorder=1)
            if math.isfinite(one.closure):
                axes.barh(row, 100 * one.closure, height=0.34, color=colour, zorder=2)
                if math.isfinite(one.low) and math.isfinite(one.high):
                    axes.plot([100 * one.low, 100 * one.high], [row, row], color="black", linewidth=1.0, zorder=3)
                text = f"{percent(one.closure)} {interval_percent(one.low, one.high)}"
                axes.text(108, row, text, va="center", fontsize=7, fontweight="bold" if part else "normal")
        ends = [e for one in rows for e in (one.low, one.closure) if math.isfinite(e)]
        axes.set_xlim(max(-50.0, min(0.0, *(100 * e for e in ends))) - 1 if ends else 0.0, 145)
        axes.set_xticks([0, 25, 50, 75, 100])
        axes.set_yticks(range(len(rows)), [one.name for one in rows])
        for label, one in zip(axes.get_yticklabels(), rows, strict=True):
            label.set_fontweight("bold" if role(diagnosis, one) else "normal")
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.set_xlabel("share (%)")
        axes.axvline(0.0, color=MUTED, linewidth=0.6)
        axes.grid(False, axis="y")
        axes.tick_params(axis="y", length=0)
        words = (
            "Wide grey: residual of the fitted recordings that a regression on the effect takes away (screening). "
            "Narrow: excess over the floor closed on held-out recordings after fitting base and effect together, with "
            "its 95 % interval. Bold: named (blue) or explaining as much (green)."
        )
        caption(figure, words + (f" {left_out} weaker candidates are not drawn." if left_out else ""))
    return figure


def measures_figure(diagnosis: Diagnosis) -> Figure:
    """Measures of every held-out recording and of all together: before, after and floor, logarithmic."""
    together = totals(diagnosis)
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
            axes.set_xlabel(f"{MEASURE_WORDS[measure]} ({display.unit})")
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
