"""Own terms at many samples at once: each operation of their programs in a loop of its own, as vector instructions.

What a program is and what its operations do is told in own_terms.py, which asks sample by sample.
"""

from __future__ import annotations

import math

import numpy as np

from linid.physics.friction import stribeck
from linid.physics.model import ELAPSED, OWN_STACK, OWN_START, OWN_VARIABLES
from linid.physics.own_terms import layout
from linid.physics.own_terms.layout import ACCELERATION_BIT, HEAD, STRIBECK_BIT, TERMS
from linid.simulation.binding import allocating, compiled
from linid.simulation.lane_functions import exp_lanes, sine_cosine_lanes
from linid.simulation.lanes import LANES, bits_of, lanes_at, put_lanes
from linid.simulation.own_terms import (
    driven_acceleration,
    of_one,
    of_two,
    periodic_value,
    ramped,
    spline_value,
    surface_value,
)

AT_ONCE = 256  # samples, a multiple of LANES: all rows of a program stay near the processor
_VARIABLES = OWN_STACK - OWN_VARIABLES
_ROWS = _VARIABLES + layout.STACK + 1  # and an operand
_PLAIN = 1e4  # rad, up to which `sine_cosine_lanes` is exact to the last bits
_MOST = 700.0  # beyond it, e^x leaves the numbers that `exp_lanes` knows
_LOAD, _NUMBER, _RAMP, _SPLINE, _SURFACE = layout.LOAD, layout.NUMBER, layout.RAMP, layout.SPLINE, layout.SURFACE
_PERIODIC, _WAVE, _SIN, _COS, _EXP = layout.PERIODIC, layout.WAVE, layout.SIN, layout.COS, layout.EXP
_ABS = layout.ABS
_ADD, _SUBTRACT, _MULTIPLY, _DIVIDE = layout.ADD, layout.SUBTRACT, layout.MULTIPLY, layout.DIVIDE
_MAX, _WITH_NUMBER, _WITH_LOAD = layout.MAX, layout.WITH_NUMBER, layout.WITH_LOAD


@compiled
def are_within(rows, at, most):
    """Whether no number of a row is larger. rows: flat, each of AT_ONCE numbers; at: where the first of this one is."""
    beyond = 0
    for block in range(at, at + AT_ONCE, LANES):
        beyond |= bits_of(~(abs(lanes_at(rows, block)) <= most))  # or is no number
    return beyond == 0


@compiled
def fill(rows, at, value):
    """Put a number into a whole row."""
    for k in range(at, at + AT_ONCE):
        rows[k] = value


@compiled
def put_operand(p, place, rows, at):
    """Put the variable or parameter with this place in the vector into a row."""
    if OWN_VARIABLES <= place < OWN_STACK:
        source = AT_ONCE * (place - OWN_VARIABLES) - at
        for block in range(at, at + AT_ONCE, LANES):
            put_lanes(rows, block, lanes_at(rows, source + block))
    else:
        fill(rows, at, p[place])


@compiled
def waved(rows, at, sine, cosine):
    """Make sine sin x + cosine cos x of a row."""
    if are_within(rows, at, _PLAIN):
        for block in range(at, at + AT_ONCE, LANES):
            along_sine, along_cosine = sine_cosine_lanes(lanes_at(rows, block))
            put_lanes(rows, block, sine * along_sine + cosine * along_cosine)
    else:
        for k in range(at, at + AT_ONCE):
            rows[k] = sine * math.sin(rows[k]) + cosine * math.cos(rows[k])


@compiled
def exponential(rows, at):
    """Make e^x of a row."""
    if are_within(rows, at, _MOST):
        for block in range(at, at + AT_ONCE, LANES):
            put_lanes(rows, block, exp_lanes(lanes_at(rows, block)))
    else:
        for k in range(at, at + AT_ONCE):
            rows[k] = math.exp(rows[k])


@compiled
def one_over(code, rows, at):
    """An operation on one number, of a row."""
    if code == _SIN:
        waved(rows, at, 1.0, 0.0)
    elif code == _COS:
        waved(rows, at, 0.0, 1.0)
    elif code == _EXP:
        exponential(rows, at)
    elif code == _ABS:
        for block in range(at, at + AT_ONCE, LANES):
            put_lanes(rows, block, abs(lanes_at(rows, block)))
    else:
        for k in range(at, at + AT_ONCE):
            rows[k] = of_one(code, rows[k])


