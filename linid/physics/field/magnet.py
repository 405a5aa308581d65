"""The field of a bar magnet from Ampere's model and the law of Biot and Savart (6)-(12), in its standard form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from linid.arrays import Array

_TOLERANCE = 1e-11  # relative, of the integral over the magnet's thickness
_MOST_INTERVALS = 20_000


@dataclass(frozen=True)
class BarMagnet:
    """A cuboid magnet around the origin, magnetised along z.

    size_x, size_y, size_z: m, across the guideway, along it and through the magnet; remanence: T.
    """

    size_x: float
    size_y: float
    size_z: float
    remanence: float


def bar_magnet_field(points: ArrayLike, magnet: BarMagnet) -> Array:
    """Flux density of a bar magnet as that of the currents that run around its four sides.

    Magnetisation along z is a surface current of remanence / mu_0 ampere per metre of thickness: rectangular loops of
    straight wires, summed over z. The printed (9)-(12) have squared numerators, which is no field; this is the law
    itself. points: (n, 3) m, not on an edge of the magnet. Returns (n, 3) T. Source: eqs. (6)-(8); Derby and Olbert,
    Am. J. Phys. 78 (2010).
    """
    from scipy.integrate import quad_vec

    x, y, z = np.atleast_2d(np.asarray(points, dtype=float)).T
    half_x, half_y, half_z = 0.5 * magnet.size_x, 0.5 * magnet.size_y, 0.5 * magnet.size_z

    def loop(height: float) -> Array:
        rise = z - height
        field = np.zeros((3, x.size))
        for side in (1.0, -1.0):
            # Seen from above the current runs against the clock: +y at x = +half_x, -x at y = +half_y.
            across = x - side * half_x
            share = side * _wire(y, np.hypot(across, rise), half_y)
            field[0] += share * rise
            field[2] -= share * across
            across = y - side * half_y
            share = side * _wire(x, np.hypot(across, rise), half_x)
            field[1] += share * rise
            field[2] -= share * across
        return field

    # mu_0 i / (4 pi), with i = remanence / mu_0.
    scale = magnet.remanence / (4.0 * np.pi)
    total, _ = quad_vec(loop, -half_z, half_z, epsrel=_TOLERANCE, epsabs=1e-14, norm="max", limit=_MOST_INTERVALS)
    return np.asarray(scale * total.T)


def _wire(along: Array, distance: Array, half: float) -> Array:
    """Integral of 1/r^3 along a straight wire from -half to half, (n,) 1/m^2; `along` from its middle, m.

    Written without the difference of two nearly equal numbers beyond the wire's ends.
    """
    first, last = along + half, along - half
    r_first, r_last = np.hypot(first, distance), np.hypot(last, distance)
    with np.errstate(divide="ignore", invalid="ignore"):
        beside = (first / r_first - last / r_last) / distance**2
        beyond = (first**2 - last**2) / (first * r_last + last * r_first) / (r_first * r_last)
    return np.asarray(np.where(first * last > 0.0, beyond, beside))
