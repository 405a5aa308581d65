"""What the residual depends on only through pairs of coordinates: tables as maps, proportions as lines."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.report.diagnosis.content import (
    coordinate_display,
    force_display,
    force_word,
    p_words,
    pairs_left_out,
    share_words,
    shown_pairs,
)
from linid.report.figures.common import draw_map
from linid.report.residual_views import COLOURED, centres, pair_slopes
from linid.report.style import MEASURED, MUTED, caption, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.report_data import Diagnosis, PairShare

PAIRS_MEANING = (
    "Share of the residual's variance that only both coordinates together explain, beyond any sum of the two alone. "
    "Map: mean in each cell; line: slope in the one coordinate for each value of the other."
)


_LABEL_COLUMNS = (34, 24)  # characters of a label along a panel's width and height


def axis_title(label: str, unit: str) -> str:
    """`velocity (mm/s)`."""
    return f"{label} ({unit})" if unit else label


def slope_unit(force: str, pair: PairShare) -> str:
    """The unit of a slope in y: `N/A`, of a bare number `N`."""
    if pair.y_unit == "1":
        return force
    return f"{force}/({pair.y_unit})" if "/" in pair.y_unit else f"{force}/{pair.y_unit}"


def pair_title(pair: PairShare) -> str:
    """The share of a pair in words."""
    chance = p_words(pair.p_value)
    return f"{share_words(pair)} explained" + (f", {chance}" if chance else "")


def map_limit(pair: PairShare) -> float:
    """End of a symmetric colour scale that single cells do not blow up."""
    sizes = np.abs(pair.mean[np.isfinite(pair.mean)])
    return float(np.quantile(sizes, COLOURED)) if sizes.size and np.quantile(sizes, COLOURED) > 0 else 1.0


def pairs_figure(diagnosis: Diagnosis) -> Figure:
    """The strongest pairs: a map of the mean residual, or its slope along a line."""
    shown = shown_pairs(diagnosis)
    rows = -(-len(shown) // 2)
    with style():
        figure = new_figure(24.0 + 56.0 * rows, f"Residual {force_word(diagnosis.axis)} over pairs of coordinates")
        grid: Any = figure.subplots(rows, min(2, len(shown)), squeeze=False)
        for axes, pair in zip(grid.flat, shown, strict=False):
            _draw(figure, axes, diagnosis, pair)
        for axes in grid.flat[len(shown) :]:
            axes.set_visible(False)
        caption(figure, f"{PAIRS_MEANING} {pairs_left_out(diagnosis)}".strip())
    return figure


def _draw(figure: Figure, axes: Any, diagnosis: Diagnosis, pair: PairShare) -> None:
    force, x = force_display(diagnosis), coordinate_display(pair.x_edges, pair.x_unit)
    axes.set_title(pair_title(pair), fontweight="normal")
    along, up = _LABEL_COLUMNS
    axes.set_xlabel(textwrap.fill(axis_title(pair.x_label, x.unit), along))
    if pair.form == "proportional":
        axes.axhline(0.0, color=MUTED, linewidth=0.5)
        axes.plot(centres(pair.x_edges) * x.factor, pair_slopes(pair) * force.factor, color=MEASURED)
        axes.set_ylabel(textwrap.fill(f"slope in {pair.y_label} ({slope_unit(force.unit, pair)})", up))
        return
    y = coordinate_display(pair.y_edges, pair.y_unit)
    limit = map_limit(pair) * force.factor
    mesh = draw_map(axes, pair.x_edges * x.factor, pair.y_edges * y.factor, pair.mean * force.factor, limit)
    axes.set_ylabel(textwrap.fill(axis_title(pair.y_label, y.unit), up))
    figure.colorbar(mesh, ax=axes, label=f"mean residual ({force.unit})", extend="both", shrink=0.9)
