"""Where the residual force lies: over position and velocity, within the pole pair, over frequency, by coordinate."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.report.diagnosis.content import (
    FEWEST_OF_CURVE,
    SIGNIFICANT,
    after_words,
    before_words,
    by_share,
    changed,
    coordinate_display,
    force_display,
    force_word,
    p_words,
    share_words,
    significant,
)
from linid.report.display import display_unit, peak
from linid.report.figures.common import draw_map, legend_above
from linid.report.residual_views import Which, amplitude_spectrum, folded, residual_map, resolves_poles, symmetric_limit
from linid.report.style import ERROR, MEASURED, MEASURED_LIGHT, MUTED, caption, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.report_data import Diagnosis, Share

MOST_CURVES = 6


def states(diagnosis: Diagnosis) -> tuple[tuple[Which, str, str], ...]:
    """(field of a trace, words, colour) of what there is to draw: before and, if the model changed, after."""
    before: tuple[Which, str, str] = ("before", before_words(diagnosis), ERROR)
    after: tuple[Which, str, str] = ("after", after_words(diagnosis), MEASURED)
    return (before, after) if changed(diagnosis) else (before,)


def residual_map_figure(diagnosis: Diagnosis) -> Figure:
    """Mean residual over position and velocity of all recordings, before and after in one colour scale."""
    force = force_display(diagnosis)
    position = display_unit("position", diagnosis.axis, max(peak(t.y) for t in diagnosis.traces))
    velocity = display_unit("velocity", diagnosis.axis, max(peak(t.v) for t in diagnosis.traces))
    shown = states(diagnosis)
    maps = [residual_map(diagnosis.traces, which, diagnosis.field_wavenumber) for which, _, _ in shown]
    limit = symmetric_limit(*maps) * force.factor
    with style():
        figure = new_figure(72.0, f"Residual {force_word(diagnosis.axis)} over position and velocity, all recordings")
        row: Any = figure.subplots(1, len(shown), sharex=True, sharey=True, squeeze=False)[0]
        for axes, one, (_, words, _) in zip(row, maps, shown, strict=True):
            mesh = draw_map(axes, one.y * position.factor, one.v * velocity.factor, one.mean * force.factor, limit)
            axes.set_title(words)
            axes.set_xlabel(f"position ({position.unit})")
        row[0].set_ylabel(f"velocity ({velocity.unit})")
        figure.colorbar(mesh, ax=list(row), label=f"mean residual ({force.unit})", extend="both", shrink=0.9)
        caption(figure, map_words(diagnosis))
    return figure


def map_words(diagnosis: Diagnosis) -> str:
    """How to read the map."""
    how = "Mean per cell; grey: fewer than four samples."
    if diagnosis.field_wavenumber is not None and not resolves_poles(diagnosis.traces, diagnosis.field_wavenumber):
        how += " Cells span whole pole pairs: what repeats with them averages out here."
    return how


def pitch_words(diagnosis: Diagnosis) -> str:
    """What the middle of the pole pair marks."""
    return "one pole" if diagnosis.axis == "rotary" else "one pole pitch"


def pole_pair_figure(diagnosis: Diagnosis) -> Figure:
    """Residual over the position within the pole pair, mean and standard deviation; needs `field_wavenumber`."""
    assert diagnosis.field_wavenumber is not None
    force, pitch = force_display(diagnosis), math.pi / diagnosis.field_wavenumber
    position = display_unit("position", diagnosis.axis, 2 * pitch)
    with style():
        figure = new_figure(75.0, f"Residual {force_word(diagnosis.axis)} within the pole pair, all recordings")
        axes: Any = figure.subplots()
        axes.axhline(0.0, color=MUTED, linewidth=0.5)
        for which, words, colour in states(diagnosis):
            one = folded(diagnosis.traces, which, diagnosis.field_wavenumber)
            x, mean, spread = one.x * position.factor, one.mean * force.factor, one.spread * force.factor
            axes.fill_between(x, mean - spread, mean + spread, color=colour, alpha=0.15, linewidth=0)
            axes.plot(x, mean, color=colour, linewidth=1.3, label=words)
        axes.axvline(pitch * position.factor, color=MUTED, linewidth=0.8, linestyle="--")
        axes.annotate(
            pitch_words(diagnosis),
            (pitch * position.factor, 0.02),
            xycoords=("data", "axes fraction"),
            xytext=(3, 0),
            textcoords="offset points",
            fontsize=7,
            color=MUTED,
        )
        axes.set_xlim(0, 2 * pitch * position.factor)
        axes.set_xlabel(f"position within the pole pair ({position.unit})")
        axes.set_ylabel(f"residual {force_word(diagnosis.axis)} ({force.unit})")
        legend_above(axes)
        caption(figure, "Line: mean. Shade: standard deviation of the samples.")
    return figure


def spectrum_figure(diagnosis: Diagnosis) -> Figure:
    """Amplitude of the residual over frequency, before and after."""
    force = force_display(diagnosis)
    with style():
        figure = new_figure(75.0, f"Amplitude spectrum of the residual {force_word(diagnosis.axis)}, all recordings")
        axes: Any = figure.subplots()
        for which, words, colour in states(diagnosis):
            frequency, amplitude = amplitude_spectrum(diagnosis.traces, which)
            axes.loglog(frequency, amplitude * force.factor, color=colour, linewidth=0.8, label=words)
        axes.set_xlabel("frequency (Hz)")
        axes.set_ylabel(f"amplitude ({force.unit})")
        legend_above(axes)
        caption(figure, "A steady sine shows with its amplitude; what depends on position spreads as the speed varies.")
    return figure


def shares_figure(diagnosis: Diagnosis) -> Figure:
    """Share of the residual's variance that each coordinate explains, with its p-value."""
    rows = by_share(diagnosis)
    with style():
        figure = new_figure(34.0 + 5.5 * len(rows), f"What the residual {force_word(diagnosis.axis)} depends on")
        axes: Any = figure.subplots()
        values = [max(0.0, 100 * share.share) if math.isfinite(share.share) else 0.0 for share in rows]
        colours = [MEASURED if share.p_value < SIGNIFICANT else "#C9C9C9" for share in rows]
        axes.barh(range(len(rows)), values, color=colours, height=0.62)
        for row, (share, value) in enumerate(zip(rows, values, strict=True)):
            text = f"{share_words(share)}  {p_words(share.p_value)}"
            axes.annotate(text, (value, row), xytext=(4, 0), textcoords="offset points", va="center", fontsize=7)
        axes.set_yticks(range(len(rows)), [share.label for share in rows])
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.set_xlim(0, max(1.35 * max(values, default=0.0), 30.0))
        axes.set_xlabel("share of the residual's variance, cross-validated (%)")
        axes.grid(False, axis="y")
        axes.tick_params(axis="y", length=0)
        caption(figure, f"Blue: beyond chance (p < {SIGNIFICANT:g}, against residuals permuted in blocks of time).")
    return figure


