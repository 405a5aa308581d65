"""The compiled simulation of an axis whose inputs are currents: one run, and many of them.

Every function takes the terms of motors and effects first (terms.py); `entry points` for Python come from compiled.py.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.physics.friction import glide_weights, gliding_step, lugre_step
from linid.physics.model import STATE_START
from linid.physics.motors import motor_forces
from linid.simulation.bundle import Bundle
from linid.simulation.forces import (
    advance_states,
    axis_of,
    bristles_of,
    external_force,
    force_once,
    keep_states,
    reading_error,
    start_states,
    steady_bristle,
    total_delay,
    work_vector,
)
from linid.simulation.splines_at import inputs_then, spline_at
from linid.simulation.steps import (
    FINEST,
    REST_BRISTLE,
    REST_SPEED,
    borders_of,
    bristle_now,
    friction_at,
    impulse,
    is_steady,
    predicted,
    too_slow,
)
from linid.simulation.terms import allocating, compiled, inlined

LARGEST_POSITION, LARGEST_SPEED = 1e6, 1e4  # m and m/s; beyond, a simulation has diverged


class Clock(NamedTuple):
    """Times of a recording in s: t_start, dt; substeps: base steps per sample, tick: s of the finest one; lag: by which
    inputs act late; guided: whether forces act at the measured position; tolerance: of a followed step."""

    t_start: Any
    dt: Any
    substeps: Any
    tick: Any
    lag: Any
    guided: Any
    tolerance: Any


class AxisState(NamedTuple):
    """Where a simulation stands: y in m, v in m/s, w in m, forces on the mass but friction in N, the inputs, and the
    bristle's stiffness and damping as they are now."""

    y: Any
    v: Any
    w: Any
    force: Any
    currents: Any
    spring: Any


@inlined
def set_states(start, kept, p):
    """Hidden states that are given with the start of a simulation take the place of the effects' own."""
    if start.size > 3 and not math.isnan(start[3]):
        for place in range(kept.size):
            p[STATE_START + kept[place]] = start[3 + place]
        keep_states(p)


@allocating
def prepared(terms, params, motor, on, powered, t_start, dt, added_mass, record, elapsed, guided, substeps, tolerance):
    """What stays the same in one simulation: axis, bristles, clock, parameters with room for states, harmonics."""
    on = on & terms.chosen | terms.always
    p = params
    if on & terms.acts.any:
        p = work_vector(params, record, elapsed)
    table = np.zeros((3, 12))
    axis = axis_of(motor, on, powered, p, table)
    tick = dt / (substeps << FINEST)
    clock = Clock(t_start, dt, substeps, tick, total_delay(terms, on, p), guided, tolerance)
    return axis, bristles_of(terms, on, p, added_mass), clock, p, table


@inlined
def first_inputs(terms, axis, clock, coefficients, first, count):
    """The three inputs at the first sample; none where there is no interval to act in."""
    if axis.powered and count > 1:
        return inputs_then(terms, axis.on, coefficients, clock.dt, first, 0.0, 0.0, clock.lag)
    return 0.0, 0.0, 0.0


@compiled
def started(terms, axis, bristles, t, start, kept, currents, p, table):
    """The motion at the first sample, at t seconds with these currents."""
    y, v, w = start[0], start[1], start[2]
    if axis.on & terms.acts.advance:
        start_states(terms, axis.on, t, y, v, currents, p)
        set_states(start, kept, p)
    if math.isnan(w):  # not given: the bristle that goes with steady sliding, or holds the resting axis
        w = steady_bristle(terms, axis, bristles, t, y, v, currents, p, table)
    force = force_once(terms, axis, t, y, v, currents, p, table)
    _, stiffness, damping = bristle_now(terms, axis, bristles, t, y, v, currents, p)
    return AxisState(y, v, w, force, currents, (stiffness, damping))


@inlined
def force_then(terms, axis, clock, coefficients, n, x, back, y, v, currents, p, table):
    """Forces on the mass but friction in N, and inputs, x - back seconds after sample n, with the axis at y and v."""
    if axis.powered:
        currents = inputs_then(terms, axis.on, coefficients, clock.dt, n, x, back, clock.lag)
    t = clock.t_start + n * clock.dt + x - back
    return external_force(terms, axis, t, y, v, currents, p, table), currents


