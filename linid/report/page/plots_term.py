"""The page's figures as plotly.js dictionaries: the curve or surface of a proposed term."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from linid.report.diagnosis.proposal import argument_words, term_closed_words
from linid.report.diagnosis.term_view import direction_words, term_view, value_limits
from linid.report.figures.diagnosis_term import cut_colours
from linid.report.page.pieces import Plot, band, base_layout, heat_map, line, map_layout, short, wrapped
from linid.report.style import MUTED

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis
    from linid.report.diagnosis.term_view import TermCut, TermSurface, TermView

_HEIGHT = 360
_TITLE_COLUMNS = 36  # of an upright axis title
_SIDE = 0.7  # room beside the outer points


def term_plots(diagnosis: Diagnosis) -> list[Plot]:
    """The curve over one argument; of two, a map and cuts; none where there is no curve."""
    view = term_view(diagnosis)
    if view is None:
        return []
    said = f"of {argument_words(diagnosis)}. {term_closed_words(diagnosis)}"
    plots = [_map(view, view.surface, said)] if view.surface is not None else []
    return [*plots, _cuts(view, said)]


def _map(view: TermView, surface: TermSurface, said: str) -> Plot:
    units = (view.x_unit, surface.y_unit, view.value_unit)
    data = heat_map(view.cuts[0].x, surface.y, surface.value, surface.limit, view.value_title, units)
    layout = map_layout(view.x_title, wrapped(surface.y_title, _TITLE_COLUMNS), _HEIGHT) | {"showlegend": False}
    layout["shapes"] = [
        {
            "type": "line",
            "xref": "paper",
            "x0": 0,
            "x1": 1,
            "y0": cut.at,
            "y1": cut.at,
            "line": {"color": colour, "dash": "dash", "width": 1.5},
        }
        for cut, colour in zip(view.cuts, cut_colours(view), strict=True)
    ]
    return Plot("term-map", f"Map of the proposed term {said}", [data], layout)


def _cuts(view: TermView, said: str) -> Plot:
    data: list[dict[str, Any]] = []
    for cut, colour in zip(view.cuts, cut_colours(view), strict=True):
        data += [_points(cut, colour)] if view.points else _line(cut, colour)
    layout = base_layout(view.x_title, wrapped(view.value_title, _TITLE_COLUMNS), _HEIGHT)
    layout["showlegend"] = len(view.cuts) > 1
    if view.surface is not None:
        layout["margin"] |= {"t": 34}
    layout["legend"] |= {"title": {"text": view.cut_title}}
    layout["yaxis"] |= {"range": short(value_limits(view)), "zeroline": True, "zerolinecolor": MUTED}
    if view.points:
        x = view.cuts[0].x
        layout["xaxis"] |= {"tickvals": short(x), "range": [float(np.min(x)) - _SIDE, float(np.max(x)) + _SIDE]}
        if view.directions:
            layout["xaxis"]["ticktext"] = [direction_words(float(one)) for one in x]
    return Plot("term-curve", f"The proposed term {said}", data, layout)


def _line(cut: TermCut, colour: str) -> list[dict[str, Any]]:
    good = np.isfinite(cut.low) & np.isfinite(cut.high)
    edges = np.flatnonzero(np.diff(good.astype(int))) + 1  # a band of each stretch with data: gaps stay gaps
    stretches = [part for part in np.split(np.arange(good.size), edges) if part.size > 1 and good[part[0]]]
    bands = [band(cut.x[part], cut.low[part], cut.high[part], colour) for part in stretches]
    return [*bands, line(cut.x, cut.value, cut.words or "proposed term", colour)]


def _points(cut: TermCut, colour: str) -> dict[str, Any]:
    bars = {
        "type": "data",
        "symmetric": False,
        "array": short(np.maximum(cut.high - cut.value, 0.0)),
        "arrayminus": short(np.maximum(cut.value - cut.low, 0.0)),
        "color": colour,
    }
    return {**line(cut.x, cut.value, cut.words, colour), "mode": "markers", "marker": {"size": 9}, "error_y": bars}
