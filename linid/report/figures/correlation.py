"""Correlation of the estimates as a triangle of numbers; what the data cannot tell apart is outlined."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from linid.errors import DataError
from linid.report.style import ERROR, caption, new_figure, style
from linid.report.symbols import symbol_label

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.identification.result import FitResult

_DARK = 0.7  # of the colour scale: on more, white letters read better


def correlation_figure(result: FitResult) -> Figure:
    """Lower triangle of the correlation matrix of `result.fitted`, values written in; pairs in `result.pairs` outlined.

    Raises DataError if fewer than two parameters were fitted.
    """
    names = list(result.fitted)
    count = len(names)
    if count < 2 or result.correlation.shape != (count, count):
        fact = f"{count} fitted parameters and a correlation matrix of shape {result.correlation.shape}"
        raise DataError("correlation figure", fact, "Draw it for a fit of two or more parameters.")
    symbols = {e.name: symbol_label(e.symbol) for e in result.estimates}
    with style():
        figure = new_figure(min(150.0, max(62.0, 30.0 + 9.0 * count)))
        axes: Any = figure.subplots()
        values = np.where(np.tri(count, k=-1, dtype=bool), result.correlation, np.nan)[1:, :-1]
        image = axes.imshow(np.ma.masked_invalid(values), cmap="RdBu_r", vmin=-1.0, vmax=1.0, aspect="auto")
        size = 7.0 if count <= 12 else (5.5 if count <= 18 else 4.5)
        for row in range(count - 1):
            for column in range(row + 1):
                _write(axes, column, row, float(values[row, column]), size)
        _outline(axes, result, names)
        label_size = 7.5 if count <= 18 else 6.5
        axes.set_xticks(range(count - 1), [symbols.get(n, n) for n in names[:-1]], fontsize=label_size)
        labels = [f"{n.replace('_', ' ')} {symbols.get(n, '')}" for n in names[1:]]
        axes.set_yticks(range(count - 1), labels, fontsize=label_size)
        axes.grid(False)
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        axes.set_title(f"Correlation of the estimates, {result.model} model")
        figure.colorbar(image, ax=axes, label="correlation (1)", fraction=0.04, pad=0.02, ticks=(-1, -0.5, 0, 0.5, 1))
        note = f"Condition number {result.condition_number:.1e}."
        if result.pairs:
            note += " Outlined: the data cannot tell these two apart."
        caption(figure, note)
    return figure


def _write(axes: Any, x: int, y: int, value: float, size: float) -> None:
    if not np.isfinite(value):
        axes.text(x, y, "–", ha="center", va="center", fontsize=size, color="#777777")
        return
    text = f"{value:.2f}".replace("0.", ".", 1).replace("-", "−")
    colour = "white" if abs(value) > _DARK else "#222222"
    axes.text(x, y, "0" if text in (".00", "−.00") else text, ha="center", va="center", fontsize=size, color=colour)


def _outline(axes: Any, result: FitResult, names: list[str]) -> None:
    from matplotlib.patches import Rectangle

    for first, second, _, _ in result.pairs:
        if first in names and second in names and first != second:
            column, row = sorted((names.index(first), names.index(second)))
            box = Rectangle((column - 0.5, row - 1.5), 1, 1, fill=False, edgecolor=ERROR, linewidth=1.8, zorder=4)
            box.set_clip_on(False)
            axes.add_patch(box)
