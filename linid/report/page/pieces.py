"""Building blocks of the page's figures: plotly.js traces and layouts as plain dictionaries."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from linid.arrays import Array
from linid.report.display import log_limits
from linid.report.style import NO_DATA

_DIVERGING = [[0.0, "#053061"], [0.25, "#4393C3"], [0.5, "#F7F7F7"], [0.75, "#D6604D"], [1.0, "#67001F"]]
_DIGITS = 5
_MOST_DECADES = 5  # labels of a logarithmic axis that a third of the page has room for


@dataclass(frozen=True)
class Plot:
    """One figure: HTML id, what it shows in words (for those who cannot see it), plotly data and layout."""

    id: str
    alt: str
    data: list[dict[str, Any]]
    layout: dict[str, Any]


def short(values: Sequence[float] | Array, digits: int = _DIGITS) -> list[float | None]:
    """Values (n,) with the digits that a screen can show; None where there is none."""
    return [float(f"{x:.{digits}g}") if math.isfinite(x) else None for x in np.asarray(values, dtype=float).tolist()]


def wrapped(name: str, columns: int = 20) -> str:
    """A category label in short lines, broken at blanks and underscores; what HTML would read is made harmless."""
    lines = (line.replace("_ ", "_") for line in textwrap.wrap(name.replace("_", "_ "), columns))
    return "<br>".join(line.replace("&", "&amp;").replace("<", "&lt;") for line in lines)


def line(x: Array, y: Array, name: str, colour: str, width: float = 1.6) -> dict[str, Any]:
    """A line through x (n,), y (n,) in the units of its axes; gaps (nan) stay gaps."""
    return {
        "type": "scatter",
        "mode": "lines",
        "x": short(x, 6),
        "y": short(y, 4),
        "name": name,
        "line": {"color": colour, "width": width, "simplify": False},
        "connectgaps": False,
    }


def band(x: Array, low: Array, high: Array, colour: str, name: str = "") -> dict[str, Any]:
    """A shaded band over x (n,) between two lines, low (n,) and high (n,), in the units of its axes."""
    good = np.isfinite(low) & np.isfinite(high)
    x, low, high = x[good], low[good], high[good]
    return {
        "type": "scatter",
        "mode": "lines",
        "x": short(np.concatenate([x, x[::-1]])),
        "y": short(np.concatenate([high, low[::-1]]), 4),
        "fill": "toself",
        "hoverinfo": "skip",
        "line": {"width": 0},
        "fillcolor": _transparent(colour),
        "name": name,
        "showlegend": bool(name),
    }


def dots(x: list[float], y: list[str], name: str, colour: str, symbol: str, size: int) -> dict[str, Any]:
    """Markers along categories."""
    return {
        "type": "scatter",
        "mode": "markers",
        "x": short(x),
        "y": y,
        "name": name,
        "marker": {"color": colour, "symbol": symbol, "size": size, "line": {"width": 2, "color": colour}},
        "hovertemplate": "%{y}: %{x:.3g}<extra>" + name + "</extra>",
    }


def base_layout(x: str, y: str, height: int) -> dict[str, Any]:
    """The look that all figures share; x, y: titles of the axes."""
    axis = {"gridcolor": "#E6E6E6", "zeroline": False, "automargin": True, "ticks": "outside", "tickcolor": "#999999"}
    return {
        "height": height,
        "autosize": True,
        "margin": {"l": 10, "r": 12, "t": 10, "b": 10},
        "font": {"family": "system-ui, -apple-system, Segoe UI, Roboto, sans-serif", "size": 12, "color": "#222222"},
        "paper_bgcolor": "#FFFFFF",
        "plot_bgcolor": "#FFFFFF",
        "legend": {"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom"},
        "xaxis": axis | {"title": {"text": x}},
        "yaxis": axis | {"title": {"text": y}},
    }


def heat_map(
    x: Array, y: Array, values: Array, limit: float, title: str, units: tuple[str, str, str]
) -> dict[str, Any]:
    """Signed values over two quantities, blue to red about zero.

    x (m,), y (k,): centres or edges of the cells; values: (k, m); limit: of the colours; title: of their bar; units:
    those of x, y and the values, in which all are given.
    """
    return {
        "type": "heatmap",
        "x": short(x),
        "y": short(y),
        "z": [short(row, 3) for row in values],
        "zmin": -limit,
        "zmax": limit,
        "colorscale": _DIVERGING,
        "hoverongaps": False,
        "colorbar": {"thickness": 10, "title": {"text": title, "side": "right"}, "outlinewidth": 0},
        "hovertemplate": "%{{x:.4g}} {}, %{{y:.3g}} {}<br>%{{z:.3g}} {}<extra></extra>".format(*units),
    }


def map_layout(x: str, y: str, height: int) -> dict[str, Any]:
    """`base_layout` of a map with a title above: cells without data are grey, and no grid lies over it."""
    layout = base_layout(x, y, height) | {"plot_bgcolor": NO_DATA}
    layout["margin"] |= {"t": 34}
    for axis in ("xaxis", "yaxis"):
        layout[axis] |= {"showgrid": False}
    return layout


def small_title(text: str) -> dict[str, Any]:
    """A title above one panel."""
    return {"text": text, "x": 0, "xref": "paper", "y": 0.98, "yanchor": "top", "font": {"size": 13}}


def _transparent(colour: str) -> str:
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({red},{green},{blue},0.2)"


def log_axis(values: list[float]) -> dict[str, Any]:
    """A logarithmic axis with level labels at 1, 2, 5, at decades or, of many, at every second, third ... of them."""
    low, high = map(math.log10, log_limits(values))
    factors = (1, 2, 5) if high - low < 1 else (1, 3) if high - low < 2 else (1,)
    step = math.ceil((high - low) / _MOST_DECADES)
    decades = [k for k in range(math.floor(low), math.ceil(high)) if k % step == 0]
    ticks = [factor * 10.0**decade for decade in decades for factor in factors]
    return {
        "type": "log",
        "range": [low, high],
        "tickvals": short(ticks),
        "ticktext": [f"{tick:g}" for tick in ticks],
        "tickangle": 0,
    }


def percent_ticks(values: list[float]) -> list[int]:
    """Ticks of an axis in per cent that leave room for words on its right."""
    largest = max(values, default=0.0)
    step = 25 if largest > 50 else 10 if largest > 15 else 5
    return list(range(0, min(100, int(max(30.0, 1.2 * largest))) + 1, step))
