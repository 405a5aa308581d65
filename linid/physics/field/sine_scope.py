"""Where the sine model will do (19) to (27): the k at which a cosine comes nearest to the field, and what it costs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.physics.field.guideway import harmonic

# The paper's fit of k_N (25), whose limit it takes as the scope of the sine model.
PAPER_FIT = (0.4594, 0.1547, 0.4118, 0.4077)
# A sine of the field's fundamental misses less than this share of the field: the sine model will do.
NEGLIGIBLE = 0.01
_BRACKET = (0.2, 0.6)


def delta(k: float, pairs: int) -> float:
    """Derivative over k of the squared error of a cosine for 2 N + 1 magnets (24), (22), (23); N = `pairs`.

    Dimensionless: per unit of pole pitch and squared B_0. k: the ratio (17). The summands of (23) hang on i - j alone,
    so one sum serves.
    """
    number = 2 * pairs + 1
    shared = math.sqrt(math.pi) * math.exp(-0.25 * (math.pi * k) ** 2) * ((math.pi * k) ** 2 - 2.0)
    total = number * shared
    for distance in range(0, 2 * pairs + 1):
        weight = math.exp(-(distance**2) / (2.0 * k * k))
        if weight < 1e-18 and distance > 0:
            break
        count = number if distance == 0 else 2 * (number - distance)
        sign = 1.0 if distance % 2 == 0 else -1.0
        total += count * sign * math.sqrt(0.5 * math.pi) * weight * (distance**2 + k * k) / (k * k)
    return total


def best_k(pairs: int) -> float:
    """The ratio k_N where `delta` changes sign: the field of 2 N + 1 magnets is nearest to a cosine (24).

    pairs: N.
    """
    from scipy.optimize import brentq

    return float(brentq(lambda k: delta(k, pairs), *_BRACKET, xtol=1e-15, rtol=1e-14))


def limit_k() -> float:
    """The ratio k of an infinite guideway that is nearest to a cosine, 0.46223: where its squared error (19) stops
    falling.

    The paper takes 0.4594, the limit of its fit (25).
    """
    from scipy.optimize import brentq

    return float(brentq(_slope, *_BRACKET, xtol=1e-15, rtol=1e-14))


def fit_of_best_k(numbers: Sequence[int]) -> tuple[float, float, float, float]:
    """a_0 to a_3 of k(N) = a_0 - a_1 exp(-a_2 N^a_3) (25), by least squares over some N."""
    from scipy.optimize import least_squares

    n = np.asarray(numbers, dtype=float)
    exact = np.array([best_k(int(one)) for one in numbers])

    def error(a: Array) -> Array:
        return np.asarray(a[0] - a[1] * np.exp(-a[2] * n ** a[3]) - exact)

    found = least_squares(error, PAPER_FIT, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    a_0, a_1, a_2, a_3 = (float(a) for a in found.x)
    return a_0, a_1, a_2, a_3


@dataclass(frozen=True)
class SineCost:
    """What a sine model costs at a given k, all as ratios.

    k: the ratio sigma_y / pole pitch (17); of_cosine: ratio of the RMS of field minus B_0 cos(pi y / pole pitch) to
    that cosine's RMS, the paper's measure (19); of_field: the same ratio with the best amplitude: what the higher
    harmonics alone are worth; in_star: the same without the harmonics of orders divisible by three, which three
    windings 120 degrees apart do not feel while their currents sum to zero; fundamental: ratio of the amplitude of the
    field's first harmonic to B_0; third: ratio of that of its third to the first.
    """

    k: float
    of_cosine: float
    of_field: float
    in_star: float
    fundamental: float
    third: float

    @property
    def advice(self) -> str:
        """Which model to take, in words."""
        return advise("of the field the harmonics are", self.of_field, self.in_star)


def advise(what: str, alone: float, in_star: float) -> str:
    """Which model to take, in words. what: begins the reason; alone, in_star: ratio of what a sine misses to the whole,
    of a winding fed alone and of three whose currents sum to zero (`SineCost`)."""
    shares = f"{what} {100.0 * alone:.2g} %, and {100.0 * in_star:.2g} % in a star, which cancels the third"
    if alone < NEGLIGIBLE:
        return f"sine will do: {shares}"
    if in_star < NEGLIGIBLE:
        return f"sine will do in a star, whose currents sum to zero; take theta where a phase is fed alone: {shares}"
    return f"take theta: {shares}"


def sine_cost(k: float) -> SineCost:
    """Field error (19) that a sine costs at the ratio k = sigma_y / pole pitch; raises ValueError for k <= 0."""
    if not k > 0.0:
        raise ValueError(f"k = {k} is not above zero")
    first = harmonic(1, k)
    higher = math.sqrt(sum(harmonic(n, k) ** 2 for n in _orders(k)))
    felt = math.sqrt(sum(harmonic(n, k) ** 2 for n in _orders(k) if n % 3))
    return SineCost(k, math.sqrt(_squared_error(k)), higher / first, felt / first, first, harmonic(3, k) / first)


def _orders(k: float) -> range:
    """Odd orders from 3 on that matter."""
    return range(3, 5 + 2 * math.ceil(8.0 / (math.pi * k)), 2)


def _squared_error(k: float) -> float:
    """Mean square of field minus cosine over that of the cosine (19): (a_1 - 1)^2 + a_3^2 + ..."""
    return (harmonic(1, k) - 1.0) ** 2 + sum(harmonic(n, k) ** 2 for n in _orders(k))


def _slope(k: float) -> float:
    """Derivative of `_squared_error` over k."""

    def rate(n: int) -> float:
        return harmonic(n, k) * (1.0 / k - 0.5 * (math.pi * n) ** 2 * k)

    return 2.0 * (harmonic(1, k) - 1.0) * rate(1) + sum(2.0 * harmonic(n, k) * rate(n) for n in _orders(k))
