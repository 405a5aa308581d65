"""The curve or surface of a proposed term as it is drawn: in display units, with cuts through a surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from linid.arrays import Array
from linid.report.diagnosis.content import FEWEST_OF_CURVE, coordinate_display, force_word, number, scaled_display
from linid.report.display import Display, display_unit, peak
from linid.report.residual_views import COLOURED
from linid.report.symbols import unit_label

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis, TermAxis, TermCurve

_FORCES = ("N", "N m", "N/kg", "rad/s^2")  # as `scaled_unit` may leave a force
_SMALL = 0.1  # of a unit, below which thousandths read better
_PLACES = (0.1, 0.5, 0.9)  # of the rows with data: where a surface is cut
_FULL = 0.5  # of the fullest row's places: rows with fewer data are not cut
_ROOM = 0.6  # how far, in spans of the curve, its band may widen the panel
_MARGIN = 0.06
_NO_SPAN = 1e-12


@dataclass(frozen=True)
class TermCut:
    """The term over its first argument.

    words, at: where the second one stands ('' and 0 if there is none); x, value, low, high: (n,) in display units, the
    latter two a 95 % band.
    """

    words: str
    at: float
    x: Array
    value: Array
    low: Array
    high: Array


@dataclass(frozen=True)
class TermSurface:
    """The term over two arguments: x (n,), y (m,) centres, value (m, n), nan without data, all in display units; limit:
    of the colours."""

    x: Array
    y: Array
    y_title: str
    y_unit: str
    value: Array
    limit: float


@dataclass(frozen=True)
class TermView:
    """What is drawn. cut_title: which argument tells the cuts apart; points: the first argument has few places, which
    are no line; directions: it is the direction of motion."""

    x_title: str
    x_unit: str
    value_title: str
    value_unit: str
    cuts: tuple[TermCut, ...]
    cut_title: str
    surface: TermSurface | None
    points: bool
    directions: bool


def term_view(diagnosis: Diagnosis) -> TermView | None:
    """How the proposed term is drawn; None where there is no curve, or no place with data."""
    curve = diagnosis.proposal.curve if diagnosis.proposal is not None else None
    if curve is None or not curve.axes or not np.isfinite(curve.value).any():
        return None
    value, low, high, axes = curve.value, curve.low, curve.high, curve.axes
    if len(axes) == 2 and axes[0].x.size < FEWEST_OF_CURVE <= axes[1].x.size:  # lines along the argument with many
        axes, value, low, high = axes[::-1], value.T, low.T, high.T
    shown = value_display(diagnosis, curve)
    value, low, high = (one * shown.factor for one in (value, low, high))
    displays = [axis_display(diagnosis, axis) for axis in axes]
    x = axes[0].x * displays[0].factor
    surface = None
    if len(axes) == 1:
        cuts: tuple[TermCut, ...] = (TermCut("", 0.0, x, value, low, high),)
    else:
        rows = rows_of_cuts(value, axes[1].x.size < FEWEST_OF_CURVE)
        y, places = axes[1].x * displays[1].factor, [place_words(axes[1], displays[1], k) for k in range(len(value))]
        cuts = tuple(TermCut(places[k], float(y[k]), x, value[k], low[k], high[k]) for k in rows)
        if axes[1].x.size >= FEWEST_OF_CURVE:
            title = titled(axes[1].label, displays[1].unit)
            surface = TermSurface(x, y, title, displays[1].unit, value, colour_limit(value))
    return TermView(
        x_title=titled(axes[0].label, displays[0].unit),
        x_unit=displays[0].unit,
        value_title=titled(value_words(diagnosis, curve), shown.unit),
        value_unit=shown.unit,
        cuts=cuts,
        cut_title=titled(axes[-1].label, displays[-1].unit),
        surface=surface,
        points=x.size < FEWEST_OF_CURVE,
        directions=axes[0].argument == "direction",
    )


def titled(label: str, unit: str) -> str:
    """`velocity (mm/s)`."""
    return f"{label} ({unit})" if unit else label


def value_words(diagnosis: Diagnosis, curve: TermCurve) -> str:
    """What the shown values are."""
    word = force_word(diagnosis.axis)
    if curve.factor == "motor_force":
        return f"share of the motor {word}"
    if curve.factor == "velocity":
        return f"proposed {word} per velocity"
    return f"proposed {word}" + (", positive along the motion" if curve.factor == "direction" else "")


def value_display(diagnosis: Diagnosis, curve: TermCurve) -> Display:
    """The unit in which the shown values read well: mN or N, per cent of the motor force."""
    size = peak(curve.value)
    if curve.unit in _FORCES:
        return scaled_display(diagnosis, size)
    if curve.unit == "1":
        return Display(100.0, "%") if curve.factor == "motor_force" else Display(1.0, "")
    if curve.unit.startswith("N") and 0 < size < _SMALL:
        return Display(1e3, f"m{unit_label(curve.unit)}")
    return Display(1.0, unit_label(curve.unit))


def axis_display(diagnosis: Diagnosis, axis: TermAxis) -> Display:
    """The unit of an argument."""
    if axis.argument == "direction":
        return Display(1.0, "")
    if axis.argument == "motor_force":
        return scaled_display(diagnosis, peak(axis.x))
    if axis.argument == "travel":  # zero at one end: as a position
        return display_unit("position", diagnosis.axis, peak(axis.x))
    shown = coordinate_display(axis.x, axis.unit)
    return Display(shown.factor, unit_label(shown.unit))


def rows_of_cuts(value: Array, all_rows: bool) -> list[int]:
    """Rows of a surface that are drawn as lines: all with data, or a low, a middle and a high one. value: (m, n)."""
    count = np.isfinite(value).sum(axis=1)
    if all_rows:
        return [int(k) for k in np.flatnonzero(count)]
    full = np.flatnonzero(count >= max(1.0, _FULL * float(count.max())))
    return sorted({int(full[round(place * (full.size - 1))]) for place in _PLACES})


def place_words(axis: TermAxis, display: Display, place: int) -> str:
    """Where a cut lies, in the unit of display: `120`, `forwards`."""
    at = float(axis.x[place])
    if axis.argument == "direction":
        return direction_words(at)
    return number(at * display.factor)


def direction_words(at: float) -> str:
    """A direction of motion (its sign) in words."""
    return "forwards" if at > 0 else "backwards" if at < 0 else "at rest"


def colour_limit(value: Array) -> float:
    """End of a symmetric colour scale that single cells do not blow up; value: (m, n) in any unit."""
    sizes = np.abs(value[np.isfinite(value)])
    limit = float(np.quantile(sizes, COLOURED)) if sizes.size else 0.0
    return limit if limit > 0 else 1.0


def value_limits(view: TermView) -> tuple[float, float]:
    """Ends of the axis of values: all curves with zero, and of their bands as much as leaves the curves legible."""
    values = np.concatenate([cut.value for cut in view.cuts])
    ends = np.concatenate([end[np.isfinite(end)] for cut in view.cuts for end in (cut.low, cut.high)])
    least, most = min(0.0, float(np.nanmin(values))), max(0.0, float(np.nanmax(values)))
    room = _ROOM * max(most - least, _NO_SPAN)
    if ends.size:
        least = min(least, max(float(ends.min()), least - room))
        most = max(most, min(float(ends.max()), most + room))
    margin = _MARGIN * max(most - least, _NO_SPAN)
    return least - margin, most + margin


def view_words(view: TermView) -> str:
    """How to read what is drawn."""
    words = "Points: the proposed term; bars: 95 %." if view.points else "Line: the proposed term; shade: 95 %."
    if view.surface is not None:
        words = f"Map: the proposed term; grey: no data. Lines: cuts through the map; {words.split('; ')[1]}"
    return words
