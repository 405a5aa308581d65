"""Simulations in the lanes of a block, driven on until one of them has to leave it (lockstep.py)."""

from __future__ import annotations

import math

import numpy as np

from linid.simulation.binding import compiled, inlined
from linid.simulation.course import parabola_at
from linid.simulation.forces import Axis
from linid.simulation.lane_functions import phase_force_lanes, phi_of_lanes
from linid.simulation.lanes import LANES, bits_of, count_of, gathered, lanes_at, put_lanes, select
from linid.simulation.lockstep_block import (
    ALONE,
    CANDIDATE,
    DONE,
    END,
    FAST,
    FORCE,
    GLIDE,
    GLIDE_2,
    GLIDE_3,
    GLIDE_H,
    GOING,
    INTERVAL,
    LEAPS,
    LEFT,
    NEXT,
    RECORDING,
    SIZE,
    SLOWEST,
    TABLED,
    TICK,
    V,
    W,
    Y,
    bristles_in,
    moving_in,
    put_row,
    row,
)
from linid.simulation.lockstep_steps import WHOLE, Moving, followed, foreseen, slid, strayed
from linid.simulation.splines_at import inputs_at
from linid.simulation.steps import REST_BRISTLE, REST_SPEED, is_steady


@compiled
def new_splines(block, coefficients, bits):
    """Put in the splines of the intervals that the lanes of these bits have come to."""
    rows, lanes = block.splines.shape  # not constants, as short loops of known length would be unrolled
    for lane in range(lanes):
        if bits >> lane & 1:
            n = int(block.values[INTERVAL, lane])
            block.splines[0, lane] = n
            for k in range(rows - 1):
                block.splines[1 + k, lane] = coefficients[n, k >> 2, k & 3]


@inlined
def spline_lanes(splines, first, x):
    """The spline whose coefficients begin with row `first`, x s after each lane's sample: `spline_at` for lanes."""
    c_0, c_1 = row(splines, first), row(splines, first + 1)
    return ((row(splines, first + 3) * x + row(splines, first + 2)) * x + c_1) * x + c_0


@inlined
def currents_lanes(splines, x):
    """The three inputs x s after each lane's sample."""
    first = np.int64(1)
    u, v = spline_lanes(splines, first, x), spline_lanes(splines, first + 4, x)
    return u, v, spline_lanes(splines, first + 8, x)


@compiled
def other_forces(terms, motor, block, way, bits):
    """Forces in N of a motor whose field is no table of harmonics, lane by lane, at two positions and times; they take
    the place of the times that `block.room` holds behind the positions."""
    code, _, table = motor
    for lane in range(block.places.shape[1]):
        if bits >> lane & 1:
            n = int(block.values[INTERVAL, lane])
            p = way.params[block.places[CANDIDATE, lane]]
            axis = Axis(0, True, code, 0, 0.0, 0.0, p, table)
            for k in range(2):
                inputs = inputs_at(way.coefficients, n, block.room[2 + k, lane])
                block.room[2 + k, lane] = terms.motor.untabled(axis, block.room[k, lane], inputs)


@inlined
def forces_where(terms, motor, block, way, asked, y, x):
    """Forces in N in the middle and at the end of steps at the positions y in m, x: s from the sample before to both;
    where the mask `asked` holds. motor: its code, the most harmonics that a lane's field has, and a table's shape."""
    mid = end = 0.0 * x[0]
    harmonics = motor[1]
    if harmonics > 0:
        first, second = currents_lanes(block.splines, x[0]), currents_lanes(block.splines, x[1])
        mid = phase_force_lanes(y[0], first, block.field, harmonics)
        end = phase_force_lanes(y[1], second, block.field, harmonics)
    others = asked & (row(block.field, TABLED) < 0.5)
    if bits_of(others) != 0:
        put_lanes(block.room, 0, y[0])
        put_lanes(block.room, LANES, y[1])
        put_lanes(block.room, 2 * LANES, x[0])
        put_lanes(block.room, 3 * LANES, x[1])
        other_forces(terms, motor, block, way, bits_of(others))
        mid = select(others, lanes_at(block.room, 2 * LANES), mid)
        end = select(others, lanes_at(block.room, 3 * LANES), end)
    return mid, end


@inlined
def come_to_splines(block, way, asked):
    """Have the splines of the intervals that the lanes of the mask `asked` are in."""
    other = asked & (lanes_at(block.splines, 0) != row(block.values, INTERVAL))
    if bits_of(other) != 0:
        new_splines(block, way.coefficients, bits_of(other))


@compiled
def forces_within(terms, motor, block, way, within, x):
    """Forces in N in the middle and at the end of steps that are no base steps, where measured positions have them; x:
    s from the sample before to both."""
    come_to_splines(block, way, within)
    y = spline_lanes(block.splines, np.int64(13), x[0]), spline_lanes(block.splines, np.int64(13), x[1])
    return forces_where(terms, motor, block, way, within, y, x)


