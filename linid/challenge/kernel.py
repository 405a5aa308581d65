"""Compiled core of the hidden plant: fine-step Runge-Kutta integration of the axis, its drive and its hidden effects.

Written apart from `linid.simulation` and from the effect library: the functional forms differ on purpose, so that
naming an effect needs its physics and not its formula. One file, because numba's disk cache follows one file.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from linid.arrays import Array

# Columns logged: position, velocity, bristle deflection, q-current, work, friction loss, bristle of the base model.
Y, V, W, IQ, WORK, LOSS, BASE_W = range(7)
PLAIN_STATES = 7
# Hidden states, logged after those: the last is of the encoder's play.
HEAT_FAST, HEAT_SLOW, CABLE, LOAD, LOAD_RATE, FELT, DWELT, GEAR, GEAR_RATE, SLACK = range(10)
HIDDEN = 10
STATES = PLAIN_STATES + HIDDEN
# Then acceleration, acceleration the base model would have, motor force in N.
ACCELERATION, BASE_ACCELERATION, THRUST = STATES, STATES + 1, STATES + 2
LOGGED = STATES + 3
# Rows of `Plant.number` (amplitude first, then the shape), and bits of `Plant.on`.
(
    COGGING,
    CABLE_FORCE,
    DRAG,
    SATURATION,
    THERMAL,
    END,
    LOAD_SPRING,
    ENCODER,
    DISTURBANCE,
    DRIFT,
    ASYMMETRY,
    BUMP,
    DELAY,
    VIBRATION,
    WALK,
    SPEED_DERATING,
    THRUST_FRICTION,
    ACCELERATION_FRICTION,
    SPEED_COGGING,
    RELUCTANCE,
    CONSTANT,
    EDDY,
    DWELL,
    LEVEL,
    GRAVITY,
    WANDER,
    PITCH,
    GEAR_PLAY,
    PLAY,
) = range(29)
ROWS, COLUMNS = 29, 7
# Friction laws, and the elements of Maxwell's.
LUGRE, DAHL, MAXWELL = range(3)
ELEMENTS = 4
# Rows by where they act, as bits of `on`: whole groups are skipped where none is present.
MOTOR_ROWS = 1 << SATURATION | 1 << THERMAL | 1 << END | 1 << SPEED_DERATING
FRICTION_ROWS = (
    1 << DRIFT
    | 1 << ASYMMETRY
    | 1 << BUMP
    | 1 << WALK
    | 1 << THRUST_FRICTION
    | 1 << ACCELERATION_FRICTION
    | 1 << DWELL
    | 1 << LEVEL
)
FORCE_ROWS = (
    1 << CONSTANT
    | 1 << COGGING
    | 1 << CABLE_FORCE
    | 1 << DRAG
    | 1 << DISTURBANCE
    | 1 << VIBRATION
    | 1 << SPEED_COGGING
    | 1 << RELUCTANCE
    | 1 << EDDY
    | 1 << GRAVITY
    | 1 << WANDER
)
STATE_ROWS = (
    1 << THERMAL | 1 << CABLE_FORCE | 1 << LOAD_SPRING | 1 << ACCELERATION_FRICTION | 1 << DWELL | 1 << GEAR_PLAY
)
SIXTH, TWELFTH, THIRTIETH, FORTY_SECOND = 1 / 6, 1 / 12, 1 / 30, 1 / 42


class Plant(NamedTuple):
    """Numbers of one recording's plant, SI.

    mass: of the forcer with everything rigidly on it; load_mass: hangs on a spring, gear_mass: behind a play;
    base_mass: what the base model takes for their sum. field, base_field: (m, 4), base_phases: (m, 2, 3), see
    `linid.challenge.plant.field_tables`. offsets: what the three current sensors read too much, A; trusted: a model
    that lacks these offsets, and takes the shown currents for true. on: bit k is set while the hidden effect of row k
    acts; number: (ROWS, COLUMNS). law: of friction; shares, stiffness: (ELEMENTS,) of Maxwell's elements, shares of
    the sliding force and N/m; bend: exponent of Dahl's law. walk, wander: (k,) random walks of friction and force at
    knots walk_step s apart. pushes: (k, 3) size in N, start and length in s.
    """

    mass: float
    load_mass: float
    gear_mass: float
    base_mass: float
    law: int
    shares: Array
    stiffness: Array
    bend: float
    coulomb: float
    static: float
    stribeck: float
    exponent: float
    sigma_0: float
    sigma_1: float
    sigma_2: float
    field: Array
    base_field: Array
    base_phases: Array
    density: float
    shift: float
    polarity: float
    current_lag: float
    offsets: Array
    trusted: bool
    on: int
    number: Array
    walk: Array
    wander: Array
    walk_step: float
    pushes: Array


class Loops(NamedTuple):
    """Numbers of the sampled position and velocity loops, SI."""

    period: float
    limit: float
    position_gain: float
    velocity_gain: float
    integral_gain: float
    feedforward: float


@njit(cache=True, inline="always", error_model="numpy")
def _fade(v: float, p: Plant) -> float:
    """exp(-|v/v_s|^alpha)."""
    x = abs(v) * (1.0 / p.stribeck)
    power = x * x if p.exponent == 2.0 else x**p.exponent
    return math.exp(-power) if power < 45.0 else 0.0


@njit(cache=True, inline="always", error_model="numpy")
def _contract(table: Array, s: float, c: float, a: float, b: float) -> float:
    """Force in N of the currents (a, b) in the field at sin, cos of the electrical angle; odd harmonics."""
    s2, c2 = 2.0 * s * c, c * c - s * s
    force, sn, cn = 0.0, s, c
    for m in range(table.shape[0]):
        force += sn * (table[m, 0] * a + table[m, 1] * b) + cn * (table[m, 2] * a + table[m, 3] * b)
        sn, cn = sn * c2 + cn * s2, cn * c2 - sn * s2
    return force


@njit(cache=True, error_model="numpy")
def reading_error(y: float, p: Plant) -> float:
    """What the encoder reads too much at y, in m: a sine with a slightly modulated phase."""
    n = p.number[ENCODER]
    angle = 2.0 * math.pi * y / n[1] + n[2]
    error: float = n[0] * math.sin(angle + n[3] * math.sin(angle))
    return error


@njit(cache=True, error_model="numpy")
def _reading_slope(y: float, p: Plant) -> float:
    n = p.number[ENCODER]
    angle = 2.0 * math.pi * y / n[1] + n[2]
    rate = 2.0 * math.pi / n[1]
    slope: float = n[0] * rate * (1.0 + n[3] * math.cos(angle)) * math.cos(angle + n[3] * math.sin(angle))
    return slope


@njit(cache=True, error_model="numpy")
def _currents(y: float, i_q: float, p: Plant) -> tuple[float, float]:
    """Stationary current components (a, b) in A: I_j = a cos(2 pi j/3) + b sin(2 pi j/3), j = -1, 0, 1."""
    reading = y + (reading_error(y, p) if p.on & 1 << ENCODER else 0.0)
    angle = p.density * reading + p.shift
    return p.polarity * i_q * math.sin(angle), p.polarity * i_q * math.cos(angle)


@njit(cache=True, error_model="numpy")
def _with_offsets(force: float, y: float, p: Plant) -> float:
    """A motor force in N, and what the sensors' offsets would add if they were currents."""
    angle = p.density * y + p.shift
    for m in range(p.base_phases.shape[0]):
        order = (2 * m + 1) * angle
        for j in range(3):
            field = p.base_phases[m, 0, j] * math.sin(order) + p.base_phases[m, 1, j] * math.cos(order)
            force += field * p.offsets[j]
    return force


