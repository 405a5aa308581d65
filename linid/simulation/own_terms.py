"""Own terms in a simulation: a stack machine reads their programs, so that no formula needs to be compiled.

Programs, parameters, variables and the stack lie in the vector with which a simulation works (see
`linid/physics/model.py`).
"""

from __future__ import annotations

import math
from typing import Any

from linid.physics.friction import stribeck
from linid.physics.model import (
    ADDED_MASS,
    ELAPSED,
    MASS,
    MEMORY_PLACE,
    OWN_STACK,
    OWN_START,
    OWN_VARIABLES,
    STATE_SIZE,
    STATE_START,
)
from linid.physics.own_terms import layout
from linid.physics.own_terms.layout import (
    ACCELERATION_BIT,
    CREEP,
    HEAD,
    LEAST_REST,
    MEMORY_BIT,
    PLAY,
    STRIBECK_BIT,
    TERMS,
)
from linid.simulation.binding import compiled, inlined

FORCE, LEVEL = 0, 1  # parts of own terms: forces, and levels of friction
LEAST_LEVEL = 0.05  # of Coulomb's force: friction that no own term takes away
MEMORY_AT = STATE_START + MEMORY_PLACE  # in the vector
MEMORY_BEFORE = MEMORY_AT + STATE_SIZE  # the memory at the start of a step
MEMORY_SIZE = len(layout.MEMORY)
_LOAD, _NUMBER, _RAMP = layout.LOAD, layout.NUMBER, layout.RAMP
_SPLINE, _SURFACE, _PERIODIC, _WAVE = layout.SPLINE, layout.SURFACE, layout.PERIODIC, layout.WAVE
_NEGATIVE, _ABS, _SIGN, _SIN, _COS, _EXP = (
    layout.NEGATIVE,
    layout.ABS,
    layout.SIGN,
    layout.SIN,
    layout.COS,
    layout.EXP,
)
_LOG, _SQRT, _TANH = layout.LOG, layout.SQRT, layout.TANH
_ADD, _SUBTRACT, _MULTIPLY, _DIVIDE = layout.ADD, layout.SUBTRACT, layout.MULTIPLY, layout.DIVIDE
_POWER, _MIN, _MAX = layout.POWER, layout.MIN, layout.MAX
_WITH_NUMBER, _WITH_LOAD = layout.WITH_NUMBER, layout.WITH_LOAD


@inlined
def weights_at(u):
    """The four cubic B-splines that are not zero at the share u of an interval (own_terms/basis.py)."""
    r = 1.0 - u
    return (
        r * r * r / 6.0,
        (u * u * (3.0 * u - 6.0) + 4.0) / 6.0,
        (u * (u * (3.0 - 3.0 * u) + 3.0) + 1.0) / 6.0,
        u * u * u / 6.0,
    )


@inlined
def interval_of(x, low, inverse, intervals):
    """The interval in which x lies, from 0, and its share of it; beyond the ends: the ends."""
    s = (x - low) * inverse
    if not s > 0.0:
        s = 0.0
    if s > intervals:
        s = intervals
    j = min(int(s), int(intervals) - 1)
    return j, s - j


@compiled
def spline_value(p, pc, x):
    """A curve at x; its numbers stand at pc: place of the coefficients, low, intervals per unit, coefficients."""
    if math.isnan(x):
        return x
    j, u = interval_of(x, p[pc + 1], p[pc + 2], p[pc + 3] - 3.0)
    a, b, c, d = weights_at(u)
    at = int(p[pc]) + j
    return a * p[at] + b * p[at + 1] + c * p[at + 2] + d * p[at + 3]


@compiled
def surface_value(p, pc, x, x2):
    """A surface at x, x2; numbers as in `spline_value`, those of the second direction behind."""
    if math.isnan(x) or math.isnan(x2):
        return math.nan
    j, u = interval_of(x, p[pc + 1], p[pc + 2], p[pc + 3] - 3.0)
    k, u2 = interval_of(x2, p[pc + 4], p[pc + 5], p[pc + 6] - 3.0)
    a, b, c, d = weights_at(u2)
    width = int(p[pc + 6])
    at = int(p[pc]) + j * width + k
    total = 0.0
    for weight in weights_at(u):
        total += weight * (a * p[at] + b * p[at + 1] + c * p[at + 2] + d * p[at + 3])
        at += width
    return total


