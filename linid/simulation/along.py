"""Acceleration along a measured motion, compiled: what the model says where position and speed are given."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.physics.friction import stribeck
from linid.physics.model import STATE_START
from linid.simulation.along_before import bristle_or_before, followed_before, is_followed_before, shared_with
from linid.simulation.along_between import (
    PIECES,
    SHORT,
    asked_between,
    hangs_on_motor,
    is_uneven,
    nothing_between,
    reached_at,
    skipped,
    told_between,
)
from linid.simulation.along_effects import effected_before, effects_shared, known_beforehand
from linid.simulation.along_motion import MeasuredMotion, advance_on, inputs_of_sample, midway_if
from linid.simulation.binding import allocating, compiled, inlined
from linid.simulation.bundle import Bundle
from linid.simulation.course import measured_course, stretch_of
from linid.simulation.forces import (
    axis_of,
    bristles_of,
    force_once,
    friction_factor,
    friction_load,
    just_set_off,
    level_factor,
    reading_error,
    start_states,
    steady_bristle,
)
from linid.simulation.splines_at import late_inputs

START_SAMPLES = 20  # over which the balance of forces at a recording's start is averaged
REST_AVERAGE = 0.03  # s, over which a resting bristle is drawn to the balance of forces
FORGOTTEN = 22.0  # breakaway deflections of travel, after which a bristle has forgotten all (to 3e-10)
FACTOR, FORCE, MEAN, LATE = range(4)  # rows of what makes the acceleration
RAISED = 4.0  # times its own, to which effects may raise friction for that to hold: no deflection then exceeds this


class AlongTraces(NamedTuple):
    """Where results land, (candidates, samples) of all tasks, (samples,) of one.

    a: m/s^2, mean of the acceleration over both neighbouring intervals with triangular weights, as second differences
    of position show it, or empty if not wanted; w: m; states: with one axis more, of hidden states; reading: m, or
    empty if no effect has a reading error.
    """

    a: Any
    w: Any
    states: Any
    reading: Any


class Resistance(NamedTuple):
    """Factors on the bristle and on the level of friction, and friction by the motor's force in N."""

    factor: Any
    level: Any
    load: Any


@inlined
def decay_means(x, decay):
    """Means over s in [0, 1] of exp(-x s) and of s exp(-x s), x >= 0; decay: exp(-x)."""
    if x < SHORT:
        return 1.0 - x * (0.5 - x / 6.0), 0.5 - x * (1.0 / 3.0 - 0.125 * x)
    first = (1.0 - decay) / x
    return first, (first - decay) / x


@compiled
def held_at_start(terms, axis, bristles, course, motion, currents, factor):
    """Deflection in m of the bristle of an axis that has just set off: it holds what the acceleration leaves."""
    y, v, t, dt = motion.y, motion.v, course.t_start, course.dt
    balance = travelled = 0.0
    for n in range(START_SAMPLES):
        inputs = late_inputs(course.coefficients, dt, n * dt - course.lag) if axis.powered else currents
        balance += force_once(terms, axis, t + n * dt, y[n], v[n], inputs)
        balance -= bristles.sigma_2 * v[n]
        travelled += y[n] - y[0]
    balance -= bristles.mass * (v[START_SAMPLES - 1] - v[0]) / ((START_SAMPLES - 1) * dt) * START_SAMPLES
    return (balance / (factor * bristles.sigma_0) - travelled) / START_SAMPLES


@inlined
def pieces_of(way):
    """How many pieces of the time between two samples the bristle is followed in, each at its mean speed."""
    travel, v, v_next, dt = way[:4]
    return PIECES if is_uneven(travel, v, v_next, dt) else 1


@inlined
def reached_by(piece, pieces, way):
    """How far the axis has come by the end of a piece of the time between two samples, in m."""
    travel, v, v_next, dt = way[:4]
    if piece == pieces - 1:
        return travel
    return reached_at((piece + 1) / pieces, travel, v, v_next, dt)


@inlined
def piece_of(bristles, resistance, told, piece, pieces, way, done):
    """One piece of the time between two samples: how far the axis has come by its end, the travel in it, and the
    deflection of steady sliding at its mean speed, in m. way: as in `bristle_along`; done: of the way before it."""
    coulomb, static, stribeck_velocity, exponent, sigma_0 = bristles[:5]
    _, level, load = resistance
    reached, k = reached_by(piece, pieces, way), way[4]
    if pieces == 1 and told.curve.size > 0:
        curve = told.curve[k]
    elif pieces > 1 and told.curves.size > 0:
        curve = told.curves[k * PIECES + piece]
    else:
        curve = stribeck((reached - done) * pieces / way[3], coulomb, static, stribeck_velocity, exponent)
    return reached, reached - done, level * (curve + load) / sigma_0


