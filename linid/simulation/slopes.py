"""The compiled simulation with its derivatives: positions of one candidate, and how they change by many columns.

For LuGre friction, where measured positions and inputs alone decide the motor's force or there is no motor, with
effects that slope_effects.py and slope_states.py know; models without any, or whose effects are all told beforehand,
are for lockstep_slopes.py. The positions are those of `simulate_tasks` to the bit.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.physics.model import EFFECT_START, MOTOR_START
from linid.simulation.binding import allocating, inlined
from linid.simulation.bundle import Bundle
from linid.simulation.course import FINEST, Place, course_of, first_inputs, still_known, stretch_of
from linid.simulation.forces import axis_of, bristles_of, reading_error
from linid.simulation.kernel import after, diverged, no_samples, started
from linid.simulation.slope_carry import Along, Carried, carry_followed, carry_sliding, is_pushed
from linid.simulation.slope_effects import (
    FORCE_STEP,
    READING,
    Instant,
    acting_on,
    along_directions,
    answer_of_reading,
    of_recording,
    places_of,
    table_of,
)
from linid.simulation.slope_start import start_bristles, start_factor, start_forces, start_hidden
from linid.simulation.slope_states import hidden_of
from linid.simulation.slope_steps import bends, slid_weights
from linid.simulation.splines_at import spline_at
from linid.simulation.steps import (
    Slide,
    after_sample,
    borders_of,
    followed_step,
    is_steady,
    resting,
    rests,
    slid_on,
    sliding_step,
    too_slow,
)
from linid.simulation.told_forces import points_of, put_told


class Tangents(NamedTuple):
    """Directions. count: how many; table: those of friction's parameters, (8, width), SI, padded to lanes; touched:
    (count,) bits of the effects and own terms that they change; fast: bits of those whose forces hang on speed; told:
    bits of those whose forces measured place, inputs and time tell beforehand, 0 where other effects must know the
    motor's own; forces: (movers, points) slopes of forces in N that are told already (`Scheme.forces`), by the
    directions that change these one after the other, or empty; begins:
    (S, 3 or more) y in m, v in m/s, w in m and hidden states at the start; starts: (S, as many, width) directions of
    these; kept: (n,) places of hidden states, counted from STATE_START; owners: (n,) bits of their effects; driven:
    (3,) bits of those whose states place, speed and acceleration drive."""

    count: Any
    table: Any
    touched: Any
    fast: Any
    told: Any
    forces: Any
    begins: Any
    starts: Any
    kept: Any
    owners: Any
    driven: Any


class Under(NamedTuple):
    """How far a simulation is. borders: where fast sliding begins and ends; motion: the axis; follow: whether fast
    sliding turned out to end; halvings: of the next step; weights: of fast sliding over weights_h seconds."""

    borders: Any
    motion: Any
    follow: Any
    halvings: Any
    weights: Any
    weights_h: Any


@inlined
def carry_over_sample(terms, along, n, going):
    """`over_sample` with the slopes taken along; going: `Under`."""
    axis, bristles, course = along.axis, along.bristles, along.course
    borders, motion, follow, halvings, weights, weights_h = going
    whole = course.substeps << FINEST
    done = 0
    if rests(terms, axis, borders, course.dt, motion):
        done = whole
        motion = resting(borders, motion)
    while done < whole:
        if halvings == 0 and not follow and abs(motion.v) > borders.fast and is_steady(bristles, motion):
            while done < whole and abs(motion.v) > borders.fast:
                size = whole - done if borders.alone else 1 << FINEST
                h = size * course.tick
                if h != weights_h:
                    weights, weights_h = slid_weights(bristles, h), h
                slide = Slide(size, borders.alone, weights[0])
                slid = sliding_step(terms, axis, bristles, course, Place(n, done, 0), motion, slide)
                follow = too_slow(borders, motion.v, slid.v)
                if follow:
                    break
                if axis.on & terms.acts.advance:
                    slid_on(terms, axis, course, Place(n, done, 0), motion, slid, size)
                point = 2 * (n * course.substeps + ((done + size) >> FINEST)) if axis.powered else 0
                points = (point - 1 if axis.powered else 0), point
                moment = n, (done + size) * course.tick, h
                carry_sliding(terms, along, motion, slid, weights, moment, points)
                motion = slid
                done += size
            continue
        place = Place(n, done, halvings)
        found = followed_step(terms, axis, bristles, course, place, motion)
        carry_followed(terms, along, place, motion, found)
        motion = found[0]
        follow = False
        done, halvings = after(done, found[1])
    return Under(borders, motion, follow, halvings, weights, weights_h)


@allocating
def carried_from(axis, course, first, force_slopes, tangents, s):
    """The slopes at sample `first`."""
    width = tangents.table.shape[1]
    rows = np.empty(3 * width), np.zeros(width), np.zeros(width)
    carried = Carried(*rows, force_slopes.reshape(-1), bends(tangents.table))
    point = 2 * first * course.substeps if axis.powered else 0
    for c in range(width):
        carried.force[c] = force_slopes[point, c]
        for row in range(3):
            carried.motion[row * width + c] = tangents.starts[s, row, c]
    return carried


class Pushed(NamedTuple):
    """What is known along a recording of the motor and of the effects that are told beforehand. forces: (points,) in N
    at its points, slopes: (points, width) of these, those of columns that do not act on it 0; start, stop: from and to
    which of the points they are known."""

    forces: Any
    slopes: Any
    start: Any
    stop: Any


@allocating
def nothing_pushed(inputs, scheme, tangents):
    """Room for the points of the longest recording, of which nothing is known."""
    points, width = 0, tangents.table.shape[1]
    for r in range(inputs.powered.size):
        if inputs.powered[r]:
            points = max(points, 2 * scheme.substeps * (inputs.offsets[r + 1] - inputs.offsets[r]) + 1)
    return Pushed(np.empty(points), np.zeros((max(points, 1), width)), 0, 0)


@allocating
def pushed_on(candidates, terms, inputs, segment, scheme, tangents, acting, known):
    """Have the motor's forces and their slopes for a stretch: those before it in the recording are kept.

    segment: its recording, first sample and number of samples; known: as far as they are.
    """
    r, first, count = segment
    if not inputs.powered[r]:
        known.slopes[0] = 0.0  # the one that is asked for
        return Pushed(known.forces, known.slopes, 0, 0)
    pieces = 2 * scheme.substeps
    start, stop = pieces * first, pieces * (first + count - 1) + 1
    known_from, known_to = still_known((known.start, known.stop), start)
    if stop > known_to:
        put_forces(candidates, terms, inputs, scheme, tangents, acting, known, (r, known_to, stop))
        known_to = stop
    return Pushed(known.forces, known.slopes, known_from, known_to)


@allocating
def put_forces(candidates, terms, inputs, scheme, tangents, acting, known, points):
    """Put the forces and their slopes in; points: of which recording, from and to which of its points."""
    r, begin, end = points
    forces, slopes, other = known.forces[begin:end], known.slopes[begin:end], np.empty(end - begin)
    on, p = candidates.on & terms.chosen | terms.always, candidates.params[0]
    bits, seen = (on, acting.told), np.empty((4, end - begin))
    where = points_of(inputs, scheme, r, begin, end)
    put_told(terms, candidates.motor, bits, of_recording(p, inputs, r), where, seen, forces)
    # Effects on inputs and field act before the motor, by its place and inputs alone.
    changing = on & (terms.acts.delay | terms.acts.drive | terms.acts.field) | acting.told
    for c in range(tangents.count):
        other_p, acts = candidates.params[1 + c], tangents.touched[c] & changing != 0
        for k in range(MOTOR_START, EFFECT_START):
            acts = acts or other_p[k] != p[k]
        if acts:
            put_told(terms, candidates.motor, bits, of_recording(other_p, inputs, r), where, seen, other)
            for k in range(other.size):
                slopes[k, c] = (other[k] - forces[k]) / FORCE_STEP


@inlined
def motor_now(along, n):
    """The motor's force in N at sample n; 0 without one."""
    return along.motor[2 * n * along.course.substeps] if along.axis.powered else 0.0


