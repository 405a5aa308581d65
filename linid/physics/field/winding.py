"""What a rectangular winding feels in a field: thrust and back-EMF (1) to (4), (28) to (30), (37), (38)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

# Flux density in T at (x, y) in m.
Field = Callable[[float, float], float]


@dataclass(frozen=True)
class Winding:
    """A coil of equal rectangular turns. length_x: m, across the guideway; length_y: m, along it; turns: n."""

    length_x: float
    length_y: float
    turns: int


def force_per_current(field: Field, winding: Winding, y: float) -> float:
    """Thrust of a winding at position y (m) over its current, N/A, by integration along its wires (2)."""
    from scipy.integrate import quad

    half_x, half_y = 0.5 * winding.length_x, 0.5 * winding.length_y
    value, _ = quad(
        lambda x: field(x, y - half_y) - field(x, y + half_y), -half_x, half_x, epsabs=1e-16, epsrel=1e-12, limit=200
    )
    return winding.turns * float(value)


def flux_linkage(field: Field, winding: Winding, y: float) -> float:
    """Flux through all turns of a winding at position y (m), Wb, by integration over its area (3), (4)."""
    from scipy.integrate import quad

    half_x, half_y = 0.5 * winding.length_x, 0.5 * winding.length_y

    def strip(place: float) -> float:
        return float(quad(lambda x: field(x, place), -half_x, half_x, epsabs=1e-16, epsrel=1e-13, limit=200)[0])

    # In two parts, so that a field that is odd about the winding's middle is not taken for none.
    parts = [quad(strip, low, low + half_y, epsabs=1e-16, epsrel=1e-13, limit=200)[0] for low in (y - half_y, y)]
    return winding.turns * float(sum(parts))


def back_emf_per_speed(field: Field, winding: Winding, y: float, step: float) -> float:
    """Induced voltage of a moving winding over its speed, V s/m: -d(flux)/dy by central differences (4).

    y: m, position; step: m, a few hundredths of the pole pitch. It is the same number as the thrust over the current,
    by which electrical power becomes mechanical. Eighth order: Fornberg, Math. Comp. 51 (1988).
    """
    weights = (4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0)
    slope = sum(
        weight * (flux_linkage(field, winding, y + n * step) - flux_linkage(field, winding, y - n * step))
        for n, weight in enumerate(weights, 1)
    )
    return -float(slope) / step


def across(winding: Winding, sigma_x: float) -> float:
    """Integral of exp(-x^2/sigma_x^2) over the winding's width, m: sqrt(pi) sigma_x erf(l_x / (2 sigma_x)), as in (30).

    sigma_x: m.
    """
    return math.sqrt(math.pi) * sigma_x * math.erf(winding.length_x / (2.0 * sigma_x))


def sine_force_constant(peak: float, sigma_x: float, winding: Winding, pole_pitch: float) -> float:
    """K_f in N/A of a cosine field of amplitude `peak` (T) (30). sigma_x, pole_pitch: m."""
    half = 0.5 * math.pi * winding.length_y / pole_pitch
    return 2.0 * winding.turns * peak * across(winding, sigma_x) * math.sin(half)


def theta_force_constant(peak: float, sigma_x: float, winding: Winding, magnitude: float) -> float:
    """K_f' in N/A of the Gaussian guideway (38). peak: T, B_0; sigma_x: m; magnitude: K_B, dimensionless."""
    return winding.turns * peak * magnitude * across(winding, sigma_x)


def half_coil_angle(winding: Winding, pole_pitch: float) -> float:
    """z_L = z_0 l_y / 2 (37), rad. pole_pitch: m."""
    return 0.25 * math.pi * winding.length_y / pole_pitch


def theta_harmonic(n: int, nome: float, half_angle: float) -> float:
    """c_n = 8 q^(n^2) sin(2 n z_L), n odd: amplitude of sin(2 n z) in Theta0 (37), dimensionless.

    half_angle: z_L, rad.
    """
    return 8.0 * nome ** (n * n) * math.sin(2.0 * n * half_angle) if nome > 0.0 else 0.0


def force_harmonics(nome: float, half_angle: float, highest: int = 39) -> dict[int, float]:
    """Amplitudes of the odd harmonics of Theta0 (37), dimensionless, by order up to `highest`. half_angle: z_L, rad."""
    return {n: theta_harmonic(n, nome, half_angle) for n in range(1, highest + 1, 2)}


def ripple_share(amplitudes: Mapping[int, float], *, balanced: bool) -> float:
    """RMS of the thrust's harmonics that a sine model leaves out, as a share of the first one: the measure (19) of the
    thrust, the first harmonic fitted.

    amplitudes: N/A or any unit, by order, of one winding. balanced: without the orders divisible by three, which three
    currents that sum to zero do not feel when the windings stand 120 degrees apart.
    """
    higher = [a for n, a in amplitudes.items() if n > 1 and not (balanced and n % 3 == 0)]
    return float(np.sqrt(np.sum(np.square(higher))) / abs(amplitudes[1]))
