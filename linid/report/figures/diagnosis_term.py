"""The proposed term: its curve with a band, or its surface as a map beside cuts through it."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.report.diagnosis.proposal import argument_words, term_closed_words
from linid.report.diagnosis.term_view import direction_words, term_view, value_limits, view_words
from linid.report.figures.common import draw_map
from linid.report.style import MEASURED, MUTED, PHASES, caption, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.report_data import Diagnosis
    from linid.report.diagnosis.term_view import TermCut, TermView

_LABEL_COLUMNS = (40, 30)  # characters of a label along a panel's width and height
_TITLE_COLUMNS = 90
_SIDE = 0.7  # room beside the outer points


def cut_colours(view: TermView) -> tuple[str, ...]:
    """A colour for each cut."""
    return (MEASURED,) if len(view.cuts) == 1 else tuple(PHASES[k % len(PHASES)] for k in range(len(view.cuts)))


def term_figure(diagnosis: Diagnosis) -> Figure:
    """The curve over one argument; of two, a map and cuts; needs a `term_view`."""
    view = term_view(diagnosis)
    assert view is not None
    words = argument_words(diagnosis).rstrip(",")
    with style():
        figure = new_figure(
            78.0 if view.surface is None else 86.0,
            textwrap.shorten(f"Proposed term of {words}", _TITLE_COLUMNS, placeholder=" …"),
        )
        panels: Any = figure.subplots(1, 1 if view.surface is None else 2, squeeze=False)[0]
        if view.surface is not None:
            _map(figure, panels[0], view)
        _cuts(panels[-1], view)
        caption(figure, f"{view_words(view)} {term_closed_words(diagnosis)}")
    return figure


def _map(figure: Figure, axes: Any, view: TermView) -> None:
    surface = view.surface
    assert surface is not None
    along, up = _LABEL_COLUMNS
    mesh = draw_map(axes, view.cuts[0].x, surface.y, surface.value, surface.limit, shading="nearest")
    axes.set_xlabel(textwrap.fill(view.x_title, along))
    axes.set_ylabel(textwrap.fill(surface.y_title, up))
    for cut, colour in zip(view.cuts, cut_colours(view), strict=True):
        axes.axhline(cut.at, color=colour, linewidth=0.9, linestyle="--")
    bar = figure.colorbar(mesh, ax=axes, extend="both", shrink=0.9)
    bar.set_label(textwrap.fill(view.value_title, up))


def _cuts(axes: Any, view: TermView) -> None:
    along, up = _LABEL_COLUMNS
    axes.axhline(0.0, color=MUTED, linewidth=0.5)
    for cut, colour in zip(view.cuts, cut_colours(view), strict=True):
        (_points if view.points else _line)(axes, cut, colour)
    if view.points:
        x = view.cuts[0].x
        axes.set_xticks(x, [direction_words(float(one)) for one in x] if view.directions else None)
        axes.set_xlim(float(np.min(x)) - _SIDE, float(np.max(x)) + _SIDE)
    axes.set_ylim(*value_limits(view))
    axes.set_xlabel(textwrap.fill(view.x_title, along if view.surface is not None else 2 * along))
    axes.set_ylabel(textwrap.fill(view.value_title, up))
    if len(view.cuts) > 1:
        axes.legend(
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=3,
            columnspacing=1.2,
            title=view.cut_title,
            alignment="left",
        )


def _line(axes: Any, cut: TermCut, colour: str) -> None:
    axes.fill_between(cut.x, cut.low, cut.high, color=colour, alpha=0.2, linewidth=0)
    axes.plot(cut.x, cut.value, color=colour, linewidth=1.3, label=cut.words.replace("-", "\u2212"))


def _points(axes: Any, cut: TermCut, colour: str) -> None:
    sides = np.maximum(np.array([cut.value - cut.low, cut.high - cut.value]), 0.0)
    axes.errorbar(cut.x, cut.value, sides, fmt="o", color=colour, capsize=2, markersize=4, label=cut.words)