@njit(cache=True, inline="always", error_model="numpy")
def _motor_factor(y: float, v: float, i_q: float, hidden: Array, p: Plant) -> float:
    """What is left of the thrust per ampere."""
    n, factor = p.number, 1.0
    if p.on & 1 << SATURATION:
        x = n[SATURATION, 0] * abs(i_q)
        factor *= math.atan(x) / x if x > 1e-4 else 1.0 - x * x / 3.0
    if p.on & 1 << THERMAL:
        heat = n[THERMAL, 3] * hidden[HEAT_FAST] + (1.0 - n[THERMAL, 3]) * hidden[HEAT_SLOW]
        factor /= 1.0 + n[THERMAL, 0] * heat
    if p.on & 1 << END:
        low = 0.5 * math.erfc((y - n[END, 1]) / n[END, 3])
        high = 0.5 * math.erfc((n[END, 2] - y) / n[END, 3])
        factor *= 1.0 - n[END, 0] * (low + high)
    if p.on & 1 << SPEED_DERATING:
        factor /= 1.0 + n[SPEED_DERATING, 0] * abs(v)
    return factor


@njit(cache=True, inline="always", error_model="numpy")
def _extra_force(y: float, v: float, i_q: float, hidden: Array, t: float, p: Plant) -> float:
    """Forces in N that neither motor nor guideway friction cause."""
    n, force, pole = p.number, 0.0, 2.0 * p.density * y
    if p.on & 1 << CONSTANT:
        force += n[CONSTANT, 0]
    if p.on & 1 << COGGING:
        swell = 1.0 + n[COGGING, 1] * math.sin(2.0 * math.pi * y / n[COGGING, 2])
        second = n[COGGING, 4] * math.sin(2.0 * pole + n[COGGING, 5])
        force += n[COGGING, 0] * swell * (math.sin(pole + n[COGGING, 3]) + second)
    if p.on & 1 << CABLE_FORCE:
        pull = math.tanh((y - n[CABLE_FORCE, 1]) / n[CABLE_FORCE, 2]) + n[CABLE_FORCE, 3] * hidden[CABLE]
        force -= n[CABLE_FORCE, 0] * pull
    if p.on & 1 << DRAG:
        force -= n[DRAG, 0] * abs(v) ** n[DRAG, 1] * (1.0 if v > 0 else -1.0)
    if p.on & 1 << DISTURBANCE:
        for k in range(p.pushes.shape[0]):
            since = (t - p.pushes[k, 1]) / p.pushes[k, 2]
            if 0.0 < since < 1.0:
                force += p.pushes[k, 0] * math.sin(math.pi * since)
    if p.on & 1 << VIBRATION:
        force += n[VIBRATION, 0] * math.sin(2.0 * math.pi * n[VIBRATION, 1] * t + n[VIBRATION, 2])
    if p.on & 1 << SPEED_COGGING:
        turn = 2.0 * math.pi * abs(v) / n[SPEED_COGGING, 1] + n[SPEED_COGGING, 2]
        force += n[SPEED_COGGING, 0] * abs(v) / (abs(v) + 0.05) * math.sin(pole + turn)
    if p.on & 1 << RELUCTANCE:
        force += n[RELUCTANCE, 0] * i_q * i_q * math.sin(pole + n[RELUCTANCE, 1])
    if p.on & 1 << EDDY:
        force -= n[EDDY, 0] * v / n[EDDY, 1] * math.exp(1.0 - abs(v) / n[EDDY, 1])
    if p.on & 1 << GRAVITY:
        turn = n[GRAVITY, 1] * y
        force += n[GRAVITY, 0] * (math.sin(turn + n[GRAVITY, 2]) + n[GRAVITY, 3] * math.sin(2.0 * turn + n[GRAVITY, 4]))
    if p.on & 1 << WANDER:
        force += n[WANDER, 0] * _walked(p.wander, t, p)
    return force