@inlined
def sliding_step(terms, axis, bristles, clock, coefficients, forces, n, done, size, alone, motion, glide, p, table):
    """A step of fast sliding: nothing but the outer forces changes, and these smoothly; no bristle need be followed.

    Without any force (alone) the step is exact however long it is. size: finest steps, glide: how fast sliding decays
    over them. Returns the motion after it.
    """
    y, v = motion.y, motion.v
    drag = math.copysign(bristles.coulomb, v)
    h = size * clock.tick
    half = 0.5 * h
    v_mid = v + half * (motion.force - drag - bristles.sigma_2 * v) / bristles.mass
    x = (done + size) * clock.tick
    currents = motion.currents
    force_mid = force_end = 0.0
    if forces.size > 0:
        point = 2 * (n * clock.substeps + ((done + size) >> FINEST))
        force_mid, force_end = forces[point - 1], forces[point]
    elif not alone:
        y_mid, y_end = y + 0.5 * half * (v + v_mid), y + h * v_mid
        if clock.guided:
            y_mid, y_end = spline_at(coefficients, n, 3, x - half), spline_at(coefficients, n, 3, x)
        force_mid, currents = force_then(terms, axis, clock, coefficients, n, x, half, y_mid, v_mid, currents, p, table)
        force_end, currents = force_then(
            terms, axis, clock, coefficients, n, x, 0.0, y_end, 2.0 * v_mid - v, currents, p, table
        )
    mean, rise = impulse(motion.force, force_mid, force_end)
    v, displacement = gliding_step(v, mean - drag - 0.5 * rise, rise, bristles.mass, bristles.sigma_2, h, glide)
    return AxisState(y + displacement, v, drag / bristles.sigma_0, force_end, currents, motion.spring)


@inlined
def followed_step(terms, axis, bristles, clock, coefficients, forces, n, done, motion, halvings, p, table):
    """A step in which the bristle is followed; returns the motion after it and its predicted middle."""
    y, v, w, force, currents, spring = motion
    t_n = clock.t_start + n * clock.dt
    middle = predicted(
        terms,
        axis,
        bristles,
        spring,
        t_n + done * clock.tick,
        y,
        v,
        w,
        currents,
        p,
        table,
        force,
        halvings,
        clock.tick,
        clock.tolerance,
    )
    v_mid, level, fall = middle.v, middle.level, middle.fall
    size = 1 << (FINEST - middle.halvings)
    h = size * clock.tick
    half = 0.5 * h
    x = (done + size) * clock.tick
    y_mid, y_end, v_end = y + 0.5 * half * (v + v_mid), y + h * v_mid, 2.0 * v_mid - v
    known = middle.halvings == 0 and forces.size > 0
    if clock.guided and not known:
        y_mid, y_end = spline_at(coefficients, n, 3, x - half), spline_at(coefficients, n, 3, x)
    t_mid = t_n + x - half
    states = axis.on & terms.acts.advance
    if states:
        advance_states(
            terms,
            axis.on,
            half,
            t_mid - 0.5 * half,
            y + 0.25 * half * (v + v_mid),
            0.5 * (v + v_mid),
            (v_mid - v) / half,
            currents,
            p,
        )
    point = 2 * (n * clock.substeps + ((done + size) >> FINEST))
    force_mid = force_end = 0.0
    if known:
        force_mid, force_end = forces[point - 1], forces[point]
    else:
        force_mid, currents = force_then(terms, axis, clock, coefficients, n, x, half, y_mid, v_mid, currents, p, table)
    if axis.on & terms.acts.load or (states and axis.on & terms.acts.level):
        level, fall = friction_at(terms, axis, bristles, t_mid, y_mid, v_mid, currents, p, table)
    factor, stiffness, damping = bristle_now(terms, axis, bristles, t_mid, y_mid, v_mid, currents, p)
    level, fall = factor * level, factor * fall
    inner = currents
    if states:
        advance_states(terms, axis.on, h, t_mid, y_mid, v_mid, (v_mid - v) / half, currents, p)
    if not known:
        force_end, currents = force_then(terms, axis, clock, coefficients, n, x, 0.0, y_end, v_end, currents, p, table)
    mean, rise = impulse(force, force_mid, force_end)
    v_new, w_new, displacement = lugre_step(
        v,
        w,
        v_mid,
        middle.w,
        level,
        fall,
        mean - 0.5 * rise,
        rise / h,
        bristles.mass,
        stiffness,
        damping,
        bristles.sigma_2,
        h,
    )
    if states:  # once more along the step as it came out, so that they keep to the motion
        advance_states(terms, axis.on, h, t_mid, y + 0.5 * displacement, displacement / h, (v_new - v) / h, inner, p)
        keep_states(p)
    return AxisState(y + displacement, v_new, w_new, force_end, currents, (stiffness, damping)), middle


