"""Intervals of pole pitch and field phase, which commutated currents hide to first order.

A drive keeps its currents aligned with the field, where the thrust is at its maximum: a phase error phi costs
only phi^2/2 of the force. The first derivative of the residuals then vanishes at the truth, and intervals from it
mean nothing. Here the residuals are expanded to second order in electrical wavenumber and shift.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array
from linid.identification.space.search_space import SearchSpace
from linid.statistics import CHI_SQUARED_95

NAMES = ("electrical_wavenumber", "commutation_offset")
PHASE_STEP = 0.02  # rad, by which the field phase is moved for the second differences
_POINTS = 400  # of the scan for the ends of an interval, per side


def columns(space: SearchSpace) -> tuple[int, int] | None:
    """Search coordinates of electrical wavenumber and shift; None unless both are searched."""
    names = space.names
    if any(name not in names for name in NAMES):
        return None
    return names.index(NAMES[0]), names.index(NAMES[1])


def steps(space: SearchSpace, point: Array, reach: float) -> tuple[float, float]:
    """Steps of the search coordinates that move the field phase by `PHASE_STEP` at `reach` (m) from position zero.
    point: (p,) search coordinates.
    """
    density, shift = columns(space) or (0, 0)
    slopes = np.diag(space.natural_jacobian(np.clip(point, 1e-5, 1.0 - 1e-5)))
    return PHASE_STEP / (slopes[density] * max(reach, 1e-12)), PHASE_STEP / slopes[shift]


def second_differences(residuals: Callable[[Array], Array], point: Array, pair: tuple[int, int], step: Array) -> Array:
    """(N, 3) second derivatives of residuals (C, p) -> (C, N): density twice, mixed, shift twice. point: (p,),
    step: (2,) search coordinates.
    """
    a, b = np.zeros((2, point.size))
    a[pair[0]], b[pair[1]] = step
    rows = np.array([point, point + a, point - a, point + b, point - b, point + a + b, point - a - b])
    at, up_a, down_a, up_b, down_b, up, down = residuals(rows)
    twice_a = (up_a + down_a - 2.0 * at) / step[0] ** 2
    twice_b = (up_b + down_b - 2.0 * at) / step[1] ** 2
    mixed = (up + down - up_a - down_a - up_b - down_b + 2.0 * at) / (2.0 * step[0] * step[1])
    return np.column_stack([twice_a, mixed, twice_b])


def profile_intervals(
    scores: Array, information: Array, meat: Array, pair: tuple[int, int], room: Array
) -> tuple[tuple[float, float], tuple[float, float]]:
    """95 % intervals of the two search coordinates as offsets from the estimate, all others profiled out.

    The scores s(x) = scores + information x with x = (offsets of all parameters, and the second-order terms d^2/2, d e,
    e^2/2 of the pair d, e) have mean zero and covariance `meat` at the truth; the interval holds where the least s'
    meat^-1 s exceeds its minimum by less than the 95 % quantile of chi squared (Newey and West 1987, Int. Econ. Rev.
    28: tests in the generalised method of moments). scores: (n + 3,), information and meat: (n + 3, n + 3) with the
    second-order terms last; room: (2, 2) offsets of search coordinates at which the search box ends.
    """
    n = scores.size - 3
    unit = np.sqrt(np.maximum(np.diag(meat), 1e-300))
    values, vectors = np.linalg.eigh(meat / np.outer(unit, unit))
    white = (vectors / np.sqrt(np.maximum(values, 1e-10 * values[-1]))).T / unit
    others = [column for column in range(n) if column not in pair]
    basis = np.linalg.svd(white @ information[:, others], full_matrices=False)[0]
    chosen = white @ np.column_stack([scores, information[:, [*pair, n, n + 1, n + 2]]])
    chosen -= basis @ (basis.T @ chosen)
    gram = chosen.T @ chosen
    turned = gram[np.ix_([0, 2, 1, 5, 4, 3], [0, 2, 1, 5, 4, 3])]
    return _ends(gram, room[0]), _ends(turned, room[1])


def _profiles(gram: Array, d: Array) -> Array:
    """Least values (D,) over e of z' gram z with z = (1, d, e, d^2/2, d e, e^2/2), for d (D,)."""
    none, one = np.zeros_like(d), np.ones_like(d)
    constant = np.stack([one, d, none, 0.5 * d * d, none, none], axis=1)
    linear = np.stack([none, none, one, none, d, none], axis=1)
    square = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.5])
    quartics = np.stack(
        [
            (square @ gram @ square) * one,
            2.0 * linear @ gram @ square,
            np.sum((linear @ gram) * linear, axis=1) + 2.0 * constant @ gram @ square,
            2.0 * np.sum((constant @ gram) * linear, axis=1),
            np.sum((constant @ gram) * constant, axis=1),
        ]
    )
    turning = _roots(quartics[:4] * np.array([[4.0], [3.0], [2.0], [1.0]]))
    real = np.abs(turning.imag) < 1e-6 * (1.0 + np.abs(turning.real))
    values = np.where(real, np.polyval(quartics[:, None], turning.real.T).T, math.inf)
    return np.asarray(np.where(np.any(real, axis=1), np.min(values, axis=1), quartics[-1]))


def _roots(cubics: Array) -> NDArray[np.complex128]:
    """Roots (D, 3) of polynomials (4, D), highest power first: eigenvalues of their companion matrices (as numpy's
    `roots`); nan where a polynomial is of a lower degree and has fewer."""
    if not np.all(cubics[0] != 0.0):
        out = np.full((cubics.shape[1], 3), np.nan, dtype=np.complex128)
        for row, cubic in zip(out, cubics.T, strict=True):
            found = np.roots(cubic)
            row[: found.size] = found
        return out
    companions = np.zeros((cubics.shape[1], 3, 3))
    companions[:, 1, 0] = companions[:, 2, 1] = 1.0
    companions[:, 0] = (-cubics[1:] / cubics[0]).T
    return np.asarray(np.linalg.eigvals(companions), dtype=np.complex128)


def _ends(gram: Array, room: Array) -> tuple[float, float]:
    """First and last offset within the box at which the profile stays under the limit, the estimate's own among them:
    in the flat valley a search may end beside the profile's lowest point."""
    outwards = np.geomspace(1e-6, 1.0, _POINTS)
    offsets = np.concatenate([room[0] * outwards[::-1], [0.0], room[1] * outwards])
    profile = _profiles(gram, offsets)
    inside = np.flatnonzero(profile <= float(np.min(profile)) + CHI_SQUARED_95)
    low = offsets[max(int(inside[0]) - 1, 0)]
    high = offsets[min(int(inside[-1]) + 1, offsets.size - 1)]
    if not math.isfinite(low + high):
        return float(room[0]), float(room[1])
    return min(float(low), 0.0), max(float(high), 0.0)