@njit(cache=True, inline="always", error_model="numpy")
def _walked(walk: Array, t: float, p: Plant) -> float:
    """A random walk at t, linear between its knots."""
    place = t / p.walk_step
    k = min(int(place), walk.shape[0] - 2)
    value: float = walk[k] + (place - k) * (walk[k + 1] - walk[k])
    return value


@njit(cache=True, inline="always", error_model="numpy")
def sliding(y: float, v: float, felt: float, dwelt: float, t: float, thrust: float, p: Plant) -> float:
    """g(v) in N with what hidden effects make of it; felt: filtered acceleration in m/s^2; dwelt: 0 to 1, how far the
    contact has grown."""
    n = p.number
    coulomb, static = p.coulomb, p.static
    if p.on & 1 << ASYMMETRY:
        side = 1.0 if v > 0 else -1.0
        coulomb *= 1.0 + n[ASYMMETRY, 0] * side
        static *= 1.0 + n[ASYMMETRY, 0] * n[ASYMMETRY, 1] * side
    g = coulomb + (static - coulomb) * _fade(v, p)
    if p.on & 1 << DRIFT:
        g *= 1.0 - n[DRIFT, 0] * math.expm1(-t / n[DRIFT, 1])
    if p.on & 1 << BUMP:
        g *= 1.0 + n[BUMP, 0] * math.exp(-(((y - n[BUMP, 1]) / n[BUMP, 2]) ** 2))
    if p.on & 1 << WALK:
        g *= math.exp(n[WALK, 0] * _walked(p.walk, t, p))
    if p.on & 1 << THRUST_FRICTION:
        g *= 1.0 + n[THRUST_FRICTION, 0] * abs(thrust) / p.coulomb
    if p.on & 1 << ACCELERATION_FRICTION:
        g *= 1.0 + n[ACCELERATION_FRICTION, 0] * abs(felt) / (abs(felt) + n[ACCELERATION_FRICTION, 1])
    if p.on & 1 << DWELL:
        g *= 1.0 + n[DWELL, 0] * dwelt
    if p.on & 1 << LEVEL:
        g *= 1.0 + n[LEVEL, 0]
    return g


