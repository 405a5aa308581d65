"""The magnet field in pictures: a pair and its Gaussian, the guideway over k, theta functions, thrust over position."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.physics.field.guideway import gaussian_guideway, harmonic, theta_guideway
from linid.physics.field.magnet_pair import pair_field
from linid.physics.field.sine_scope import limit_k
from linid.physics.field.winding import theta_harmonic
from linid.physics.theta import Theta0, theta3
from linid.report.figures.common import legend_beside
from linid.report.style import ERROR, MODEL, PHASES, SHADE, caption, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.physics.field.geometry import MotorDesign

_POINTS = 401
_SHOWN_K = (0.1, 0.2, 0.3, 0.46, 0.65, 0.9)  # that nearest to the cosine, and others far enough apart to be seen
_SHOWN_NOMES = (0.1, 0.3, 0.493, 0.7)
_MM = 1e3


def pair_figure(design: MotorDesign) -> Figure:
    """Flux density in the middle of the gap along and across the guideway: one pair of magnets and its Gaussian (13).

    The counterpart of the paper's fig. 3.
    """
    geometry, gaussian = design.geometry, design.gaussian
    pair = geometry.pair
    with style():
        figure = new_figure(72.0, f"A pair of magnets, {geometry.name}")
        along, across = figure.subplots(1, 2, sharey=True)
        for axes, size, name in ((along, pair.magnet.size_y, "y"), (across, pair.magnet.size_x, "x")):
            place = np.linspace(-1.0, 1.0, _POINTS) * (0.5 * size + 2.0 * pair.gap)
            zero = np.zeros_like(place)
            x, y = (zero, place) if name == "y" else (place, zero)
            axes.axvspan(-0.5 * size * _MM, 0.5 * size * _MM, color=SHADE, zorder=0, label="magnet")
            axes.plot(place * _MM, pair_field(x, y, pair), color=MODEL, label="exact (8)")
            axes.plot(place * _MM, gaussian.at(x, y), color=ERROR, linestyle="--", label="Gaussian (13)")
            axes.set_xlabel(f"{name} (mm)")
        along.set_title("along the guideway")
        across.set_title("across the guideway")
        along.set_ylabel("flux density $B_z$ (T)")
        along.legend(loc="upper right", frameon=True, facecolor="white", framealpha=1.0)  # its swatch is shaded too
        caption(
            figure,
            f"Gaussian: $B_0$ = {gaussian.peak:.4g} T, $\\sigma_x$ = {gaussian.sigma_x * _MM:.4g} mm, $\\sigma_y$ = "
            f"{gaussian.sigma_y * _MM:.4g} mm; it misses {100 * gaussian.rms_error:.2g} % RMS and at most "
            f"{100 * gaussian.largest_error:.2g} % of the peak within {gaussian.reach_x * _MM:.3g} by "
            f"{gaussian.reach_y * _MM:.3g} mm.",
        )
    return figure


def guideway_figure() -> Figure:
    """Field of the infinite guideway over position and k (16): the paper's fig. 5, as a map."""
    with style():
        figure = new_figure(76.0, "Field of the guideway by its k")
        axes = figure.subplots()
        y, k = np.linspace(-2.0, 2.0, 321), np.linspace(0.02, 1.0, 99)
        field = np.array([gaussian_guideway(y, float(one)) for one in k])
        drawn = axes.pcolormesh(y, k, field, cmap="RdBu_r", vmin=-1.0, vmax=1.0, shading="gouraud", rasterized=True)
        figure.colorbar(drawn, ax=axes, label="B / $B_0$")
        axes.axhline(limit_k(), color=MODEL, linewidth=0.8, linestyle=":", label=f"k = {limit_k():.5f}")
        axes.set_xlabel("y / pole pitch")
        axes.set_ylabel("k = $\\sigma_y$ / pole pitch")
        axes.legend(loc="upper right")
        axes.grid(False)
        caption(figure, "Small k: separate bumps with nothing between them. Large k: a sine, ever weaker.")
    return figure


def theta3_figure() -> Figure:
    """Jacobi's theta3 for real z and some nomes (33): the paper's fig. 7."""
    with style():
        figure = new_figure(70.0, "Jacobi's theta function of the third kind")
        axes = figure.subplots()
        z = np.linspace(-math.pi, math.pi, _POINTS)
        for nome, colour in zip(_SHOWN_NOMES, _shades(len(_SHOWN_NOMES)), strict=True):
            axes.plot(z, theta3(z, nome), color=colour, label=f"q = {nome:g}")
        axes.set_xlabel("z (rad)")
        axes.set_ylabel("$\\vartheta_3(z, q)$")
        legend_beside(axes)
    return figure