@allocating
def begun_at(terms, along, first, start, motion):
    """Put in what of the slopes at the start follows from the model."""
    axis, course, carried = along.axis, along.course, along.carried
    t = course.t_start + first * course.dt
    at = Instant(t, motion.y, motion.v, motion.currents, motor_now(along, first), not course.guided)
    seen = Instant(at.t, at.y, at.v, at.currents, at.motor, True)  # by friction, guided or not
    motor = carried.force.copy()
    if axis.on & terms.acts.advance:
        start_hidden(terms, along, at, start)
    if is_pushed(terms, along):
        start_forces(terms, along, at)
    factor = 1.0
    if axis.on & terms.acts.friction:
        factor = start_factor(terms, along, seen)
    if math.isnan(start[2]):
        start_bristles(terms, along, seen, motion, motor, factor)


@allocating
def stepped(terms, along, n, motion):
    """The motion with the inputs that act from sample n on (`after_sample`), and the slopes of the force then."""
    axis, course, carried = along.axis, along.course, along.carried
    motion = after_sample(terms, axis, course, n, motion)
    width = along.table.shape[1]
    for c in range(width):
        carried.force[c] = carried.forces[2 * n * course.substeps * width + c]
    if is_pushed(terms, along):
        y = spline_at(course.coefficients, n, 3, 0.0) if course.guided else motion.y
        t = course.t_start + n * course.dt
        at = Instant(t, y, motion.v, motion.currents, motor_now(along, n), not course.guided)
        start_forces(terms, along, at)
    return motion


