"""The C-shaped magnet: two bar magnets that face each other across the air gap (fig. 3), and its Gaussian (13)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from linid.arrays import Array
from linid.physics.field.magnet import BarMagnet, bar_magnet_field

# The fit covers the magnet and this many air gaps around it, on so many points per quarter side.
_MARGIN = 1.0
_POINTS = 25


@dataclass(frozen=True)
class MagnetPair:
    """Two equal magnets with opposite poles facing; the middle of the air gap is z = 0. gap: m."""

    magnet: BarMagnet
    gap: float


@dataclass(frozen=True)
class GaussianField:
    """B = B_0 exp(-(x^2/sigma_x^2 + y^2/sigma_y^2)) in the middle of the gap (13).

    peak: B_0 in T; sigma_x, sigma_y: m; rms_error, largest_error: of the fit, as shares of the field's peak; reach_x,
    reach_y: m, what the fit covered to either side.
    """

    peak: float
    sigma_x: float
    sigma_y: float
    rms_error: float
    largest_error: float
    reach_x: float
    reach_y: float

    def at(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Flux density in T, of the shape that x and y give together (13); x, y: m, of broadcastable shapes."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        return np.asarray(self.peak * np.exp(-((x / self.sigma_x) ** 2) - (y / self.sigma_y) ** 2))


def pair_field(x: ArrayLike, y: ArrayLike, pair: MagnetPair, z: float = 0.0) -> Array:
    """z component in T of a magnet pair's flux density at height z (m) above the middle of the gap, of the shape that x
    and y give together.

    x, y: m, of broadcastable shapes. Source: eq. (8) for both magnets, fig. 3.
    """
    x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
    lift = 0.5 * (pair.gap + pair.magnet.size_z)
    total = np.zeros(x.size)
    for side in (1.0, -1.0):
        points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, z - side * lift)])
        total += bar_magnet_field(points, pair.magnet)[:, 2]
    return total.reshape(x.shape)


def fit_gaussian(pair: MagnetPair) -> GaussianField:
    """The Gaussian (13) next to a pair's field in the middle of the gap, by least squares, with its error.

    The true field has a flat top where magnets are wide and turns negative outside, which no Gaussian does.
    """
    from scipy.optimize import least_squares

    magnet = pair.magnet
    reach_x = 0.5 * magnet.size_x + _MARGIN * pair.gap
    reach_y = 0.5 * magnet.size_y + _MARGIN * pair.gap
    x, y = np.meshgrid(np.linspace(0.0, reach_x, _POINTS), np.linspace(0.0, reach_y, _POINTS), indexing="ij")
    field = pair_field(x, y, pair)
    top = float(np.max(np.abs(field)))
    # A quarter stands for the whole: points on an axis belong to two quarters.
    weight = np.sqrt(np.where(x > 0.0, 1.0, 0.5) * np.where(y > 0.0, 1.0, 0.5))

    def error(p: Array) -> Array:
        return np.asarray(p[0] * np.exp(-((x / p[1]) ** 2) - (y / p[2]) ** 2) - field / top)

    start = (math.copysign(1.0, float(field[0, 0])), 0.6 * magnet.size_x, 0.6 * magnet.size_y)
    scale = (1.0, magnet.size_x, magnet.size_y)
    found = least_squares(lambda p: (weight * error(p)).ravel(), start, x_scale=scale, xtol=1e-12, ftol=1e-12)
    rest = error(found.x)
    rms = float(np.sqrt(np.sum((weight * rest) ** 2) / np.sum(weight**2)))
    peak, sigma_x, sigma_y = (float(p) for p in found.x)
    return GaussianField(top * peak, abs(sigma_x), abs(sigma_y), rms, float(np.max(np.abs(rest))), reach_x, reach_y)
