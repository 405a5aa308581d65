"""The three motor models: `force` (one logged current or command), `sine` (31, 44) and `theta` (39, 45)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from linid.physics.parameter import Parameter
from linid.physics.theta import GAUSSIAN_NOME, big_theta_0, harmonic_coefficients

NONE, FORCE, SINE, THETA = 0, 1, 2, 3

_TURN = 2.0 * math.pi
_HALF_PI = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21)  # 33 bits, 33 bits, rest
_BLOCK = 256
_Values = TypeVar("_Values", float, NDArray[np.float64])


def fundamental_force_constant(force_constant: _Values, winding_length: _Values, nome: _Values) -> _Values:
    """Force constant in N/A of the first harmonic of theta motors: 8 K_f' q sin(2 z_L) (from eq. 37)."""
    return force_constant * 8.0 * nome * np.sin(2.0 * winding_length)  # type: ignore[no-any-return]


@dataclass(frozen=True)
class Motor:
    """One motor model. code: its number in the compiled kernel; inputs: how many it has, 0, 1 or 3 (phase currents);
    turns: electrical radians per radian of its own angles (displacement and commutation offset), and so of its
    wavenumber; shape: parameters of its field's shape, with the values that a search begins with; harmonic: force
    constant and shape -> amplitude of the thrust's first harmonic per phase current, N/A, where there is a shape."""

    name: str
    code: int
    inputs: int
    parameters: tuple[Parameter, ...] = ()
    turns: float = 1.0
    shape: tuple[tuple[str, float], ...] = ()
    harmonic: Callable[..., Any] | None = None

    @property
    def phases(self) -> bool:
        """Whether three phase currents drive it."""
        return self.inputs == 3

    def fundamental(self, constant: Any, values: Mapping[str, Any]) -> Any:
        """Thrust per input of the first harmonic, N/A: the force constant itself where the field has no shape.

        constant: force constant (float or (C,)); values: at least those of the shape, each like it.
        """
        return constant if self.harmonic is None else self.harmonic(constant, *(values[name] for name, _ in self.shape))

    def of_first_harmonic(self, sine: Mapping[str, float], known: Mapping[str, float]) -> dict[str, float]:
        """First values of this motor's parameters, SI, from those of a sine; known: of its shape, where they are."""
        out = dict(sine)
        for name in ("electrical_wavenumber", "winding_displacement", "commutation_offset"):
            out[name] = sine[name] / self.turns
        shape = {name: known.get(name, usual) for name, usual in self.shape}
        out["force_constant"] = sine["force_constant"] / self.fundamental(1.0, shape)
        return {**out, **shape}


_FORCE = (Parameter("force_constant", "K", "N/A", 1e-3, 1e3, 1.0, log=True, meaning="force per input"),)
_SINE = (
    Parameter("force_constant", "K_f", "N/A", 1e-1, 1e3, 30.0, log=True, meaning="force per phase current"),
    Parameter("electrical_wavenumber", "omega_g", "1/m", 20.0, 1500.0, 200.0, log=True, meaning="pi / pole pitch"),
    Parameter("winding_displacement", "alpha_p", "1", 0.05, _TURN, 2.094, meaning="phase between windings"),
    Parameter("commutation_offset", "alpha_S", "1", -_TURN, _TURN, 0.0, meaning="field phase at position zero"),
)
_THETA = (
    Parameter("force_constant", "K_f'", "N/A", 1e-2, 1e4, 10.0, log=True, meaning="theta force per phase current"),
    Parameter("electrical_wavenumber", "z_0", "1/m", 10.0, 750.0, 100.0, log=True, meaning="pi / (2 pole pitch)"),
    Parameter("winding_displacement", "z_p", "1", 0.025, math.pi, 1.047, meaning="phase between windings"),
    Parameter("commutation_offset", "z_S", "1", -math.pi, math.pi, 0.0, meaning="field phase at position zero"),
    Parameter("winding_length", "z_L", "1", 0.02, 0.5 * math.pi - 0.02, 0.7, meaning="half coil length z_0 l_y / 2"),
    Parameter("nome", "q_0", "1", 0.02, 0.98, 0.5, meaning="field shape, exp(-k^2 pi^2 / 4)"),
)
MOTORS = {
    motor.name: motor
    for motor in (
        Motor("friction", NONE, 0),
        Motor("force", FORCE, 1, _FORCE),
        Motor("sine", SINE, 3, _SINE),
        Motor(
            "theta",
            THETA,
            3,
            _THETA,
            turns=2.0,
            shape=(("winding_length", 0.25 * math.pi), ("nome", 0.5)),
            harmonic=fundamental_force_constant,
        ),
    )
}


