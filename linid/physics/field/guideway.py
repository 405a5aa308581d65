"""The infinite guideway: magnet pairs of alternating polarity, a pole pitch apart (15), (16), (33) to (36)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from linid.arrays import Array
from linid.physics.field.magnet_pair import MagnetPair, pair_field
from linid.physics.theta import Theta

_FAR = 12.0  # magnet and gap sizes, beyond which a pair's field does not matter


def gaussian_guideway(y: ArrayLike, k: float) -> Array:
    """Field of infinitely many Gaussians of alternating sign over B_0, a ratio, with y in pole pitches (16).

    y: any shape, a number of pole pitches; k: the ratio sigma_y / pole pitch (17). Returns the same shape. Raises
    ValueError for k <= 0.
    """
    y = np.asarray(y, dtype=float)
    if k <= 0.0:
        raise ValueError(f"k = {k} is not above zero")
    reach = math.ceil(6.1 * k) + 1  # exp(-6.1^2) is below rounding
    centre = np.rint(y)
    total = np.zeros_like(y)
    for step in range(-reach, reach + 1):
        index = centre + step
        total += np.where(index % 2.0 == 0.0, 1.0, -1.0) * np.exp(-(((y - index) / k) ** 2))
    return total


def theta_guideway(y: ArrayLike, k: float) -> Array:
    """The same field by Jacobi's theta functions, K_B Theta(pi y / 2, q_0) (34) to (36). y, k and what is returned: as
    in `gaussian_guideway`.
    """
    return np.asarray(field_magnitude(k) * Theta(0.5 * math.pi * np.asarray(y, dtype=float), nome_of(k)))


def harmonic(n: int, k: float) -> float:
    """Amplitude of cos(n pi y / pole pitch), n odd, in the Gaussian guideway's field over B_0, dimensionless.

    a_n = 2 sqrt(pi) k exp(-(n k pi / 2)^2): Poisson's sum of (16). k: the ratio (17).
    """
    return 2.0 * math.sqrt(math.pi) * k * math.exp(-((0.5 * math.pi * n * k) ** 2))


def nome_of(k: float) -> float:
    """The nome q_0 = exp(-k^2 pi^2 / 4) (35); k: the ratio sigma_y / pole pitch (17)."""
    return math.exp(-((0.5 * math.pi * k) ** 2))


def k_of(nome: float) -> float:
    """The ratio k = sigma_y / pole pitch (17) of a nome (35)."""
    return 2.0 * math.sqrt(-math.log(nome)) / math.pi


def field_magnitude(k: float) -> float:
    """K_B = k sqrt(pi) / 2 (35), dimensionless; k: the ratio sigma_y / pole pitch (17)."""
    return 0.5 * math.sqrt(math.pi) * k


def magnet_guideway(y: ArrayLike, pair: MagnetPair, pole_pitch: float, x: float = 0.0, pairs: int = 20) -> Array:
    """z component in T of the exact field of 2 `pairs` + 1 alternating magnet pairs, of y's shape (8), (15).

    y: any shape, m; pole_pitch, x: m. Of fields that fall with the cube of the distance and alternate, the neighbours
    that are left out add less than the last one's share.
    """
    y = np.asarray(y, dtype=float)
    total = np.zeros_like(y)
    for index in range(-pairs, pairs + 1):
        sign = 1.0 if index % 2 == 0 else -1.0
        total += sign * pair_field(np.full_like(y, x), y - index * pole_pitch, pair)
    return total


def magnet_harmonics(
    pair: MagnetPair, pole_pitch: float, x: ArrayLike = 0.0, orders: Sequence[int] = (1, 3, 5, 7, 9)
) -> Array:
    """Amplitudes in T of cos(n pi y / pole pitch) in the exact field (8) of infinitely many pairs, (m, orders).

    By Poisson's sum each is an integral over a single pair's field along the guideway, a_n = 2/chi int B cos dy.
    pole_pitch: m; x: (m,) m.
    """
    x = np.atleast_1d(np.asarray(x, dtype=float))
    magnet = pair.magnet
    step = min(pole_pitch / (8.0 * max(orders)), 0.1 * pair.gap, 0.05 * magnet.size_y)
    reach = _FAR * (max(magnet.size_x, magnet.size_y) + pair.gap + magnet.size_z)
    y = np.arange(0.0, reach, step)
    field = pair_field(x[:, None], y[None, :], pair)
    waves = np.cos(np.pi / pole_pitch * np.outer(y, orders))
    waves[0] *= 0.5
    return np.asarray(4.0 * step / pole_pitch * (field @ waves))