@inlined
def write_slopes(terms, along, k, t, motion, out):
    """Put what is seen of a motion at t seconds into sample k of `out`: y (count,) in m, slopes (count, width)."""
    y_out, slopes = out
    axis, carried, width = along.axis, along.carried, along.table.shape[1]
    y_out[k] = motion.y
    for c in range(width):
        slopes[k, c] = carried.motion[c]
    if axis.on & terms.acts.sensor:
        y_out[k] += reading_error(terms, axis.on, t, motion.y, motion.v, motion.currents, axis.p)
        at = Instant(t, motion.y, motion.v, motion.currents, 0.0, True)
        acting, hidden = along.acting, along.hidden
        answer = answer_of_reading(terms, axis, acting, at, places_of(READING, width, acting))
        for c in range(width):
            slopes[k, c] += answer.by_place * carried.motion[c] + answer.by_speed * carried.motion[width + c]
            slopes[k, c] += acting.own[answer.own + c]
            for j in range(acting.kept.size):
                slopes[k, c] += acting.by_state[answer.state + j] * hidden.slopes[j * width + c]


@allocating
def carry_one(terms, stretches, tangents, s, scheme, known, acting, out):
    """Simulate one stretch with slopes. stretches: what `stretch_of` takes but for the candidate; known: `Pushed` over
    it; out: y (count,) in m and slopes (count, width)."""
    candidates, inputs, r, first, count = stretches
    start = tangents.begins[s]
    stretch = stretch_of(candidates, inputs, 0, r, first, count)
    axis = axis_of(terms, candidates, stretch)
    bristles = bristles_of(terms, axis, stretch.added_mass)
    course = course_of(terms, axis, stretch, scheme, known.forces[0:0])
    t = stretch.t_start + first * stretch.dt
    currents = first_inputs(terms, axis, course, stretch)
    motion = started(terms, axis, bristles, t, start, tangents.kept, currents)
    table = table_of(terms, axis, acting.params, stretch.added_mass, tangents.table)
    carried = carried_from(axis, course, first, known.slopes, tangents, s)
    hidden = hidden_of(acting.kept.size, table.shape[1])
    for k in range(acting.kept.size):
        for c in range(tangents.count if start.size > 3 else 0):
            hidden.slopes[k * table.shape[1] + c] = tangents.starts[s, 3 + k, c]
    along = Along(axis, bristles, course, table, carried, acting, known.forces, hidden)
    begun_at(terms, along, first, start, motion)
    # A literal 0 would have a type of its own, and compile all twice.
    weights = slid_weights(bristles, 0.0)
    going = Under(borders_of(terms, axis, bristles, course.guided), motion, False, np.int64(0), weights, 0.0)
    for k in range(count):
        n = first + k
        if k > 0:
            motion = going.motion
            if stretch.steps:
                motion = stepped(terms, along, n - 1, motion)
            going = Under(going.borders, motion, going.follow, going.halvings, going.weights, going.weights_h)
            going = carry_over_sample(terms, along, n - 1, going)
        if diverged(going.motion):
            no_samples(k, out[0], out[0][0:0])
            out[1][k:] = np.nan
            return
        write_slopes(terms, along, k, stretch.t_start + n * stretch.dt, going.motion, out)


def slope_tasks_with(terms: Bundle) -> Any:
    """`slope_tasks` with these terms, for Python to call."""

    def slope_tasks(candidates, inputs, segments, scheme, tangents, begin, end, out):
        """Simulate segments begin..end-1 of the first candidate; results land in `out`: offsets, y (samples,) in m and
        slopes (samples, width).

        candidates: the one, then those a FORCE_STEP along each direction.
        """
        offsets, y_out, slopes = out
        owner = -1
        known = nothing_pushed(inputs, scheme, tangents)
        acting = acting_on(terms, candidates, tangents)
        for s in range(begin, end):
            r, first, count = segments.recording[s], segments.first[s], segments.count[s]
            if r != owner:
                along_directions(candidates, acting.params, inputs, r)
                known = Pushed(known.forces, known.slopes, 0, 0)
                owner = r
            known = pushed_on(candidates, terms, inputs, (r, first, count), scheme, tangents, acting, known)
            a, b = offsets[s], offsets[s + 1]
            stretches = candidates, inputs, r, first, count
            carry_one(terms, stretches, tangents, s, scheme, known, acting, (y_out[a:b], slopes[a:b]))

    return slope_tasks
