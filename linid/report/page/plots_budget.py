"""The page's figures as plotly.js dictionaries: the waterfall of the gap, the measures, pairs of coordinates."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from linid.diagnosis.report_data import MEASURES
from linid.report.diagnosis.budget import Step, waterfall, which_words
from linid.report.diagnosis.content import (
    after_words,
    before_words,
    changed,
    coordinate_display,
    force_display,
    force_word,
    held_out,
    share_words,
    shown_pairs,
)
from linid.report.diagnosis.measures import measure_display, measure_labels
from linid.report.figures.diagnosis_pairs import axis_title, map_limit, pair_title, slope_unit
from linid.report.figures.diagnosis_waterfall import colour, limits
from linid.report.page.pieces import (
    Plot,
    base_layout,
    dots,
    heat_map,
    line,
    log_axis,
    map_layout,
    short,
    small_title,
    wrapped,
)
from linid.report.residual_views import centres, pair_slopes
from linid.report.style import ERROR, MEASURED, MUTED

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis, PairShare

_TITLE_COLUMNS = 32  # of an upright axis title
_ENDS = ("before", "after", "floor", "low", "high")


def waterfall_plot(diagnosis: Diagnosis) -> Plot:
    """Horizontal bars from the whole gap down to the floor, with the share of each and its 95 % whisker."""
    steps = waterfall(diagnosis)
    layout = base_layout("share of the gap (%)", "", 80 + 52 * len(steps))
    layout |= {"barmode": "overlay", "showlegend": False}
    layout["margin"] |= {"t": 22}
    low, high = limits(steps)
    layout["yaxis"] |= {"autorange": "reversed", "showgrid": False, "ticks": ""}
    layout["xaxis"] |= {"range": [low, high], "tickvals": [x for x in range(-100, 201, 25) if low <= x <= high]}
    layout["shapes"] = _lines_between(steps)
    layout["annotations"] = [
        {
            "x": 0,
            "y": 1,
            "yref": "paper",
            "text": "floor",
            "showarrow": False,
            "xanchor": "left",
            "yanchor": "bottom",
            "font": {"color": MUTED},
        }
    ]
    alt = f"Waterfall of the gap: {which_words(diagnosis)}; {steps[-1].words} unexplained."
    return Plot("waterfall", alt, _bars(steps), layout)


def _bars(steps: tuple[Step, ...]) -> list[dict[str, Any]]:
    """Bars of the steps, hatched as far as smooth functions reach into the rest, and their whiskers."""
    names = [f"{wrapped(step.label, 22)}<br><b>{step.words}</b>" for step in steps]
    middle = np.array([100.0 * (step.low + step.high) / 2 for step in steps])
    half = np.array([100.0 * (step.high - step.low) / 2 for step in steps])
    return [
        {
            "type": "bar",
            "orientation": "h",
            "y": names,
            "base": short([100 * min(s.start, s.end) for s in steps]),
            "x": short([100 * abs(s.start - s.end) for s in steps]),
            "width": 0.6,
            "marker": {"color": [colour(s) for s in steps]},
            "customdata": [s.words for s in steps],
            "hovertemplate": "%{customdata}<extra></extra>",
        },
        {
            "type": "bar",
            "orientation": "h",
            "y": names,
            "base": [0.0] * len(steps),
            "width": 0.6,
            "x": short([100 * s.reach for s in steps]),
            "hoverinfo": "skip",
            "marker": {
                "color": "rgba(0,0,0,0)",
                "pattern": {"shape": "/", "fgcolor": "#FFFFFF", "bgcolor": "rgba(0,0,0,0)"},
            },
        },
        {
            "type": "scatter",
            "mode": "markers",
            "y": names,
            "x": short(middle),
            "hoverinfo": "skip",
            "marker": {"size": 1, "color": "#111111"},
            "error_x": {"type": "data", "array": short(half), "color": "#111111", "thickness": 1.4, "width": 5},
        },
    ]


def _lines_between(steps: tuple[Step, ...]) -> list[dict[str, Any]]:
    """The floor's line, and short ones from where a bar ends to where the next begins."""
    dash = {"color": MUTED, "dash": "dash", "width": 1.5}
    shapes: list[dict[str, Any]] = [
        {"type": "line", "x0": 0, "x1": 0, "yref": "paper", "y0": 0, "y1": 1, "line": dash, "layer": "below"}
    ]
    for row, step in enumerate(steps[:-1]):
        place = 100 * (step.end if step.kind == "effect" else step.start)
        shapes.append(
            {
                "type": "line",
                "x0": place,
                "x1": place,
                "y0": row + 0.3,
                "y1": row + 0.7,
                "line": {"color": MUTED, "width": 1},
            }
        )
    return shapes


