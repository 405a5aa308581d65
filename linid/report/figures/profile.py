"""Profile likelihood of one parameter: how fast the fit worsens when it is held elsewhere."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.report.figures.common import legend_above
from linid.report.style import ACCENT, MEASURED, MODEL, MUTED, caption, new_figure, style
from linid.statistics import CHI_SQUARED_95

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.identification.result import FitResult, Profile


def profile_figure(result: FitResult, profile: Profile) -> Figure:
    """Likelihood ratio (1) over the parameter in SI, its 95 % limit, and the parabola of the reported deviation."""
    estimate = next(e for e in result.estimates if e.name == profile.name)
    values = np.array(profile.values)
    with style():
        figure = new_figure(75.0)
        axes: Any = figure.subplots()
        axes.axhline(CHI_SQUARED_95, color=MUTED, linewidth=0.8, linestyle="--", label="95 % limit")
        if math.isfinite(estimate.std) and estimate.std > 0.0:
            x = np.linspace(values[0], values[-1], 200)
            parabola = ((x - estimate.value) / estimate.std) ** 2
            axes.plot(x, parabola, color=ACCENT, linewidth=1.0, label="parabola of the standard deviation")
        axes.plot(values, profile.statistic, color=MODEL, marker="o", label="profile")
        for end in (profile.low, profile.high):
            if math.isfinite(end):
                axes.axvline(end, color=MEASURED, linewidth=0.8, linestyle=":")
        axes.set_ylim(0.0, 1.15 * max(*profile.statistic, CHI_SQUARED_95))
        unit = "" if estimate.unit == "1" else f" ({estimate.unit})"
        axes.set_xlabel(f"{profile.name.replace('_', ' ')} {estimate.symbol}{unit}")
        axes.set_ylabel("likelihood ratio (1)")
        axes.set_title(f"Profile likelihood of {profile.name.replace('_', ' ')}")
        legend_above(axes)
        ends = (f"{profile.low:.4g}", f"{profile.high:.4g}")
        caption(figure, f"95 % interval {_end(ends[0], profile.low)} to {_end(ends[1], profile.high)}: dotted.")
    return figure


def _end(text: str, value: float) -> str:
    return text if math.isfinite(value) else "open"
