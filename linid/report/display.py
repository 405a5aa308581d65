"""Display units and decimation for drawing; SI comes in, a factor and a label go out."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from linid.arrays import Array

Quantity = Literal["position", "velocity", "force"]

# (largest magnitude in SI up to which the unit is used, factor from SI, label)
_UNITS: dict[tuple[Quantity, str], tuple[tuple[float, float, str], ...]] = {
    ("position", "linear"): ((1e-6, 1e9, "nm"), (1e-3, 1e6, "µm"), (2.0, 1e3, "mm"), (np.inf, 1.0, "m")),
    ("position", "rotary"): ((1e-6, 1e9, "nrad"), (1e-3, 1e6, "µrad"), (0.5, 1e3, "mrad"), (np.inf, 1.0, "rad")),
    ("velocity", "linear"): ((0.1, 1e3, "mm/s"), (np.inf, 1.0, "m/s")),
    ("velocity", "rotary"): ((0.1, 1e3, "mrad/s"), (np.inf, 1.0, "rad/s")),
    ("force", "linear"): ((0.1, 1e3, "mN"), (np.inf, 1.0, "N")),
    ("force", "rotary"): ((0.1, 1e3, "mN m"), (np.inf, 1.0, "N m")),
}
_WHEN_ZERO = {"position": 0.1, "velocity": 1.0, "force": 1.0}


@dataclass(frozen=True)
class Display:
    """factor: display value per SI value; unit: its label."""

    factor: float
    unit: str


def display_unit(quantity: Quantity, axis: str, magnitude: float) -> Display:
    """The unit in which values up to `magnitude` (SI) of a `linear` or `rotary` axis read well."""
    if not np.isfinite(magnitude) or magnitude <= 0:
        magnitude = _WHEN_ZERO[quantity]
    for limit, factor, unit in _UNITS[(quantity, "rotary" if axis == "rotary" else "linear")]:
        if magnitude <= limit:
            return Display(factor, unit)
    raise AssertionError("the last limit is infinite")


def peak(*arrays: Array) -> float:
    """Largest finite magnitude in the arrays (any shape), 0 if there is none."""
    largest = 0.0
    for array in arrays:
        finite = np.abs(array[np.isfinite(array)])
        largest = max(largest, float(finite.max())) if finite.size else largest
    return largest


def rms(values: Array) -> float:
    """Root mean square of the values, any shape; nan if any value is not finite."""
    return float(np.sqrt(np.mean(np.square(values)))) if values.size and np.isfinite(values).all() else float("nan")


def log_limits(values: Iterable[float], least: float = 0.6) -> tuple[float, float]:
    """Ends of a logarithmic axis with room on both sides, at least `least` decades; 0.1 to 1 if there is no value."""
    shown = [value for value in values if math.isfinite(value) and value > 0]
    low, high = (math.log10(min(shown)), math.log10(max(shown))) if shown else (-1.0, 0.0)
    room = max(0.12 * (high - low), (least - (high - low)) / 2)
    return 10.0 ** (low - room), 10.0 ** (high + room)


def envelope(t: Array, y: Array, bins: int = 1000) -> tuple[Array, Array]:
    """Decimate a line for drawing without losing a peak.

    t, y: (n,); of each of `bins` stretches the smallest, the largest and the first non-finite sample stay, and the
    first and last sample of all. Returns the samples that stay, (k,) each; unchanged when n <= 2 bins. Gaps (nan) stay
    gaps.
    """
    n = len(t)
    if n <= 2 * bins:
        return t, y
    keep = {0, n - 1}
    edges = np.linspace(0, n, bins + 1).astype(int)
    finite = np.isfinite(y)
    for start, stop in pairwise(edges):
        part, good = y[start:stop], finite[start:stop]
        if good.any():
            keep.add(start + int(np.argmin(np.where(good, part, np.inf))))
            keep.add(start + int(np.argmax(np.where(good, part, -np.inf))))
        if not good.all():
            keep.add(start + int(np.argmin(good)))
    chosen = np.array(sorted(keep))
    return t[chosen], y[chosen]


def every(n: int, points: int) -> slice:
    """The slice that keeps about `points` of the first n samples, evenly."""
    return slice(None, n, max(1, -(-n // points)))