def pair_plots(diagnosis: Diagnosis) -> list[Plot]:
    """The strongest pairs of coordinates: a map of the mean residual, or its slope along a line."""
    return [_pair(diagnosis, pair, place) for place, pair in enumerate(shown_pairs(diagnosis))]


def measure_plots(diagnosis: Diagnosis) -> list[Plot]:
    """For each measure the held-out recordings before, after and at the floor, on logarithmic axes."""
    together = diagnosis.measures
    rows = [("all together", together), *((one.recording, one.changes) for one in held_out(diagnosis))]
    plots = []
    for measure in MEASURES:
        if measure not in together:
            continue
        display = measure_display(diagnosis, measure)
        some = [(wrapped(name), changes[measure]) for name, changes in rows if measure in changes]
        names = [name for name, _ in some]
        columns = {end: [getattr(c, end) * display.factor for _, c in some] for end in ("before", "after", "floor")}
        data = [
            dots(columns["floor"], names, "floor", MUTED, "line-ns-open", 14),
            dots(columns["before"], names, before_words(diagnosis), ERROR, "circle-open", 10),
        ]
        if changed(diagnosis):
            after = dots(columns["after"], names, after_words(diagnosis), MEASURED, "circle", 10)
            low, high = (np.array([getattr(c, end) for _, c in some]) * display.factor for end in ("low", "high"))
            now = np.array(columns["after"])
            after["error_x"] = {
                "type": "data",
                "symmetric": False,
                "array": short(high - now),
                "arrayminus": short(now - low),
                "thickness": 2,
                "width": 4,
                "color": MEASURED,
            }
            data.append(after)
        shown = [getattr(c, end) * display.factor for _, c in some for end in _ENDS]
        layout = base_layout(f"{measure_labels(diagnosis.axis)[measure]}<br>({display.unit})", "", 130 + 30 * len(some))
        layout["xaxis"] |= log_axis(shown)
        layout["showlegend"] = False
        layout["yaxis"] |= {"autorange": "reversed", "showgrid": False}
        alt = f"{measure_labels(diagnosis.axis)[measure]} of each held-out recording before, after and at the floor."
        plots.append(Plot(f"measure-{measure}", alt, data, layout))
    return plots


def _pair(diagnosis: Diagnosis, pair: PairShare, place: int) -> Plot:
    force, x = force_display(diagnosis), coordinate_display(pair.x_edges, pair.x_unit)
    x_title = axis_title(pair.x_label, x.unit)
    if pair.form == "proportional":
        data = line(centres(pair.x_edges) * x.factor, pair_slopes(pair) * force.factor, pair.y_label, MEASURED)
        y_title = f"slope in {pair.y_label} ({slope_unit(force.unit, pair)})"
        layout = base_layout(x_title, wrapped(y_title, _TITLE_COLUMNS), 330)
        layout["margin"] |= {"t": 34}
    else:
        y = coordinate_display(pair.y_edges, pair.y_unit)
        edges, mean = (pair.x_edges * x.factor, pair.y_edges * y.factor), pair.mean * force.factor
        limit, units = map_limit(pair) * force.factor, (x.unit, y.unit, force.unit)
        data = heat_map(*edges, mean, limit, f"mean residual ({force.unit})", units)
        layout = map_layout(x_title, wrapped(axis_title(pair.y_label, y.unit), _TITLE_COLUMNS), 330)
    layout |= {"showlegend": False, "title": small_title(pair_title(pair))}
    alt = (
        f"Residual {force_word(diagnosis.axis)} over {pair.x_label} and {pair.y_label}, {share_words(pair)} explained "
        "by both together."
    )
    return Plot(f"pair-{place}", alt, [data], layout)
