"""Figures of the public interface: matplotlib axes in, axes out; without axes, of a new figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from linid.physics.friction import stribeck_fall
from linid.report.figures.diagnosis_waterfall import waterfall_figure
from linid.report.style import MEASURED, MODEL

if TYPE_CHECKING:
    from linid.api import Diagnosed, Fit
    from linid.diagnosis.gap import Trace

__all__ = ["error", "free_run", "friction_curve", "waterfall"]

_DRAWS = 400
_POINTS = 400


def _axes(axes: Any) -> Any:
    if axes is not None:
        return axes
    from matplotlib.figure import Figure

    return Figure(layout="constrained").subplots()


def friction_curve(fit: Fit, axes: Any = None, *, top_speed: float | None = None, seed: int = 1) -> Any:
    """Steady friction over speed, Stribeck curve and viscous part (paper, eq. 42), with its 95 % band.

    top_speed: m/s (rotary: rad/s), by default ten times the Stribeck velocity; the band: of draws from the estimates'
    covariance, seeded. Returns the axes.
    """
    axes = _axes(axes)
    names = ("coulomb_force", "static_force", "stribeck_velocity", "stribeck_exponent", "viscous_friction")
    values = [fit[name].value for name in names]
    top = 10.0 * values[2] if top_speed is None else top_speed
    v = np.linspace(-top, top, _POINTS)
    fitted = list(fit.result.fitted)
    rows = np.tile([e.value for e in fit.result.estimates], (_DRAWS, 1))
    places = {e.name: k for k, e in enumerate(fit.result.estimates)}
    if fit.result.covariance.shape == (len(fitted), len(fitted)) and fitted:
        draws = np.random.default_rng(seed).multivariate_normal(
            np.zeros(len(fitted)), fit.result.covariance, _DRAWS, check_valid="ignore"
        )
        rows[:, [places[name] for name in fitted]] += draws
    drawn = np.array([_curve(v, rows[k, [places[name] for name in names]]) for k in range(_DRAWS)])
    low, high = np.nanquantile(drawn, (0.025, 0.975), axis=0)
    rotary = fit.result.axis == "rotary"
    axes.fill_between(v, low, high, color=MODEL, alpha=0.25, linewidth=0.0, label="95 %")
    axes.plot(v, _curve(v, np.array(values)), color=MODEL, label="steady friction")
    axes.set_xlabel("Speed (rad/s)" if rotary else "Speed (m/s)")
    unit = "N m" if rotary else "N"
    per = (" per kg m²" if rotary else " per kg") if fit.result.per_mass else ""
    axes.set_ylabel(f"Friction ({unit}{per})")
    axes.legend()
    return axes


def _curve(v: Any, values: Any) -> Any:
    """Friction in N at speeds (n,) in m/s; values: F_C, F_S, v_s, alpha, sigma_2; nan for impossible ones."""
    coulomb, static, velocity, exponent, viscous = map(float, values)
    if not velocity > 0.0:
        return np.full(v.size, np.nan)
    levels = np.array([stribeck_fall(abs(x), coulomb, static, velocity, exponent)[0] for x in v])
    return np.sign(v) * levels + viscous * v


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
