"""The scope of the sine model in pictures: Delta(k, N) with its zero line, and what a sine costs over k."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from linid.physics.field.sine_scope import NEGLIGIBLE, PAPER_FIT, best_k, delta, limit_k, sine_cost
from linid.report.figures.common import legend_beside
from linid.report.style import ERROR, MEASURED, MODEL, MUTED, caption, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST = 100
OWN_MARKERS = ("o", "s")


def scope_figure() -> Figure:
    """Delta(k, N) per magnet with the line of its zeros (24), beside k_N and its limit: the paper's fig. 6."""
    numbers = np.arange(1, _MOST + 1)
    zeros = np.array([best_k(int(n)) for n in numbers])
    k = np.linspace(0.25, 0.5, 126)
    height = np.array([[delta(float(one), int(n)) / (2 * n + 1) for one in k] for n in numbers])
    limit = limit_k()
    with style():
        figure = new_figure(78.0, "Where a cosine comes nearest to the field")
        left, right = figure.subplots(1, 2)
        drawn = left.contourf(k, numbers, height, levels=np.linspace(-0.5, 0.5, 21), cmap="RdBu_r", extend="both")
        left.plot(zeros, numbers, color=MODEL, linewidth=1.6, label="zeros $k_N$")
        figure.colorbar(drawn, ax=left, label="Δ(k, N) / (2N + 1)")
        left.set_xlabel("k")
        left.set_ylabel("N")
        left.legend(loc="lower left", frameon=True, facecolor="white", framealpha=1.0)  # it stands on dark blue
        far = np.unique(np.round(np.logspace(0.0, 4.0, 41)).astype(int))
        a_0, a_1, a_2, a_3 = PAPER_FIT
        right.semilogx(far, [best_k(int(n)) for n in far], color=ERROR, label="$k_N$")
        right.semilogx(far, a_0 - a_1 * np.exp(-a_2 * far**a_3), color=MODEL, linestyle="--", label="fit (25)")
        right.axhline(limit, color=MEASURED, linewidth=0.8, label=f"limit {limit:.5f}")
        right.axhline(a_0, color=MUTED, linewidth=0.8, linestyle=":", label=f"paper's limit {a_0}")
        right.set_xlabel("N")
        right.set_ylabel("k")
        right.legend(loc="lower right")
        caption(
            figure,
            "The fit (25) was made on N up to 100, where it holds; as its exponential dies out too fast, its constant "
            "lies below the true limit, which $k_N$ approaches as 1/N.",
        )
    return figure


def cost_figure(own: Mapping[str, float] | None = None) -> Figure:
    """What a sine misses of the field over k; own: the motor's k by what they are of."""
    k = np.linspace(0.15, 0.8, 261)
    costs = [sine_cost(float(one)) for one in k]
    with style():
        figure = new_figure(72.0, "What the sine model costs")
        axes = figure.subplots()
        axes.semilogy(k, [100.0 * c.of_field for c in costs], color=MEASURED, label="best sine: the harmonics")
        axes.semilogy(k, [100.0 * c.in_star for c in costs], color=MEASURED, linestyle="-.", label="the same in a star")
        axes.semilogy(
            k, [100.0 * c.of_cosine for c in costs], color=MODEL, linestyle="--", label="cosine of $B_0$ (19)"
        )
        axes.axvline(limit_k(), color=MUTED, linewidth=0.8, label=f"k = {limit_k():.5f}")
        axes.axhline(100.0 * NEGLIGIBLE, color=MUTED, linewidth=0.8, linestyle=":", label=f"{100 * NEGLIGIBLE:g} %")
        for (name, one), marker in zip((own or {}).items(), OWN_MARKERS, strict=False):
            label = f"{name}, k = {one:.3g}"
            axes.plot([one], [100.0 * sine_cost(one).of_field], marker, markersize=5.0, color=ERROR, label=label)
        axes.set_ylim(bottom=1e-5)
        axes.set_xlabel("k = $\\sigma_y$ / pole pitch")
        axes.set_ylabel("missed, of the sine (% RMS)")
        legend_beside(axes)
        caption(
            figure,
            "The paper holds the cosine's amplitude at $B_0$, hence an optimum; an identified force constant is free, "
            "and then every larger k is nearer to a sine.",
        )
    return figure