@njit(cache=True, inline="always", error_model="numpy")
def _dahl(v: float, w: float, g: float, p: Plant) -> float:
    """Rate of the bristle after Dahl, m/s: v sgn(1 - u) |1 - u|^bend, u the share of the sliding force against v."""
    rest = 1.0 - p.sigma_0 * w / g * (1.0 if v > 0 else -1.0)
    return v * math.copysign(abs(rest) ** p.bend, rest)


@njit(cache=True, error_model="numpy")
def slipped(slips: Array, travel: float, g: float, p: Plant) -> tuple[float, float]:
    """Force in N of Maxwell's elements after `travel` m from the deflections `slips` (ELEMENTS,), and the share of
    stiffness that is not yet strained to its limit; g: sliding force in N."""
    force, sticking = 0.0, 0.0
    for k in range(ELEMENTS):
        most, pull = p.shares[k] * g, p.stiffness[k] * (slips[k] + travel)
        if abs(pull) >= most:
            force += math.copysign(most, pull)
        else:
            force += pull
            sticking += p.stiffness[k] * (1.0 - abs(pull) / most)
    return force, sticking / p.sigma_0


@njit(cache=True, error_model="numpy")
def slip(slips: Array, travel: float, g: float, p: Plant) -> None:
    """Move Maxwell's elements on by `travel` m; each gives way at its share of g."""
    for k in range(ELEMENTS):
        most = p.shares[k] * g / p.stiffness[k]
        slips[k] = min(max(slips[k] + travel, -most), most)


