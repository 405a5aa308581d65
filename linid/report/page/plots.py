"""The page's figures as plotly.js dictionaries: where the gap lies and which effect explains it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from linid.diagnosis.report_data import MEASURES
from linid.report.diagnosis_content import (
    MEASURE_WORDS,
    SIGNIFICANT,
    after_words,
    before_words,
    by_share,
    changed,
    coordinate_display,
    force_display,
    held_out,
    measure_display,
    p_words,
    percent,
    ranked,
    role,
    share_words,
    significant,
    totals,
)
from linid.report.display import display_unit, envelope, peak
from linid.report.figures.diagnosis_where import MOST_CURVES, states
from linid.report.figures.diagnosis_which import MOST_CANDIDATES
from linid.report.page.pieces import (
    DIVERGING,
    band,
    base_layout,
    dots,
    line,
    log_axis,
    percent_ticks,
    short,
    small_title,
    wrapped,
)
from linid.report.residual_views import amplitude_spectrum, folded, residual_map, symmetric_limit
from linid.report.style import ACCENT, ERROR, MEASURED, MUTED

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis, ResidualTrace, Share

Array = NDArray[np.float64]
MOST_POINTS = 3000  # of a drawn line
_ALL_POINTS = 240_000  # of all recordings together: the page stays below 8 MB
_ENDS = ("before", "after", "floor", "low", "high")
_GREY = "#C9C9C9"


@dataclass(frozen=True)
class Plot:
    """One figure: HTML id, what it shows in words (for those who cannot see it), plotly data and layout."""

    id: str
    alt: str
    data: list[dict[str, Any]]
    layout: dict[str, Any]


def measure_plots(diagnosis: Diagnosis) -> list[Plot]:
    """For each measure the held-out recordings before, after and at the floor, on logarithmic axes."""
    together = totals(diagnosis)
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
                "type": "data", "symmetric": False, "array": short(high - now), "arrayminus": short(now - low),
                "thickness": 2, "width": 4, "color": MEASURED,
            }  # fmt: skip
            data.append(after)
        shown = [getattr(c, end) * display.factor for _, c in some for end in _ENDS]
        layout = base_layout(f"{MEASURE_WORDS[measure]}<br>({display.unit})", "", 130 + 30 * len(some))
        layout["xaxis"] |= log_axis(shown)
        layout["showlegend"] = False
        layout["yaxis"] |= {"autorange": "reversed", "showgrid": False}
        alt = (
            f"{MEASURE_WORDS[measure]} of each held-out recording before, after and at the floor; numbers in the table."
        )
        plots.append(Plot(f"measure-{measure}", alt, data, layout))
    return plots


def ranking_plot(diagnosis: Diagnosis) -> Plot:
    """Candidates with screened share (light) and confirmed closure with its interval (dark)."""
    rows = ranked(diagnosis)[:MOST_CANDIDATES]
    names = [wrapped(one.name) for one in rows]
    colours = [{"cause": MEASURED, "equivalent": ACCENT}.get(role(diagnosis, one), MUTED) for one in rows]
    closures = np.array([one.closure for one in rows])
    ends = [np.array([getattr(one, end) for one in rows]) for end in ("low", "high")]
    data: list[dict[str, Any]] = [
        {
            "type": "bar", "orientation": "h", "name": "screened", "y": names, "width": 0.74,
            "x": short([100 * one.explained for one in rows]), "marker": {"color": "#DDDDDD"},
            "hovertemplate": "%{y}<br>screened %{x:.0f} %<extra></extra>",
        },
        {
            "type": "bar", "orientation": "h", "name": "closed (confirmed)", "y": names, "x": short(100 * closures),
            "marker": {"color": colours}, "width": 0.36,
            "error_x": {
                "type": "data", "symmetric": False, "array": short(100 * (ends[1] - closures)),
                "arrayminus": short(100 * (closures - ends[0])), "color": "#111111", "thickness": 1.2, "width": 3,
            },
            "text": [percent(one.closure) if math.isfinite(one.closure) else "" for one in rows],
            "textposition": "none", "hovertemplate": "%{y}<br>closed %{text}<extra></extra>",
        },
    ]  # fmt: skip
    layout = base_layout("share (%)", "", 110 + 36 * len(rows))
    layout |= {"barmode": "overlay"}
    layout["yaxis"] |= {"autorange": "reversed", "showgrid": False}
    lowest = min((100 * x for x in (*ends[0], *closures) if math.isfinite(x)), default=0.0)
    layout["xaxis"] |= {"zeroline": True, "zerolinecolor": "#888888", "range": [max(-60.0, min(0.0, lowest - 2)), 103]}
    alt = "Candidate effects with the share of the residual that they explain; numbers in the table of candidates."
    return Plot("ranking", alt, data, layout)


def shares_plot(diagnosis: Diagnosis) -> Plot:
    """Share of the residual's variance that each coordinate explains, with its p-value."""
    rows = by_share(diagnosis)
    values = [max(0.0, 100 * s.share) if math.isfinite(s.share) else 0.0 for s in rows]
    chance = [p_words(s.p_value).replace(" ", "\u00a0") for s in rows]
    data: list[dict[str, Any]] = [
        {
            "type": "bar", "orientation": "h", "x": short(values),
            "y": [wrapped(f"{s.label} ({p})" if p else s.label, 24) for s, p in zip(rows, chance, strict=True)],
            "marker": {"color": [MEASURED if s.p_value < SIGNIFICANT else _GREY for s in rows]},
            "text": [share_words(s) for s in rows], "textposition": "outside", "cliponaxis": False,
            "hoverinfo": "skip",
        }
    ]  # fmt: skip
    layout = base_layout("share of variance (%)", "", 90 + 34 * len(rows))
    layout["xaxis"] |= {"range": [0, max(30.0, 1.2 * max(values, default=0.0))], "tickvals": percent_ticks(values)}
    layout["yaxis"] |= {"autorange": "reversed", "showgrid": False}
    listed = "; ".join(f"{s.label} {share_words(s)}" for s in rows[:4])
    return Plot("shares", f"Share of the residual explained by each coordinate: {listed}.", data, layout)