@compiled
def two_over(code, rows, at):
    """An operation on two numbers, of a row and the next one."""
    end, other = at + AT_ONCE, AT_ONCE
    if code == _ADD:
        for block in range(at, end, LANES):
            put_lanes(rows, block, lanes_at(rows, block) + lanes_at(rows, block + other))
    elif code == _SUBTRACT:
        for block in range(at, end, LANES):
            put_lanes(rows, block, lanes_at(rows, block) - lanes_at(rows, block + other))
    elif code == _MULTIPLY:
        for block in range(at, end, LANES):
            put_lanes(rows, block, lanes_at(rows, block) * lanes_at(rows, block + other))
    elif code == _DIVIDE:
        for block in range(at, end, LANES):
            put_lanes(rows, block, lanes_at(rows, block) / lanes_at(rows, block + other))
    else:
        for k in range(at, end):
            rows[k] = of_two(code, rows[k], rows[k + other])


@compiled
def pushed_over(p, pc, code, rows, at):
    """Put a number into a row above all others; its own numbers stand at pc. Returns where the next operation does."""
    if code == _NUMBER:
        fill(rows, at, p[pc])
        return pc + 1
    put_operand(p, int(p[pc]), rows, at)
    if code == _LOAD:
        return pc + 1
    for k in range(at, at + AT_ONCE):
        rows[k] = ramped(p, pc, rows[k])
    return pc + 5


@compiled
def curve_over(p, pc, code, rows, at):
    """Make a curve or surface of a row, or of the one below and it. Returns where the row stands and the next operation
    does."""
    if code == _SPLINE:
        for k in range(at, at + AT_ONCE):
            rows[k] = spline_value(p, pc, rows[k])
        return at, pc + 4
    if code == _PERIODIC:
        for k in range(at, at + AT_ONCE):
            rows[k] = periodic_value(p, pc, rows[k])
        return at, pc + 3
    if code == _WAVE:
        waved(rows, at, p[int(p[pc])], p[int(p[pc + 1])])
        return at, pc + 2
    at -= AT_ONCE
    for k in range(at, at + AT_ONCE):
        rows[k] = surface_value(p, pc, rows[k], rows[k + AT_ONCE])
    return at, pc + 7


@compiled
def program_over(p, pc, stop, rows):
    """Run the program from pc to stop. rows: the variables, and behind them the stack. Returns where the row stands
    that holds what it gives."""
    at = AT_ONCE * (_VARIABLES - 1)
    while pc < stop:
        code = int(p[pc])
        pc += 1
        if code > _MAX:
            if code > _MAX + _WITH_NUMBER:
                put_operand(p, int(p[pc]), rows, at + AT_ONCE)
                two_over(code - _WITH_LOAD, rows, at)
            else:
                pushed_over(p, pc, _NUMBER, rows, at + AT_ONCE)
                two_over(code - _WITH_NUMBER, rows, at)
            pc += 1
        elif code >= _ADD:
            at -= AT_ONCE
            two_over(code, rows, at)
        elif code <= _RAMP:
            at += AT_ONCE
            pc = pushed_over(p, pc, code, rows, at)
        elif code <= _WAVE:
            at, pc = curve_over(p, pc, code, rows, at)
        else:
            one_over(code, rows, at)
    return at


@compiled
def put_variables_over(p, on, push, samples, first, rows):
    """Put the variables of own terms at samples from the first on into their rows, but for those of the memory."""
    count = min(AT_ONCE, samples.y.size - first)
    for k in range(AT_ONCE):
        s = first + min(k, count - 1)
        t = samples.t_start + s * samples.dt
        rows[k], rows[AT_ONCE + k] = t, p[ELAPSED] + t
        rows[2 * AT_ONCE + k], rows[3 * AT_ONCE + k], rows[4 * AT_ONCE + k] = samples.y[s], samples.v[s], push[s]
        if on & ACCELERATION_BIT:
            rows[9 * AT_ONCE + k] = driven_acceleration(p, push[s], samples.v[s])
        if on & STRIBECK_BIT:
            rows[10 * AT_ONCE + k] = stribeck(samples.v[s], p[0], p[1], p[2], p[3]) / p[0]


@allocating
def own_sums(p, on, part, push, samples, out):
    """Fill in the sums in N of the forces (part 0) or levels of friction (part 1) of all own terms without memory.

    push: the motor's force in N; out: (n,), nan where it is no number."""
    rows = np.zeros(_ROWS * AT_ONCE)
    for first in range(0, out.size, AT_ONCE):
        end = min(first + AT_ONCE, out.size)
        put_variables_over(p, on, push, samples, first, rows)
        for k in range(first, end):
            out[k] = 0.0
        for number in range(TERMS):
            head = OWN_START + HEAD * number + 2 * part
            start, stop = int(p[head]), int(p[head + 1])
            if stop > start:
                at = program_over(p, start, stop, rows)
                for k in range(first, end):
                    out[k] += rows[at + k - first]
        for k in range(first, end):
            if not abs(out[k]) < math.inf:
                out[k] = math.nan