@inlined
def write_sample(terms, on, k, t, motion, p, y_out, v_out):
    """Put what is seen of a motion at t seconds into sample k."""
    y_out[k] = motion.y
    if on & terms.acts.sensor:
        y_out[k] += reading_error(terms, on, t, motion.y, motion.v, motion.currents, p)
    if v_out.size > 0:
        v_out[k] = motion.v


@inlined
def diverged(motion):
    """Whether a simulation has run away, or is no number any more."""
    return not abs(motion.y) < LARGEST_POSITION or not abs(motion.v) < LARGEST_SPEED


@inlined
def no_samples(first, y_out, v_out):
    """Nothing is known from sample `first` on."""
    for k in range(first, y_out.size):
        y_out[k] = np.nan
    for k in range(first, v_out.size):
        v_out[k] = np.nan


@allocating
def simulate_one(
    terms,
    params,
    motor,
    on,
    powered,
    coefficients,
    t_start,
    dt,
    first,
    count,
    added_mass,
    record,
    elapsed,
    start,
    kept,
    guided,
    substeps,
    tolerance,
    forces,
    y_out,
    v_out,
):
    """Simulate `count` samples from sample `first`; returns the number of internal steps.

    params: flat parameters; coefficients: (n - 1, 4, 4) splines of the inputs and of the measured position; start:
    y, v, w and, if given, the hidden states number `kept`; guided: outer forces act at the measured position; forces:
    the motor's at the ends and middles of all base steps of the recording, or empty;
    y_out: (count,) m; v_out: (count,) m/s, or empty if not wanted. A diverged run is nan from there on.
    """
    axis, bristles, clock, p, table = prepared(
        terms, params, motor, on, powered, t_start, dt, added_mass, record, elapsed, guided, substeps, tolerance
    )
    whole = substeps << FINEST
    borders = borders_of(terms, axis, bristles)
    currents = first_inputs(terms, axis, clock, coefficients, first, count)
    motion = started(terms, axis, bristles, t_start + first * dt, start, kept, currents, p, table)
    followed = False  # the bristle, where fast sliding turned out to end
    glide, glide_h = (1.0, 0.5, 1.0 / 6.0), 0.0  # how fast sliding decays over a step of that length
    write_sample(terms, axis.on, 0, t_start + first * dt, motion, p, y_out, v_out)
    steps, halvings = 0, np.int64(0)  # a literal 0 would have a type of its own, and compile all twice
    for k in range(count - 1):
        n = first + k
        done = 0
        if borders.alone and abs(motion.v) < REST_SPEED and abs(motion.w) < REST_BRISTLE:  # nothing ever moves it
            done = whole
            motion = AxisState(motion.y, 0.0, 0.0, motion.force, motion.currents, motion.spring)
        while done < whole:
            if halvings == 0 and not followed and abs(motion.v) > borders.fast and is_steady(bristles, motion):
                while done < whole and abs(motion.v) > borders.fast:  # the bristle stays steady
                    size = whole - done if borders.alone else 1 << FINEST
                    h = size * clock.tick
                    if h != glide_h:
                        glide, glide_h = glide_weights(bristles.sigma_2, bristles.mass, h), h
                    slid = sliding_step(
                        terms,
                        axis,
                        bristles,
                        clock,
                        coefficients,
                        forces,
                        n,
                        done,
                        size,
                        borders.alone,
                        motion,
                        glide,
                        p,
                        table,
                    )
                    followed = too_slow(borders, motion.v, slid.v)
                    if followed:  # the same step once more
                        break
                    motion = slid
                    done += size
                    steps += 1
                continue
            motion, middle = followed_step(
                terms, axis, bristles, clock, coefficients, forces, n, done, motion, halvings, p, table
            )
            followed = False
            halvings = middle.halvings
            size = 1 << (FINEST - halvings)
            done += size
            steps += 1
            if halvings > 0 and done % (size << 1) == 0 and middle.swing < 0.3 * middle.allowed:
                halvings -= 1
        if diverged(motion):
            no_samples(k + 1, y_out, v_out)
            return steps
        write_sample(terms, axis.on, k + 1, t_start + n * dt + dt, motion, p, y_out, v_out)
    return steps


