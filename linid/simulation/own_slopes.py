"""Derivatives of own terms: their programs are gone through once more from the end, which tells by how much every
variable and every parameter changes the value, exactly and all at once.

Source: Griewank and Walther 2008, Evaluating Derivatives, chapter 3 (reverse mode).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.physics.friction import stribeck
from linid.physics.model import MASS, OWN_STACK, OWN_START, OWN_VARIABLES, WORK_SIZE
from linid.physics.own_terms import layout
from linid.physics.own_terms.layout import (
    ACCELERATION_BIT,
    FORCE_BIT,
    HEAD,
    LEVEL_BIT,
    MEMORY_BIT,
    POOL,
    STRIBECK_BIT,
    TERMS,
)
from linid.simulation.binding import allocating, compiled, inlined
from linid.simulation.own_terms import (
    MEMORY_AT,
    MEMORY_BEFORE,
    MEMORY_SIZE,
    driven_acceleration,
    interval_of,
    operated,
    put_variables,
    weights_at,
)

_STEP = 1e-6  # of a parameter, a force or a speed, in their own scale; for variables that are formulas themselves
_WEAK, _SLOW = 1.0, 1e-3  # N, m/s
_SPEED, _PLACE, _PUSH, _TRAVEL, _SLID, _ACCELERATION, _STRIBECK = (
    OWN_VARIABLES + layout.VARIABLES.index(name)
    for name in ("v", "y", "F", "travel", "slid", "acceleration", "stribeck")
)
# What of the memory motion moves, and by which that shows.
_DIRECTION, _TURN, _FAR, _SINCE_FAR, _ANCHOR, _CLOCK, _GONE = (
    layout.MEMORY.index(name) for name in ("direction", "turn", "far", "since_far", "anchor", "clock", "slid")
)
# What stands where in the room for derivatives: how many changes of parameters, and columns that change variables; how
# what own terms add answers variables and parameters, N per unit of each; of the operations of a program in their
# order, what they found on the stack and where they stand; then what columns change (`own_slopes_of`).
CHANGED, HANGING, BY = range(3)
BELOW = BY + WORK_SIZE
ABOVE, WHERE, ENTRIES = (BELOW + k * POOL for k in (1, 2, 3))
_LOAD, _NUMBER, _RAMP, _MAX, _ADD = layout.LOAD, layout.NUMBER, layout.RAMP, layout.MAX, layout.ADD
_SPLINE, _SURFACE, _PERIODIC, _WAVE = layout.SPLINE, layout.SURFACE, layout.PERIODIC, layout.WAVE
_NEGATIVE, _ABS, _SIGN, _SIN, _COS, _EXP, _LOG, _SQRT = range(layout.NEGATIVE, layout.TANH)
_SUBTRACT, _MULTIPLY, _DIVIDE, _POWER, _MIN = range(layout.SUBTRACT, layout.MAX)
_WITH_NUMBER, _WITH_LOAD = layout.WITH_NUMBER, layout.WITH_LOAD


class OwnAnswer(NamedTuple):
    """How what own terms add answers the motor's force in N, the speed in m/s and the place in m."""

    by_push: Any
    by_speed: Any
    by_place: Any


@allocating
def own_slopes_of(on, params, count, step):
    """Room for the derivatives of own terms, empty where a model has none: one array, as simulations hand it on at
    every step. Beside the numbers under the names above: columns, places and rates by which columns change parameters,
    and behind them the columns that change variables.

    params: (1 + count, ...) of the model and a `step` along each column.
    """
    if on & (FORCE_BIT | LEVEL_BIT) == 0:
        return np.empty(0)
    changed = hanging = 0
    own = np.zeros(ENTRIES + count * (3 * layout.SIZE + 1))
    for c in range(count):
        for k in range(OWN_START, params.shape[1]):
            if params[1 + c, k] != params[0, k]:
                at = ENTRIES + 3 * changed
                own[at], own[at + 1], own[at + 2] = c, k, (params[1 + c, k] - params[0, k]) / step
                changed += 1
    for c in range(count if on & (ACCELERATION_BIT | STRIBECK_BIT) else 0):
        hangs = False
        for k in range(MASS + 1):
            hangs = hangs or params[1 + c, k] != params[0, k]
        if hangs:
            own[ENTRIES + 3 * changed + hanging] = c
            hanging += 1
    own[CHANGED], own[HANGING] = changed, hanging
    return own[: ENTRIES + 3 * changed + hanging].copy()


