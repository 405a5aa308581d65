"""What several figures share: traces as lines, limits that a diverged simulation cannot blow up, labels."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from linid.arrays import Array
from linid.report.display import display_unit, envelope, peak, rms
from linid.report.numbers import format_number
from linid.report.style import ERROR, MEASURED, MODEL, MUTED, NO_DATA

if TYPE_CHECKING:
    from linid.diagnosis.gap import Trace
    from linid.report.display import Display

TIME_LABEL = "time (s)"
_STILL = 1e-9
_ROOM = 0.6  # how far, in spans of the measured line, a simulation may leave it before it is cut


def position_display(traces: list[Trace]) -> Display:
    """One unit for the positions of all traces, by their largest travel."""
    travel = max((float(np.ptp(trace.y_measured)) for trace in traces if trace.t.size), default=0.0)
    return display_unit("position", traces[0].axis, travel)


def error_display(traces: list[Trace]) -> Display:
    """One unit for simulated minus measured position; what lies beyond the measured travel does not count."""
    largest = 0.0
    for trace in traces:
        error = np.abs(trace.y_simulated - trace.y_measured)
        error = error[np.isfinite(error)]
        if error.size:
            travel = float(np.ptp(trace.y_measured))
            largest = max(largest, float(min(error.max(), travel)) if travel > 0 else float(error.max()))
    return display_unit("position", traces[0].axis, largest)


def velocity_display(traces: list[Trace]) -> Display:
    """One unit for the velocities of all traces."""
    return display_unit("velocity", traces[0].axis, max(peak(trace.velocity_measured) for trace in traces))


def draw_map(axes: Any, x: Array, y: Array, values: Array, limit: float, **more: Any) -> Any:
    """Signed values over two quantities, blue to red about zero; what is nan is grey.

    x (m,), y (k,): centres or edges of the cells; values: (k, m); limit: of the colours; all in the units shown.
    """
    axes.grid(False)
    axes.set_facecolor(NO_DATA)
    return axes.pcolormesh(
        x, y, np.ma.masked_invalid(values), cmap="RdBu_r", vmin=-limit, vmax=limit, rasterized=True, **more
    )


def legend_beside(axes: Any) -> None:
    """The legend right of the axes, where it covers nothing."""
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))


def draw_pair(axes: Any, t: Array, measured: Array, simulated: Array, factor: float) -> None:
    """Measured (blue, wide) below simulated (black, thin), decimated to envelopes, limits ruled by the measured.

    t: (n,) s; measured, simulated: (n,) SI, shown times factor.
    """
    axes.plot(*envelope(t, measured * factor), color=MEASURED, linewidth=2.4, label="measured", zorder=2)
    axes.plot(*envelope(t, simulated * factor), color=MODEL, linewidth=0.7, label="model", zorder=3)
    limit_to_measured(axes, measured * factor, simulated * factor)


def draw_error(axes: Any, t: Array, measured: Array, simulated: Array, factor: float, **line: Any) -> None:
    """Simulated minus measured; a runaway error is cut at the measured span. t, measured, simulated: (n,) as in
    `draw_pair`.
    """
    error = (simulated - measured) * factor
    axes.axhline(0.0, color=MUTED, linewidth=0.5, zorder=1)
    axes.plot(*envelope(t, error), **{"color": ERROR, "linewidth": 0.8, "zorder": 3, **line})
    span = float(np.ptp(measured)) * factor if measured.size else 0.0
    if span > 0 and peak(error) > span:
        axes.set_ylim(-span, span)


def limit_to_measured(axes: Any, measured: Array, simulated: Array) -> None:
    """Keep the measured line (n,) legible when the simulated one (n,) runs far away; both in the unit shown."""
    low, high = float(np.min(measured)), float(np.max(measured))
    if high - low <= _STILL * max(1.0, abs(high)) and peak(simulated - high) <= _STILL * max(1.0, abs(high)):
        axes.set_ylim(low - 1.0, high + 1.0)  # else rounding noise would fill the panel
        return
    room = _ROOM * (high - low)
    good = simulated[np.isfinite(simulated)]
    if room > 0 and good.size and (good.min() < low - room or good.max() > high + room):
        axes.set_ylim(max(low - room, min(low, good.min())) - 0.05 * room, min(high + room, max(high, good.max())))


def breakdown(trace: Trace) -> tuple[float, str] | None:
    """When and how the simulation fails, as (t, text); None if it follows within the drawn range."""
    simulated, measured = trace.y_simulated, trace.y_measured
    bad = ~np.isfinite(simulated)
    if bad.any():
        first = float(trace.t[int(np.argmax(bad))])
        return first, f"diverged at {first:.3g} s"
    room = _ROOM * float(np.ptp(measured))
    out = (simulated < measured.min() - room) | (simulated > measured.max() + room)
    if room > 0 and out.any():
        first = float(trace.t[int(np.argmax(out))])
        return first, f"off the scale at {first:.3g} s"
    return None


def mark_breakdown(axes: Any, trace: Trace) -> None:
    """A dotted line and a word where the simulation fails."""
    failure = breakdown(trace)
    if failure is not None:
        t, text = failure
        axes.axvline(t, color=ERROR, linewidth=0.8, linestyle=":")
        late = t > 0.5 * (trace.t[0] + trace.t[-1])
        axes.annotate(
            f"simulation {text}",
            (t, 0.04),
            xycoords=("data", "axes fraction"),
            xytext=(-3 if late else 3, 0),
            textcoords="offset points",
            ha="right" if late else "left",
            color=ERROR,
            fontsize=7,
            zorder=5,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1, "alpha": 0.8},
        )


def rms_text(trace: Trace) -> str:
    """`RMS error 81.2 µm` in its own unit; empty if the simulation diverged."""
    size = rms(trace.y_simulated - trace.y_measured)
    display = display_unit("position", trace.axis, size)
    return "" if np.isnan(size) else f"RMS error {format_number(size * display.factor)} {display.unit}"


def legend_above(axes: Any, columns: int = 4, **more: Any) -> None:
    """A legend on the line of the title, where no data can be."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=columns, borderaxespad=0.2, **more)


def shorten(name: str, longest: int) -> str:
    """A name of at most `longest` characters, cut in the middle: the ends tell recordings apart."""
    if len(name) <= longest:
        return name
    tail = longest // 2
    return f"{name[: longest - tail - 1]}…{name[-tail:]}"


def kind_and_split(trace: Trace) -> str:
    """`motor, held out`."""
    return f"{trace.kind}, {trace.split}".replace("_", " ")
