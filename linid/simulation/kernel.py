"""The compiled simulation of an axis whose inputs are currents: one run, and many of them.

Every function takes the terms of motors and effects first (terms.py); entry points for Python come from compiled.py.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.physics.friction import glide_weights
from linid.physics.model import STATE_START
from linid.simulation.along_effects import Samples, readings_over
from linid.simulation.binding import allocating, compiled, inlined
from linid.simulation.bundle import Bundle
from linid.simulation.course import FINEST, AxisState, Place, course_of, first_inputs, still_known, stretch_of
from linid.simulation.forces import (
    axis_of,
    bristles_of,
    force_once,
    keep_states,
    motor_forces,
    reading_error,
    start_states,
    steady_bristle,
    work_vector,
)
from linid.simulation.steering import steered
from linid.simulation.steps import (
    CALM,
    Slide,
    after_sample,
    borders_of,
    bristle_now,
    followed_step,
    is_steady,
    resting,
    rests,
    slid_on,
    sliding_step,
    too_slow,
)

LARGEST_POSITION, LARGEST_SPEED = 1e6, 1e4  # m and m/s; beyond, a simulation has diverged


class Filled(NamedTuple):
    """The motor's forces in N along the measured position: those of which candidate and recording, and from and to
    which of the recording's points."""

    forces: Any
    owner: Any
    start: Any
    stop: Any


class Going(NamedTuple):
    """How far a simulation is. motion: the axis; followed: whether fast sliding turned out to end, and the bristle is
    followed for a step; glide: how fast sliding decays over a step of glide_h seconds; halvings: of the next step;
    steps: so far."""

    motion: Any
    followed: Any
    glide: Any
    glide_h: Any
    halvings: Any
    steps: Any


NO_GLIDE = (1.0, 0.5, 1.0 / 6.0)  # weights of sliding over no time


@inlined
def set_states(start, kept, p):
    """Hidden states that are given with the start of a simulation take the place of the effects' own."""
    if start.size > 3 and not math.isnan(start[3]):
        for place in range(kept.size):
            p[STATE_START + kept[place]] = start[3 + place]
        keep_states(p)


@compiled
def started(terms, axis, bristles, t, start, kept, currents):
    """The motion at the first sample, at t seconds with these currents."""
    y, v, w = start[0], start[1], start[2]
    if axis.on & terms.acts.advance:
        start_states(terms, axis, t, y, v, currents)
        set_states(start, kept, axis.p)
    if math.isnan(w):  # not given: the bristle that goes with steady sliding, or holds the resting axis
        w = steady_bristle(terms, axis, bristles, t, y, v, currents)
    if terms.law.elements > 0:
        terms.law.share_out(axis, bristles, w)
        set_states(start, kept, axis.p)
        w = terms.law.bristle(axis, bristles)
    force = force_once(terms, axis, t, y, v, currents)
    _, stiffness, damping = bristle_now(terms, axis, bristles, t, y, v, currents)
    return AxisState(y, v, w, force, currents, (stiffness, damping))


@inlined
def write_sample(terms, axis, k, t, motion, y_out, v_out):
    """Put what is seen of a motion at t seconds into sample k."""
    y_out[k] = motion.y
    if axis.on & terms.acts.sensor:
        y_out[k] += reading_error(terms, axis.on, t, motion.y, motion.v, motion.currents, axis.p)
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


@inlined
def after(done, middle):
    """Finest steps that are done after a followed step, and the halvings that the next one begins with."""
    halvings = middle.halvings
    size = 1 << (FINEST - halvings)
    done += size
    if halvings > 0 and done % (size << 1) == 0 and middle.swing < CALM * middle.allowed:
        halvings -= 1
    return done, halvings


@inlined
def over_sample(terms, axis, bristles, course, borders, n, going):
    """From sample n to the next one."""
    motion, followed, glide, glide_h, halvings, steps = going
    whole = course.substeps << FINEST
    done = 0
    if rests(terms, axis, borders, course.dt, motion):
        done = whole
        motion = resting(borders, motion)
    while done < whole:
        if halvings == 0 and not followed and abs(motion.v) > borders.fast and is_steady(bristles, motion):
            while done < whole and abs(motion.v) > borders.fast:  # the bristle stays steady
                size = whole - done if borders.alone else 1 << FINEST
                h = size * course.tick
                if h != glide_h:
                    glide, glide_h = glide_weights(bristles.sigma_2, bristles.mass, h), h
                slide = Slide(size, borders.alone, glide)
                slid = sliding_step(terms, axis, bristles, course, Place(n, done, 0), motion, slide)
                followed = too_slow(borders, motion.v, slid.v)
                if followed:  # the same step once more
                    break
                if axis.on & terms.acts.advance:
                    slid_on(terms, axis, course, Place(n, done, 0), motion, slid, size)
                motion = slid
                done += size
                steps += 1
            continue
        motion, middle = followed_step(terms, axis, bristles, course, Place(n, done, halvings), motion)
        followed = False
        done, halvings = after(done, middle)
        steps += 1
    return Going(motion, followed, glide, glide_h, halvings, steps)


