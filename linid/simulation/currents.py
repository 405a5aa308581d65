"""The phase currents that measured voltages drive along a measured motion (5), (31), (39), compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from linid.physics.electrical import WEIGHTS, clarke, current_weights, mode_inductances, phases
from linid.physics.model import WINDING_START
from linid.simulation.binding import allocating, inlined
from linid.simulation.bundle import Bundle
from linid.simulation.course import stretch_of
from linid.simulation.forces import axis_of
from linid.simulation.kernel_by_voltage import SEPARATE, STAR
from linid.simulation.splines_at import inputs_at

PIECES = 2  # of a sampling interval, within which voltages and back-EMF are parabolas


@inlined
def motion_between(k, share, dt, y, v):
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


@inlined
def push_between(terms, axis, stretch, k, share, y, v):
    """Space vector and mean of the voltages less back-EMF in V, a share of the interval after sample k."""
    here, speed = motion_between(k, share, stretch.dt, y, v)
    e_1, e_2, e_3 = terms.motor.constants(axis, here)
    u_1, u_2, u_3 = inputs_at(stretch.coefficients, k, share * stretch.dt)
    return clarke(u_1 - e_1 * speed, u_2 - e_2 * speed, u_3 - e_3 * speed)


@allocating
def currents_one(terms, candidates, stretch, y, v, start, out):
    """The currents of one candidate along one recording; effects are left out.

    y, v: (count,) measured motion in m and m/s; start: (3,) A at its first sample; out: (3, count) A is filled.
    """
    axis = axis_of(terms, candidates, stretch)
    p, winding = axis.p, candidates.winding
    resistance = p[WINDING_START]
    inductance, mean_inductance = mode_inductances(winding, p[WINDING_START + 1], p[WINDING_START + 2])
    h = stretch.dt / PIECES
    space, mean = np.zeros(WEIGHTS), np.zeros(WEIGHTS)
    current_weights(resistance, inductance, h, space)
    current_weights(resistance, mean_inductance, h, mean)
    i_a, i_b, i_0 = clarke(start[0], start[1], start[2])
    if winding == STAR:
        i_0 = 0.0
    out[0, 0], out[1, 0], out[2, 0] = phases(i_a, i_b, i_0)
    ended = push_between(terms, axis, stretch, 0, 0.0, y, v)
    for k in range(stretch.count - 1):
        for piece in range(PIECES):
            begun = ended
            half_way = push_between(terms, axis, stretch, k, (piece + 0.5) / PIECES, y, v)
            ended = push_between(terms, axis, stretch, k, (piece + 1.0) / PIECES, y, v)
            i_a = space[0] * i_a + space[1] * begun[0] + space[2] * half_way[0] + space[3] * ended[0]
            i_b = space[0] * i_b + space[1] * begun[1] + space[2] * half_way[1] + space[3] * ended[1]
            if winding == SEPARATE:
                i_0 = mean[0] * i_0 + mean[1] * begun[2] + mean[2] * half_way[2] + mean[3] * ended[2]
        out[0, k + 1], out[1, k + 1], out[2, k + 1] = phases(i_a, i_b, i_0)


def current_tasks_with(terms: Bundle) -> Any:
    """`current_tasks` with these terms, for Python to call."""

    def current_tasks(candidates, inputs, y, v, starts, out):
        """Currents along the measured motion of all driven recordings.

        inputs: packed with their voltages; y, v: (samples of all recordings,) m, m/s; starts: (recordings, 3) A;
        out: (candidates, 3, samples) A is filled where a recording is driven.
        """
        for r in range(inputs.dts.size):
            a, b = inputs.sample_offsets[r], inputs.sample_offsets[r + 1]
            for candidate in range(out.shape[0]):
                if inputs.powered[r]:
                    stretch = stretch_of(candidates, inputs, candidate, r, 0, b - a)
                    currents_one(terms, candidates, stretch, y[a:b], v[a:b], starts[r], out[candidate, :, a:b])

    return current_tasks