@njit(cache=True)
def prepare_motor(motor: int, p: NDArray[np.float64], table: NDArray[np.float64]) -> int:
    """Fill `table` with what the force needs once per simulation; returns the number of harmonics.

    p: (6,) force_constant, electrical_wavenumber, winding_displacement, shift, winding_length, nome;
    table: (3, MAX_HARMONICS) amplitude in N/A, cos and sin of the phase step per harmonic.
    0 harmonics with a theta motor means: nome too near 1 for Fourier, use Gaussians.
    """
    if motor == SINE:
        table[0, 0] = p[0]
        table[1, 0] = math.cos(p[2])
        table[2, 0] = math.sin(p[2])
        return 1
    if motor != THETA or p[5] > GAUSSIAN_NOME:
        return 0
    count = harmonic_coefficients(p[4], p[5], table[0])
    for k in range(count):
        n = 2 * k + 1
        table[0, k] *= p[0]
        table[1, k] = math.cos(2.0 * n * p[2])
        table[2, k] = math.sin(2.0 * n * p[2])
    return count


@njit(cache=True, error_model="numpy", forceinline=True)
def sine_cosine(angle: float) -> tuple[float, float]:
    """Sine and cosine of an angle in rad, without branches, so that loops over angles become vector instructions.

    The angle is brought to within pi/4 of a multiple of pi/2, which is held in three parts (Cody and Waite 1980);
    Taylor's series follow, of which the first term left out is below 5e-17.
    """
    n = np.floor(angle * (2.0 / math.pi) + 0.5)
    x = ((angle - n * _HALF_PI[0]) - n * _HALF_PI[1]) - n * _HALF_PI[2]
    q = x * x
    odd = q * (1.0 / 362880.0 - q * (1.0 / 39916800.0 - q * (1.0 / 6227020800.0 - q / 1307674368000.0)))
    odd = x - x * q * (1.0 / 6.0 - q * (1.0 / 120.0 - q * (1.0 / 5040.0 - odd)))
    even = q * (1.0 / 3628800.0 - q * (1.0 / 479001600.0 - q * (1.0 / 87178291200.0 - q / 20922789888000.0)))
    even = 1.0 - q * (0.5 - q * (1.0 / 24.0 - q * (1.0 / 720.0 - q * (1.0 / 40320.0 - even))))
    quarter = n - 4.0 * np.floor(0.25 * n)
    turned = quarter == 1.0 or quarter == 3.0
    sine = even if turned else odd
    cosine = odd if turned else even
    return (-sine if quarter >= 2.0 else sine), (-cosine if quarter == 1.0 or quarter == 2.0 else cosine)