@njit(cache=True, inline="always", error_model="numpy")
def _rates(
    y: float,
    v: float,
    w: float,
    i_q: float,
    base_w: float,
    hidden: Array,
    push: float,
    t: float,
    late: bool,
    a: float,
    b: float,
    y0: float,
    sin0: float,
    cos0: float,
    p: Plant,
    out: Array,
    slips: Array,
    led: bool,
    lead: float,
) -> tuple[float, float, float, float, float, float]:
    """Motor force, acceleration, rates of w, work, loss and base_w; those of the hidden states go into `out`.

    late: the currents a, b are delayed ones; sin0, cos0: of the electrical angle at y0, a step or less away; slips:
    (ELEMENTS,) Maxwell's deflections at y0, m; led: the axis moves with the acceleration lead, m/s^2, whatever acts.
    """
    thrust = 0.0
    if late or i_q != 0.0:
        # Angle addition with a short series is exact to rounding for the turn within a step.
        x = p.density * (y - y0)
        x2 = x * x
        sin_x = x * (1.0 - x2 * SIXTH * (1.0 - x2 * 0.05 * (1.0 - x2 * FORTY_SECOND)))
        cos_x = 1.0 - x2 * 0.5 * (1.0 - x2 * TWELFTH * (1.0 - x2 * THIRTIETH))
        sine, cosine = sin0 * cos_x + cos0 * sin_x, cos0 * cos_x - sin0 * sin_x
        if not late:
            if p.on & 1 << ENCODER:
                a, b = _currents(y, i_q, p)
            else:
                a, b = p.polarity * i_q * sine, p.polarity * i_q * cosine
        if p.on & 1 << PITCH:
            n = p.number[PITCH]
            away = p.density * n[0] * math.sin(2.0 * math.pi * y / n[1] + n[2])
            turned = sine * math.cos(away) + cosine * math.sin(away)
            sine, cosine = turned, cosine * math.cos(away) - sine * math.sin(away)
        thrust = _contract(p.field, sine, cosine, a, b)
    if p.trusted:
        thrust = _with_offsets(thrust, y, p)
    drive, viscous, coupling, spring_loss = push, p.sigma_2, 0.0, 0.0
    if p.on & MOTOR_ROWS:
        thrust *= _motor_factor(y, v, i_q, hidden, p)
    if p.on & FORCE_ROWS:
        drive += _extra_force(y, v, i_q, hidden, t, p)
    if p.on & 1 << DRIFT:
        viscous *= 1.0 - p.number[DRIFT, 0] * math.expm1(-t / p.number[DRIFT, 1])
    if p.on & 1 << LOAD_SPRING:
        rate = 2.0 * math.pi * p.number[LOAD_SPRING, 1]
        damping = 2.0 * p.number[LOAD_SPRING, 2] * rate * p.load_mass
        coupling = p.load_mass * rate * rate * hidden[LOAD] + damping * hidden[LOAD_RATE]
        spring_loss = damping * hidden[LOAD_RATE] * hidden[LOAD_RATE]
    gear = 0.0
    if p.on & 1 << GEAR_PLAY:
        n = p.number[GEAR_PLAY]
        rate = 2.0 * math.pi * n[2]
        damping = 2.0 * n[3] * rate * p.gear_mass
        touch = math.tanh(hidden[GEAR] / n[1])
        gear = p.gear_mass * rate * rate * (hidden[GEAR] - n[1] * touch) + damping * touch * touch * hidden[GEAR_RATE]
        coupling += gear
        spring_loss += damping * touch * touch * hidden[GEAR_RATE] * hidden[GEAR_RATE]
    drive += thrust
    if p.on & FRICTION_ROWS:
        g = sliding(y, v, hidden[FELT], hidden[DWELT], t, thrust, p)
    else:
        g = p.coulomb + (p.static - p.coulomb) * _fade(v, p)
    if p.law == LUGRE:
        pull = p.sigma_0 * abs(v) * w / g
        w_rate = v - pull
        resist = p.sigma_0 * w + p.sigma_1 * w_rate + viscous * v
        loss = p.sigma_0 * w * pull + p.sigma_1 * w_rate * v + viscous * v * v + spring_loss
    elif p.law == DAHL:
        w_rate = _dahl(v, w, g, p)
        resist = p.sigma_0 * w + viscous * v
        loss = p.sigma_0 * w * (v - w_rate) + viscous * v * v + spring_loss
    else:
        # What the elements store counts as lost while they hold it.
        stuck, sticking = slipped(slips, y - y0, g, p)
        w_rate = 0.0
        resist = stuck + (p.sigma_1 * sticking + viscous) * v
        loss = resist * v + spring_loss
    acceleration = (drive - resist + coupling) * (1.0 / p.mass)
    base_rate = w_rate
    if p.on & FRICTION_ROWS and p.law != MAXWELL:
        base_g = p.coulomb + (p.static - p.coulomb) * _fade(v, p)
        base_rate = v - p.sigma_0 * abs(v) * base_w / base_g if p.law == LUGRE else _dahl(v, base_w, base_g, p)
    if p.on & STATE_ROWS:
        n, moved = p.number, lead if led else acceleration
        if p.on & 1 << THERMAL:
            out[HEAT_FAST] = (i_q * i_q - hidden[HEAT_FAST]) / n[THERMAL, 1]
            out[HEAT_SLOW] = (i_q * i_q - hidden[HEAT_SLOW]) / n[THERMAL, 2]
        if p.on & 1 << CABLE_FORCE:
            out[CABLE] = (v - abs(v) * hidden[CABLE]) / n[CABLE_FORCE, 4]
        if p.on & 1 << LOAD_SPRING:
            out[LOAD], out[LOAD_RATE] = hidden[LOAD_RATE], -(coupling - gear) / p.load_mass - moved
        if p.on & 1 << GEAR_PLAY:
            out[GEAR], out[GEAR_RATE] = hidden[GEAR_RATE], -gear / p.gear_mass - moved
        if p.on & 1 << ACCELERATION_FRICTION:
            out[FELT] = (moved - hidden[FELT]) / n[ACCELERATION_FRICTION, 2]
        if p.on & 1 << DWELL:
            out[DWELT] = (1.0 - hidden[DWELT]) / n[DWELL, 1] - abs(v) * hidden[DWELT] / n[DWELL, 2]
    return thrust, acceleration, w_rate, drive * v, loss, base_rate