def curves_figure(diagnosis: Diagnosis) -> Figure:
    """Mean residual over each coordinate that explains it beyond chance, with twice its standard error."""
    shown = significant(diagnosis)[:MOST_CURVES]
    rows = -(-len(shown) // 2)
    with style():
        word = force_word(diagnosis.axis)
        figure = new_figure(14.0 + 46.0 * rows, f"Mean residual {word} over the coordinates that matter")
        grid: Any = figure.subplots(rows, min(2, len(shown)), sharey=True, squeeze=False)
        for axes, share in zip(grid.flat, shown, strict=False):
            _curve(axes, diagnosis, share)
        for axes in grid.flat[len(shown) :]:
            axes.set_visible(False)
        for axes in grid[:, 0]:
            axes.set_ylabel(f"residual ({force_display(diagnosis).unit})")
        caption(figure, "Before; shade and bars: two standard errors.")
    return figure


def _curve(axes: Any, diagnosis: Diagnosis, share: Share) -> None:
    display, force = coordinate_display(share.x, share.unit), force_display(diagnosis)
    x, mean, spread = share.x * display.factor, share.mean * force.factor, 2 * share.spread * force.factor
    axes.axhline(0.0, color=MUTED, linewidth=0.5)
    if len(x) >= FEWEST_OF_CURVE:
        axes.fill_between(x, mean - spread, mean + spread, color=MEASURED_LIGHT, alpha=0.5, linewidth=0)
        axes.plot(x, mean, color=MEASURED)
    else:
        axes.errorbar(x, mean, spread, fmt="o", color=MEASURED, capsize=2, markersize=4)
        axes.set_xticks(x)
        axes.set_xlim(float(np.min(x)) - 0.7, float(np.max(x)) + 0.7)
    axes.set_xlabel(share.label + (f" ({display.unit})" if display.unit else ""))
    axes.set_title(f"{share_words(share)} explained", fontweight="normal")
