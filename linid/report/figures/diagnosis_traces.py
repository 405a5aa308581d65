"""Residual force of one recording over time, before and after, with the band that noise alone explains."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from linid.report.diagnosis.content import after_words, before_words, changed, force_display, force_word
from linid.report.display import display_unit, envelope, peak, rms
from linid.report.figures.common import TIME_LABEL, legend_above, shorten
from linid.report.numbers import format_number
from linid.report.style import ERROR, MEASURED, MUTED, SHADE, caption, new_figure, stacked, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.report_data import Diagnosis, ResidualTrace


def residual_trace_figure(diagnosis: Diagnosis, trace: ResidualTrace) -> Figure:
    """Residual force before (vermilion) and after (blue) over its ±2 sigma noise band; below it the motion."""
    force = force_display(diagnosis)
    position = display_unit("position", diagnosis.axis, peak(trace.y))
    with style():
        figure = new_figure(92.0)
        axes: Any = stacked(figure, (3, 1), caption_mm=caption(figure, _sizes(diagnosis, trace)))
        upper, lower = axes
        upper.set_title(f"Residual {force_word(diagnosis.axis)}, {shorten(trace.recording, 40)} ({_kind(trace)})")
        noise = 2 * trace.deviation * force.factor
        if np.isfinite(noise):
            upper.axhspan(-noise, noise, color=SHADE, zorder=1, label="noise, ±2σ")
        upper.plot(
            *envelope(trace.t, trace.before * force.factor),
            color=ERROR,
            linewidth=0.7,
            label=before_words(diagnosis),
            zorder=2,
        )
        if changed(diagnosis):
            after = envelope(trace.t, trace.after * force.factor)
            upper.plot(*after, color=MEASURED, linewidth=0.7, label=after_words(diagnosis), zorder=3)
        upper.set_ylabel(f"measured − modelled ({force.unit})")
        legend_above(lower, handles=upper.get_legend_handles_labels()[0])  # above, the title would be in its way
        lower.plot(*envelope(trace.t, trace.y * position.factor), color=MUTED)
        lower.set_ylabel(f"position ({position.unit})")
        lower.set_xlabel(TIME_LABEL)
    return figure


def _kind(trace: ResidualTrace) -> str:
    return f"{trace.kind}, {trace.split}".replace("_", " ")


def _sizes(diagnosis: Diagnosis, trace: ResidualTrace) -> str:
    force = force_display(diagnosis)
    before, after = (format_number(rms(x[np.isfinite(x)]) * force.factor) for x in (trace.before, trace.after))
    noise = format_number(trace.deviation * force.factor)
    change = (
        f"{before} {force.unit} before, {after} {force.unit} after" if changed(diagnosis) else f"{before} {force.unit}"
    )
    return f"RMS {change}; encoder and current noise alone: {noise} {force.unit}."