@inlined
def bristle_along(axis, bristles, resistance, told, w, way, want_means):
    """The bristle after the interval between two samples, in m, its mean, and its mean with a weight that grows from 0
    to 1. told: as of `told_between`; way: travel in m, speeds at both in m/s, time in s, number of the first one."""
    pieces = pieces_of(way)
    done = mean = late = 0.0  # of the way
    for piece in range(pieces):
        done, part, rest = piece_of(bristles, resistance, told, piece, pieces, way, done)
        if part < 0.0:
            rest = -rest
        started = w - rest
        passed = abs(part / rest)
        decay = math.exp(-passed)
        w = rest + started * decay
        if want_means:
            first, second = decay_means(passed, decay)
            whole = rest + started * first
            mean += whole / pieces
            late += (piece * whole + 0.5 * rest + started * second) / pieces**2
    return w, mean, late


@inlined
def factor_at(terms, axis, k, where, given):
    """The factor of effects on the bristle at sample k; where: time, position, speed, inputs; given: as of
    `given_over`."""
    if not axis.on & terms.acts.friction:
        return 1.0
    t, y, v, currents = where
    if given.motor.size == 0:
        return friction_factor(terms, axis, t, y, v, currents)
    factor = given.friction[k]
    if axis.on & terms.acts.stateful_friction:
        factor = terms.friction(factor, axis.on & terms.acts.stateful_friction, t, y, v, currents, axis.p)
    return factor


@inlined
def resistance_at(terms, axis, where, factor):
    """What effects do to friction at a sample or between two, given the factor on the bristle; where: time, position,
    speed, inputs."""
    t, y, v, currents = where
    level, load = 1.0, 0.0
    if axis.on & terms.acts.level:
        level = level_factor(terms, axis, t, y, v, currents)
    if axis.on & terms.acts.load:
        load = friction_load(terms, axis, t, y, v, currents)
    return Resistance(factor, level, load)


@inlined
def bristle_at_rest(axis, bristles, resistance, w, force, dt):
    """The bristle of a resting axis, drawn to the balance of forces: one sample's noise would shift it by much."""
    most = resistance.level * (bristles.static + resistance.load)
    held = min(max(force / resistance.factor, -most), most) / bristles.sigma_0
    return w + min(1.0, dt / REST_AVERAGE) * (held - w)


@compiled
def begun(terms, axis, bristles, course, motion, currents, given, w):
    """The bristle at the first sample in m; w: as given, or nan. Hidden states and elements start too.

    Not given, it is that of steady sliding, but an axis that has just set off need not slide yet.
    """
    t, y, v = course.t_start, motion.y[0], motion.v[0]
    if axis.on & terms.acts.advance:
        # What an axis that stood brings along is that of its rest: the sign of its first speed is chance.
        stood = motion.standstill[0] or just_set_off(v, bristles.static / bristles.sigma_0)
        start_states(terms, axis, t, y, 0.0 if stood else v, currents)
    if math.isnan(w):
        w = steady_bristle(terms, axis, bristles, t, y, v, currents)
        if not motion.standstill[0] and motion.y.size > START_SAMPLES:
            where = t, y, v, currents
            resistance = resistance_at(terms, axis, where, factor_at(terms, axis, 0, where, given))
            breakaway = resistance.level * (bristles.static + resistance.load) / bristles.sigma_0
            if just_set_off(v, breakaway):
                held = held_at_start(terms, axis, bristles, course, motion, currents, resistance.factor)
                w = min(max(held, -breakaway), breakaway)
    terms.law.share_out(axis, bristles, w)
    return w


@inlined
def derating_at(terms, axis, k, where, given):
    """The factor that hidden states make on the thrust at sample k; where: time, position, speed; given: as of
    `given_over`."""
    by_states = axis.on & terms.acts.stateful_thrust
    if by_states == 0 or given.motor.size == 0 or not axis.powered:
        return 1.0
    currents = given.inputs[0][k], given.inputs[1][k], given.inputs[2][k]
    return terms.thrust(1.0, by_states, *where, currents, axis.p)


