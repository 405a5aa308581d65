"""How the search went: best and median cost over evaluations, one panel per stage."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.errors import DataError
from linid.report.figures.common import legend_above
from linid.report.numbers import format_number
from linid.report.style import MEASURED_LIGHT, MODEL, caption, grid, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.identification.result import FitResult, Generation

_MARKER_LIMIT = 40
_DECADE = 10.0  # highest to lowest cost: more is drawn logarithmically
_FLAT = 1e-3  # of the highest cost: within less, rounding would fill the panel
_TITLE_COLUMNS = 12
_GAP_MM = 18.0  # between panels: room for nine characters of a tick label
_SMALL = 1e-3  # cost below which a power of ten is shorter than zeros
_NARROWEST = 0.22  # of the widest panel: room for a title and two ticks


def convergence_figure(result: FitResult) -> Figure:
    """Best and median cost (dimensionless) against evaluations; a panel with its own scale per stage, as costs of
    different stages belong to different objectives; stop reasons below.

    Raises DataError if the result carries no history.
    """
    if not result.history:
        raise DataError("convergence figure", "the fit has no history", "Draw it only for a fit that searched.")
    grouped = groupby(result.history, key=lambda line: line.stage)
    stages = [(stage.replace("_", " "), list(group)) for stage, group in grouped]
    spans = np.array([max(lines[-1].evaluations - lines[0].evaluations, 1) for _, lines in stages], dtype=float)
    widths = np.maximum(spans / spans.max(), _NARROWEST)
    with style():
        figure = new_figure(80.0, f"Convergence of the {result.model} model, seed {result.seed}")
        lines_above = max(textwrap.fill(stage, _TITLE_COLUMNS).count("\n") for stage, _ in stages)
        small_print = caption(figure, _remark(result, len(stages)))
        margins = (17.0, 3.0, 10.5 + small_print, 11.0 + 3.5 * lines_above)
        cells = grid(figure, 1, len(stages), margins=margins, gaps=(_GAP_MM, 0.0), widths=widths)
        panels: Any = cells.subplots(squeeze=False)[0]
        for axes, (stage, lines) in zip(panels, stages, strict=True):
            _panel(axes, lines)
            axes.set_title(textwrap.fill(stage, _TITLE_COLUMNS), fontweight="normal")
        panels[0].set_ylabel("cost (1)")
        widest = panels[int(np.argmax(widths))]
        widest.set_xlabel("evaluations of the objective (1)")
        legend_above(widest)
    return figure


def _panel(axes: Any, lines: Sequence[Generation]) -> None:
    from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter

    x = np.array([line.evaluations for line in lines], dtype=float)
    best, median = _positive([line.best for line in lines]), _positive([line.median for line in lines])
    marker = "." if len(lines) < _MARKER_LIMIT else ""
    axes.plot(x, median, color=MEASURED_LIGHT, marker=marker, label="median")
    axes.plot(x, best, color=MODEL, marker=marker, label="best")
    axes.xaxis.set_major_locator(MaxNLocator(2 if len(lines) < _MARKER_LIMIT else 5, integer=True))
    shown = np.concatenate([best, median])
    shown = shown[np.isfinite(shown)]
    if shown.size and shown.max() > _DECADE * shown.min():
        axes.set_yscale("log")
        axes.yaxis.set_minor_formatter(NullFormatter())
    else:
        axes.yaxis.set_major_locator(MaxNLocator(4))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: _tick(value)))
    if len(lines) == 1 or (shown.size and np.ptp(shown) < _FLAT * shown.max()):
        axes.margins(x=0.4)
        if shown.size:
            axes.set_ylim(0.98 * shown.min(), 1.02 * shown.max())


def _tick(cost: float) -> str:
    """A cost (1) in at most nine characters: `0.0132`, `4.55e-4`."""
    if not 0.0 < cost < _SMALL:
        return format_number(cost, 4)
    mantissa, exponent = f"{cost:.3e}".split("e")
    return f"{float(mantissa):g}e{int(exponent)}"


def _remark(result: FitResult, stages: int) -> str:
    text = ("Converged: " if result.converged else "Did not converge: ") + (
        "; ".join(result.stop_reasons) or "no stop reason given"
    )
    if stages > 1:
        text += ". Each stage has its own objective: costs of different panels are not comparable."
    return text


def _positive(values: list[float]) -> Any:
    array = np.array(values, dtype=float)
    return np.where(np.isfinite(array) & (array > 0), array, np.nan)
