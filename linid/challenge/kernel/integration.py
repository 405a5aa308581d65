"""The hidden plant through one recording: its sampled loops, its steps, and what is logged."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from linid.arrays import Array
from linid.challenge.kernel.friction import plain_sliding, sliding, slip, steady_bristle
from linid.challenge.kernel.inputs import Memory, Orders, Plant, PlantState
from linid.challenge.kernel.layout import (
    ACCELERATION,
    BASE_ACCELERATION,
    BASE_W,
    DWELT,
    ELEMENTS,
    ENCODER,
    EXTREME,
    HIDDEN,
    IQ,
    LOGGED,
    LOSS,
    MAXWELL,
    MEMORY_ROWS,
    ORIGIN,
    OUTSIDE_FRICTION_ROWS,
    PLAIN_STATES,
    PLAY,
    SLACK,
    THRUST,
    WAY,
    WORK,
    V,
    W,
    Y,
)
from linid.challenge.kernel.motor import currents, lag_of, lagged, reading_error, reading_slope
from linid.challenge.kernel.outside import note_motion, outside_friction
from linid.challenge.kernel.rates import base_acceleration
from linid.challenge.kernel.steps import Lead, Step, led_motion, runge_kutta, slip_elements, take_up_play
from linid.simulation.binding import compiled, inlined
from linid.simulation.compiled import entry_of

if TYPE_CHECKING:
    from linid.stand.plant import DriveParameters

Integrate = Callable[[Plant, "DriveParameters", Orders, float, float, int, int], tuple[Array, float, float]]


@compiled
def _start(y0: float, v0: float, memory: Memory, p: Plant) -> PlantState:
    """The motion at the start, hidden states and elements with it; a moving axis has its bristles at their steady
    deflection."""
    w = base_w = 0.0
    hidden = memory.hidden
    # At rest contacts are grown and plays in their middle; a moving axis has worn and taken them up.
    hidden[DWELT], hidden[SLACK] = (0.0 if v0 != 0.0 else 1.0), (0.0 if v0 == 0.0 else math.copysign(1.0, v0))
    hidden[ORIGIN] = hidden[EXTREME] = y0
    if v0 != 0.0:
        side = math.copysign(1.0, v0)
        hidden[WAY] = side
        g = sliding(y0, v0, 0.0, 0.0, 0.0, 0.0, p)
        if p.on & OUTSIDE_FRICTION_ROWS:
            g *= outside_friction(y0, hidden, 0.0, 0.0, p)
        w = steady_bristle(g, v0, p)
        base_w = steady_bristle(plain_sliding(v0, p), v0, p)
        if p.law == MAXWELL:
            slip(memory.slips, side, w * p.sigma_0 * side, p)
            slip(memory.base_slips, side, base_w * p.sigma_0 * side, p)
    return PlantState(y0, v0, w, 0.0, base_w, 0.0, 0.0)


@inlined
def _read(s: PlantState, slack: float, p: Plant) -> tuple[float, float]:
    """Position in m and velocity in m/s that the drive reads; slack: -1 to 1, of the encoder's play."""
    y, v = s.y, s.v
    if p.on & 1 << ENCODER:
        y, v = s.y + reading_error(s.y, p), s.v * (1.0 + reading_slope(s.y, p))
    if p.on & 1 << PLAY:
        y -= 0.5 * p.number[PLAY, 0] * slack
        v *= abs(slack)
    return y, v


@inlined
def _controlled(
    s: PlantState, slack: float, told: Orders, loop: int, integral: float, d: DriveParameters, p: Plant
) -> tuple[float, float]:
    """q-current reference and new integral in A; the integral stops while the current is limited."""
    y_read, v_read = _read(s, slack, p)
    error = d.position_gain * (told.y_reference[loop] - y_read) + d.feedforward * told.v_reference[loop] - v_read
    wanted = d.velocity_gain * error + integral
    if abs(wanted) <= d.limit or wanted * error < 0:
        integral += d.integral_gain * error * d.period
    return min(max(wanted, -d.limit), d.limit), integral


@inlined
def _note(row: Array, s: PlantState, push: float, memory: Memory, p: Plant) -> None:
    """Log what is known before a step is made."""
    row[Y], row[V], row[W], row[IQ], row[WORK], row[LOSS], row[BASE_W] = s.y, s.v, s.w, s.i_q, s.work, s.loss, s.base_w
    for k in range(HIDDEN):
        row[PLAIN_STATES + k] = memory.hidden[k]
    row[BASE_ACCELERATION] = base_acceleration(s, push, memory.base_slips, p)


def integrate(
    p: Plant, d: DriveParameters, told: Orders, y0: float, v0: float, substeps: int, loops_per_sample: int
) -> tuple[Array, float, float]:
    """Kernel: integrate one recording from y0 in m at v0 in m/s, in `substeps` per loop period.

    Returns what is logged, (n, LOGGED), and the lowest and highest position in m. Along a path there has to be one step
    per loop; acceleration and motor force logged are then those that this plant would have there.
    """
    loops = told.current.shape[0]
    logged = np.zeros((loops // loops_per_sample, LOGGED))
    h = d.period / substeps
    lag = lag_of(h, p)
    hidden, stage, rate, total = np.zeros(HIDDEN), np.zeros(HIDDEN), np.zeros(HIDDEN), np.zeros(HIDDEN)
    slips, base_slips, history = np.zeros(ELEMENTS), np.zeros(ELEMENTS), np.zeros((2, int(lag.dead) + 4))
    memory = Memory(hidden, stage, rate, total, slips, base_slips, history)
    s = _start(y0, v0, memory, p)
    low, high, integral, i_reference, newest, number = y0, y0, 0.0, 0.0, (0.0, 0.0), 0
    led = told.path.shape[0] > 0
    for loop in range(loops):
        row = logged[loop // loops_per_sample]
        first = loop % loops_per_sample == 0
        lead = Lead(led, told.path, loop, min(loop + 1, loops - 1))
        if led:
            s = led_motion(s, told.path[loop])
        if first:
            _note(row, s, told.push[loop], memory, p)
        if told.control == 1:
            i_reference = min(max(told.current[loop], -d.limit), d.limit)
        elif told.control == 2:
            i_reference, integral = _controlled(s, hidden[SLACK], told, loop, integral, d, p)
        for _ in range(substeps):
            before = s.y
            s, forces = runge_kutta(s, Step(number, h, i_reference, told.push[loop]), lead, lag, memory, p)
            if first:
                row[THRUST], row[ACCELERATION], first = forces.thrust, forces.acceleration, False
            if p.on & 1 << PLAY:
                take_up_play(s.y - before, hidden, p)
            if p.on & MEMORY_ROWS:
                note_motion(s.y, s.v, s.y - before, h, hidden)
            if p.law == MAXWELL:
                slip_elements(s, s.y - before, number * h, forces.last_thrust, memory, p)
            number += 1
            if lag.late:
                newest = lagged(history, number, newest, currents(s.y, s.i_q, p), lag)
            low, high = min(low, s.y), max(high, s.y)
    return logged, low, high


@cache
def load_integrate() -> Integrate:
    """`integrate` compiled, or from the disk cache; its key follows every function that it calls."""
    loaded: Integrate = entry_of(integrate)
    return loaded