@njit(cache=True, error_model="numpy")
def _base_acceleration(y: float, v: float, w: float, i_q: float, push: float, slips: Array, p: Plant) -> float:
    """Acceleration in m/s^2 that the model without effects gives along this motion under the logged currents."""
    a, b = _currents(y, i_q, p)
    angle = p.density * y + p.shift
    force = _with_offsets(_contract(p.base_field, math.sin(angle), math.cos(angle), a, b), y, p)
    g = p.coulomb + (p.static - p.coulomb) * _fade(v, p)
    if p.law == MAXWELL:
        stuck, sticking = slipped(slips, 0.0, g, p)
        return (force + push - stuck - (p.sigma_1 * sticking + p.sigma_2) * v) / p.base_mass
    if p.law == DAHL:
        return (force + push - p.sigma_0 * w - p.sigma_2 * v) / p.base_mass
    w_rate = v - p.sigma_0 * abs(v) * w / g
    return (force + push - p.sigma_0 * w - p.sigma_1 * w_rate - p.sigma_2 * v) / p.base_mass


@njit(cache=True, error_model="numpy")
def _delayed(history: Array, row: int, step: int, back: float) -> float:
    """The lagged current `back` steps before step `step`, linear between steps (beyond the newest: extrapolated)."""
    place = step - back
    if place <= 0:
        return float(history[row, 0])
    k = min(int(place), max(step - 1, 0))
    fraction = place - k
    size = history.shape[1]
    return float(history[row, k % size] * (1.0 - fraction) + history[row, (k + 1) % size] * fraction)


