"""How the search went: best and median cost over evaluations, with its stages."""

from __future__ import annotations

import textwrap
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.errors import DataError
from linid.report.figures.common import legend_above
from linid.report.style import MEASURED_LIGHT, MODEL, MUTED, caption, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.identification.result import FitResult

_MARKER_LIMIT = 40


def convergence_figure(result: FitResult) -> Figure:
    """Best and median cost (dimensionless, logarithmic) against evaluations; stage changes marked, stop reasons below.

    Raises DataError if the result carries no history.
    """
    if not result.history:
        raise DataError("convergence figure", "the fit has no history", "Draw it only for a fit that searched.")
    with style():
        figure = new_figure(80.0)
        axes: Any = figure.subplots()
        start, total = 0, float(result.history[-1].evaluations)
        for index, (stage, group) in enumerate(groupby(result.history, key=lambda line: line.stage)):
            lines = list(group)
            x = np.array([line.evaluations for line in lines], dtype=float)
            best = _positive([line.best for line in lines])
            median = _positive([line.median for line in lines])
            marker = "." if len(lines) < _MARKER_LIMIT else ""
            first = index == 0
            axes.plot(x, median, color=MEASURED_LIGHT, marker=marker, label="median" if first else None)
            axes.plot(x, best, color=MODEL, marker=marker, label="best" if first else None)
            edge = float(x[0]) if first else float(start)
            if not first:
                axes.axvline(edge, color=MUTED, linewidth=0.6, linestyle="--")
            late = edge > 0.85 * total
            axes.annotate(
                stage, (edge, 1.0 - 0.08 * index), xycoords=axes.get_xaxis_transform(), xytext=(-3 if late else 3, -2),
                textcoords="offset points", ha="right" if late else "left", va="top", fontsize=7.5, color="#444444",
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.8},
            )  # fmt: skip
            start = int(x[-1])
        axes.set_yscale("log")
        axes.set_xlabel("evaluations of the objective (1)")
        axes.set_ylabel("cost (1)")
        axes.set_title(f"Convergence of the {result.model} model, seed {result.seed}")
        legend_above(axes)
        ended = "Converged: " if result.converged else "Did not converge: "
        text = ended + ("; ".join(result.stop_reasons) or "no stop reason given")
        caption(figure, "\n".join(textwrap.wrap(text, 125)))
    return figure


def _positive(values: list[float]) -> Any:
    array = np.array(values, dtype=float)
    return np.where(np.isfinite(array) & (array > 0), array, np.nan)
