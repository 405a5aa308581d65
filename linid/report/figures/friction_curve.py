"""The steady friction curve of a fit with its 95 % band."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.arrays import Array
from linid.errors import DataError
from linid.report.display import display_unit
from linid.report.style import MEASURED, MODEL, MUTED, SHADE, caption, grid, new_figure, style
from linid.report.symbols import unit_label

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.gap import Trace
    from linid.identification.result import FitResult

CURVE = ("coulomb_force", "static_force", "stribeck_velocity", "stribeck_exponent", "viscous_friction")
_SAMPLES = 2000
_POINTS = 160  # of either range
_FASTEST = 99.5  # per cent of the measured speeds: noise does not count as speed
_STRIBECK_RANGE = 6.0  # times v_s: there its exponential has died out
_BEYOND = 1.3  # how far past the covered speeds the curve is drawn
_LARGEST_LOG_STD = 3.0  # e^3: beyond a factor of 20 the linearised covariance says nothing


def steady_friction(v: Array, parameters: dict[str, float]) -> Array:
    """Steady LuGre friction R(v) = [F_C + (F_S - F_C) exp(-|v/v_s|^alpha)] sign(v) + sigma_2 v.

    v: (n,) m/s; parameters: SI values under the canonical names. Returns (n,) N. At v = 0 the limit from above, F_S,
    is given. Source: Canudas de Wit et al. 1995, eq. 4 and 5 (rotary: rad/s and N m).
    """
    force_c, force_s, v_s, alpha, sigma_2 = (parameters[name] for name in CURVE)
    g = force_c + (force_s - force_c) * np.exp(-(np.abs(v / v_s) ** alpha))
    return np.asarray(g * np.where(v < 0, -1.0, 1.0) + sigma_2 * v)


def sample_parameters(result: FitResult, samples: int = _SAMPLES, seed: int = 0) -> dict[str, Array]:
    """Draw parameter sets, (samples,) each, from the fit's covariance.

    Strictly positive parameters are drawn log-normally (the covariance divided by the values), others normally;
    what is fixed, at its bound without a variance, or not identifiable stays at its value.
    """
    draws = {name: np.full(samples, result.value(name)) for name in CURVE}
    status = {e.name: e.status for e in result.estimates}
    variance = np.diag(result.covariance) if result.covariance.size else np.zeros(len(result.fitted))
    chosen = [
        i
        for i, name in enumerate(result.fitted)
        if name in draws and status[name] != "not_identifiable" and np.isfinite(variance[i]) and variance[i] > 0
    ]
    if not chosen:
        return draws
    values = np.array([result.value(result.fitted[i]) for i in chosen])
    positive = values > 0
    scale = np.where(positive, values, 1.0)
    covariance = np.nan_to_num(result.covariance[np.ix_(chosen, chosen)]) / np.outer(scale, scale)
    std = np.sqrt(np.diag(covariance))
    shrink = np.where(positive, np.minimum(1.0, _LARGEST_LOG_STD / std), 1.0)
    steps = _normal(covariance * np.outer(shrink, shrink), samples, seed)
    for step, value, is_positive, i in zip(steps, values, positive, chosen, strict=True):
        draws[result.fitted[i]] = value * np.exp(step) if is_positive else value + step
    return draws


def friction_band(result: FitResult, v: Array, samples: int = _SAMPLES, seed: int = 0) -> tuple[Array, Array, Array]:
    """Steady friction at v and the ends of its pointwise 95 % band, three (n,) arrays; the band holds the curve."""
    curve = steady_friction(v, {name: result.value(name) for name in CURVE})
    draws = sample_parameters(result, samples, seed)
    curves = steady_friction(v[:, None], {name: column[None, :] for name, column in draws.items()})  # type: ignore[misc]
    low, high = np.percentile(curves, [2.5, 97.5], axis=1)
    return curve, np.minimum(low, curve), np.maximum(high, curve)


def speed_covered(traces: Sequence[Trace]) -> float:
    """Highest speed in the data, m/s: the 99.5 % point of the differentiated speed, so that noise does not count."""
    speeds = [float(np.percentile(np.abs(t.velocity_measured), _FASTEST)) for t in traces if t.velocity_measured.size]
    return max(speeds, default=0.0)


def friction_curve_figure(result: FitResult, covered: float, seed: int = 0) -> Figure:
    """Steady friction over speed with its 95 % band: whole range left, the Stribeck range right.

    covered: highest speed in the data, m/s (rotary: rad/s), 0 if not known; beyond it the line is dashed on shade.
    Raises DataError if the model has no friction curve.
    """
    missing = [name for name in CURVE if name not in {e.name for e in result.estimates}]
    if missing:
        raise DataError("friction curve", f"the model lacks {', '.join(missing)}", "Draw it for a model with friction.")
    v_s = result.value("stribeck_velocity")
    known = np.isfinite(covered) and covered > 0
    top = _BEYOND * covered if known else 10.0 * v_s
    covered = covered if known else np.inf
    zoom = min(_STRIBECK_RANGE * v_s, top)
    with style():
        figure = new_figure(75.0, "Steady friction over speed")
        margins = (15.0, 4.0, 10.5 + caption(figure, _remark(result, covered)), 12.0)
        panels: Any = grid(figure, 1, 2, margins=margins, gaps=(16.0, 0.0), widths=[1.5, 1.0]).subplots()
        whole, near = panels
        # the Stribeck range needs its own dense stretch of the grid
        v = np.unique(np.concatenate([np.linspace(0.0, top, _POINTS), np.linspace(0.0, zoom, _POINTS)]))
        for axes, limit, title in ((whole, top, "whole range"), (near, zoom, "low speed")):
            _panel(axes, result, v[v <= limit], covered, seed)
            axes.set_title(title)
            low, high = axes.get_ylim()
            axes.set_ylim(min(0.0, low), high)
            axes.set_ylabel(f"friction ({force_unit(result)})")
        whole.legend(loc="upper left")
    return figure


def force_unit(result: FitResult) -> str:
    """Label of the friction force's unit, per kilogram if the fit knows no mass."""
    unit = next(e.unit for e in result.estimates if e.name == "coulomb_force")
    if result.per_mass and unit in ("N", "N m"):
        return "N/kg" if unit == "N" else "N m/(kg m²)"
    return unit_label(unit)


