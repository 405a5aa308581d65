"""Thrust and back-EMF of a field that is a sum of odd harmonics, compiled (31, 39, 44, 45)."""

from __future__ import annotations

import math

import numpy as np

from linid.arrays import Array
from linid.kernel_cache import kept

HALF_PI = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21)  # 33 bits, 33 bits, rest
_BLOCK = 256


@kept(error_model="numpy", forceinline=True)
def sine_cosine(angle: float) -> tuple[float, float]:
    """Sine and cosine of an angle in rad, without branches, so that loops over angles become vector instructions.

    The angle is brought to within pi/4 of a multiple of pi/2, which is held in three parts (Cody and Waite 1980);
    Taylor's series follow, of which the first term left out is below 5e-17.
    """
    n = np.floor(angle * (2.0 / math.pi) + 0.5)
    x = ((angle - n * HALF_PI[0]) - n * HALF_PI[1]) - n * HALF_PI[2]
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


@kept()
def phase_steps(table: Array, count: int, force_constant: float, turns: float, displacement: float) -> None:
    """Fill the rest of a table whose first row holds relative amplitudes of `count` odd harmonics.

    table: (3, MAX_HARMONICS) becomes amplitude in N/A, cos and sin of the phase step per harmonic; force_constant: N/A;
    turns: electrical radians per radian of the motor's own angles, such as its winding displacement (rad).
    """
    for k in range(count):
        n = 2 * k + 1
        table[0, k] *= force_constant
        table[1, k] = math.cos(turns * n * displacement)
        table[2, k] = math.sin(turns * n * displacement)


@kept(error_model="numpy", forceinline=True)
def phase_force(
    y: float,
    current_u: float,
    current_v: float,
    current_w: float,
    wavenumber: float,
    phase: float,
    table: Array,
    harmonics: int,
) -> float:
    """Thrust in N of three phase currents at position y (m): sum over odd harmonics by angle addition
    (eqs. 44, 45).

    current_u, current_v, current_w: A; wavenumber: rad/m and phase: rad, of the first harmonic's angle; table: (3,
    MAX_HARMONICS) amplitude in N/A, cos and sin of the phase step per harmonic, of which there are `harmonics`. One
    sine and one cosine serve every phase and harmonic, so theta costs hardly more than sine.
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


@kept(error_model="numpy")
def phase_forces(
    y: Array,
    currents: tuple[Array, Array, Array],
    wavenumber: float,
    phase: float,
    table: Array,
    harmonics: int,
    out: Array,
) -> None:
    """Thrusts in N at many positions y (n,) in m under phase currents, each (n,) in A: what `phase_force` gives.

    wavenumber: rad/m and phase: rad, of the first harmonic's angle; table: (3, MAX_HARMONICS), the amplitudes in
    N/A, and harmonics as there; out: (n,) N is filled.
    """
    sine, cosine, sine_2, cosine_2 = np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK)
    for begin in range(0, y.size, _BLOCK):  # loops of few arrays each: only such become vector instructions
        size = min(_BLOCK, y.size - begin)
        end = begin + size
        place, force = y[begin:end], out[begin:end]
        u, v, w = currents[0][begin:end], currents[1][begin:end], currents[2][begin:end]
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


@kept(error_model="numpy")
def phase_force_slopes(
    y: Array,
    currents: tuple[Array, Array, Array],
    wavenumber: float,
    phase: float,
    table: Array,
    harmonics: int,
    moved: Array,
    out: Array,
) -> None:
    """How the thrusts of `phase_forces` change, per unit of each direction: eqs. 44 and 45, differentiated.

    y: (n,) m; currents: each (n,) in A; wavenumber: rad/m; phase: rad; table: (3, MAX_HARMONICS), the amplitudes in
    N/A, and harmonics as there; moved: (directions, 4, MAX_HARMONICS), per unit of a direction the changes of the
    amplitudes in N/A, of their products with cosine and with sine of the phase step, and in the last row those of
    wavenumber in rad/m and phase in rad; out: (directions, n) N is filled.
    """
    sine, cosine, sine_2, cosine_2 = np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK)
    middle, shared, apart, turned = np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK)
    for begin in range(0, y.size, _BLOCK):
        size = min(_BLOCK, y.size - begin)
        end = begin + size
        place = y[begin:end]
        u, v, w = currents[0][begin:end], currents[1][begin:end], currents[2][begin:end]
        for j in range(size):
            sine[j], cosine[j] = sine_cosine(wavenumber * place[j] + phase)
        for j in range(size):
            sine_2[j], cosine_2[j] = 2.0 * sine[j] * cosine[j], 1.0 - 2.0 * sine[j] * sine[j]
            turned[j] = 0.0
        for k in range(harmonics):
            amplitude, along, across = (2 * k + 1) * table[0, k], table[1, k], table[2, k]
            for j in range(size):
                both, between = u[j] + w[j], w[j] - u[j]
                middle[j], shared[j], apart[j] = sine[j] * v[j], sine[j] * both, cosine[j] * between
                turned[j] += amplitude * (cosine[j] * (v[j] + along * both) - sine[j] * across * between)
            for m in range(moved.shape[0]):
                of_middle, of_shared, of_apart, slope = (
                    moved[m, 0, k],
                    moved[m, 1, k],
                    moved[m, 2, k],
                    out[m, begin:end],
                )
                for j in range(size):
                    part = of_middle * middle[j] + of_shared * shared[j] + of_apart * apart[j]
                    slope[j] = part + (slope[j] if k > 0 else 0.0)
            if k + 1 < harmonics:
                for j in range(size):
                    ahead = sine[j] * cosine_2[j] + cosine[j] * sine_2[j]
                    cosine[j] = cosine[j] * cosine_2[j] - sine[j] * sine_2[j]
                    sine[j] = ahead
        for m in range(moved.shape[0]):
            by_wavenumber, by_phase, slope = moved[m, 3, 0], moved[m, 3, 1], out[m, begin:end]
            for j in range(size):
                slope[j] += (by_wavenumber * place[j] + by_phase) * turned[j]


@kept()
def phase_constants(
    y: float, wavenumber: float, phase: float, table: Array, harmonics: int
) -> tuple[float, float, float]:
    """Thrust per phase current in N/A of the three windings at position y (m); in V s/m their back-EMF per speed
    (eqs. 31, 39).

    wavenumber, phase, table, harmonics: as in `phase_force`.
    """
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