@inlined
def slopes_of_weights(u):
    """Derivatives by u of `weights_at`."""
    r = 1.0 - u
    return -0.5 * r * r, u * (1.5 * u - 2.0), u * (1.0 - 1.5 * u) + 0.5, 0.5 * u * u


@compiled
def answer_of_spline(p, pc, x, given, own):
    """`given` times the slope by x of `spline_value`; what the coefficients are given is put in."""
    if math.isnan(x):
        return x
    low, inverse, intervals = p[pc + 1], p[pc + 2], p[pc + 3] - 3.0
    s = (x - low) * inverse
    j, u = interval_of(x, low, inverse, intervals)
    weights, slopes, at, slope = weights_at(u), slopes_of_weights(u), int(p[pc]) + j, 0.0
    for k in range(4):
        own[BY + at + k] += given * weights[k]
        slope += slopes[k] * p[at + k]
    return given * slope * inverse if 0.0 <= s <= intervals else 0.0


@compiled
def answer_of_surface(p, pc, x, x2, given, own):
    """`given` times the slopes by x and x2 of `surface_value`; what the coefficients are given is put in."""
    if math.isnan(x) or math.isnan(x2):
        return math.nan, math.nan
    inverse, inverse_2, n, n_2 = p[pc + 2], p[pc + 5], p[pc + 3] - 3.0, p[pc + 6] - 3.0
    s, s_2 = (x - p[pc + 1]) * inverse, (x2 - p[pc + 4]) * inverse_2
    j, u = interval_of(x, p[pc + 1], inverse, n)
    k, u_2 = interval_of(x2, p[pc + 4], inverse_2, n_2)
    rows, columns, width = weights_at(u), weights_at(u_2), int(p[pc + 6])
    by_rows, by_columns, at = slopes_of_weights(u), slopes_of_weights(u_2), int(p[pc]) + j * width + k
    slope = slope_2 = 0.0
    for row in range(4):
        for one in range(4):
            own[BY + at + one] += given * rows[row] * columns[one]
            slope += by_rows[row] * columns[one] * p[at + one]
            slope_2 += rows[row] * by_columns[one] * p[at + one]
        at += width
    slope = given * slope * inverse if 0.0 <= s <= n else 0.0
    slope_2 = given * slope_2 * inverse_2 if 0.0 <= s_2 <= n_2 else 0.0
    return slope, slope_2


@compiled
def answer_of_periodic(p, pc, x, given, own):
    """`given` times the slope by x of `periodic_value`; what the coefficients are given is put in."""
    n, s = p[pc + 2], x * p[pc + 1]
    s -= math.floor(s / n) * n
    if not abs(s) <= n:
        return math.nan
    if s >= n:
        s = 0.0
    j, count, at, slope = int(s), int(n), int(p[pc]), 0.0
    weights, slopes = weights_at(s - j), slopes_of_weights(s - j)
    for k in range(4):
        place = at + (j + k) % count
        own[BY + place] += given * weights[k]
        slope += slopes[k] * p[place]
    return given * slope * p[pc + 1]


@inlined
def slope_of_one(code, x):
    """The derivative of `of_one`; 0 where it has none."""
    if code == _NEGATIVE:
        return -1.0
    if code == _ABS:
        return math.copysign(1.0, x) if x != 0.0 else 0.0
    if code == _SIGN:
        return 0.0
    if code == _SIN:
        return math.cos(x)
    if code == _COS:
        return -math.sin(x)
    if code == _EXP:
        return math.exp(x)
    if code == _LOG:
        return 1.0 / x if x != 0.0 else 0.0
    if code == _SQRT:
        return 0.5 / math.sqrt(x) if x > 0.0 else 0.0
    return 1.0 - math.tanh(x) ** 2


