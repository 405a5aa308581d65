"""Figures of a scored challenge: rates against strength, budgets against true shares, and the confusion matrix."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.errors import DataError
from linid.report.style import ACCENT, ERROR, MEASURED, MUTED, caption, new_figure, style
from linid.statistics import TINY

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.challenge.rates import Rate
    from linid.challenge.score import Score

_SERIES = (
    ("top_1", "named first", MEASURED, "o"),
    ("top_3", "among the first three", ACCENT, "s"),
    ("silent", "said none", MUTED, "D"),
    ("wrong", "named, but wrong", ERROR, "v"),
)
_DARK = 0.75  # of a row: on more, white letters read better
_SPREAD = 0.028  # of a decade, between the series within a bin


def rates_figure(score: Score) -> Figure:
    """Rates of single effects against strength, with 95 % intervals; empty bins are left out.

    Raises DataError when no single effect was scored.
    """
    bins = [one for one in score.bins if one.top_1.total]
    if not bins:
        raise DataError("rates figure", "no campaign hides a single effect", "Make some with --kinds single.")
    with style():
        figure = new_figure(78.0, "What is found against how strong it is")
        axes: Any = figure.subplots()
        for place, (name, label, colour, marker) in enumerate(_SERIES):
            shift = 10 ** (_SPREAD * (place - (len(_SERIES) - 1) / 2))
            rates: list[Rate] = [getattr(one, name) for one in bins]
            x = [math.sqrt(one.low * one.high) * shift for one in bins]
            y = np.array([100 * rate.value for rate in rates])
            low = y - np.array([100 * rate.low for rate in rates])
            high = np.array([100 * rate.high for rate in rates]) - y
            axes.errorbar(
                x,
                y,
                yerr=np.maximum([low, high], 0.0),
                color=colour,
                marker=marker,
                markersize=4,
                linewidth=0.9,
                elinewidth=0.8,
                capsize=2,
                label=label,
            )
        edges = [bins[0].low, *(one.high for one in bins)]
        axes.set_xscale("log")
        axes.set_xlim(edges[0] / 1.03, edges[-1] * 1.03)
        axes.set_xticks(edges, [f"{edge:g}" for edge in edges])
        axes.minorticks_off()
        for one in bins:
            axes.annotate(
                f"n = {one.top_1.total}",
                (math.sqrt(one.low * one.high), 1.0),
                xycoords=("data", "axes fraction"),
                ha="center",
                va="bottom",
                fontsize=7,
                color=MUTED,
            )
        axes.set_ylim(-3, 103)
        axes.set_xlabel("strength of the hidden effect (1)")
        axes.set_ylabel("share of campaigns (%)")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        caption(figure, "Strength 1: the base model misses 10 % of the total force. Bars: 95 % Wilson intervals.")
    return figure


def budget_figure(score: Score) -> Figure:
    """Effects found against their true share of the gap, and stated against true shares, with 95 % intervals.

    Raises DataError when no hidden effect has a recorded share.
    """
    whole = score.budgets["all"]
    bins = [one for one in whole.bins if one.found.total]
    if not bins:
        raise DataError("budget figure", "no campaign's key holds shares of the gap", "Make the challenge anew.")
    items = [item for line in score.lines for item in line.ledger.items if item.entry is not None]
    found = [(item.share, item.entry.stated) for item in items if item.entry and item.entry.stated.share is not None]
    with style():
        figure = new_figure(78.0, "What is found of the gap, and how much is said of it")
        recall, shares = figure.subplots(1, 2)
        places = range(len(bins))
        y = np.array([100 * one.found.value for one in bins])
        low = y - np.array([100 * one.found.low for one in bins])
        high = np.array([100 * one.found.high for one in bins]) - y
        recall.errorbar(
            places,
            y,
            yerr=np.maximum([low, high], 0.0),
            color=MEASURED,
            marker="o",
            markersize=4,
            linewidth=0.9,
            elinewidth=0.8,
            capsize=2,
        )
        recall.set_xticks(
            places, [f"{100 * one.low:g}–{100 * one.high:g}\nn = {one.found.total}" for one in bins], fontsize=6.5
        )
        recall.set_ylim(-3, 103)
        recall.set_xlabel("true share of the gap (%)")
        recall.set_ylabel("effects found (%)")
        for truth, stated in found:
            known = stated.share if stated.share is not None else math.nan
            inside = stated.covers(truth)
            if stated.low is not None and stated.high is not None:
                shares.plot(
                    [100 * truth] * 2,
                    [100 * stated.low, 100 * stated.high],
                    linewidth=0.6,
                    color=MUTED if inside else ERROR,
                )
            colour = ERROR if inside is False else MEASURED
            shares.plot(100 * truth, 100 * known, marker="o", markersize=2.5, color=colour)
        shares.plot([0, 100], [0, 100], color=MUTED, linewidth=0.7)
        shares.set_xlabel("true share (%)")
        shares.set_ylabel("stated share (%)")
        text = "Left: 95 % Wilson intervals. Right: stated 95 % intervals; red ones miss the true share."
        caption(figure, text)
    return figure


def confusion_figure(score: Score) -> Figure:
    """Hidden against said, as counts; what is right lies on the outlined cells. Raises DataError without campaigns."""
    rows, columns, counts = score.confusion
    if not rows:
        raise DataError("confusion figure", "no campaign was scored", "Make some that hide a single effect or none.")
    values = np.array(counts)
    with style():
        figure = new_figure(52.0 + 5.2 * len(rows), "Hidden effect against verdict")
        axes: Any = figure.subplots()
        share = values / np.maximum(values.sum(axis=1, keepdims=True), TINY)
        axes.imshow(np.ma.masked_equal(share, 0.0), cmap="Blues", vmin=0.0, vmax=1.3, aspect="auto")
        for row, name in enumerate(rows):
            for column, said in enumerate(columns):
                if values[row, column]:
                    colour = "white" if share[row, column] > _DARK else "#222222"
                    text = f"{round(values[row, column], 2):g}"
                    axes.text(column, row, text, ha="center", va="center", fontsize=6.5, color=colour)
                if name == said:
                    _outline(axes, column, row)
        axes.set_xticks(range(len(columns)), [c.replace("_", " ") for c in columns], rotation=90, fontsize=6.5)
        axes.set_yticks(range(len(rows)), [r.replace("_", " ") for r in rows], fontsize=6.5)
        axes.set_xlabel("verdict")
        axes.set_ylabel("hidden")
        axes.grid(False)
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        caption(figure, "Counts of campaigns; colour: share of the row. Outlined: right.")
    return figure


def _outline(axes: Any, column: int, row: int) -> None:
    from matplotlib.patches import Rectangle

    axes.add_patch(Rectangle((column - 0.5, row - 0.5), 1, 1, fill=False, edgecolor=MUTED, linewidth=0.7, zorder=4))