@compiled
def periodic_value(p, pc, x):
    """A periodic curve at x; its numbers stand at pc: place of the coefficients, intervals per unit, coefficients."""
    n = p[pc + 2]
    s = x * p[pc + 1]
    s -= math.floor(s / n) * n
    if not abs(s) <= n:  # x is no number
        return math.nan
    if s >= n:
        s = 0.0
    j, count = int(s), int(n)
    a, b, c, d = weights_at(s - j)
    at = int(p[pc])
    total = a * p[at + j] + b * p[at + (j + 1) % count]
    return total + c * p[at + (j + 2) % count] + d * p[at + (j + 3) % count]


@inlined
def of_one(code, x):
    """An operation on one number."""
    if code == _NEGATIVE:
        return -x
    if code == _ABS:
        return abs(x)
    if code == _SIGN:
        return math.copysign(1.0, x) if x != 0.0 else x
    if code == _SIN:
        return math.sin(x)
    if code == _COS:
        return math.cos(x)
    if code == _EXP:
        return math.exp(x)
    if code == _LOG:
        return math.log(x)
    if code == _SQRT:
        return math.sqrt(x)
    return math.tanh(x)


@inlined
def of_two(code, x, x2):
    """An operation on two numbers; what is no number stays none."""
    if code == _ADD:
        return x + x2
    if code == _SUBTRACT:
        return x - x2
    if code == _MULTIPLY:
        return x * x2
    if code == _DIVIDE:
        return x / x2
    if code == _POWER:
        return x * x if x2 == 2.0 else x**x2
    if code == _MIN:
        return x2 if x2 < x or math.isnan(x2) else x
    return x2 if x2 > x or math.isnan(x2) else x


@inlined
def ramped(p, pc, x):
    """A piece of a polyline at x; its numbers stand at pc: a place, ends, zero and slope."""
    x = of_two(_MAX, of_two(_MIN, x, p[pc + 2]), p[pc + 1])
    return p[pc + 4] * (x - p[pc + 3])


@inlined
def pushed_value(p, pc, code):
    """A number that an operation puts on the stack; its own numbers stand at pc."""
    if code == _NUMBER:
        return p[pc]
    x = p[int(p[pc])]
    return ramped(p, pc, x) if code == _RAMP else x


@inlined
def operated(p, pc, code, top, x):
    """What an operation, whose numbers stand at pc, makes of the number x on top of the stack, which is kept apart from
    those below, of which the first stands at `top`. Returns the number, where the one below stands then, and where the
    next operation does."""
    if code > _MAX + _WITH_NUMBER:
        return of_two(code - _WITH_LOAD, x, p[int(p[pc])]), top, pc + 1
    if code > _MAX:
        return of_two(code - _WITH_NUMBER, x, p[pc]), top, pc + 1
    if code >= _ADD:
        return of_two(code, p[top], x), top - 1, pc
    if code <= _RAMP:
        p[top + 1] = x
        return pushed_value(p, pc, code), top + 1, pc + (5 if code == _RAMP else 1)
    if code == _SPLINE:
        return spline_value(p, pc, x), top, pc + 4
    if code == _PERIODIC:
        return periodic_value(p, pc, x), top, pc + 3
    if code == _WAVE:
        return p[int(p[pc])] * math.sin(x) + p[int(p[pc + 1])] * math.cos(x), top, pc + 2
    if code == _SURFACE:
        return surface_value(p, pc, p[top], x), top - 1, pc + 7
    return of_one(code, x), top, pc


@compiled
def program_value(p, pc, stop):
    """What the program from pc to stop gives."""
    top, x = OWN_STACK - 1, 0.0
    while pc < stop:
        x, top, pc = operated(p, pc + 1, int(p[pc]), top, x)
    return x


@compiled
def driven_acceleration(p, push, v):
    """Acceleration in m/s^2 that the motor's force gives the mass beside friction of steady sliding (eq. 42), which at
    rest holds against forces up to breakaway."""
    level = stribeck(v, p[0], p[1], p[2], p[3])
    slides = 1.0 - math.exp(-((v / (CREEP * p[2])) ** 2))
    held = min(max(push, -level), level)
    friction = slides * math.copysign(level, v) + (1.0 - slides) * held + p[6] * v
    return (push - friction) / (p[MASS] + p[ADDED_MASS])