@njit(cache=True, nogil=True, error_model="numpy")
def integrate(
    p: Plant,
    d: Loops,
    control: int,
    current: Array,
    y_reference: Array,
    v_reference: Array,
    push: Array,
    y0: float,
    v0: float,
    w0: float,
    base_w0: float,
    substeps: int,
    loops_per_sample: int,
    path: Array,
) -> tuple[Array, float, float]:
    """Integrate one recording; returns what is logged, (n, LOGGED), and the lowest and highest position in m.

    control: 0 power stage off, 1 current command, 2 position loop; commands: (loops,), held over a loop period.
    path: (0, 4), or (loops, 4) position, velocity, acceleration and q-current at each loop: the axis is then led along
    it with one step per loop, and the logged acceleration and motor force are those that this plant would have there.
    """
    loops = current.shape[0]
    logged = np.zeros((loops // loops_per_sample, LOGGED))
    y, v, w, base_w, i_q, work, loss = y0, v0, w0, base_w0, 0.0, 0.0, 0.0
    hidden, x, rate, total = np.zeros(HIDDEN), np.zeros(HIDDEN), np.zeros(HIDDEN), np.zeros(HIDDEN)
    led, lead, ahead_of = path.shape[0] > 0, 0.0, 0
    # At rest contacts are grown and plays in their middle; a moving axis has worn and taken them up.
    hidden[DWELT], hidden[SLACK] = (0.0 if v0 != 0.0 else 1.0), (0.0 if v0 == 0.0 else math.copysign(1.0, v0))
    slips, base_slips = np.zeros(ELEMENTS), np.zeros(ELEMENTS)
    if p.law == MAXWELL and v0 != 0.0:
        slip(slips, math.copysign(1.0, v0), w0 * p.sigma_0 * math.copysign(1.0, v0), p)
        slip(base_slips, math.copysign(1.0, v0), base_w0 * p.sigma_0 * math.copysign(1.0, v0), p)
    low, high, integral, i_reference = y0, y0, 0.0, 0.0
    h = d.period / substeps
    late = p.on & 1 << DELAY != 0
    dead, keep, weight_old, weight_new = p.number[DELAY, 0] / h, 0.0, 0.0, 1.0
    history = np.zeros((2, int(dead) + 4))
    if late:
        # Exact step of the first-order lag under a current that is linear within the step.
        turn = h / max(p.number[DELAY, 0] * p.number[DELAY, 1], 1e-12)
        keep = math.exp(-turn)
        weight_old, weight_new = (1.0 - keep) / turn - keep, 1.0 - (1.0 - keep) / turn
    a, b, a_old, b_old, step = 0.0, 0.0, 0.0, 0.0, 0
    for loop in range(loops):
        row = logged[loop // loops_per_sample]
        first = loop % loops_per_sample == 0
        if led:
            y, v, i_q = path[loop, 0], path[loop, 1], path[loop, 3]
            ahead_of = min(loop + 1, loops - 1)
        if first:
            row[Y], row[V], row[W], row[IQ], row[WORK], row[LOSS], row[BASE_W] = y, v, w, i_q, work, loss, base_w
            row[PLAIN_STATES:STATES] = hidden
            row[BASE_ACCELERATION] = _base_acceleration(y, v, base_w, i_q, push[loop], base_slips, p)
        if control == 1:
            i_reference = min(max(current[loop], -d.limit), d.limit)
        elif control == 2:
            y_read, v_read = y, v
            if p.on & 1 << ENCODER:
                y_read, v_read = y + reading_error(y, p), v * (1.0 + _reading_slope(y, p))
            if p.on & 1 << PLAY:
                y_read -= 0.5 * p.number[PLAY, 0] * hidden[SLACK]
                v_read *= abs(hidden[SLACK])
            error = d.position_gain * (y_reference[loop] - y_read) + d.feedforward * v_reference[loop] - v_read
            wanted = d.velocity_gain * error + integral
            if abs(wanted) <= d.limit or wanted * error < 0:
                integral += d.integral_gain * error * d.period
            i_reference = min(max(wanted, -d.limit), d.limit)
        for _ in range(substeps):
            angle = p.density * y + p.shift
            sin0, cos0 = math.sin(angle), math.cos(angle)
            ys, vs, ws, bs, cs = y, v, w, base_w, i_q
            yt, vt, wt, bt, ct, work_t, loss_t = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            if p.on & STATE_ROWS:
                for k in range(HIDDEN):
                    x[k], total[k] = hidden[k], 0.0
            # One call in a loop over the stages, so that the right-hand side is compiled once.
            for stage in range(4):
                part = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
                ahead = h if stage == 2 else 0.5 * h
                weight = 2.0 if stage == 1 or stage == 2 else 1.0
                if led:
                    lead = path[loop, 2] * (1.0 - part) + path[ahead_of, 2] * part
                    if stage == 1:
                        ys = 0.5 * (y + path[ahead_of, 0]) + 0.125 * h * (v - path[ahead_of, 1])
                        vs = 0.5 * (v + path[ahead_of, 1]) + 0.125 * h * (path[loop, 2] - path[ahead_of, 2])
                        cs = 0.5 * (i_q + path[ahead_of, 3])
                    elif stage == 3:
                        ys, vs, cs = path[ahead_of, 0], path[ahead_of, 1], path[ahead_of, 3]
                if late:
                    a, b = _delayed(history, 0, step, dead - part), _delayed(history, 1, step, dead - part)
                thrust, v_rate, w_rate, power, heat, b_rate = _rates(
                    ys,
                    vs,
                    ws,
                    cs,
                    bs,
                    x,
                    push[loop],
                    (step + part) * h,
                    late,
                    a,
                    b,
                    y,
                    sin0,
                    cos0,
                    p,
                    rate,
                    slips,
                    led,
                    lead,
                )
                if first:
                    row[THRUST], row[ACCELERATION], first = thrust, v_rate, False
                c_rate = (i_reference - cs) * (1.0 / p.current_lag)
                yt, vt, wt, bt, ct = (
                    yt + weight * vs,
                    vt + weight * v_rate,
                    wt + weight * w_rate,
                    bt + weight * b_rate,
                    ct + weight * c_rate,
                )
                work_t, loss_t = work_t + weight * power, loss_t + weight * heat
                ws, bs = w + ahead * w_rate, base_w + ahead * b_rate
                if not led:
                    ys, vs, cs = y + ahead * vs, v + ahead * v_rate, i_q + ahead * c_rate
                if p.on & STATE_ROWS:
                    for k in range(HIDDEN):
                        total[k] += weight * rate[k]
                        x[k] = hidden[k] + ahead * rate[k]
            sixth = h / 6.0
            y_before = y
            y, v, w, base_w, i_q = (
                y + sixth * yt,
                v + sixth * vt,
                w + sixth * wt,
                base_w + sixth * bt,
                i_q + sixth * ct,
            )
            if led:
                y, v, i_q = path[ahead_of, 0], path[ahead_of, 1], path[ahead_of, 3]
            work, loss = work + sixth * work_t, loss + sixth * loss_t
            if p.on & STATE_ROWS:
                for k in range(HIDDEN):
                    hidden[k] += sixth * total[k]
            if p.on & 1 << PLAY:
                # Taken up by travel alone, exponentially.
                travel = y - y_before
                side = math.copysign(1.0, travel)
                hidden[SLACK] = side + (hidden[SLACK] - side) * math.exp(-2.0 * abs(travel) / p.number[PLAY, 0])
            if p.law == MAXWELL:
                g = p.coulomb + (p.static - p.coulomb) * _fade(v, p)
                slip(base_slips, y - y_before, g, p)
                if p.on & FRICTION_ROWS:
                    g = sliding(y, v, hidden[FELT], hidden[DWELT], step * h, thrust, p)
                slip(slips, y - y_before, g, p)
            step += 1
            if late:
                a, b = _currents(y, i_q, p)
                size = history.shape[1]
                now, last = step % size, (step - 1) % size
                history[0, now] = keep * history[0, last] + weight_old * a_old + weight_new * a
                history[1, now] = keep * history[1, last] + weight_old * b_old + weight_new * b
                a_old, b_old = a, b
            low, high = min(low, y), max(high, y)
    return logged, low, high