def simulate_tasks_with(terms: Bundle) -> Any:
    """`simulate_tasks` with these terms, for Python to call."""

    def simulate_tasks(
        params,
        motor,
        on,
        powered,
        coefficients,
        offsets,
        t_starts,
        dts,
        recording,
        first,
        count,
        added_mass,
        records,
        elapsed,
        starts,
        kept,
        out_offsets,
        guided,
        guide,
        substeps,
        tolerance,
        begin,
        end,
        y_out,
        v_out,
    ):
        """Simulate tasks begin..end-1; task = candidate * segments + segment. Results land in y_out[candidate].

        params: (candidates, VECTOR_SIZE); recording, first, count, out_offsets: (segments,) integers;
        coefficients: (intervals of all recordings, 4, 4); offsets: first interval of each recording;
        starts: (candidates, segments, 3 or 3 + kept) y, v, w and hidden states, those in the places `kept`; guide:
        (4, points) measured position and inputs at the ends and middles of all base steps, if these alone decide the
        motor's force, or empty. Returns the internal steps taken.
        """
        segments = recording.size
        steps = 0
        # The motor's forces at measured positions: segments overlap and share them.
        pieces = 2 * substeps
        longest = 0
        if guide.shape[1] > 0:
            for r in range(powered.size):
                longest = max(longest, pieces * (offsets[r + 1] - offsets[r]) + 1)
        forces = np.empty(longest)
        filled, filled_from, filled_to = -1, 0, 0
        for task in range(begin, end):
            candidate = task // segments
            s = task % segments
            r = recording[s]
            known = forces[0:0]
            if longest > 0 and powered[r]:
                known = forces
                start, stop = pieces * first[s], pieces * (first[s] + count[s] - 1) + 1
                if filled != candidate * powered.size + r or start < filled_from or start > filled_to:
                    filled = candidate * powered.size + r
                    filled_from = filled_to = start
                if stop > filled_to:
                    a, b = pieces * offsets[r] + r + filled_to, pieces * offsets[r] + r + stop
                    motor_forces(
                        motor,
                        params[candidate, 8:14],
                        guide[0, a:b],
                        guide[1, a:b],
                        guide[2, a:b],
                        guide[3, a:b],
                        forces[filled_to:stop],
                    )
                    filled_to = stop
            a = out_offsets[s]
            b = a + count[s]
            v_row = v_out[candidate, a:b] if v_out.size > 0 else v_out[0, 0:0]
            steps += simulate_one(
                terms,
                params[candidate],
                motor,
                on,
                powered[r],
                coefficients[offsets[r] : offsets[r + 1]],
                t_starts[r],
                dts[r],
                first[s],
                count[s],
                added_mass[r],
                records[r],
                elapsed[r],
                starts[candidate, s],
                kept,
                guided,
                substeps,
                tolerance,
                known,
                y_out[candidate, a:b],
                v_row,
            )
        return steps

    return simulate_tasks


def reading_tasks_with(terms: Bundle) -> Any:
    """`reading_tasks` with these terms, for Python to call."""

    def reading_tasks(params, on, y, v, begin, end, out):
        """Reading errors in m of candidates begin..end-1 along positions y and speeds v, for errors that hang on
        nothing else. out: (candidates, samples)."""
        on = on & terms.chosen | terms.always
        for candidate in range(begin, end):
            p = work_vector(params[candidate], 0.0, 0.0)
            for k in range(y.size):
                out[candidate, k] = reading_error(terms, on, 0.0, y[k], v[k], (0.0, 0.0, 0.0), p)

    return reading_tasks