@compiled
def forces_free(terms, motor, block, way, powered, step):
    """Forces in N in the middle and at the end of steps where the simulation itself will be, 0 where none acts. step:
    the motion, the predicted speed in its middle, and s from the sample before to its end and from its begin."""
    moving, v_mid, x, h = step
    mid = end = 0.0 * x
    if bits_of(powered) != 0:
        come_to_splines(block, way, powered)
        half = 0.5 * h
        y = moving.y + 0.5 * half * (moving.v + v_mid), moving.y + h * v_mid
        mid, end = forces_where(terms, motor, block, way, powered, y, (x - half, x))
        mid, end = select(powered, mid, 0.0), select(powered, end, 0.0)
    return mid, end


@inlined
def point_at(way, values, ahead):
    """Each lane's number of the point of base steps that lies so many finest steps after the sample before."""
    return way.pieces * row(values, INTERVAL) + row(values, RECORDING) + ahead * (2.0 / WHOLE)


@inlined
def shares_of(way, values, middle):
    """The first point of each lane's base step as a number, and weights of its three points in the middle and at the
    end of the step."""
    begin = row(values, DONE) * (1.0 / WHOLE)
    whole = (begin + 2.0**52) - 2.0**52
    whole = select(whole > begin, whole - 1.0, whole)
    share = begin - whole
    size = middle.size * (1.0 / WHOLE)
    return point_at(way, values, WHOLE * whole), parabola_at(share + 0.5 * size), parabola_at(share + size)


@inlined
def weighted(weights, first, second, third):
    """A sum with three weights."""
    return weights[0] * first + weights[1] * second + weights[2] * third


@compiled
def forces_between(way, values, middle, within):
    """Forces in N in the middle and at the end of steps that are no base steps, where all are told already: by the
    parabola through the three points of the base step."""
    point, mid_weights, end_weights = shares_of(way, values, middle)
    point = select(within, point, 0.0)
    first, second = gathered(way.forces, point), gathered(way.forces, point + 1.0)
    third = gathered(way.forces, point + 2.0)
    return weighted(mid_weights, first, second, third), weighted(end_weights, first, second, third)


@inlined
def forces_at(way, values, ahead, powered):
    """Forces in N in the middle and at the end of base steps, 0 where none acts; ahead: where they end."""
    mid = end = 0.0 * ahead
    if bits_of(powered) != 0:
        point = select(powered, point_at(way, values, ahead), 1.0)
        mid = select(powered, gathered(way.forces, point - 1.0), 0.0)
        end = select(powered, gathered(way.forces, point), 0.0)
    return mid, end


@compiled
def write_samples(terms, block, way, came, strayed_bits, rest_bits):
    """Write the sample that the lanes of the bits `came` have come to, and all still to come of those that strayed and
    of those that rest for good."""
    for lane in range(block.places.shape[1]):
        if came >> lane & 1:
            candidate, k = block.places[CANDIDATE, lane], block.places[NEXT, lane]
            y, v = block.values[Y, lane], block.values[V, lane]
            block.places[NEXT, lane] = until = k + 1
            if rest_bits >> lane & 1:
                until = block.places[END, lane]
            if strayed_bits >> lane & 1:
                y = v = np.nan
                until = block.places[END, lane]
            for sample in range(k, until):
                way.y_out[candidate, sample] = y
            terms.beside.written(way.beside, block, lane, k, until, strayed_bits >> lane & 1)
            if way.v_out.size > 0:
                way.v_out[candidate, k] = v
                for sample in range(k + 1, until):
                    way.v_out[candidate, sample] = 0.0 * v


@compiled
def leap(terms, motor, block, way, moving, leaps):
    """Put the force of the inputs that act from the sample on, where these differ from those before it."""
    come_to_splines(block, way, leaps)
    now = 0.0 * moving.y
    force, _ = forces_where(terms, motor, block, way, leaps, (moving.y, moving.y), (now, now))
    put_row(block.values, FORCE, select(leaps, force, row(block.values, FORCE)))


@inlined
def at_samples(terms, motor, block, way, moving, ends):
    """What happens where lanes have come to a sample; the mask of those whose simulation is over."""
    values = block.values
    stray = ends & strayed(moving)
    rests = (row(values, ALONE) > 0.0) & (abs(moving.v) < REST_SPEED) & (abs(moving.w) < REST_BRISTLE)
    rests = rests & ends
    write_samples(terms, block, way, bits_of(ends), bits_of(stray), bits_of(rests))
    left = select(ends, row(values, LEFT) - 1.0, row(values, LEFT))
    put_row(values, LEFT, left)
    put_row(values, DONE, select(ends, 0.0, row(values, DONE)))
    put_row(values, INTERVAL, select(ends, row(values, INTERVAL) + 1.0, row(values, INTERVAL)))
    over = ends & (stray | rests | (left < 0.5))
    if way.free:
        leaps = ends & ~over & (row(values, LEAPS) > 0.0)
        if bits_of(leaps) != 0:
            leap(terms, motor, block, way, moving, leaps)
    return over