@njit(cache=True, error_model="numpy", forceinline=True)
def phase_force(
    y: float,
    current_u: float,
    current_v: float,
    current_w: float,
    wavenumber: float,
    phase: float,
    table: NDArray[np.float64],
    harmonics: int,
) -> float:
    """Thrust in N of three phase currents (A) at position y (m): sum over odd harmonics by angle addition.

    One sine and one cosine serve every phase and harmonic, so theta costs hardly more than sine.
    """
    sine, cosine = sine_cosine(wavenumber * y + phase)
    outer_sum = current_u + current_w
    outer_difference = current_w - current_u
    force = table[0, 0] * (sine * (current_v + table[1, 0] * outer_sum) + cosine * table[2, 0] * outer_difference)
    if harmonics > 1:
        sine_2 = 2.0 * sine * cosine
        cosine_2 = 1.0 - 2.0 * sine * sine
        for k in range(1, harmonics):
            turned = sine * cosine_2 + cosine * sine_2
            cosine = cosine * cosine_2 - sine * sine_2
            sine = turned
            force += table[0, k] * (
                sine * (current_v + table[1, k] * outer_sum) + cosine * table[2, k] * outer_difference
            )
    return force  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def motor_forces(
    motor: int,
    p: NDArray[np.float64],
    y: NDArray[np.float64],
    current_u: NDArray[np.float64],
    current_v: NDArray[np.float64],
    current_w: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Forces in N of a motor at many positions y (n,) in m under inputs (n,): what `phase_force` gives one by one.

    motor, p: as in `prepare_motor`; out: (n,) is filled.
    """
    table = np.zeros((3, 12))
    harmonics = prepare_motor(motor, p, table)
    if harmonics == 0:
        for k in range(y.size):
            out[k] = p[0] * current_u[k]
            if motor == THETA:
                out[k] = gaussian_force(y[k], current_u[k], current_v[k], current_w[k], p)
        return
    turns = 2.0 if motor == THETA else 1.0
    wavenumber, phase = turns * p[1], turns * p[3]
    sine, cosine, sine_2, cosine_2 = np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK)
    for begin in range(0, y.size, _BLOCK):  # loops of few arrays each: only such become vector instructions
        size = min(_BLOCK, y.size - begin)
        end = begin + size
        place, u, v, w, force = (
            y[begin:end],
            current_u[begin:end],
            current_v[begin:end],
            current_w[begin:end],
            out[begin:end],
        )
        for j in range(size):
            sine[j], cosine[j] = sine_cosine(wavenumber * place[j] + phase)
        for j in range(size):
            sine_2[j], cosine_2[j] = 2.0 * sine[j] * cosine[j], 1.0 - 2.0 * sine[j] * sine[j]
        for k in range(harmonics):
            amplitude, along, across = table[0, k], table[1, k], table[2, k]
            for j in range(size):
                part = sine[j] * (v[j] + along * (u[j] + w[j])) + cosine[j] * across * (w[j] - u[j])
                force[j] = amplitude * part + (force[j] if k > 0 else 0.0)
            if k + 1 < harmonics:
                for j in range(size):
                    turned = sine[j] * cosine_2[j] + cosine[j] * sine_2[j]
                    cosine[j] = cosine[j] * cosine_2[j] - sine[j] * sine_2[j]
                    sine[j] = turned


@njit(cache=True)
def phase_constants(
    motor: int,
    y: float,
    p: NDArray[np.float64],
    table: NDArray[np.float64],
    harmonics: int,
    wavenumber: float,
    phase: float,
) -> tuple[float, float, float]:
    """Thrust per phase current in N/A of the three windings at position y (m); in V s/m their back-EMF per speed.

    p, table, harmonics as in `prepare_motor`; wavenumber, phase: of the first harmonic's angle.
    """
    if harmonics == 0:
        z = p[1] * y + p[3]
        return (
            p[0] * big_theta_0(z - p[2], p[4], p[5]),
            p[0] * big_theta_0(z, p[4], p[5]),
            p[0] * big_theta_0(z + p[2], p[4], p[5]),
        )
    sine, cosine = sine_cosine(wavenumber * y + phase)
    middle = table[0, 0] * sine
    shared = table[0, 0] * sine * table[1, 0]
    apart = table[0, 0] * cosine * table[2, 0]
    sine_2 = 2.0 * sine * cosine
    cosine_2 = 1.0 - 2.0 * sine * sine
    for k in range(1, harmonics):
        turned = sine * cosine_2 + cosine * sine_2
        cosine = cosine * cosine_2 - sine * sine_2
        sine = turned
        middle += table[0, k] * sine
        shared += table[0, k] * sine * table[1, k]
        apart += table[0, k] * cosine * table[2, k]
    return shared - apart, middle, shared + apart


@njit(cache=True)
def gaussian_force(y: float, current_u: float, current_v: float, current_w: float, p: NDArray[np.float64]) -> float:
    """Thrust in N of the theta motor for a nome near 1, phase by phase (eq. 45). p as in `prepare_motor`."""
    z = p[1] * y + p[3]
    return p[0] * (  # type: ignore[no-any-return]
        big_theta_0(z - p[2], p[4], p[5]) * current_u
        + big_theta_0(z, p[4], p[5]) * current_v
        + big_theta_0(z + p[2], p[4], p[5]) * current_w
    )