def _panel(axes: Any, result: FitResult, v: Array, covered: float, seed: int) -> None:
    display = display_unit("velocity", result.axis, float(v[-1]))
    curve, low, high = friction_band(result, v, seed=seed)
    x, data = v * display.factor, v <= covered
    axes.fill_between(x, low, high, color=MEASURED, alpha=0.25, linewidth=0, zorder=2, label="95 % band")
    axes.plot(x[data], curve[data], color=MODEL, linewidth=1.2, zorder=3, label="estimate")
    if not data.all():
        axes.axvspan(covered * display.factor, x[-1], facecolor=SHADE, edgecolor="none", zorder=0, label="no data")
        axes.axvline(covered * display.factor, color=MUTED, linewidth=0.6, zorder=1)
        axes.plot(x[~data], curve[~data], color=MODEL, linewidth=1.2, linestyle="--", zorder=3)
    axes.set_xlim(0.0, x[-1])
    axes.set_xlabel(f"speed ({display.unit})")


def _remark(result: FitResult, covered: float) -> str:
    held = [e.name for e in result.estimates if e.name in CURVE and e.status == "not_identifiable"]
    display = display_unit("velocity", result.axis, covered)
    text = "The speeds in the data are not known." if np.isinf(covered) else ""
    text = text or f"Data reach {covered * display.factor:.3g} {display.unit}."
    if held:
        text += f" Held, as not identifiable: {', '.join(held)}; the band leaves out their uncertainty."
    return text + (" Effects on friction are not drawn." if result.effects else "")


def _normal(covariance: Array, samples: int, seed: int) -> Array:
    # The eigenvalues of a rounded covariance may dip below zero; Cholesky would refuse it.
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return np.asarray(root @ np.random.default_rng(seed).standard_normal((len(values), samples)))
