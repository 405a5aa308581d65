"""The page's figures as plotly.js dictionaries: where the gap lies."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.report.diagnosis.content import (
    FEWEST_OF_CURVE,
    SIGNIFICANT,
    by_share,
    coordinate_display,
    force_display,
    force_word,
    p_words,
    share_words,
    significant,
)
from linid.report.display import display_unit, envelope, peak
from linid.report.figures.diagnosis_where import MOST_CURVES, pitch_words, states
from linid.report.page.pieces import (
    Plot,
    band,
    base_layout,
    heat_map,
    line,
    map_layout,
    percent_ticks,
    short,
    small_title,
    wrapped,
)
from linid.report.residual_views import amplitude_spectrum, folded, residual_map, symmetric_limit
from linid.report.style import MEASURED, MUTED

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis, ResidualTrace, Share

MOST_POINTS = 3000  # of a drawn line
_ALL_POINTS = 240_000  # of all recordings together: the page stays below 8 MB
_GREY = "#C9C9C9"


def shares_plot(diagnosis: Diagnosis) -> Plot:
    """Share of the residual's variance that each coordinate explains, with its p-value."""
    rows = by_share(diagnosis)
    values = [max(0.0, 100 * s.share) if math.isfinite(s.share) else 0.0 for s in rows]
    chance = [p_words(s.p_value).replace(" ", "\u00a0") for s in rows]
    data: list[dict[str, Any]] = [
        {
            "type": "bar",
            "orientation": "h",
            "x": short(values),
            "y": [wrapped(f"{s.label} ({p})" if p else s.label, 24) for s, p in zip(rows, chance, strict=True)],
            "marker": {"color": [MEASURED if s.p_value < SIGNIFICANT else _GREY for s in rows]},
            "text": [share_words(s) for s in rows],
            "textposition": "outside",
            "cliponaxis": False,
            "hoverinfo": "skip",
        }
    ]
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
        x, y, mean = one.y * position.factor, one.v * velocity.factor, one.mean * force.factor
        units = (position.unit, velocity.unit, force.unit)
        data = heat_map(x, y, mean, limit, f"mean residual ({force.unit})", units)
        layout = map_layout(f"position ({position.unit})", f"velocity ({velocity.unit})", 330)
        layout["title"] = small_title(words)
        alt = f"Map of the mean residual {force_word(diagnosis.axis)} over position and velocity, {words}."
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
    layout = base_layout(
        f"position within the pole pair ({position.unit})", f"residual {force_word(diagnosis.axis)} ({force.unit})", 330
    )
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
            "text": pitch_words(diagnosis),
            "showarrow": False,
            "xanchor": "left",
            "yanchor": "bottom",
        }
    ]
    return Plot(
        "pole-pair",
        f"Mean residual {force_word(diagnosis.axis)} over the position within a pair of poles.",
        data,
        layout,
    )


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
    return Plot(
        "spectrum", f"Amplitude spectrum of the residual {force_word(diagnosis.axis)} over frequency.", data, layout
    )


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
    layout = base_layout("time (s)", f"residual {force_word(diagnosis.axis)} ({force.unit})", 420)
    layout["yaxis"] |= {"domain": [0.32, 1.0]}
    layout["yaxis2"] = layout["yaxis"] | {"domain": [0.0, 0.24], "title": {"text": f"position ({position.unit})"}}
    layout["xaxis"] |= {"anchor": "y2"}
    return Plot(
        "trace",
        f"Residual {force_word(diagnosis.axis)} of {trace.recording} over time with its noise band.",
        data,
        layout,
    )


def _curve(diagnosis: Diagnosis, share: Share, place: int) -> Plot:
    display, force = coordinate_display(share.x, share.unit), force_display(diagnosis)
    x, mean, spread = share.x * display.factor, share.mean * force.factor, 2 * share.spread * force.factor
    if len(x) >= FEWEST_OF_CURVE:
        data = [band(x, mean - spread, mean + spread, MEASURED), line(x, mean, share.label, MEASURED)]
    else:
        bars = {"type": "data", "array": short(spread), "color": MEASURED}
        data = [{**line(x, mean, share.label, MEASURED), "mode": "markers", "marker": {"size": 9}, "error_y": bars}]
    word = force_word(diagnosis.axis)
    title = share.label + (f" ({display.unit})" if display.unit else "")
    layout = base_layout(title, f"residual {word} ({force.unit})", 270)
    layout |= {"showlegend": False, "title": small_title(f"{share_words(share)} explained")}
    layout["margin"] |= {"t": 34}
    if len(x) < FEWEST_OF_CURVE:
        layout["xaxis"]["tickvals"] = short(x)
        layout["xaxis"]["range"] = [float(np.min(x)) - 0.7, float(np.max(x)) + 0.7]
    alt = f"Mean residual {word} over {share.label}, {share_words(share)} explained."
    return Plot(f"curve-{place}", alt, data, layout)
