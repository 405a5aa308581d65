"""Acceleration along a measured motion with its derivatives, compiled: one candidate, and many directions at once.

For LuGre friction, with all effects and own terms. The bristle answers all directions by the same few factors; what
these do besides is told by along_beside.py.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from linid.simulation.along import (
    REST_AVERAGE,
    Resistance,
    decay_means,
    derating_at,
    outer_force,
    pieces_of,
    reached_by,
)
from linid.simulation.along_beside import (
    AlongSlopes,
    Here,
    begun_anew,
    forces_beside,
    level_beside,
    room_beside,
    started_beside,
    states_beside,
    told_beforehand,
)
from linid.simulation.along_between import SHORT, told_between
from linid.simulation.along_between_slopes import answers_at_once, between_slopes, put_between
from linid.simulation.along_effects import effected_before, given_over, samples_of
from linid.simulation.along_motion import MeasuredMotion, advance_on, inputs_of_sample, midway
from linid.simulation.along_readings import tell_readings, write_readings
from linid.simulation.along_ways import (
    ASKED,
    BEFORE_LAST,
    BRISTLE,
    DERATES,
    FACTOR,
    FORCE,
    HOLDS,
    LAST,
    LATE,
    LEFT,
    LEVEL,
    LOAD,
    MEAN,
    MOVES,
    READS,
    TOLD,
    WRITTEN,
    some_have,
    some_lack,
)
from linid.simulation.binding import allocating, compiled, inlined
from linid.simulation.bundle import Bundle
from linid.simulation.course import measured_course, stretch_of
from linid.simulation.forces import axis_of, bristles_of
from linid.simulation.friction_slopes import level_slopes
from linid.simulation.lanes import LANES, lanes_at, put_lanes
from linid.simulation.slope_steps import bends


class Ends(NamedTuple):
    """How the bristle at the end of a piece, its mean and that with a growing weight answer the bristle at its
    beginning (of) and the deflection of steady sliding (by)."""

    end_of: Any
    end_by: Any
    mean_of: Any
    mean_by: Any
    late_of: Any
    late_by: Any


@inlined
def mean_slopes(x, decay, first, second):
    """Derivatives by x of the means of `decay_means`."""
    if x < SHORT:
        return -0.5 + x * (1.0 / 3.0 - 0.125 * x), -1.0 / 3.0 + x * (0.25 - 0.1 * x)
    by_first = (decay - first) / x
    return by_first, (by_first + decay - second) / x


@compiled
def rest_beside(bristles, resistance, w, force, dt, room):
    """The bristle of a resting axis (`bristle_at_rest`) with its slopes."""
    carried, table, width, sigma_0 = room.carried, room.table, room.width, bristles.sigma_0
    most = resistance.level * (bristles.static + resistance.load)
    asked = force / resistance.factor
    held = min(max(asked, -most), most) / sigma_0
    drawn = min(1.0, dt / REST_AVERAGE)
    by_force = by_level = 0.0
    if abs(asked) <= most:
        by_force = 1.0 / resistance.factor
    else:
        by_level = math.copysign(1.0, asked)
    for block in range(0, width, LANES):
        force_by = lanes_at(carried, FORCE * width + block) - asked * lanes_at(carried, FACTOR * width + block)
        level_by = (bristles.static + resistance.load) * lanes_at(carried, LEVEL * width + block)
        added_by = lanes_at(table, width + block) + lanes_at(carried, LOAD * width + block)
        level_by = level_by + resistance.level * added_by
        by = by_force * force_by + by_level * level_by - held * lanes_at(table, 4 * width + block)
        before = lanes_at(carried, BRISTLE * width + block)
        put_lanes(carried, BRISTLE * width + block, before + drawn * ((1.0 / sigma_0) * by - before))
    return w + drawn * (held - w)


@inlined
def carry_bristles(room, curve_by, shares, ends):
    """Take the slopes of the bristle along one piece of the way between two samples. curve_by: of the friction curve;
    shares: of it, of what effects make of it and of the stiffness in the deflection of steady sliding."""
    carried, table, width = room.carried, room.table, room.width
    by_coulomb, by_static, by_velocity, by_exponent = curve_by
    for block in range(0, width, LANES):
        by = by_coulomb * lanes_at(table, block) + by_static * lanes_at(table, width + block)
        by = by + by_velocity * lanes_at(table, 2 * width + block) + by_exponent * lanes_at(table, 3 * width + block)
        by = by + lanes_at(carried, LOAD * width + block)
        by = shares[0] * by + shares[1] * lanes_at(carried, LEVEL * width + block)
        by = by - shares[2] * lanes_at(table, 4 * width + block)
        before = lanes_at(carried, BRISTLE * width + block)
        mean, late = lanes_at(carried, MEAN * width + block), lanes_at(carried, LATE * width + block)
        put_lanes(carried, BRISTLE * width + block, ends.end_of * before + ends.end_by * by)
        put_lanes(carried, MEAN * width + block, mean + ends.mean_of * before + ends.mean_by * by)
        put_lanes(carried, LATE * width + block, late + ends.late_of * before + ends.late_by * by)


@inlined
def told_curve(bristles, told, k, speed, bent):
    """The friction curve between sample k and the next with its derivatives by the parameters (`level_slopes`)."""
    coulomb, _, stribeck_velocity, exponent = bristles[:4]
    power, left, curve = told.power[k], told.decayed[k], told.curve[k]
    ratio, excess = abs(speed) / stribeck_velocity, curve - coulomb
    by_exponent = -excess * power * math.log(ratio) if bent and ratio > 0.0 else 0.0
    return curve, (1.0 - left, left, excess * exponent * power / stribeck_velocity, by_exponent)


@inlined
def bristle_beside(bristles, resistance, w, way, bent, told, k, room):
    """The bristle after the interval between sample k and the next with its means (`bristle_along`), and the slopes of
    all three put in; told: as of `told_between`."""
    coulomb, static, stribeck_velocity, exponent, sigma_0 = bristles[:5]
    pieces = pieces_of(way)
    scale = 1.0 / pieces
    done = mean = late = 0.0
    for piece in range(pieces):
        reached = reached_by(piece, pieces, way)
        part, done = reached - done, reached
        speed = part * pieces / way[3]
        if pieces == 1:
            curve, curve_by = told_curve(bristles, told, k, speed, bent)
        else:
            slopes = level_slopes(speed, coulomb, static, stribeck_velocity, exponent, bent)
            curve, curve_by = slopes.level, slopes.level_by[1:]
        sign = -1.0 if part < 0.0 else 1.0
        share = sign * resistance.level / sigma_0
        level = curve + resistance.load
        rest = share * level
        passed = abs(part / rest)
        if pieces == 1 and told.kept.size > 0:
            decay, first, second = told.kept[k], told.mean_kept[k], told.late_kept[k]
        else:
            decay = math.exp(-passed)
            first, second = decay_means(passed, decay)
        started = w - rest
        by_first, by_second = mean_slopes(passed, decay, first, second)
        whole = rest + started * first
        w = rest + started * decay
        mean += whole * scale
        late += (piece * whole + 0.5 * rest + started * second) * scale * scale
        # by the deflection at the beginning, and by that of steady sliding
        turned = started * passed / rest
        end_by, mean_by = 1.0 - decay + turned * decay, 1.0 - first - turned * by_first
        late_by = piece * mean_by + 0.5 - second - turned * by_second
        late_of = (piece * first + second) * scale * scale
        late_by *= scale * scale
        by_level, by_stiffness = sign * level / sigma_0, rest / sigma_0
        ends = Ends(decay, end_by, scale * first, scale * mean_by, late_of, late_by)
        carry_bristles(room, curve_by, (share, by_level, by_stiffness), ends)
    return w, mean, late


@inlined
def write_outer(bristles, here, a, room):
    """Put in what the outer forces at sample k give the sample before."""
    carried, table, width, mass = room.carried, room.table, room.width, bristles.mass
    k, v = here.k, here.v
    outer = (here.force - bristles.sigma_2 * v) / mass
    for block in range(0, width, LANES):
        now = lanes_at(carried, FORCE * width + block) - v * lanes_at(table, 6 * width + block)
        now = (1.0 / mass) * (now - outer * lanes_at(table, 7 * width + block))
        before, last = lanes_at(carried, BEFORE_LAST * width + block), lanes_at(carried, LAST * width + block)
        put_lanes(carried, BEFORE_LAST * width + block, last)
        put_lanes(carried, LAST * width + block, now)
        put_lanes(carried, WRITTEN * width + block, (1.0 / 12.0) * (before + 10.0 * last + now))
    if k > 1:
        for c in range(a.shape[0]):
            a[c, k - 1] += carried[WRITTEN * width + c]


@inlined
def write_bristle(bristles, factor, here, means, a, room):
    """Put in what the bristle gives sample k. here: its number and the sampling period in s; means: of the intervals
    before and after it (`bristle_along`)."""
    carried, table, width, sigma_0 = room.carried, room.table, room.width, bristles.sigma_0
    k, dt = here
    mean_before, late_before, mean, late = means
    stiff, damped = late_before + mean - late, (mean - mean_before) / dt
    bristle, damping = factor / bristles.mass, bristles.sigma_1 / dt
    held = (sigma_0 * stiff + bristles.sigma_1 * damped) / bristles.mass
    for block in range(0, width, LANES):
        mean_by, late_by = lanes_at(carried, MEAN * width + block), lanes_at(carried, LATE * width + block)
        by = lanes_at(carried, LEFT * width + block) + sigma_0 * (mean_by - late_by) + damping * mean_by
        by = by + stiff * lanes_at(table, 4 * width + block) + damped * lanes_at(table, 5 * width + block)
        factor_by = lanes_at(carried, FACTOR * width + block) - bristle * lanes_at(table, 7 * width + block)
        put_lanes(carried, LEFT * width + block, sigma_0 * late_by - damping * mean_by)
        put_lanes(carried, WRITTEN * width + block, -bristle * by - held * factor_by)
        put_lanes(carried, MEAN * width + block, 0.0 * mean_by)
        put_lanes(carried, LATE * width + block, 0.0 * mean_by)
    for c in range(a.shape[0]):
        a[c, k] = carried[WRITTEN * width + c]


@allocating
def along_slopes_one(terms, candidates, directions, recording, motion, found):
    """Derivatives of the acceleration along a measured motion of one recording; recording: inputs of all and its
    number."""
    inputs, r = recording
    stretch = stretch_of(candidates, inputs, 0, r, 0, motion.y.size)
    axis = axis_of(terms, candidates, stretch)
    bristles = bristles_of(terms, axis, stretch.added_mass)
    course = measured_course(terms, axis, stretch)
    acts, on, dt, count, y, v = terms.acts, axis.on, stretch.dt, stretch.count, motion.y, motion.v
    bent = bends(directions.table)
    room = room_beside(terms, axis, directions, candidates, recording)
    w = begun_anew(terms, axis, bristles, course, motion)
    samples = samples_of(terms, axis, course, motion)
    given = given_over(terms, axis, candidates, samples, effected_before(count))
    started_beside(terms, candidates, recording, motion, w, given, room)
    told_beforehand(terms, axis, directions.touched, samples, given, room)
    told = told_between(terms, axis, candidates, bristles, course, motion, motion.standstill[0:0])
    asks = some_lack(room.ways, TOLD | DERATES) or some_have(room.ways, HOLDS)
    stirs, reads = some_have(room.ways, MOVES | ASKED), some_have(room.ways, READS)
    by_sample = on & (acts.stateful_sensor | acts.delay) != 0
    if reads and not by_sample:
        tell_readings(terms, axis, samples, found, room)
    level, mean, late = (1.0, 0.0), 0.0, 0.0  # of friction: the factor on it, and N added before
    by_level, at_once = on & (acts.level | acts.load) != 0, answers_at_once(terms, on)
    between = between_slopes(terms, axis, candidates, course, motion, told, room)
    for k in range(count):
        t = stretch.t_start + k * dt
        currents = inputs_of_sample(terms, axis, course, motion, k)
        derating = derating_at(terms, axis, k, (t, y[k], v[k]), given)
        force = outer_force(terms, axis, motion, k, t, currents, given, derating)
        here = Here(k, t, y[k], v[k], currents, force, derating)
        factor = forces_beside(terms, axis, course, here, given, asks, room)
        if motion.standstill[k]:
            if by_level:
                level = level_beside(terms, axis, course, (1.0 * k, t, y[k], v[k], currents), room)
            w = rest_beside(bristles, Resistance(factor, *level), w, force, dt, room)
        write_outer(bristles, here, found.a, room)
        if reads and by_sample:
            write_readings(terms, axis, course, here, found, room)
        before = mean, late
        mean = late = 0.0
        if k < count - 1:
            if by_level and at_once:
                level = told.level[k], told.load[k]
                put_between(between, k, room)
            if (by_level and not at_once) or on & acts.advance:
                where = midway(terms, axis, course, motion, k)
                if by_level and not at_once:
                    level = level_beside(terms, axis, course, where, room)
                if on & acts.advance:
                    advance_on(terms, axis, course, motion, where)
                    if stirs:
                        states_beside(terms, axis, course, where, (v[k + 1] - v[k]) / dt, room)
            way = y[k + 1] - y[k], v[k], v[k + 1], dt, k
            w, mean, late = bristle_beside(bristles, Resistance(factor, *level), w, way, bent, told, k, room)
        write_bristle(bristles, factor, (k, dt), (*before, mean, late), found.a, room)


def along_slope_tasks_with(terms: Bundle) -> Any:
    """`along_slope_tasks` with these terms, for Python to call."""

    def along_slope_tasks(candidates, inputs, motion, directions, begin, end, found):
        """`along_slopes_one` for recordings begin..end-1.

        candidates: the one, then those a FORCE_STEP along each direction; motion: of all recordings.
        """
        for r in range(begin, end):
            a, b = inputs.sample_offsets[r], inputs.sample_offsets[r + 1]
            part = MeasuredMotion(
                motion.y[a:b], motion.v[a:b], motion.inputs[:, a:b], motion.standstill[a:b], motion.wanted
            )
            reading = found.reading[:, a:b] if found.reading.size > 0 else found.reading
            slopes = AlongSlopes(found.a[:, a:b], reading)
            along_slopes_one(terms, candidates, directions, (inputs, r), part, slopes)

    return along_slope_tasks