@inlined
def slopes_of_two(code, x, x2, fixed):
    """The derivatives of `of_two` by both numbers, 0 where there is none; fixed: the second one is never asked for."""
    if code == _ADD:
        return 1.0, 1.0
    if code == _SUBTRACT:
        return 1.0, -1.0
    if code == _MULTIPLY:
        return x2, x
    if code == _DIVIDE:
        return (1.0 / x2, -x / (x2 * x2)) if x2 != 0.0 else (0.0, 0.0)
    if code == _POWER:
        if x2 == 2.0 and fixed:
            return 2.0 * x, 0.0
        if x == 0.0:
            return 1.0 if x2 == 1.0 else 0.0, 0.0
        by_exponent = x**x2 * math.log(x) if x > 0.0 and not fixed else 0.0
        return x2 * x ** (x2 - 1.0), by_exponent
    first = x < x2 if code == _MIN else x > x2
    return (1.0, 0.0) if first else (0.0, 1.0)


@compiled
def gone_through(p, pc, stop, own):
    """`program_value`, with what its operations found on the stack written down; returns it and how many they were."""
    top, x, count = OWN_STACK - 1, 0.0, 0
    while pc < stop:
        own[WHERE + count], own[BELOW + count], own[ABOVE + count] = pc, p[top], x
        x, top, pc = operated(p, pc + 1, int(p[pc]), top, x)
        count += 1
    return x, count


@inlined
def given_to_pushed(p, pc, code, given, own):
    """What a number that an operation has put on the stack is given, put in."""
    if code == _NUMBER:
        return
    place = int(p[pc])
    if code == _RAMP:
        x = p[place]
        given *= p[pc + 4] if p[pc + 1] < x < p[pc + 2] else 0.0
    own[BY + place] += given


@compiled
def gone_back(p, count, own):
    """The way back through a program: what every number adds to its value per unit, put in."""
    top, given = OWN_STACK - 1, 1.0
    for n in range(count - 1, -1, -1):
        pc, below, x = int(own[WHERE + n]), own[BELOW + n], own[ABOVE + n]
        code = int(p[pc])
        pc += 1
        if code > _MAX + _WITH_NUMBER:
            place = int(p[pc])
            of_first, of_second = slopes_of_two(code - _WITH_LOAD, x, p[place], False)
            own[BY + place] += given * of_second
            given *= of_first
        elif code > _MAX:
            given *= slopes_of_two(code - _WITH_NUMBER, x, p[pc], True)[0]
        elif code >= _ADD:
            of_first, of_second = slopes_of_two(code, below, x, False)
            top += 1
            p[top] = given * of_first
            given *= of_second
        elif code <= _RAMP:
            given_to_pushed(p, pc, code, given, own)
            given = p[top]
            top -= 1
        elif code == _SPLINE:
            given = answer_of_spline(p, pc, x, given, own)
        elif code == _PERIODIC:
            given = answer_of_periodic(p, pc, x, given, own)
        elif code == _WAVE:
            s, c = math.sin(x), math.cos(x)
            of_sine, of_cosine = int(p[pc]), int(p[pc + 1])
            own[BY + of_sine] += given * s
            own[BY + of_cosine] += given * c
            given *= p[of_sine] * c - p[of_cosine] * s
        elif code == _SURFACE:
            top += 1
            p[top], given = answer_of_surface(p, pc, below, x, given, own)
        else:
            given *= slope_of_one(code, x)


@compiled
def put_answers(p, on, part, push, t, y, v, own):
    """Put in how the sum of the forces (part 0) or levels of friction (part 1) of all own terms answers variables and
    parameters; returns that sum in N. push: the motor's force in N."""
    put_variables(p, on, push, t, y, v)
    total = 0.0
    for k in range(OWN_START, OWN_START + layout.SIZE):
        own[BY + k] = 0.0
    for k in range(len(layout.VARIABLES)):
        own[BY + OWN_VARIABLES + k] = 0.0
    for k in range(TERMS):
        head = OWN_START + HEAD * k + 2 * part
        start, stop = int(p[head]), int(p[head + 1])
        if stop > start:
            value, count = gone_through(p, start, stop, own)
            gone_back(p, count, own)
            total += value
    return total


