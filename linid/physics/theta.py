"""Jacobi's theta functions of the magnet field: theta3 (33), Theta (36) and Theta0 (37), for every nome in (0, 1)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from linid.kernel_cache import kept

# Above this nome the Fourier series needs more terms than the modular transform (sum of Gaussians).
GAUSSIAN_NOME = 0.9
_PRECISION = 1e-17


@kept()
def _theta3(z: float, q: float) -> float:
    if q <= 0.5:
        total, power, n = 1.0, q, 1
        while power > _PRECISION:
            total += 2.0 * power * math.cos(2.0 * n * z)
            n += 1
            power = q ** (n * n)
        return total
    # Jacobi's imaginary transformation: theta3(z, q) = sqrt(pi/a) sum exp(-(z - n pi)^2 / a), a = -ln q
    a = -math.log(q)
    reach = int(math.sqrt(a * 40.0) / math.pi) + 1
    centre = round(z / math.pi)
    total = 0.0
    for n in range(centre - reach, centre + reach + 1):
        total += math.exp(-((z - n * math.pi) ** 2) / a)
    return math.sqrt(math.pi / a) * total


@kept()
def big_theta(z: float, q: float) -> float:
    """Theta(z, q) = theta3(z, q) - theta3(z - pi/2, q): the field of alternating magnets (eq. 36), dimensionless.

    z: rad; q: nome, 0 < q < 1. Above GAUSSIAN_NOME by Jacobi's imaginary transformation.
    """
    if q <= GAUSSIAN_NOME:
        total = 0.0
        n = 1
        power = q
        while power > _PRECISION:
            total += power * math.cos(2.0 * n * z)
            n += 2
            power = q ** (n * n)
        return 4.0 * total
    a = -math.log(q)
    reach = int(math.sqrt(a * 40.0) / (0.5 * math.pi)) + 1
    centre = round(z / (0.5 * math.pi))
    total = 0.0
    for n in range(centre - reach, centre + reach + 1):
        sign = 1.0 if n % 2 == 0 else -1.0
        total += sign * math.exp(-((z - n * 0.5 * math.pi) ** 2) / a)
    return math.sqrt(math.pi / a) * total


@kept()
def big_theta_0(z: float, z_L: float, q: float) -> float:
    """Theta0(z, q) = Theta(z - z_L, q) - Theta(z + z_L, q): the field seen by a coil (eq. 37), dimensionless.

    z, z_L: rad; q: nome, 0 < q < 1.
    """
    return big_theta(z - z_L, q) - big_theta(z + z_L, q)


@kept()
def harmonic_coefficients(z_L: float, q: float, out: NDArray[np.float64]) -> int:
    """Fourier coefficients c_n = 8 q^(n^2) sin(2 n z_L), n = 1, 3, 5 ... of Theta0 in sin(2 n z) (eq. 33, 37).

    z_L: rad; q: nome, 0 < q <= GAUSSIAN_NOME; out: (k,) is filled, dimensionless. Returns how many matter (relative
    size above rounding).
    """
    count = 0
    for k in range(out.size):
        n = 2 * k + 1
        power = q ** (n * n)
        if power < 1e-14 * q:
            break
        out[k] = 8.0 * power * math.sin(2.0 * n * z_L)
        count = k + 1
    return count


def _nome(q: float) -> float:
    if not 0.0 < q < 1.0:
        raise ValueError(f"nome {q} is outside (0, 1)")
    return float(q)


def theta3(z: ArrayLike, q: float) -> NDArray[np.float64]:
    """Jacobi's theta3(z, q) in Whittaker and Watson's notation for real z and 0 < q < 1 (eq. 33), dimensionless.

    z: any shape, rad; q: nome. Returns the same shape. Raises ValueError for a nome outside (0, 1).
    """
    q = _nome(q)
    return np.asarray(np.vectorize(lambda x: _theta3(float(x), q), otypes=[np.float64])(z))


def Theta(z: ArrayLike, q: float) -> NDArray[np.float64]:  # noqa: N802 - the paper's capital
    """Theta(z, q) = theta3(z, q) - theta3(z - pi/2, q), the field along the guideway (eq. 36), dimensionless.

    z: any shape, rad; q: nome. Returns the same shape. Raises ValueError for a nome outside (0, 1).
    """
    q = _nome(q)
    return np.asarray(np.vectorize(lambda x: big_theta(float(x), q), otypes=[np.float64])(z))


def Theta0(z: ArrayLike, q: float, z_L: float) -> NDArray[np.float64]:  # noqa: N802 - the paper's capital
    """Theta0(z, q) = Theta(z - z_L, q) - Theta(z + z_L, q), the coil's force shape (eq. 37), dimensionless.

    z: any shape, rad; q: nome; z_L: rad. Returns the same shape. Raises ValueError for a nome outside (0, 1).
    """
    q = _nome(q)
    return np.asarray(np.vectorize(lambda x: big_theta_0(float(x), z_L, q), otypes=[np.float64])(z))