@inlined
def moved_on(terms, motor, block, way, moving, new, took, ahead):
    """Put the lanes of the mask `took` where a step has brought them; returns their motion, and the mask of those whose
    simulation is over."""
    values = block.values
    new = Moving(
        select(took, new.y, moving.y),
        select(took, new.v, moving.v),
        select(took, new.w, moving.w),
        select(took, new.force, moving.force),
    )
    put_row(values, Y, new.y)
    put_row(values, V, new.v)
    put_row(values, W, new.w)
    put_row(values, FORCE, new.force)
    put_row(values, DONE, select(took, ahead, row(values, DONE)))
    ends = took & (ahead == way.whole)
    over = ends & ~ends
    if bits_of(ends) != 0:
        over = at_samples(terms, motor, block, way, new, ends)
    return new, over


@inlined
def is_sliding(values, bristles, moving):
    """Where the next step is one of fast sliding."""
    fast = (row(values, SIZE) == WHOLE) & (abs(moving.v) > row(values, FAST))
    return fast & is_steady(bristles, moving)


@inlined
def glides(values, bristles, h, going):
    """Weights of fast sliding over h seconds: `glide_weights`, kept while h stays the same."""
    other = going & (h != row(values, GLIDE_H))
    if bits_of(other) != 0:
        first, second, third = phi_of_lanes(-bristles.sigma_2 * h / bristles.mass, other)
        put_row(values, GLIDE_H, select(other, h, row(values, GLIDE_H)))
        put_row(values, GLIDE, select(other, first, row(values, GLIDE)))
        put_row(values, GLIDE_2, select(other, second, row(values, GLIDE_2)))
        put_row(values, GLIDE_3, select(other, third, row(values, GLIDE_3)))
    return row(values, GLIDE), row(values, GLIDE_2), row(values, GLIDE_3)


@compiled
def slide(terms, motor, block, way):
    """Have all lanes slide fast until one has to leave; the bits of those whose simulation is over, of those that must
    be followed, and the number of steps. motor: as in `forces_where`."""
    values = block.values
    steps = 0
    while True:
        going, alone, done = row(values, GOING) > 0.0, row(values, ALONE) > 0.0, row(values, DONE)
        bristles, moving = bristles_in(values), moving_in(values)
        size = select(alone, way.whole - done, WHOLE)
        h = size * row(values, TICK)
        ahead = done + size
        weights = glides(values, bristles, h, going)
        powered = going & ~alone
        if way.free:
            drag = math.copysign(bristles.coulomb, moving.v)
            v_mid = moving.v + 0.5 * h * (moving.force - drag - bristles.sigma_2 * moving.v) / bristles.mass
            step = moving, v_mid, ahead * row(values, TICK), h
            forces = forces_free(terms, motor, block, way, powered, step)
        else:
            forces = forces_at(way, values, ahead, powered)
        new = slid(bristles, moving, h, weights, forces)
        slow = (math.copysign(new.v, moving.v) != new.v) | (abs(new.v) <= row(values, SLOWEST))
        took = going & ~slow
        terms.beside.slid(way, values, bristles, moving, weights, (h, ahead, forces), (took, powered))
        new, over = moved_on(terms, motor, block, way, moving, new, took, ahead)
        steps += count_of(took)
        leave = going & ~over & (slow | ~is_sliding(values, bristles, new))
        if bits_of(leave | over) != 0:
            return bits_of(over), bits_of(leave), steps


@compiled
def follow(terms, motor, block, way):
    """Have the bristle followed in all lanes until one has to leave; the bits of those whose simulation is over, of
    those that slide fast, and the number of steps. motor: as in `forces_where`."""
    values = block.values
    steps = 0
    while True:
        going, alone, done = row(values, GOING) > 0.0, row(values, ALONE) > 0.0, row(values, DONE)
        bristles, moving, tick = bristles_in(values), moving_in(values), row(values, TICK)
        middle = foreseen(bristles, moving, row(values, SIZE), tick, way.tolerance, going)
        ahead = done + middle.size
        powered, x = going & ~alone, ahead * tick
        if way.free:
            mid, end = forces_free(terms, motor, block, way, powered, (moving, middle.v, x, middle.h))
        else:
            within = powered & (middle.size < WHOLE)
            mid, end = forces_at(way, values, ahead, powered & ~within)
            if bits_of(within) != 0:
                forces = mid, end
                if way.given:
                    forces = forces_between(way, values, middle, within)
                else:
                    forces = forces_within(terms, motor, block, way, within, (x - 0.5 * middle.h, x))
                mid, end = select(within, forces[0], mid), select(within, forces[1], end)
        new = followed(bristles, moving, middle, (mid, end), going)
        terms.beside.followed(way, values, bristles, moving, middle, (mid, end), (going, powered))
        twice = 2.0 * middle.size
        pairs = ahead / twice
        # Whether that is a whole number: 2^52 takes halves away.
        longer = middle.calm & (middle.size < WHOLE) & ((pairs + 2.0**52) - 2.0**52 == pairs)
        put_row(values, SIZE, select(longer, twice, middle.size))
        new, over = moved_on(terms, motor, block, way, moving, new, going, ahead)
        steps += count_of(going)
        leave = going & ~over & is_sliding(values, bristles, new)
        if bits_of(leave | over) != 0:
            return bits_of(over), bits_of(leave), steps
