"""The hidden plant's motor as its encoder commutates it: currents, their delay, thrust, and what is left of it."""

from __future__ import annotations

import math
from typing import NamedTuple

from linid.arrays import Array
from linid.challenge.kernel.inputs import Plant, PlantState
from linid.challenge.kernel.layout import (
    DELAY,
    ENCODER,
    END,
    HEAT_FAST,
    HEAT_SLOW,
    MOTOR_ROWS,
    PITCH,
    SATURATION,
    SPEED_DERATING,
    THERMAL,
)
from linid.simulation.binding import compiled, inlined

SIXTH, TWELFTH, THIRTIETH, FORTY_SECOND = 1 / 6, 1 / 12, 1 / 30, 1 / 42


class Field(NamedTuple):
    """Currents and field about a step: y0 in m, sine and cosine of the electrical angle there; late: whether the
    current components a, b in A are delayed ones."""

    y0: float
    sine: float
    cosine: float
    late: bool
    a: float
    b: float


class Lag(NamedTuple):
    """A delay in steps of integration: the dead time, and the weights with which a first-order lag takes its last
    value, the last current and the new one."""

    late: bool
    dead: float
    keep: float
    weight_old: float
    weight_new: float


@inlined
def reading_error(y: float, p: Plant) -> float:
    """What the encoder reads too much at y, in m: a sine with a slightly modulated phase."""
    n = p.number[ENCODER]
    angle = 2.0 * math.pi * y / n[1] + n[2]
    error: float = n[0] * math.sin(angle + n[3] * math.sin(angle))
    return error


@inlined
def reading_slope(y: float, p: Plant) -> float:
    """d(reading error)/dy."""
    n = p.number[ENCODER]
    angle = 2.0 * math.pi * y / n[1] + n[2]
    rate = 2.0 * math.pi / n[1]
    slope: float = n[0] * rate * (1.0 + n[3] * math.cos(angle)) * math.cos(angle + n[3] * math.sin(angle))
    return slope


@compiled
def currents(y: float, i_q: float, p: Plant) -> tuple[float, float]:
    """Stationary current components (a, b) in A: I_j = a cos(2 pi j/3) + b sin(2 pi j/3), j = -1, 0, 1."""
    reading = y + (reading_error(y, p) if p.on & 1 << ENCODER else 0.0)
    angle = p.density * reading + p.shift
    return p.polarity * i_q * math.sin(angle), p.polarity * i_q * math.cos(angle)


@inlined
def contract(table: Array, s: float, c: float, a: float, b: float) -> float:
    """Force in N of currents (a, b) in the field, table (m, 4), at sin, cos of the electrical angle; odd harmonics."""
    s2, c2 = 2.0 * s * c, c * c - s * s
    force, sn, cn = 0.0, s, c
    for m in range(table.shape[0]):
        force += sn * (table[m, 0] * a + table[m, 1] * b) + cn * (table[m, 2] * a + table[m, 3] * b)
        sn, cn = sn * c2 + cn * s2, cn * c2 - sn * s2
    return force


@compiled
def with_offsets(force: float, y: float, p: Plant) -> float:
    """A motor force in N, and what the sensors' offsets would add if they were currents."""
    angle = p.density * y + p.shift
    for m in range(p.base_phases.shape[0]):
        order = (2 * m + 1) * angle
        for j in range(3):
            field = p.base_phases[m, 0, j] * math.sin(order) + p.base_phases[m, 1, j] * math.cos(order)
            force += field * p.offsets[j]
    return force


