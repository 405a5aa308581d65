"""Where a free wheel was found in a recording."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from linid.report.display import display_unit, envelope, peak
from linid.report.figures.common import TIME_LABEL, legend_above, shorten
from linid.report.style import ACCENT, MEASURED, SHADE, new_figure, stacked, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.recording.recording import Recording


def coast_down_figure(
    recording: Recording, t_start: float, t_end: float, candidates: Sequence[tuple[float, float]] = ()
) -> Figure:
    """Position and differentiated velocity; the chosen window [t_start, t_end] (s) and other candidates shaded."""
    t, y = recording.t, recording.y
    v = np.gradient(y, t)
    position = display_unit("position", recording.axis, float(np.ptp(y)))
    velocity = display_unit("velocity", recording.axis, peak(v))
    with style():
        figure = new_figure(90.0)
        top, bottom = stacked(figure, (1, 1))
        for axes in (top, bottom):
            others = [c for c in candidates if not (c[0] == t_start and c[1] == t_end)]
            for index, (start, end) in enumerate(others):
                label = "other candidates" if index == 0 else None
                axes.axvspan(start, end, facecolor=SHADE, edgecolor="none", zorder=0, label=label)
            axes.axvspan(t_start, t_end, facecolor=ACCENT, alpha=0.22, edgecolor="none", zorder=0.5, label="coast-down")
            for edge in (t_start, t_end):
                axes.axvline(edge, color=ACCENT, linewidth=0.8, zorder=1)
        top.plot(*envelope(t, y * position.factor), color=MEASURED)
        bottom.plot(*envelope(t, v * velocity.factor), color=MEASURED, linewidth=0.8)
        bottom.axhline(0.0, color="#777777", linewidth=0.5, zorder=1)
        top.set_title(f"{shorten(recording.name, 24)}: coast-down from {t_start:.3f} to {t_end:.3f} s")
        legend_above(bottom)
        top.set_ylabel(f"position ({position.unit})")
        bottom.set_ylabel(f"differentiated\nvelocity ({velocity.unit})")
        bottom.set_xlabel(TIME_LABEL)
    return figure