def shapes_figure(k: Sequence[float] = _SHOWN_K, own: Mapping[str, float] | None = None) -> Figure:
    """K_B Theta(z_0 y, q_0) along a pole pitch for some k (34) to (36): the paper's fig. 8.

    own: the motor's k by what they are of, drawn above the others. The other half of the period repeats this one.
    """
    with style():
        figure = new_figure(90.0, "Shape of the guideway's field")
        axes = figure.subplots()
        y = np.linspace(-0.5, 0.5, _POINTS)
        for one, colour in zip(k, _shades(len(k)), strict=True):
            axes.plot(y, theta_guideway(y, one), color=colour, linewidth=1.6, label=f"k = {one:g}")
        axes.plot(y, np.cos(np.pi * y), color=MODEL, linestyle=":", linewidth=1.4, zorder=4, label="cosine (18)")
        for (name, one), line in zip((own or {}).items(), ("--", "-."), strict=False):
            label = f"{name}, k = {one:.3g}"
            axes.plot(y, theta_guideway(y, one), color=ERROR, linestyle=line, zorder=5, label=label)
        axes.set_xlabel("y / pole pitch")
        axes.set_ylabel("$K_B\\,\\Theta(z_0 y, q_0)$ = B / $B_0$")
        legend_beside(axes)
        if own:
            caption(figure, " ".join(_harmonics_of_field(name, one) for name, one in own.items()))
    return figure


def _harmonics_of_field(name: str, k: float) -> str:
    shares = ", ".join(f"{n}: {100 * harmonic(n, k) / harmonic(1, k):.2g} %" for n in (3, 5))
    return f"Harmonics at k = {k:.3g} ({name}), of the first: {shares}."


def thrust_figure(design: MotorDesign, identified: Mapping[str, float] | None = None, kind: str = "") -> Figure:
    """Thrust over current of the three windings in the exact field, by theta as derived, and by theta as matched.

    identified: SI values of a fitted motor of that kind, laid over the designed one by its own field phase.
    """
    pitch = design.geometry.pole_pitch
    y = np.linspace(0.0, 2.0 * pitch, _POINTS)
    shift = design.sine["winding_displacement"]
    with style():
        figure = new_figure(84.0, f"Thrust over phase current, {design.geometry.name}")
        axes = figure.subplots()
        for winding, colour in zip((-1, 0, 1), PHASES, strict=True):
            angle = math.pi * y / pitch + winding * shift
            exact = sum(amplitude * np.sin(n * angle) for n, amplitude in design.exact.items())
            theta = _theta(design.theta, angle)
            axes.plot(y * _MM, exact, color=colour, linewidth=2.4, alpha=0.35, label=_label("exact field", winding))
            matched = _theta(design.matched, angle)
            axes.plot(y * _MM, theta, color=colour, linestyle=":", label=_label("theta by (38)", winding))
            axes.plot(y * _MM, matched, color=colour, linewidth=0.8, label=_label("theta, matched", winding))
        if identified is not None:
            axes.plot(
                y * _MM, _identified(identified, kind, y), color=ERROR, linestyle="--", label=f"identified, {kind}"
            )
        axes.set_xlabel("position (mm)")
        axes.set_ylabel("thrust / current (N/A)")
        legend_beside(axes)
        caption(figure, _harmonics(design))
    return figure


def _harmonics(design: MotorDesign) -> str:
    """The harmonics of the thrust in words."""

    def theta(values: Mapping[str, float], n: int) -> float:
        return values["force_constant"] * theta_harmonic(n, values["nome"], values["winding_length"])

    def share(amplitude: float, first: float) -> str:
        return f"{100.0 * amplitude / first:+.2g} %"

    exact, matched = design.exact, design.matched
    others = ", ".join(f"{n}: {share(exact[n], exact[1])} ({share(theta(matched, n), exact[1])})" for n in (3, 5, 7))
    return (
        f"First harmonic: {exact[1]:.4g} N/A in the exact field, {theta(design.theta, 1):.4g} N/A by (38). Others, of "
        f"it, exact and (matched theta): {others}."
    )


def _identified(values: Mapping[str, float], kind: str, y: Any) -> Any:
    """Thrust over current of the middle winding, its field phase put to zero and its first harmonic made positive."""
    if kind == "sine":
        return abs(values["force_constant"]) * np.sin(values["electrical_wavenumber"] * y)
    thrust = values["force_constant"] * Theta0(
        values["electrical_wavenumber"] * y, values["nome"], values["winding_length"]
    )
    return thrust * (1.0 if values["force_constant"] * math.sin(2.0 * values["winding_length"]) > 0.0 else -1.0)


def _theta(values: Mapping[str, float], angle: Any) -> Any:
    """Thrust over current at an electrical angle, the field phase left out."""
    return values["force_constant"] * Theta0(0.5 * angle, values["nome"], values["winding_length"])


def _label(text: str, winding: int) -> str:
    return text if winding == 0 else "_"


def _shades(number: int) -> list[Any]:
    from matplotlib import colormaps

    return [colormaps["cividis"](0.9 * i / max(number - 1, 1)) for i in range(number)]
