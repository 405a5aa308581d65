"""Figures of the public interface: matplotlib axes in, axes out; without axes, of a new figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from linid.report.figures.diagnosis_waterfall import waterfall_figure
from linid.report.figures.friction_curve import force_unit, friction_band
from linid.report.style import MEASURED, MODEL

if TYPE_CHECKING:
    from linid.api import Diagnosed, Fit
    from linid.diagnosis.gap import Trace

__all__ = ["error", "free_run", "friction_curve", "waterfall"]

_POINTS = 400


def _axes(axes: Any) -> Any:
    if axes is not None:
        return axes
    from matplotlib.figure import Figure

    return Figure(layout="constrained").subplots()


def friction_curve(fit: Fit, axes: Any = None, *, top_speed: float | None = None, seed: int = 0) -> Any:
    """Steady friction over speed, Stribeck curve and viscous part (paper, eq. 42), with its 95 % band.

    top_speed: m/s (rotary: rad/s), by default ten times the Stribeck velocity; the band: of seeded draws from the
    estimates' covariance, see `friction_band`. Returns the axes.
    """
    axes = _axes(axes)
    top = 10.0 * fit["stribeck_velocity"].value if top_speed is None else top_speed
    v = np.linspace(-top, top, _POINTS)
    curve, low, high = friction_band(fit.result, v, seed=seed)
    axes.fill_between(v, low, high, color=MODEL, alpha=0.25, linewidth=0.0, label="95 %")
    axes.plot(v, curve, color=MODEL, label="steady friction")
    axes.set_xlabel("Speed (rad/s)" if fit.result.axis == "rotary" else "Speed (m/s)")
    axes.set_ylabel(f"Friction ({force_unit(fit.result)})")
    axes.legend()
    return axes


def free_run(trace: Trace, axes: Any = None) -> Any:
    """Measured and simulated position over time (s, m or rad) of a `linid.simulate`. Returns the axes."""
    axes = _axes(axes)
    axes.plot(trace.t, trace.y_measured, color=MEASURED, label="measured")
    axes.plot(trace.t, trace.y_simulated, color=MODEL, linestyle="--", label="simulated")
    axes.set_xlabel("Time (s)")
    axes.set_ylabel("Position (rad)" if trace.axis == "rotary" else "Position (m)")
    axes.set_title(trace.recording)
    axes.legend()
    return axes


def error(trace: Trace, axes: Any = None) -> Any:
    """Simulated minus measured position over time (s, m or rad). Returns the axes."""
    axes = _axes(axes)
    axes.plot(trace.t, trace.y_simulated - trace.y_measured, color=MODEL)
    axes.axhline(0.0, color=MEASURED, linewidth=0.8)
    axes.set_xlabel("Time (s)")
    axes.set_ylabel("Error (rad)" if trace.axis == "rotary" else "Error (m)")
    axes.set_title(trace.recording)
    return axes


def waterfall(found: Diagnosed) -> Any:
    """The gap's budget as a waterfall: base, each effect, unexplained, floor. Returns the matplotlib figure."""
    return waterfall_figure(found.found.diagnosis)
