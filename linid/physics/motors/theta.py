"""The elliptic theta model: the field of the magnets as Jacobi's theta functions make it (39, 45)."""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from linid.physics.field.guideway import k_of
from linid.physics.motors.motor import Derived, Motor
from linid.physics.parameter import Parameter
from linid.physics.term import term
from linid.physics.theta import GAUSSIAN_NOME, big_theta_0, harmonic_coefficients

_Values = TypeVar("_Values", float, NDArray[np.float64])


def fundamental_force_constant(force_constant: _Values, winding_length: _Values, nome: _Values) -> _Values:
    """Force constant in N/A of the first harmonic of theta motors: 8 K_f' q sin(2 z_L) (from eq. 37).

    force_constant: K_f' in N/A; winding_length: z_L in rad; nome: q, dimensionless; each a float or (C,).
    """
    return force_constant * 8.0 * nome * np.sin(2.0 * winding_length)  # type: ignore[no-any-return]


@term
def amplitudes(out, winding_length, nome):
    """Fourier coefficients of Theta0 (37), dimensionless; 0 of them where there would be too many."""
    if nome > GAUSSIAN_NOME:  # more harmonics than there is room for: the sum of Gaussians takes over
        return 0
    return harmonic_coefficients(winding_length, nome, out)


@term
def constant(z, winding_length, nome):
    """Theta0 (37) at z, dimensionless."""
    return big_theta_0(z, winding_length, nome)


MOTOR = Motor(
    name="theta",
    inputs=3,
    parameters=(
        Parameter("force_constant", "K_f'", "N/A", 1e-2, 1e4, 10.0, log=True, meaning="theta force per phase current"),
        Parameter("electrical_wavenumber", "z_0", "1/m", 10.0, 750.0, 100.0, log=True, meaning="pi / (2 pole pitch)"),
        Parameter("winding_displacement", "z_p", "1", 0.025, math.pi, 1.047, meaning="phase between windings"),
        Parameter("commutation_offset", "z_S", "1", -math.pi, math.pi, 0.0, meaning="field phase at position zero"),
        Parameter(
            "winding_length", "z_L", "1", 0.02, 0.5 * math.pi - 0.02, 0.7, meaning="half coil length z_0 l_y / 2"
        ),
        Parameter("nome", "q_0", "1", 0.02, 0.98, 0.5, meaning="field shape, exp(-k^2 pi^2 / 4)"),
    ),
    turns=2.0,
    shape=(("winding_length", 0.25 * math.pi), ("nome", 0.5)),
    harmonic=fundamental_force_constant,
    derived=(
        Derived("field_shape", "k", "1", k_of, ("nome",)),
        Derived("coil_length", "l_y", "m", lambda z, d: 2.0 * z / d, ("winding_length", "electrical_wavenumber")),
    ),
    amplitudes=amplitudes,
    constant=constant,
)
