"""Where the gap lies, in pairs of coordinates: what only their product shows, such as gains of the phases."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from linid.arrays import Array, Integers
from linid.diagnosis.balance import Balance
from linid.diagnosis.locate import LEAST_ROWS, Coordinate, bin_edges, bins_of
from linid.diagnosis.report_data import Form, PairShare
from linid.diagnosis.roll_null import Draws, p_value, slot_sums, with_rolled

_BINS = 12  # per coordinate; 24 by 24 cells of a campaign would hold some dozen rows
_LINE_BINS = 24  # where only a slope in the other coordinate is asked for
_SHRUNK = 8.0  # rows without a residual that each cell is given: few rows say little
_STATES = ("position", "velocity", "direction", "current", "pole_phase")
_SLOPES = ("direction", "current")  # what forces are proportional to: friction's sign, thrust
_WHEN = ("recording", "time")  # one of the pair only; which recording, or when, the slope is another
_SAME = frozenset({"velocity", "direction"})  # the one is a function of the other
_FEW = 5


def locate_pairs(
    balance: Balance, residual: Array, scale: Array, masses: Array, coordinates: Sequence[Coordinate], seed: int
) -> tuple[PairShare, ...]:
    """The pairs of coordinates that explain most of the residual (n,) m/s^2 beyond their sum; at most five.

    As in `locate`, all is estimated on every second block and judged on the others, and the null rolls each recording's
    residual against its motion. The p-value is that of the largest of all pairs' shares, each counted in the spread
    of its own null (P. H. Westfall and S. S. Young 1993, Resampling-Based Multiple Testing).
    scale: (R,) m/s^2 in which a recording's residuals are counted; masses: (R,) kg, to show forces.
    """
    rows = balance.rows
    draws = with_rolled(residual / scale[rows.recording], rows.recording, seed)
    half = rows.block % 2
    pairs = _pairs(coordinates)
    tried: list[tuple[Coordinate, Coordinate, Form, Array]] = []
    for x, y in pairs:
        if x.name not in _WHEN:
            tried.append((x, y, "table", _beyond_sum(draws, bins_of(x, _BINS), bins_of(y, _BINS), half)))
        for line, other in ((y, x), (x, y)):
            # In two bins, which is all that a direction has, a table and a slope are the same.
            if line.name in _SLOPES and (line.name == "current" or x.name in _WHEN) and other.name not in _SLOPES:
                slopes = _beyond_slope(draws, bins_of(other, _LINE_BINS), line, half)
                tried.append((other, line, "proportional", slopes))
    if not tried:
        return ()
    shares = np.array([one[3] for one in tried])
    spread = np.maximum(np.std(shares[:, 1:], axis=1, keepdims=True), 1e-12)
    standing = (shares - np.mean(shares[:, 1:], axis=1, keepdims=True)) / spread
    largest = np.max(standing[:, 1:], axis=0)
    force = residual * masses[rows.recording]
    best: dict[frozenset[str], tuple[float, int]] = {}
    for k, (x, y, _, share) in enumerate(tried):
        key = frozenset((x.name, y.name))
        best[key] = max(best.get(key, (-math.inf, -1)), (float(share[0]), k))
    order = sorted((one for one in best.values() if one[0] > 0.0), reverse=True)[:_FEW]
    return tuple(_pair_share(*tried[k], p_value(float(standing[k, 0]), largest), force) for _, k in order)


def _pairs(coordinates: Sequence[Coordinate]) -> list[tuple[Coordinate, Coordinate]]:
    """The pairs that can mean something."""
    named = {c.name: c for c in coordinates}
    states = [named[name] for name in _STATES if name in named]
    pairs = [pair for pair in itertools.combinations(states, 2) if {c.name for c in pair} != _SAME]
    slopes = [named[name] for name in _SLOPES if name in named]
    return pairs + [(named[when], slope) for when in _WHEN if when in named for slope in slopes]


def _beyond_sum(draws: Draws, x_bins: Integers, y_bins: Integers, half: Integers) -> Array:
    """Share (p,) of each draw's power (n, p) that cells of both explain beyond a sum of functions of each."""
    a, b = int(x_bins.max(initial=0)) + 1, int(y_bins.max(initial=0)) + 1
    cells = a * b
    slots = np.where((x_bins >= 0) & (y_bins >= 0), x_bins * b + y_bins + half * cells, -1)
    counts = np.bincount(slots[slots >= 0], minlength=2 * cells).reshape(2, cells).astype(np.float64)
    sums = slot_sums(slots, 2 * cells, draws).reshape(2, cells, -1)
    first, second = np.divmod(np.arange(cells), b)
    design = np.zeros((cells, a + b))
    design[np.arange(cells), first] = 1.0
    design[np.arange(cells), a + second] = 1.0
    gain = np.zeros(draws.shape[1])
    for train, test in ((0, 1), (1, 0)):
        normal = design.T @ (counts[train][:, None] * design) + _SHRUNK * np.eye(a + b)
        added = design @ np.linalg.solve(normal, design.T @ sums[train])
        weight = np.where(counts[train] >= LEAST_ROWS, 1.0 / (counts[train] + _SHRUNK), 0.0)[:, None]
        both = weight * (sums[train] - counts[train][:, None] * added)
        # What the test rows lose of their squares by `both`, once `added` is taken off them.
        number = counts[test][:, None]
        gain += np.sum(2.0 * both * (sums[test] - number * added) - number * both**2, axis=0)
    return np.asarray(gain / _power(draws))