@inlined
def outer_force(terms, axis, motion, k, t, currents, given, derating):
    """All forces on the mass but friction at sample k, in N; given: as of `given_over`; derating: as of
    `derating_at`."""
    on, acts, y, v = axis.on, terms.acts, motion.y[k], motion.v[k]
    if given.motor.size == 0:
        return force_once(terms, axis, t, y, v, currents)
    if not on & acts.push:
        return given.motor[k]
    motor, push = given.motor[k] * given.thrust[k] * derating, given.push[k]
    if given.own.size > 0:
        push += given.own[k]
    if on & acts.stateful_force or (on & acts.pushed and given.own.size == 0):
        i = given.inputs[0][k], given.inputs[1][k], given.inputs[2][k]
        push = terms.force(push, on & acts.stateful_force, t, y, v, i, axis.p)
        if on & acts.pushed and given.own.size == 0:
            return terms.pushed(motor + push, on, motor, t, y, v, i, axis.p)
    return motor + push


@inlined
def write_hidden(terms, axis, k, t, motion, currents, kept, found):
    """Put hidden states and reading error at t seconds into sample k."""
    if axis.on & terms.acts.advance or terms.law.elements > 0:
        for place in range(kept.size):
            found.states[k, place] = axis.p[STATE_START + kept[place]]
    if axis.on & terms.acts.stateful_sensor:
        y, v, on, p = motion.y[k], motion.v[k], axis.on, axis.p
        error = reading_error(terms, on, t, y, v, currents, p)  # at the reading, then at the position
        found.reading[k] = reading_error(terms, on, t, y - error, v, currents, p)


@compiled
def put_acceleration(bristles, dt, v, rows, out):
    """Put the acceleration in m/s^2 in at all samples. rows: (4, samples), the factor on the bristle, all forces but
    friction in N, and the bristle's mean over the interval after each sample with that of a growing weight, m."""
    sigma_0, damping, mass, last = bristles.sigma_0, bristles.sigma_1 / dt, bristles.mass, out.size - 1
    rows[MEAN, last] = rows[LATE, last] = 0.0
    for k in range(out.size):
        rows[FORCE, k] = (rows[FORCE, k] - bristles.sigma_2 * v[k]) / mass
    out[0] = -rows[FACTOR, 0] / mass * (sigma_0 * (rows[MEAN, 0] - rows[LATE, 0]) + damping * rows[MEAN, 0])
    # Triangle-weighted means of what changes smoothly by its three samples (Numerov), of the bristle by integrals. Its
    # rate is a difference of w: the equation's right-hand side would amplify noise.
    for k in range(1, out.size):
        held = rows[LATE, k - 1] + rows[MEAN, k] - rows[LATE, k]
        bristle = sigma_0 * held + damping * (rows[MEAN, k] - rows[MEAN, k - 1])
        out[k] = -rows[FACTOR, k] / mass * bristle
    for k in range(1, last):
        out[k] += (rows[FORCE, k - 1] + 10.0 * rows[FORCE, k] + rows[FORCE, k + 1]) / 12.0


@allocating
def told_or_before(terms, axis, candidates, bristles, course, motion, skip, before):
    """What is told of the intervals, or was for the candidate before. skip: how far back the bristle remembers in m,
    and whether it is followed in parts; before: as of `told_between`, and whether that is known."""
    told, known = before
    if known:
        return told
    return told_between(terms, axis, candidates, bristles, course, motion, asked_between(motion, *skip))