@inlined
def put_variables(p, on, push, t, y, v):
    """Put the variables of own terms in; push: the motor's force in N."""
    at = OWN_VARIABLES
    p[at], p[at + 1], p[at + 2], p[at + 3], p[at + 4] = t, p[ELAPSED] + t, y, v, push
    if on & MEMORY_BIT:
        p[at + 5] = abs(y - p[MEMORY_AT + 1])
        p[at + 6] = p[MEMORY_AT + 3]
        p[at + 7] = p[MEMORY_AT + 7]
        p[at + 8] = p[MEMORY_AT + 8]
    if on & ACCELERATION_BIT:
        p[at + 9] = driven_acceleration(p, push, v)
    if on & STRIBECK_BIT:
        p[at + 10] = stribeck(v, p[0], p[1], p[2], p[3]) / p[0]


@compiled
def own_sum(p, on, part, push, t, y, v):
    """Sum in N of the forces (part 0) or levels of friction (part 1) of all own terms; nan if it is no number.

    push: the motor's force in N."""
    put_variables(p, on, push, t, y, v)
    total = 0.0
    for k in range(TERMS):
        head = OWN_START + HEAD * k + 2 * part
        start, stop = int(p[head]), int(p[head + 1])
        if stop > start:
            total += program_value(p, start, stop)
    return total if abs(total) < math.inf else math.nan


@compiled
def start_memory(p, y):
    """The memory of an axis that starts at y in m: nothing is known of what was before."""
    for k in range(MEMORY_SIZE):
        p[MEMORY_AT + k] = 0.0
    p[MEMORY_AT + 1] = p[MEMORY_AT + 2] = p[MEMORY_AT + 5] = y


@compiled
def advance_memory(p, h, y):
    """The memory h seconds after the start of the step, the axis being at y in m by then."""
    for k in range(MEMORY_SIZE):
        p[MEMORY_AT + k] = p[MEMORY_BEFORE + k]
    p[MEMORY_AT + 3] += h
    p[MEMORY_AT + 4] += h
    p[MEMORY_AT + 6] += h
    direction, moved = p[MEMORY_AT], y - p[MEMORY_AT + 2]
    if direction == 0.0 and abs(moved) > PLAY:
        p[MEMORY_AT] = direction = math.copysign(1.0, moved)
    if direction * moved > 0.0:
        p[MEMORY_AT + 2], p[MEMORY_AT + 4] = y, 0.0
    elif direction * moved < -PLAY:  # a reversal, where it had gone farthest
        p[MEMORY_AT], p[MEMORY_AT + 1] = -direction, p[MEMORY_AT + 2]
        p[MEMORY_AT + 3] = p[MEMORY_AT + 4]
        p[MEMORY_AT + 2], p[MEMORY_AT + 4] = y, 0.0
    gone = abs(y - p[MEMORY_AT + 5])
    if gone > PLAY:
        p[MEMORY_AT + 8] += gone
        p[MEMORY_AT + 5], p[MEMORY_AT + 6] = y, 0.0
    elif p[MEMORY_AT + 6] >= LEAST_REST:
        p[MEMORY_AT + 7], p[MEMORY_AT + 8] = p[MEMORY_AT + 6], 0.0


@inlined
def with_least(p, load):
    """What is added to the level of friction in N, of which a share of Coulomb's force is left at least."""
    least = (LEAST_LEVEL - 1.0) * p[0]
    return least if load < least else load


def with_own(rest: Any, part: int, bit: int) -> Any:
    """What effects add to the forces (part 0) or to the level of friction (part 1), with what own terms add, which the
    bit switches on; at least a share of Coulomb's force is left of all friction."""

    @inlined
    def total(value, on, push, t, y, v, currents, p):
        value = rest(value, on, push, t, y, v, currents, p)
        if on & bit:
            value += own_sum(p, on, part, push, t, y, v)
            if part == LEVEL:
                value = with_least(p, value)
        return value

    return total


def with_memory_start(rest: Any) -> Any:
    """The start of hidden states, with that of the memory."""

    @inlined
    def total(on, t, y, v, currents, p):
        rest(on, t, y, v, currents, p)
        if on & MEMORY_BIT:
            start_memory(p, y)

    return total


def with_memory(rest: Any) -> Any:
    """The advance of hidden states, with that of the memory."""

    @inlined
    def total(on, h, t, y, v, a, currents, p):
        rest(on, h, t, y, v, a, currents, p)
        if on & MEMORY_BIT:
            advance_memory(p, h, y + 0.5 * h * v)

    return total
