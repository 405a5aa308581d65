"""What acts on the bristle between the samples of a measured motion, told beforehand by lanes of intervals.

The measured motion alone tells the friction curve, and with it, and what effects make of it by motion and inputs, how
far steady sliding bends the bristle and how much of what it was bent by before it keeps, where nothing that is known
only sample by sample makes more or less of friction.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from linid.physics.friction import DECAYED
from linid.physics.own_terms.layout import LEVEL_BIT, MEMORY_BIT
from linid.simulation.along_effects import Samples, driven_samples, motor_over
from linid.simulation.binding import allocating, compiled, inlined
from linid.simulation.lane_functions import exp_lanes, power_lanes
from linid.simulation.lanes import LANES, bits_of, lanes_at, padded, put_lanes, select
from linid.simulation.own_over import own_sums
from linid.simulation.own_terms import LEVEL, with_least
from linid.simulation.splines_at import late_inputs

UNEVEN = 0.1  # relative change of speed between samples, from which the bristle is followed in PIECES
PIECES = LANES
room_for = inlined(padded)
SHORT = 0.02  # deflections of steady sliding, within which means are taken by their series


class Between(NamedTuple):
    """Of each interval between samples (n or more,), or empty where not told. curve: friction at the mean speed in N;
    power: of that speed in Stribeck velocities, by the exponent; decayed: exp(-power); level: the factor that effects
    make on the curve and load; load: N that they add to it before; rest: deflection of steady sliding in m, with the
    sign of the travel. The deflection w at an interval's beginning becomes end + kept w at its end, its mean is mean +
    mean_kept w, and that with a weight that grows from 0 to 1 late + late_kept w, in m; where the speed changes by
    much, of all PIECES together. curves: friction in N at the mean speed of each piece where it does, PIECES of each
    interval; for laws that follow them."""

    curve: Any
    power: Any
    decayed: Any
    level: Any
    load: Any
    rest: Any
    end: Any
    kept: Any
    mean: Any
    mean_kept: Any
    late: Any
    late_kept: Any
    curves: Any


@inlined
def is_uneven(travel, v, v_next, dt):
    """Whether the speed changes by much between two samples."""
    return abs(v_next - v) > UNEVEN * abs(travel / dt)


@inlined
def reached_at(s, travel, v, v_next, dt):
    """How far the axis has come after a share s of the time between two samples, in m: a cubic through both with their
    speeds."""
    return s * s * (3.0 - 2.0 * s) * travel + dt * s * (1.0 - s) * ((1.0 - s) * v - s * v_next)


@inlined
def curve_lanes(bristles, speed):
    """The friction curve in N at lanes of speeds in m/s, with its power and exp(-power) (eq. 42)."""
    coulomb, static, stribeck_velocity, exponent = bristles[:4]
    ratio = abs(speed) / stribeck_velocity
    power = ratio * ratio if exponent == 2.0 else power_lanes(ratio, exponent)
    falling = ~(power > DECAYED)
    decayed = select(falling, power, 0.0)
    if bits_of(falling) != 0:
        decayed = select(falling, exp_lanes(-power), 0.0)
    return coulomb + (static - coulomb) * decayed, power, decayed


@inlined
def shares_lanes(sigma_0, travel, friction):
    """Deflection of steady sliding in m along lanes of ways in m under friction in N, and what is left of being off it:
    at the end, in the mean, and in that with a growing weight (`decay_means`)."""
    rest = friction / sigma_0
    passed = abs(travel) / rest
    decay, small = exp_lanes(-passed), passed < SHORT
    first = (1.0 - decay) / passed
    second = (first - decay) / passed
    first = select(small, 1.0 - passed * (0.5 - passed * (1.0 / 6.0)), first)
    second = select(small, 0.5 - passed * ((1.0 / 3.0) - 0.125 * passed), second)
    return select(travel < 0.0, -rest, rest), decay, first, second


@inlined
def is_asked(asked, k):
    """Whether something in the lanes of interval k is asked for; asked: by blocks of lanes, or empty where all is."""
    return asked.size == 0 or asked[k // LANES]


@compiled
def skipped(k, wanted, y, memory):
    """The next sample whose bristle is wanted (or the number of samples), and the sample from which to follow it:
    what lies farther back than `memory` (m of travel) it has forgotten."""
    goal = k
    while goal < wanted.size and not wanted[goal]:
        goal += 1
    back, travelled = goal, 0.0
    if goal < wanted.size:
        while back > k and travelled < memory:
            travelled += abs(y[back] - y[back - 1])
            back -= 1
    return goal, back


@allocating
def asked_between(motion, memory, skipping):
    """The blocks of lanes that hold an interval through which the bristle is followed (`skipped`), or empty where it is
    through all."""
    count = motion.y.size
    asked = np.zeros(room_for(count) // LANES if skipping else 0, dtype=np.bool_)
    goal = k = -1
    while skipping and k < count - 1:
        k += 1
        if k > goal:
            goal, back = skipped(k, motion.wanted, motion.y, memory)
            if goal == count:
                break
            k = max(k, back)
        asked[k // LANES] = True
    return asked


@compiled
def put_curves(bristles, dt, travel, asked, curve, power, decayed):
    """Put the friction curve at the mean speeds in; travel: in m, between samples dt seconds apart; asked: as of
    `asked_between`."""
    for block in range(0, travel.size, LANES):
        if not is_asked(asked, block):
            continue
        found = curve_lanes(bristles, lanes_at(travel, block) / dt)
        put_lanes(curve, block, found[0])
        put_lanes(power, block, found[1])
        put_lanes(decayed, block, found[2])


@compiled
def put_shares(sigma_0, travel, asked, between):
    """Put in what each interval makes of the bristle, as if its speed hardly changed; asked: as of `asked_between`."""
    for block in range(0, travel.size, LANES):
        if not is_asked(asked, block):
            continue
        friction = lanes_at(between.level, block) * (lanes_at(between.curve, block) + lanes_at(between.load, block))
        rest, kept, first, second = shares_lanes(sigma_0, lanes_at(travel, block), friction)
        put_lanes(between.rest, block, rest)
        put_lanes(between.end, block, rest - rest * kept)
        put_lanes(between.kept, block, kept)
        put_lanes(between.mean, block, rest - rest * first)
        put_lanes(between.mean_kept, block, first)
        put_lanes(between.late, block, rest * (0.5 - second))
        put_lanes(between.late_kept, block, second)


@compiled
def put_pieces(bristles, dt, motion, travel, asked, pieces, curves):
    """Put the friction curve at the mean speeds of all pieces of uneven intervals in; pieces: as of `put_uneven`."""
    begins, ends = lanes_at(pieces, 0), lanes_at(pieces, PIECES)
    for k in range(motion.y.size - 1):
        way = travel[k], motion.v[k], motion.v[k + 1], dt
        if is_uneven(*way) and is_asked(asked, k):
            part = reached_at(ends, *way) - reached_at(begins, *way)
            put_lanes(curves, k * PIECES, curve_lanes(bristles, part * (PIECES / dt))[0])


@allocating
def begun_pieces():
    """Room for PIECES, and in its first two rows where each begins and ends, in shares of the time."""
    pieces = np.empty((6, PIECES))
    for piece in range(PIECES):
        pieces[0, piece], pieces[1, piece] = piece / PIECES, (piece + 1) / PIECES
    return pieces


@compiled
def put_uneven(bristles, dt, motion, travel, asked, pieces, between):
    """Put in what uneven intervals make of it, piece by piece; asked: as of `asked_between`; pieces: (6, PIECES), of
    which the first two rows say where each begins and ends, in shares of the time."""
    begins, ends, scale = lanes_at(pieces, 0), lanes_at(pieces, PIECES), 1.0 / PIECES
    for k in range(motion.y.size - 1):
        way = travel[k], motion.v[k], motion.v[k + 1], dt
        if not is_uneven(*way) or not is_asked(asked, k):
            continue
        part = reached_at(ends, *way) - reached_at(begins, *way)
        friction = between.level[k] * (curve_lanes(bristles, part / (scale * dt))[0] + between.load[k])
        found = shares_lanes(bristles.sigma_0, part, friction)
        for row in range(4):
            put_lanes(pieces, (2 + row) * PIECES, found[row])
        end = mean = mean_kept = late = late_kept = 0.0
        kept = 1.0
        for piece in range(PIECES):
            rest, left, first, second = pieces[2, piece], pieces[3, piece], pieces[4, piece], pieces[5, piece]
            off = end - rest
            whole, whole_kept = rest + off * first, kept * first
            mean += scale * whole
            mean_kept += scale * whole_kept
            late += scale * scale * (piece * whole + 0.5 * rest + off * second)
            late_kept += scale * scale * (piece * whole_kept + kept * second)
            end, kept = rest + off * left, kept * left
        between.end[k], between.mean[k], between.late[k] = end, mean, late
        between.kept[k], between.mean_kept[k], between.late_kept[k] = kept, mean_kept, late_kept


@allocating
def samples_between(axis, course, motion, travel, by_inputs):
    """The middle between all samples. by_inputs: whether what acts there hangs on the inputs, which are 0 otherwise."""
    count, dt = motion.y.size - 1, course.dt
    y, v, inputs = np.empty(count), np.empty(count), np.zeros((3, count))
    for k in range(count):
        y[k], v[k] = motion.y[k] + 0.5 * travel[k], travel[k] / dt
    if axis.powered and by_inputs:
        for k in range(count):
            currents = late_inputs(course.coefficients, dt, (k + 0.5) * dt - course.lag)
            inputs[0, k], inputs[1, k], inputs[2, k] = currents
    return Samples(course.t_start + 0.5 * dt, dt, y, v, inputs[0], inputs[1], inputs[2])


@allocating
def travel_between(motion):
    """Travel in m between all samples, with room for lanes."""
    travel = np.zeros(room_for(motion.y.size - 1))
    for k in range(motion.y.size - 1):
        travel[k] = motion.y[k + 1] - motion.y[k]
    return travel


@allocating
def push_between(terms, axis, candidates, samples):
    """The motor's force in N in the middle between samples; 0 where no friction is made of it."""
    push = np.zeros(samples.y.size)
    if axis.powered and axis.on & terms.acts.pressed:
        driven = driven_samples(terms, axis, samples)
        push = motor_over(terms, axis, candidates, driven)
        if axis.on & terms.acts.thrust:
            factor = np.ones(push.size)
            terms.over.thrust(factor, axis.on, driven, axis.p)
            for k in range(push.size):
                push[k] *= factor[k]
    return push