@allocating
def along_one(terms, candidates, stretch, motion, w, kept, shared, found):
    """Model acceleration and bristle along a measured motion, the bristle integrated exactly between samples.

    w: start deflection in m, nan if not given; kept: places of the wanted hidden states; shared: as of `shared_with`
    and of `effects_shared`, and as of `told_between` with whether that is known; returns that.
    """
    before, effected = shared[:2]
    axis = axis_of(terms, candidates, stretch)
    bristles = bristles_of(terms, axis, stretch.added_mass)
    course = measured_course(terms, axis, stretch)
    acts, on, dt, count, y, v = terms.acts, axis.on, stretch.dt, stretch.count, motion.y, motion.v
    mean = late = force = 0.0
    want_a = found.a.size > 0
    rows = np.empty((4, count if want_a else 0))
    # Where nothing that has states of its own acts on the bristle, it can be followed in parts.
    skipping = motion.wanted.size > 0 and not want_a and not (on & acts.advance or on & acts.sensor)
    raised = RAISED if on & acts.level or on & acts.load else 1.0
    memory = raised * FORGOTTEN * max(bristles.static, bristles.coulomb) / bristles.sigma_0
    given = known_beforehand(terms, axis, candidates, course, motion, effected, found)
    told = told_or_before(terms, axis, candidates, bristles, course, motion, (memory, skipping), shared[2:])
    goal = k = -1  # goal: the next wanted sample
    while k < count - 1:
        k += 1
        if skipping and k > goal:
            goal, back = skipped(k, motion.wanted, y, memory)
            if goal == count:
                break
            if back > k:
                k = back
                w = math.copysign(bristles.coulomb / bristles.sigma_0, v[k])
                terms.law.share_out(axis, bristles, w)
        t = stretch.t_start + k * dt
        currents = inputs_of_sample(terms, axis, course, motion, k)
        if k == 0:
            w = begun(terms, axis, bristles, course, motion, currents, given, w)
        if want_a or motion.standstill[k]:
            derating = derating_at(terms, axis, k, (t, y[k], v[k]), given)
            force = outer_force(terms, axis, motion, k, t, currents, given, derating)
        here = t, y[k], v[k], currents
        factor = factor_at(terms, axis, k, here, given)
        if motion.standstill[k]:
            w = terms.law.at_rest(axis, bristles, resistance_at(terms, axis, here, factor), w, force, dt)
        found.w[k] = w
        write_hidden(terms, axis, k, t, motion, currents, kept, found)
        if k < count - 1:
            where = midway_if(told.kept.size == 0 or on & acts.advance != 0, terms, axis, course, motion, k)
            if told.kept.size > 0:
                mean, late = told.mean[k] + told.mean_kept[k] * w, told.late[k] + told.late_kept[k] * w
                w = told.end[k] + told.kept[k] * w
            else:
                resistance = resistance_at(terms, axis, where[1:], factor)
                way = y[k + 1] - y[k], v[k], v[k + 1], dt, k
                w, mean, late = bristle_or_before(terms, axis, bristles, resistance, w, way, want_a, (told, before))
            if on & acts.advance:
                advance_on(terms, axis, course, motion, where)
        if want_a:
            rows[FACTOR, k], rows[FORCE, k], rows[MEAN, k], rows[LATE, k] = factor, force, mean, late
    if want_a:
        put_acceleration(bristles, dt, v, rows, found.a)
    return told


def along_tasks_with(terms: Bundle) -> Any:
    """`along_tasks` with these terms, for Python to call."""

    def along_tasks(candidates, inputs, motion, starts, kept, begin, end, found):
        """`along_one` for tasks begin..end-1; task = recording * candidates + candidate.

        inputs: packed recordings; motion: of all of them; starts: (candidates, recordings) deflections in m.
        """
        count, on = starts.shape[0], candidates.on & terms.chosen | terms.always
        longest = 0
        for r in range(inputs.dts.size):
            longest = max(longest, inputs.sample_offsets[r + 1] - inputs.sample_offsets[r])
        # What effects make of the way between samples.
        resists = on & (terms.acts.level | terms.acts.load | terms.acts.static) != 0
        shared = not hangs_on_motor(terms, on)
        before, effected, told = followed_before(longest), effected_before(longest), nothing_between()
        for number in range(begin, end):
            r = number // count
            candidate = number % count
            if candidate == 0:
                before.params[:] = effected.params[:] = np.nan
            a = inputs.sample_offsets[r]
            b = inputs.sample_offsets[r + 1]
            wanted = motion.wanted[a:b] if motion.wanted.size > 0 else motion.wanted
            same_friction = is_followed_before(candidates.params[candidate], before)
            before_it = shared_with(terms, on, candidates.params[candidate], before)
            effects = effects_shared(candidates.params[candidate], effected)
            told = along_one(
                terms,
                candidates,
                stretch_of(candidates, inputs, candidate, r, 0, b - a),
                MeasuredMotion(motion.y[a:b], motion.v[a:b], motion.inputs[:, a:b], motion.standstill[a:b], wanted),
                starts[candidate, r],
                kept,
                (before_it, effects, told, shared and same_friction and (effects.known or not resists)),
                AlongTraces(
                    found.a[candidate, a:b] if found.a.size > 0 else found.a[0, 0:0],
                    found.w[candidate, a:b],
                    found.states[candidate, a:b] if found.states.size > 0 else found.states[0, 0:0],
                    found.reading[candidate, a:b] if found.reading.size > 0 else found.reading[0, 0:0],
                ),
            )

    return along_tasks