def curve_plots(diagnosis: Diagnosis) -> list[Plot]:
    """Mean residual of the base model over each coordinate that explains it beyond chance."""
    return [_curve(diagnosis, share, place) for place, share in enumerate(significant(diagnosis)[:MOST_CURVES])]


def map_plots(diagnosis: Diagnosis) -> list[Plot]:
    """Mean residual over position and velocity, before and after in one colour scale."""
    force = force_display(diagnosis)
    position = display_unit("position", diagnosis.axis, max(peak(t.y) for t in diagnosis.traces))
    velocity = display_unit("velocity", diagnosis.axis, max(peak(t.v) for t in diagnosis.traces))
    maps = [residual_map(diagnosis.traces, which, diagnosis.field_wavenumber) for which, _, _ in states(diagnosis)]
    limit = symmetric_limit(*maps) * force.factor
    plots = []
    for (which, words, _), one in zip(states(diagnosis), maps, strict=True):
        data = {
            "type": "heatmap", "x": short(one.y * position.factor), "y": short(one.v * velocity.factor),
            "z": [short(row, 3) for row in one.mean * force.factor], "zmin": -limit, "zmax": limit,
            "colorscale": DIVERGING, "hoverongaps": False,
            "colorbar": {"thickness": 10, "title": {"text": force.unit, "side": "right"}, "outlinewidth": 0},
            "hovertemplate": f"%{{x:.4g}} {position.unit}, %{{y:.3g}} {velocity.unit}<br>"
            f"%{{z:.3g}} {force.unit}<extra></extra>",
        }  # fmt: skip
        layout = base_layout(f"position ({position.unit})", f"velocity ({velocity.unit})", 330)
        layout |= {"plot_bgcolor": "#E4E4E4", "title": small_title(words)}
        layout["margin"] |= {"t": 34}
        for axis in ("xaxis", "yaxis"):
            layout[axis] |= {"showgrid": False, "zeroline": False}
        alt = f"Map of the mean residual force over position and velocity, {words}."
        plots.append(Plot(f"map-{which}", alt, [data], layout))
    return plots