@inlined
def motor_factor(s: PlantState, hidden: Array, p: Plant) -> float:
    """What is left of the thrust per ampere, a factor; hidden: (HIDDEN,) states."""
    n, factor = p.number, 1.0
    if p.on & 1 << SATURATION:
        x = n[SATURATION, 0] * abs(s.i_q)
        factor *= math.atan(x) / x if x > 1e-4 else 1.0 - x * x / 3.0
    if p.on & 1 << THERMAL:
        heat = n[THERMAL, 3] * hidden[HEAT_FAST] + (1.0 - n[THERMAL, 3]) * hidden[HEAT_SLOW]
        factor /= 1.0 + n[THERMAL, 0] * heat
    if p.on & 1 << END:
        low = 0.5 * math.erfc((s.y - n[END, 1]) / n[END, 3])
        high = 0.5 * math.erfc((n[END, 2] - s.y) / n[END, 3])
        factor *= 1.0 - n[END, 0] * (low + high)
    if p.on & 1 << SPEED_DERATING:
        factor /= 1.0 + n[SPEED_DERATING, 0] * abs(s.v)
    return factor


@inlined
def motor_force(s: PlantState, field: Field, hidden: Array, p: Plant) -> float:
    """Thrust in N with the axis a step or less away from field.y0; hidden: (HIDDEN,) states."""
    thrust = 0.0
    if field.late or s.i_q != 0.0:
        # Angle addition with a short series is exact to rounding for the turn within a step.
        x = p.density * (s.y - field.y0)
        x2 = x * x
        sin_x = x * (1.0 - x2 * SIXTH * (1.0 - x2 * 0.05 * (1.0 - x2 * FORTY_SECOND)))
        cos_x = 1.0 - x2 * 0.5 * (1.0 - x2 * TWELFTH * (1.0 - x2 * THIRTIETH))
        sine, cosine = field.sine * cos_x + field.cosine * sin_x, field.cosine * cos_x - field.sine * sin_x
        a, b = field.a, field.b
        if not field.late:
            if p.on & 1 << ENCODER:
                a, b = currents(s.y, s.i_q, p)
            else:
                a, b = p.polarity * s.i_q * sine, p.polarity * s.i_q * cosine
        if p.on & 1 << PITCH:
            n = p.number[PITCH]
            away = p.density * n[0] * math.sin(2.0 * math.pi * s.y / n[1] + n[2])
            turned = sine * math.cos(away) + cosine * math.sin(away)
            sine, cosine = turned, cosine * math.cos(away) - sine * math.sin(away)
        thrust = contract(p.field, sine, cosine, a, b)
    if p.trusted:
        thrust = with_offsets(thrust, s.y, p)
    if p.on & MOTOR_ROWS:
        thrust *= motor_factor(s, hidden, p)
    return thrust


@inlined
def lag_of(h: float, p: Plant) -> Lag:
    """The delay of a plant that is integrated in steps of h seconds."""
    late = p.on & 1 << DELAY != 0
    dead, keep, weight_old, weight_new = p.number[DELAY, 0] / h, 0.0, 0.0, 1.0
    if late:
        # Exact step of the first-order lag under a current that is linear within the step.
        turn = h / max(p.number[DELAY, 0] * p.number[DELAY, 1], 1e-12)
        keep = math.exp(-turn)
        weight_old, weight_new = (1.0 - keep) / turn - keep, 1.0 - (1.0 - keep) / turn
    return Lag(late, dead, keep, weight_old, weight_new)


@inlined
def lagged(
    history: Array, step: int, old: tuple[float, float], new: tuple[float, float], lag: Lag
) -> tuple[float, float]:
    """Note in the history (2, k) the lagged currents at the end of a step that ends as number `step`; returns the new
    ones, A.
    """
    size = history.shape[1]
    now, last = step % size, (step - 1) % size
    history[0, now] = lag.keep * history[0, last] + lag.weight_old * old[0] + lag.weight_new * new[0]
    history[1, now] = lag.keep * history[1, last] + lag.weight_old * old[1] + lag.weight_new * new[1]
    return new


@compiled
def delayed(history: Array, row: int, step: int, back: float) -> float:
    """The lagged current `back` steps before step `step`, linear between steps (beyond the newest: extrapolated), A.
    history: (2, k); row: of it.
    """
    place = step - back
    if place <= 0:
        return float(history[row, 0])
    k = min(int(place), max(step - 1, 0))
    fraction = place - k
    size = history.shape[1]
    return float(history[row, k % size] * (1.0 - fraction) + history[row, (k + 1) % size] * fraction)
