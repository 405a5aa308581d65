"""Driven recordings: the prediction restarted from the measured state, and the free run while it keeps step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from linid.report.display import Display, display_unit, envelope, peak, rms
from linid.report.figures.common import limit_to_measured
from linid.report.numbers import format_number
from linid.report.style import ACCENT, ERROR, ERROR_LIGHT, MEASURED, MODEL, MUTED

if TYPE_CHECKING:
    from linid.diagnosis.gap import AheadPieces, Trace

_FEW = 400  # windows, whose points can be told apart
_BINS = 4000
_LOST = 0.25  # of the measured travel: where a free run without pole pitch is of no more use


def free_run_end(trace: Trace) -> int | None:
    """First sample at which the free run has left the measured motion; None if it keeps step to the end.

    One pole pitch off the motor's pull changes sign and the axis falls into another period of the field; a model
    without poles is given a quarter of the measured travel.
    """
    limit = trace.pole_pitch or _LOST * float(np.ptp(trace.y_measured))
    error = np.abs(trace.y_simulated - trace.y_measured)
    out = ~(error <= limit)
    return int(np.argmax(out)) if out.any() else None


def free_run_text(trace: Trace) -> str:
    """How far the free run went and how well."""
    end = free_run_end(trace)
    size = rms((trace.y_simulated - trace.y_measured)[:end])
    display = display_unit("position", trace.axis, size)
    error = f"RMS error {format_number(size * display.factor)} {display.unit}" if np.isfinite(size) else "no motion"
    begin = "Free run (started once, from the first sample)"
    if end is None:
        how = "keeps step" if trace.pole_pitch else "stays with the measured motion"
        return f"{begin}: {how} to the end, {error}."
    how = "lost step" if trace.pole_pitch else "left the measured motion"
    return f"{begin}: {how} at {trace.t[end]:.3g} s, not drawn beyond; {error} until then."


def ahead_text(pieces: AheadPieces, axis: str) -> str:
    """`0.1 s ahead, RMS 48.1 µm`."""
    size = rms(pieces.end_error)
    display = display_unit("position", axis, size)
    value = f"RMS {format_number(size * display.factor)} {display.unit}" if np.isfinite(size) else "diverged"
    return f"{pieces.horizon:.3g} s ahead, {value}"


def ahead_display(pieces: AheadPieces, axis: str) -> Display:
    """The unit for the errors of the pieces."""
    return display_unit("position", axis, peak(pieces.end_error))


def draw_ahead(axes: Any, trace: Trace, pieces: AheadPieces, factor: float, *, free_run: bool) -> None:
    """Measured position, the pieces above it and, if wanted, the free run until it loses step."""
    measured = trace.y_measured * factor
    axes.plot(*envelope(trace.t, measured), color=MEASURED, linewidth=2.4, label="measured", zorder=2)
    axes.plot(
        *envelope(pieces.t, pieces.y * factor, _BINS),
        color=MODEL,
        linewidth=0.7,
        zorder=4,
        label=f"model, restarted every {pieces.horizon:.3g} s",
    )
    drawn = pieces.y[np.isfinite(pieces.y)] * factor
    if free_run:
        end = free_run_end(trace)
        t, y = trace.t[:end], trace.y_simulated[:end] * factor
        axes.plot(*envelope(t, y), color=ACCENT, linewidth=0.8, linestyle="--", label="free run", zorder=3)
        drawn = np.concatenate([drawn, y])
        if end is not None:
            axes.axvline(trace.t[end], color=ACCENT, linewidth=0.8, linestyle=":", zorder=1)
    limit_to_measured(axes, measured, drawn)


def draw_ahead_error(axes: Any, pieces: AheadPieces, factor: float) -> None:
    """Errors growing over each piece, and points where a window reaches the horizon."""
    axes.axhline(0.0, color=MUTED, linewidth=0.5, zorder=1)
    axes.plot(*envelope(pieces.t, pieces.error * factor, _BINS), color=ERROR_LIGHT, linewidth=0.8, zorder=2)
    few = len(pieces.end_t) <= _FEW
    axes.plot(
        pieces.end_t,
        pieces.end_error * factor,
        linestyle="none",
        marker="o",
        color=ERROR,
        zorder=3,
        markersize=2.2 if few else 1.0,
        markeredgewidth=0.0,
    )
