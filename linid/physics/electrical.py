"""The windings' electrical equation: three phase currents driven by voltages (5), (31), (39).

L dI_j/dt + M sum_(k != j) dI_k/dt + R I_j = U_j - e_j(y) v, where e_j is the thrust per phase current: the same number
in V s/m and in N/A. In a star the three currents sum to zero and the neutral floats, so only L - M shows.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from linid.kernel_cache import kept
from linid.physics.parameter import Parameter

STAR, SEPARATE = "star", "separate"
WINDING_CODES = {"": 0, STAR: 1, SEPARATE: 2}

RESISTANCE = Parameter("phase_resistance", "R", "ohm", 1e-3, 1e3, 5.0, log=True, meaning="resistance of a phase")
INDUCTANCE = Parameter(
    "phase_inductance", "L", "H", 1e-6, 1.0, 2e-3, log=True, meaning="inductance of a phase; in a star L - M"
)
MUTUAL = Parameter("mutual_inductance", "M", "H", -0.5, 0.5, 0.0, meaning="between two phases")
PARAMETERS = {"": (), STAR: (RESISTANCE, INDUCTANCE), SEPARATE: (RESISTANCE, INDUCTANCE, MUTUAL)}

WEIGHTS = 8
_SMALL = 0.02


@kept()
def phi_functions(z: float) -> tuple[float, float, float]:
    """Integrals of exp(-z (1 - s)) s^k / k! over s in [0, 1] for k = 0, 1, 2; z >= 0.

    Source: Hochbruck and Ostermann, Acta Numerica 19 (2010), eq. 2.10, with -z.
    """
    if z < _SMALL:
        return (
            1.0 - z * (0.5 - z * (1.0 / 6.0 - z * (1.0 / 24.0 - z / 120.0))),
            0.5 - z * (1.0 / 6.0 - z * (1.0 / 24.0 - z * (1.0 / 120.0 - z / 720.0))),
            1.0 / 6.0 - z * (1.0 / 24.0 - z * (1.0 / 120.0 - z * (1.0 / 720.0 - z / 5040.0))),
        )
    first = (1.0 - math.exp(-z)) / z
    second = (1.0 - first) / z
    return first, second, (0.5 - second) / z


@kept()
def current_weights(resistance: float, inductance: float, h: float, out: NDArray) -> None:  # type: ignore[type-arg]
    """Weights that carry a current over a step of h seconds, exact for voltages that are parabolas in time.

    i(h) = out[0] i(0) + out[1] u(0) + out[2] u(h/2) + out[3] u(h), and the same for i(h/2) with out[4:8]; u: voltage
    less back-EMF, V. resistance: ohm; inductance: H, of one mode; out: (8,) is filled, dimensionless for i, 1/ohm for
    u. Source: `phi_functions`, i.e. Hochbruck and Ostermann 2010, eq. 2.10, for (5).
    """
    z = resistance * h / inductance
    scale = h / inductance
    first, second, third = phi_functions(z)
    out[0] = math.exp(-z)
    out[1] = scale * (first - 3.0 * second + 4.0 * third)
    out[2] = scale * (4.0 * second - 8.0 * third)
    out[3] = scale * (4.0 * third - second)
    first, second, third = phi_functions(0.5 * z)
    scale *= 0.5
    out[4] = math.exp(-0.5 * z)
    out[5] = scale * (first - 1.5 * second + third)
    out[6] = scale * (2.0 * second - 2.0 * third)
    out[7] = scale * (third - 0.5 * second)


@kept()
def clarke(x_1: float, x_2: float, x_3: float) -> tuple[float, float, float]:
    """Space vector's two parts and mean of three phase quantities, in their unit. x_1, x_2, x_3: A or V.

    Source: the amplitude-invariant transform of Clarke 1943, Circuit Analysis of A-C Power Systems.
    """
    return (2.0 * x_1 - x_2 - x_3) / 3.0, (x_2 - x_3) / math.sqrt(3.0), (x_1 + x_2 + x_3) / 3.0


@kept()
def phases(alpha: float, beta: float, mean: float) -> tuple[float, float, float]:
    """The three phase quantities of a space vector and a mean, in their unit: inverse of `clarke` (Clarke 1943).

    alpha, beta, mean: A or V.
    """
    turned = 0.5 * math.sqrt(3.0) * beta
    return alpha + mean, turned - 0.5 * alpha + mean, mean - turned - 0.5 * alpha


@kept()
def mode_inductances(winding: int, inductance: float, mutual: float) -> tuple[float, float]:
    """Inductances in H that the space vector and the mean of the currents feel: L - M and L + 2 M of (5).

    winding: 1 star, 2 separate; inductance: H, of a phase, in a star L - M already; mutual: H, between two phases.
    """
    if winding == 1:
        return inductance, inductance  # the mean current is zero, whatever its inductance
    return inductance - mutual, inductance + 2.0 * mutual