@allocating
def put_loads(terms, axis, samples, push, load):
    """Put in what the motor's force `push` in N, effects and own terms add to friction in the middle between samples
    (`friction_load`)."""
    terms.over.load(load, push, axis.on, samples, axis.p)
    if axis.on & terms.acts.load & LEVEL_BIT:
        own = np.empty(push.size)
        own_sums(axis.p, axis.on, LEVEL, push, samples, own)
        for k in range(own.size):
            load[k] = with_least(axis.p, load[k] + own[k])


@inlined
def is_told_between(terms, on):
    """Whether all that effects do to friction between samples is told by the motion and the inputs alone."""
    acts = terms.acts
    if on & acts.pressed and on & (acts.stateful_drive | acts.stateful_field | acts.stateful_thrust):
        return False
    if on & acts.load and (on & acts.stateful_load or (on & LEVEL_BIT and on & MEMORY_BIT)):
        return False
    return not on & (acts.stateful_level | acts.level & acts.by_inputs)


@inlined
def hangs_on_motor(terms, on):
    """Whether what is told of the intervals hangs on the motor too, not on friction, effects and motion alone."""
    return terms.law.plain != 0 and on & terms.acts.pressed != 0 and is_told_between(terms, on)


@allocating
def nothing_between():
    """Nothing is told beforehand."""
    none = np.empty(0)
    return Between(none, none, none, none, none, none, none, none, none, none, none, none, none)