@compiled
def answer_by_motion(p, on, push, y, v, own):
    """How own terms answer push, speed and place, given how they answer their variables (`put_answers`)."""
    by_push, by_speed, by_place = own[BY + _PUSH], own[BY + _SPEED], own[BY + _PLACE]
    faster = _STEP * (abs(v) + _SLOW)
    if on & MEMORY_BIT:
        by_place += own[BY + _TRAVEL] * (1.0 if y > p[MEMORY_AT + _TURN] else -1.0)
    if on & ACCELERATION_BIT:
        a, more = driven_acceleration(p, push, v), _STEP * (abs(push) + _WEAK)
        by_push += own[BY + _ACCELERATION] * (driven_acceleration(p, push + more, v) - a) / more
        by_speed += own[BY + _ACCELERATION] * (driven_acceleration(p, push, v + faster) - a) / faster
    if on & STRIBECK_BIT:
        rise = stribeck(v + faster, p[0], p[1], p[2], p[3]) - stribeck(v, p[0], p[1], p[2], p[3])
        by_speed += own[BY + _STRIBECK] * rise / (p[0] * faster)
    return OwnAnswer(by_push, by_speed, by_place)


@compiled
def add_memory(p, y, own, scale, by_state, states):
    """Add how own terms answer their memory, times a scale, to by_state, where the hidden states begin and end at
    `states`; what of it is time answers nothing."""
    first = states[1] - MEMORY_SIZE
    by_state[first + _TURN] -= scale * own[BY + _TRAVEL] * (1.0 if y > p[MEMORY_AT + _TURN] else -1.0)
    by_state[first + _GONE] += scale * own[BY + _SLID]


@compiled
def answers_of_memory(p, h, y, by, row, n):
    """Put in how the memory h seconds after the start of a step, the axis being at y in m by then (`advance_memory`),
    answers what it was, the place and the speed. by: from `row` on, n + 3 numbers for each of n hidden states, of which
    those of the memory are the last ones."""
    first, size = n - MEMORY_SIZE, n + 3
    turn, far = row + (first + _TURN) * size, row + (first + _FAR) * size
    anchor, gone = row + (first + _ANCHOR) * size, row + (first + _GONE) * size
    for k in range(size):
        by[turn + k] = by[far + k] = by[anchor + k] = by[gone + k] = 0.0
    before = p[MEMORY_BEFORE + _DIRECTION]
    turned = before != 0.0 and p[MEMORY_AT + _DIRECTION] != before
    by[turn + first + (_FAR if turned else _TURN)] = 1.0
    if p[MEMORY_AT + _SINCE_FAR] == 0.0:
        by[far + n], by[far + n + 1] = 1.0, 0.5 * h
    else:
        by[far + first + _FAR] = 1.0
    if p[MEMORY_AT + _GONE] != 0.0:
        by[gone + first + _GONE] = 1.0
    if p[MEMORY_AT + _CLOCK] == 0.0:
        ahead = math.copysign(1.0, y - p[MEMORY_BEFORE + _ANCHOR])
        by[anchor + n], by[anchor + n + 1] = 1.0, 0.5 * h
        by[gone + n], by[gone + n + 1], by[gone + first + _ANCHOR] = ahead, 0.5 * h * ahead, -ahead
    else:
        by[anchor + first + _ANCHOR] = 1.0


@compiled
def add_columns(p, on, moving, beside, own, to):
    """Add how own terms answer the columns, given how they answer their variables and parameters (`put_answers`).
    moving: the motor's force in N and the speed in m/s; beside: (K, WORK_SIZE) parameters, and the step that they are
    along each column; to: where it is added, from which place on, and times what."""
    (push, v), (params, step), (out, start, scale) = moving, beside, to
    behind = ENTRIES + 3 * int(own[CHANGED])
    for at in range(ENTRIES, behind, 3):
        out[start + int(own[at])] += scale * own[at + 2] * own[BY + int(own[at + 1])]
    for n in range(int(own[HANGING])):
        c = int(own[behind + n])
        q, total = params[c], 0.0
        if on & ACCELERATION_BIT:
            change = driven_acceleration(q, push, v) - driven_acceleration(p, push, v)
            total += own[BY + _ACCELERATION] * change / step
        if on & STRIBECK_BIT:
            change = stribeck(v, q[0], q[1], q[2], q[3]) / q[0] - stribeck(v, p[0], p[1], p[2], p[3]) / p[0]
            total += own[BY + _STRIBECK] * change / step
        out[start + c] += scale * total