@allocating
def simulate_one(terms, candidates, stretch, start, kept, scheme, forces, out):
    """Simulate one stretch; returns the number of internal steps.

    start: y, v, w and, if given, the hidden states number `kept`; forces: the motor's at the ends and middles of all
    base steps of the recording, or empty; out: y (count,) in m, v (count,) in m/s or empty if not wanted. A diverged
    run is nan from there on.
    """
    y_out, v_out = out
    axis = axis_of(terms, candidates, stretch)
    bristles = bristles_of(terms, axis, stretch.added_mass)
    course = course_of(terms, axis, stretch, scheme, forces)
    borders = borders_of(terms, axis, bristles, course.guided)
    t_first = stretch.t_start + stretch.first * stretch.dt
    currents = first_inputs(terms, axis, course, stretch)
    motion = started(terms, axis, bristles, t_first, start, kept, currents)
    write_sample(terms, axis, 0, t_first, motion, y_out, v_out)
    # A literal 0 would have a type of its own, and compile all twice.
    going = Going(motion, False, NO_GLIDE, 0.0, np.int64(0), np.int64(0))
    # Asked for once: what takes an array out of a tuple counts it.
    steering, is_steered = scheme.steering, scheme.steering.y.size > 0
    renewed = stretch.steps and course.forces.size == 0
    for k in range(stretch.count - 1):
        n = stretch.first + k
        motion = going.motion
        if is_steered:
            motion = steered(terms, axis, course, steering, n, motion)
        elif renewed:
            motion = after_sample(terms, axis, course, n, motion)
        going = Going(motion, going.followed, going.glide, going.glide_h, going.halvings, going.steps)
        going = over_sample(terms, axis, bristles, course, borders, n, going)
        if diverged(going.motion):
            no_samples(k + 1, y_out, v_out)
            return going.steps
        write_sample(terms, axis, k + 1, stretch.t_start + n * stretch.dt + stretch.dt, going.motion, y_out, v_out)
    return going.steps


@allocating
def fill(terms, candidates, candidate, inputs, r, scheme, points, filled):
    """Have the motor's forces for a stretch of recording r: overlapping stretches share what is known already.

    points: from and to which of the recording's points.
    """
    start, stop = points
    pieces = 2 * scheme.substeps
    owner = candidate * inputs.powered.size + r
    known = (filled.start, filled.stop) if filled.owner == owner else (start, start)
    known_from, known_to = still_known(known, start)
    if stop > known_to:
        offset = pieces * inputs.offsets[r] + r
        a, b = offset + known_to, offset + stop
        guide = scheme.guide
        currents = (guide[1, a:b], guide[2, a:b], guide[3, a:b])
        p, out = candidates.params[candidate], filled.forces[known_to:stop]
        motor_forces(terms, candidates.motor, p, guide[0, a:b], currents, out)
        known_to = stop
    return Filled(filled.forces, owner, known_from, known_to)


def simulate_tasks_with(terms: Bundle) -> Any:
    """`simulate_tasks` with these terms, for Python to call."""

    def simulate_tasks(candidates, inputs, segments, starts, scheme, begin, end, out):
        """Simulate tasks begin..end-1; task = candidate * segments + segment. Results land in `out`.

        inputs: packed recordings (inputs.py); segments: stretches of them (run.py); the rest: course.py.
        Returns the internal steps taken.
        """
        count_of_segments = segments.recording.size
        steps = 0
        pieces = 2 * scheme.substeps
        longest = 0
        if scheme.guide.shape[1] > 0:
            for r in range(inputs.powered.size):
                longest = max(longest, pieces * (inputs.offsets[r + 1] - inputs.offsets[r]) + 1)
        filled = Filled(np.empty(longest), -1, 0, 0)
        for number in range(begin, end):
            candidate = number // count_of_segments
            s = number % count_of_segments
            r, first, count = segments.recording[s], segments.first[s], segments.count[s]
            forces = filled.forces[0:0]
            if longest > 0 and inputs.powered[r]:
                points = (pieces * first, pieces * (first + count - 1) + 1)
                filled = fill(terms, candidates, candidate, inputs, r, scheme, points, filled)
                forces = filled.forces
            stretch = stretch_of(candidates, inputs, candidate, r, first, count)
            a = out.offsets[s]
            b = a + count
            traces = (out.y[candidate, a:b], out.v[candidate, a:b] if out.v.size > 0 else out.v[0, 0:0])
            start = starts.values[candidate, s]
            steps += simulate_one(terms, candidates, stretch, start, starts.kept, scheme, forces, traces)
        return steps

    return simulate_tasks


def reading_tasks_with(terms: Bundle) -> Any:
    """`reading_tasks` with these terms, for Python to call."""

    def reading_tasks(params, on, y, v, begin, end, out):
        """Reading errors in m of candidates begin..end-1 along positions y and speeds v, for errors that hang on
        nothing else. out: (candidates, samples)."""
        on, nothing = on & terms.chosen | terms.always, np.zeros(y.size)
        samples = Samples(0.0, 0.0, y, v, nothing, nothing, nothing)
        for candidate in range(begin, end):
            p = work_vector(params[candidate], 0.0, 0.0, 0.0)
            readings_over(terms, on, samples, p, out[candidate])

    return reading_tasks