@allocating
def told_between(terms, axis, candidates, bristles, course, motion, asked):
    """What is told of the intervals of a recording: the curve, and all else where it hangs on the motion and the inputs
    alone. asked: as of `asked_between`."""
    count, dt, acts, on = motion.y.size - 1, course.dt, terms.acts, axis.on
    size, travel = room_for(count), travel_between(motion)
    rooms = np.empty((10, size))
    curve, power, decayed = rooms[0], rooms[1], rooms[2]
    put_curves(bristles, dt, travel, asked, curve, power, decayed)
    none, pieces = np.empty(0), begun_pieces()
    if terms.law.plain == 0:
        curves = np.empty(count * PIECES)
        put_pieces(bristles, dt, motion, travel, asked, pieces, curves)
        return Between(curve, power, decayed, none, none, none, none, none, none, none, none, none, curves)
    if not is_told_between(terms, on):
        return Between(curve, power, decayed, none, none, none, none, none, none, none, none, none, none)
    level, load = np.ones(size), np.zeros(size)
    if on & (acts.level | acts.load):
        samples = samples_between(axis, course, motion, travel, on & acts.by_inputs != 0)
        if on & acts.level:
            terms.over.level(level[:count], on, samples, axis.p)
        if on & acts.load:
            put_loads(terms, axis, samples, push_between(terms, axis, candidates, samples), load[:count])
    found = rooms[3], rooms[4], rooms[5], rooms[6], rooms[7], rooms[8], rooms[9]
    between = Between(curve, power, decayed, level, load, *found, none)
    put_shares(bristles.sigma_0, travel, asked, between)
    put_uneven(bristles, dt, motion, travel, asked, pieces, between)
    return between