def _beyond_slope(draws: Draws, bins: Integers, line: Coordinate, half: Integers) -> Array:
    """Share (p,) of each draw's power (n, p) that slopes in `line`, another in each bin, explain beyond one for all.

    A mean of its own each bin has in both.
    """
    known = np.isfinite(line.values)
    x = np.where(known, line.values, 0.0)
    x = x / max(math.sqrt(float(x @ x) / max(int(known.sum()), 1)), 1e-300)
    size = int(bins.max(initial=0)) + 1
    slots = np.where((bins >= 0) & known, bins + half * size, -1)
    inside = slots >= 0
    n, sx, sxx = (
        np.bincount(slots[inside], w, 2 * size).reshape(2, size, 1)
        for w in (np.ones(int(inside.sum())), x[inside], x[inside] ** 2)
    )
    sr = slot_sums(slots, 2 * size, draws).reshape(2, size, -1)
    srx = slot_sums(slots, 2 * size, draws, x).reshape(2, size, -1)
    gain = np.zeros(draws.shape[1])
    for train, test in ((0, 1), (1, 0)):
        some = np.maximum(n[train], 1.0)
        across = sxx[train] - sx[train] ** 2 / some
        product = srx[train] - sx[train] * sr[train] / some
        common = np.sum(product, axis=0) / max(float(np.sum(across)), 1e-300)
        steep = np.where(n[train] >= LEAST_ROWS, (product - across * common) / (across + _SHRUNK), 0.0)
        level = (sr[train] - common * sx[train]) / some
        offset = -steep * sx[train] / some  # the mean stays where it was
        left, leftx = sr[test] - level * n[test] - common * sx[test], srx[test] - level * sx[test] - common * sxx[test]
        gain += np.sum(
            2.0 * (offset * left + steep * leftx)
            - (offset**2 * n[test] + 2.0 * offset * steep * sx[test] + steep**2 * sxx[test]),
            axis=0,
        )
    return np.asarray(gain / _power(draws))


def _power(draws: Draws) -> float:
    """Sum of squares of a draw, the same for all."""
    return max(float(draws[:, 0] @ draws[:, 0]), 1e-30)


def _pair_share(x: Coordinate, y: Coordinate, form: Form, share: Array, p: float, force: Array) -> PairShare:
    x_bins, y_bins = bins_of(x, _LINE_BINS if form == "proportional" else _BINS), bins_of(y, _BINS)
    x_edges, y_edges = bin_edges(x, _LINE_BINS if form == "proportional" else _BINS), bin_edges(y, _BINS)
    a, b = x_edges.size - 1, y_edges.size - 1
    inside = (x_bins >= 0) & (y_bins >= 0)
    slots = y_bins[inside] * a + x_bins[inside]
    rows = np.bincount(slots, minlength=a * b).reshape(b, a)
    total = np.bincount(slots, force[inside], a * b).reshape(b, a)
    mean = np.where(rows >= LEAST_ROWS, total / np.maximum(rows, 1), np.nan)
    return PairShare(
        x.name, y.name, x.label, y.label, x.unit, y.unit, form, float(share[0]), p, x_edges, y_edges, mean, rows
    )
