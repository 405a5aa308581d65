"""The phase currents that measured voltages drive along a measured motion (5), (31), (39)."""

from __future__ import annotations

import numpy as np
from numba import njit

from linid.arrays import Array
from linid.physics.electrical import WEIGHTS, WINDING_CODES, clarke, current_weights, mode_inductances, phases
from linid.physics.model import MOTOR_START, WINDING_START, Model
from linid.physics.motors import phase_constants, prepare_motor
from linid.simulation.inputs import Inputs

_PIECES = 2  # of a sampling interval, within which voltages and back-EMF are parabolas


def currents_along(model: Model, params: Array, inputs: Inputs, y: Array, v: Array, start: Array) -> Array:
    """Currents (C, 3, samples) in A of C candidates, exact for voltages that are parabolas between half samples.

    model: with windings; params: (C, VECTOR_SIZE) SI; inputs: packed with their voltages; y, v: (samples,) measured
    motion in m and m/s; start: (R, 3) A at the recordings' first samples. Effects are left out.
    """
    out = np.zeros((params.shape[0], 3, y.size))
    offsets = inputs.sample_offsets
    for index in range(inputs.counts.size):
        if not inputs.powered[index]:
            continue
        part = slice(int(offsets[index]), int(offsets[index + 1]))
        block = inputs.coefficients[inputs.offsets[index] : inputs.offsets[index + 1]]
        for candidate in range(params.shape[0]):
            _along(
                params[candidate],
                model.motor,
                WINDING_CODES[model.winding],
                block,
                inputs.dts[index],
                y[part],
                v[part],
                start[index],
                out[candidate, :, part],
            )
    return out


@njit(cache=True, nogil=True)
def _motion_between(k: int, share: float, dt: float, y: Array, v: Array) -> tuple[float, float]:
    """Position and speed a share of the interval after sample k, by the cubic through both samples' own."""
    here = y[k] + share * (
        dt * v[k]
        + share
        * (
            3.0 * (y[k + 1] - y[k])
            - dt * (2.0 * v[k] + v[k + 1])
            + share * (dt * (v[k] + v[k + 1]) - 2.0 * (y[k + 1] - y[k]))
        )
    )
    speed = v[k] + share * (
        2.0 * (3.0 * (y[k + 1] - y[k]) / dt - 2.0 * v[k] - v[k + 1])
        + 3.0 * share * (v[k] + v[k + 1] - 2.0 * (y[k + 1] - y[k]) / dt)
    )
    return here, speed


@njit(cache=True, nogil=True)
def _along(
    params: Array,
    motor: int,
    winding: int,
    coefficients: Array,
    dt: float,
    y: Array,
    v: Array,
    start: Array,
    out: Array,
) -> None:
    """Kernel: the currents of one candidate along one recording, into `out`; arguments as of `currents_along`."""
    p = params[MOTOR_START : MOTOR_START + 6]
    table = np.zeros((3, 12))
    harmonics = prepare_motor(motor, p, table)
    wavenumber, phase = p[1], p[3]
    if motor == 3:
        wavenumber, phase = 2.0 * wavenumber, 2.0 * phase
    resistance = params[WINDING_START]
    inductance, mean_inductance = mode_inductances(winding, params[WINDING_START + 1], params[WINDING_START + 2])
    h = dt / _PIECES
    space, mean = np.zeros(WEIGHTS), np.zeros(WEIGHTS)
    current_weights(resistance, inductance, h, space)
    current_weights(resistance, mean_inductance, h, mean)
    i_a, i_b, i_0 = clarke(start[0], start[1], start[2])
    if winding == 1:
        i_0 = 0.0
    out[0, 0], out[1, 0], out[2, 0] = phases(i_a, i_b, i_0)
    push = np.zeros((3, 3))  # start, middle and end of a piece; two parts of the space vector, mean
    for k in range(y.size - 1):
        for piece in range(_PIECES):
            for place in range(3):
                if place == 0 and (k > 0 or piece > 0):
                    continue
                share = (piece + 0.5 * place) / _PIECES
                x = share * dt
                here, speed = _motion_between(k, share, dt, y, v)
                e_1, e_2, e_3 = phase_constants(motor, here, p, table, harmonics, wavenumber, phase)
                c = coefficients[k]
                u_1 = ((c[0, 3] * x + c[0, 2]) * x + c[0, 1]) * x + c[0, 0] - e_1 * speed
                u_2 = ((c[1, 3] * x + c[1, 2]) * x + c[1, 1]) * x + c[1, 0] - e_2 * speed
                u_3 = ((c[2, 3] * x + c[2, 2]) * x + c[2, 1]) * x + c[2, 0] - e_3 * speed
                push[place, 0], push[place, 1], push[place, 2] = clarke(u_1, u_2, u_3)
            i_a = space[0] * i_a + space[1] * push[0, 0] + space[2] * push[1, 0] + space[3] * push[2, 0]
            i_b = space[0] * i_b + space[1] * push[0, 1] + space[2] * push[1, 1] + space[3] * push[2, 1]
            if winding == 2:
                i_0 = mean[0] * i_0 + mean[1] * push[0, 2] + mean[2] * push[1, 2] + mean[3] * push[2, 2]
            push[0] = push[2]
        out[0, k + 1], out[1, k + 1], out[2, k + 1] = phases(i_a, i_b, i_0)