def pole_pair_plot(diagnosis: Diagnosis) -> Plot:
    """Mean residual over the position within the pole pair; needs `field_wavenumber`."""
    assert diagnosis.field_wavenumber is not None
    force, pitch = force_display(diagnosis), math.pi / diagnosis.field_wavenumber
    position = display_unit("position", diagnosis.axis, 2 * pitch)
    data = []
    for which, words, colour in states(diagnosis):
        one = folded(diagnosis.traces, which, diagnosis.field_wavenumber)
        x, mean, spread = one.x * position.factor, one.mean * force.factor, one.spread * force.factor
        data += [band(x, mean - spread, mean + spread, colour), line(x, mean, words, colour)]
    layout = base_layout(f"position modulo two pole pitches ({position.unit})", f"residual force ({force.unit})", 330)
    edge = pitch * position.factor
    layout["shapes"] = [
        {
            "type": "line",
            "x0": edge,
            "x1": edge,
            "yref": "paper",
            "y0": 0,
            "y1": 1,
            "line": {"color": MUTED, "dash": "dash"},
        }
    ]
    layout["annotations"] = [
        {
            "x": edge,
            "y": 0,
            "yref": "paper",
            "text": "one pole pitch",
            "showarrow": False,
            "xanchor": "left",
            "yanchor": "bottom",
        }
    ]
    return Plot("pole-pair", "Mean residual force over the position within a pair of poles.", data, layout)


def spectrum_plot(diagnosis: Diagnosis) -> Plot:
    """Amplitude spectrum of the residual, before and after."""
    force = force_display(diagnosis)
    data = []
    for which, words, colour in states(diagnosis):
        frequency, amplitude = amplitude_spectrum(diagnosis.traces, which)
        data.append(line(*envelope(frequency, amplitude * force.factor, 900), words, colour, width=1.0))
    layout = base_layout("frequency (Hz)", f"amplitude ({force.unit})", 330)
    for axis in ("xaxis", "yaxis"):
        layout[axis] |= {"type": "log", "tickformat": "~g", "dtick": 1}
    return Plot("spectrum", "Amplitude spectrum of the residual force over frequency.", data, layout)


def trace_plot(diagnosis: Diagnosis, trace: ResidualTrace) -> Plot:
    """Residual force of one recording over time with its ±2 sigma noise band, and the motion below it."""
    force = force_display(diagnosis)
    position = display_unit("position", diagnosis.axis, peak(trace.y))
    bins = max(100, min(MOST_POINTS, _ALL_POINTS // (3 * len(diagnosis.traces))) // 3 - 1)
    noise = 2 * trace.deviation * force.factor
    ends = np.array([trace.t[0], trace.t[-1]])
    data = [band(ends, np.full(2, -noise), np.full(2, noise), "#8A8172", "noise, ±2σ")]
    for which, words, colour in states(diagnosis):
        drawn = envelope(trace.t, getattr(trace, which) * force.factor, bins)
        data.append(line(*drawn, words, colour, width=0.9))
    motion = line(*envelope(trace.t, trace.y * position.factor, bins // 3), "position", MUTED)
    data.append({**motion, "yaxis": "y2", "showlegend": False})
    layout = base_layout("time (s)", f"residual force ({force.unit})", 420)
    layout["yaxis"] |= {"domain": [0.32, 1.0]}
    layout["yaxis2"] = layout["yaxis"] | {"domain": [0.0, 0.24], "title": {"text": f"position ({position.unit})"}}
    layout["xaxis"] |= {"anchor": "y2"}
    return Plot("trace", f"Residual force of {trace.recording} over time with its noise band.", data, layout)


def _curve(diagnosis: Diagnosis, share: Share, place: int) -> Plot:
    display, force = coordinate_display(share, diagnosis.axis), force_display(diagnosis)
    x, mean, spread = share.x * display.factor, share.mean * force.factor, 2 * share.spread * force.factor
    if len(x) > 4:
        data = [band(x, mean - spread, mean + spread, MEASURED), line(x, mean, share.label, MEASURED)]
    else:
        bars = {"type": "data", "array": short(spread), "color": MEASURED}
        data = [{**line(x, mean, share.label, MEASURED), "mode": "markers", "marker": {"size": 9}, "error_y": bars}]
    layout = base_layout(
        share.label + (f" ({display.unit})" if display.unit else ""), f"residual force ({force.unit})", 270
    )
    layout |= {"showlegend": False, "title": small_title(f"{share_words(share)} explained")}
    layout["margin"] |= {"t": 34}
    if len(x) <= 4:
        layout["xaxis"]["tickvals"] = short(x)
        layout["xaxis"]["range"] = [float(np.min(x)) - 0.7, float(np.max(x)) + 0.7]
    return Plot(
        f"curve-{place}", f"Mean residual force over {share.label}, {share_words(share)} explained.", data, layout
    )
