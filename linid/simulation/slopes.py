"""The compiled simulation with its derivatives: positions of one candidate, and how they change by many columns.

For LuGre friction without effects, where measured positions and inputs alone decide the motor's force or there is no
motor. The positions are those of `simulate_tasks` to the bit.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.physics.model import MOTOR_START
from linid.simulation.binding import allocating, compiled, inlined
from linid.simulation.bundle import Bundle
from linid.simulation.course import FINEST, AxisState, Place, course_of, first_inputs, inputs_then, stretch_of
from linid.simulation.forces import axis_of, bristles_of, force_once, motor_forces
from linid.simulation.friction_slopes import level_slopes
from linid.simulation.kernel import after, diverged, no_samples, started
from linid.simulation.lanes import LANES, lanes_at, put_lanes
from linid.simulation.slope_steps import (
    Motions,
    Pushes,
    bristle_lanes,
    columns_at,
    level_lanes,
    linear_lanes,
    linear_of,
    predicted_lanes,
    predictor_of,
    slid_lanes,
    slid_weights,
)
from linid.simulation.steps import (
    REST_BRISTLE,
    REST_SPEED,
    Slide,
    borders_of,
    followed_step,
    impulse,
    is_steady,
    reach_of,
    sliding_step,
    too_slow,
)

FORCE_STEP = 2e-8  # of a search coordinate: forces are smooth to the last bits, of which it leaves half


class Tangents(NamedTuple):
    """Directions. count: how many; table: those of friction's parameters, (8, width), SI, padded to lanes; begins:
    (S, 3) y in m, v in m/s and w in m at the start; starts: (S, 3, width) directions of these; kept: places of hidden
    states, of which there are none."""

    count: Any
    table: Any
    begins: Any
    starts: Any
    kept: Any


class Carried(NamedTuple):
    """What goes along with a simulation: slopes (3 * width) of y, v and w; (width) of the force now; (points * width)
    of the forces at the recording's points, those of one point without a motor; bent: whether alpha is a direction."""

    motion: Any
    force: Any
    forces: Any
    bent: Any


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
def motions_at(carried, width, block):
    """Slopes of y, v and w of a block of lanes."""
    m = carried.motion
    return Motions(lanes_at(m, block), lanes_at(m, block + width), lanes_at(m, block + 2 * width))


@inlined
def put_motions(carried, width, block, motions):
    """Put them back."""
    put_lanes(carried.motion, block, motions.y)
    put_lanes(carried.motion, block + width, motions.v)
    put_lanes(carried.motion, block + 2 * width, motions.w)


@compiled
def carry_sliding(bristles, table, carried, motion, slid, step, h):
    """Take the slopes along a step of fast sliding. step: its weights, the force in its middle in N, and the numbers of
    the points in its middle and at its end."""
    weights, force, before, point = step
    width = table.shape[1]
    mean, rise = impulse(motion.force, force, slid.force)
    for block in range(0, width, LANES):
        middle = lanes_at(carried.forces, before * width + block)
        end = lanes_at(carried.forces, point * width + block)
        pushes = Pushes(lanes_at(carried.force, block), middle, end)
        both = pushes, columns_at(table, width, block)
        motions = slid_lanes(weights, bristles, motion.v, mean, rise, h, motions_at(carried, width, block), both)
        put_motions(carried, width, block, motions)
        put_lanes(carried.force, block, end)


@inlined
def push_between(carried, at, share, width, block):
    """Slopes of the force a share of the base step after its first point, by the parabola through its three."""
    first, last = (1.0 - share) * (1.0 - 2.0 * share), share * (2.0 * share - 1.0)
    f = carried.forces
    value = first * lanes_at(f, at * width + block) + (1.0 - first - last) * lanes_at(f, (at + 1) * width + block)
    return value + last * lanes_at(f, (at + 2) * width + block)


@compiled
def carry_followed(bristles, table, carried, motion, middle, outer, step, h):
    """Take the slopes along a followed step. outer: forces in its middle and at its end; step: the first point of its
    base step (-1: no motor), and the shares of that at its middle and end."""
    width = table.shape[1]
    predictor = predictor_of(bristles, motion, middle, h, carried.bent)
    mean, rise = impulse(motion.force, outer[0], outer[1])
    linear = linear_of(bristles, motion, middle, mean, rise, h)
    base = motion.v, motion.w, middle.v
    at, at_middle, at_end = step
    for block in range(0, width, LANES):
        columns, motions = columns_at(table, width, block), motions_at(carried, width, block)
        start = lanes_at(carried.force, block)
        half = end = start
        if at >= 0:
            half = push_between(carried, at, at_middle, width, block)
            end = push_between(carried, at, at_end, width, block)
        at_mid = predicted_lanes(predictor, motions, start, columns)
        rate, slope = bristle_lanes(linear, bristles, middle, at_mid, columns)
        rates, pushes = (rate, slope, at_mid[0]), Pushes(start, half, end)
        put_motions(carried, width, block, linear_lanes(linear, bristles, base, h, rates, motions, pushes, columns))
        put_lanes(carried.force, block, end)


@inlined
def force_in_the_middle(terms, axis, course, place, motion, middle):
    """The outer force in N that a followed step took in its middle."""
    if not axis.powered:
        return 0.0
    if middle.halvings == 0:
        return course.forces[2 * (place.n * course.substeps + (place.done >> FINEST)) + 1]
    reach = reach_of(course, place, motion, middle, True)
    currents = inputs_then(terms, axis, course, place.n, reach.x, 0.5 * reach.h)
    return force_once(terms, axis, reach.t_mid, reach.y_mid, middle.v, currents)


@inlined
def carry_step(terms, axis, bristles, course, place, table_and_carried, motion, followed):
    """Take the slopes along a followed step from `motion` to what `followed_step` gave."""
    table, carried = table_and_carried
    reached, middle = followed
    size = 1 << (FINEST - middle.halvings)
    outer = force_in_the_middle(terms, axis, course, place, motion, middle), reached.force
    base_step = place.done >> FINEST
    begin = (place.done - (base_step << FINEST)) / (1 << FINEST)
    share = size / (1 << FINEST)
    at = 2 * (place.n * course.substeps + base_step) if axis.powered else -1
    step = at, begin + 0.5 * share, begin + share
    carry_followed(bristles, table, carried, motion, middle, outer, step, size * course.tick)


@inlined
def carry_over_sample(terms, axis, bristles, course, n, table, carried, going):
    """`over_sample` with the slopes taken along; going: `Under`."""
    borders, motion, follow, halvings, weights, weights_h = going
    whole = course.substeps << FINEST
    done = 0
    if borders.alone and abs(motion.v) < REST_SPEED and abs(motion.w) < REST_BRISTLE:
        done = whole
        motion = AxisState(motion.y, 0.0, 0.0, motion.force, motion.currents, motion.spring)
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
                point = 0 if borders.alone else 2 * (n * course.substeps + ((done + size) >> FINEST))
                before = 0 if borders.alone else point - 1
                force = 0.0 if borders.alone else course.forces[before]
                carry_sliding(bristles, table, carried, motion, slid, (weights, force, before, point), h)
                motion = slid
                done += size
            continue
        place = Place(n, done, halvings)
        found = followed_step(terms, axis, bristles, course, place, motion)
        carry_step(terms, axis, bristles, course, place, (table, carried), motion, found)
        motion = found[0]
        follow = False
        done, halvings = after(done, found[1])
    return Under(borders, motion, follow, halvings, weights, weights_h)


@compiled
def start_bristles(bristles, table, carried, motion):
    """Put in the slopes of a bristle that follows from the model at the start (`started`)."""
    coulomb, static, velocity, exponent, sigma_0 = bristles[:5]
    width = table.shape[1]
    level = level_slopes(motion.v, coulomb, static, velocity, exponent, carried.bent)
    slides = abs(motion.v) > 0.0
    turn = math.copysign(1.0, motion.w)
    breaks = 1.0 if not slides and abs(motion.force) >= static else 0.0
    for block in range(0, width, LANES):
        columns = columns_at(table, width, block)
        held = (turn * breaks) * columns.static + (1.0 - breaks) * lanes_at(carried.force, block)
        if slides:
            held = turn * level_lanes(level.level_by, lanes_at(carried.motion, block + width), columns)
        put_lanes(carried.motion, block + 2 * width, (1.0 / sigma_0) * (held - motion.w * columns.sigma_0))


@allocating
def carried_from(axis, course, first, force_slopes, tangents, s):
    """The slopes at sample `first`."""
    width = tangents.table.shape[1]
    carried = Carried(np.empty(3 * width), np.zeros(width), force_slopes.reshape(-1), np.any(tangents.table[3] != 0.0))
    point = 2 * first * course.substeps if axis.powered else 0
    for c in range(width):
        carried.force[c] = force_slopes[point, c]
        for row in range(3):
            carried.motion[row * width + c] = tangents.starts[s, row, c]
    return carried


@allocating
def forces_of(candidates, terms, inputs, r, scheme, tangents):
    """The motor's forces in N at the points of recording r, and their slopes (points, width)."""
    pieces = 2 * scheme.substeps
    points = pieces * (inputs.offsets[r + 1] - inputs.offsets[r]) + 1
    width = tangents.table.shape[1]
    if not inputs.powered[r]:
        return np.empty(0), np.zeros((1, width))
    a = pieces * inputs.offsets[r] + r
    b = a + points
    guide = scheme.guide
    y, currents = guide[0, a:b], (guide[1, a:b], guide[2, a:b], guide[3, a:b])
    forces, other, slopes = np.empty(points), np.empty(points), np.zeros((points, width))
    motor_forces(terms, candidates.motor, candidates.params[0], y, currents, forces)
    for c in range(tangents.count):
        p, acts = candidates.params[1 + c], False
        for k in range(MOTOR_START, p.size):
            acts = acts or p[k] != candidates.params[0, k]
        if acts:
            motor_forces(terms, candidates.motor, p, y, currents, other)
            for k in range(points):
                slopes[k, c] = (other[k] - forces[k]) / FORCE_STEP
    return forces, slopes


@allocating
def carry_one(terms, stretches, start, tangents, s, scheme, known, out):
    """Simulate one stretch with slopes. stretches: what `stretch_of` takes but for the candidate; start: (3,) y, v, w;
    known: forces of its recording and their slopes; out: y (count,) in m and slopes (count, width)."""
    candidates, inputs, r, first, count = stretches
    stretch = stretch_of(candidates, inputs, 0, r, first, count)
    y_out, slopes = out
    axis = axis_of(terms, candidates, stretch)
    bristles = bristles_of(terms, axis, stretch.added_mass)
    course = course_of(terms, axis, stretch, scheme, known[0])
    t = stretch.t_start + first * stretch.dt
    currents = first_inputs(terms, axis, course, stretch)
    motion = started(terms, axis, bristles, t, start, tangents.kept, currents)
    carried = carried_from(axis, course, first, known[1], tangents, s)
    if math.isnan(start[2]):
        start_bristles(bristles, tangents.table, carried, motion)
    # A literal 0 would have a type of its own, and compile all twice.
    weights = slid_weights(bristles, 0.0)
    going = Under(borders_of(terms, axis, bristles), motion, False, np.int64(0), weights, 0.0)
    for k in range(count):
        if k > 0:
            going = carry_over_sample(terms, axis, bristles, course, first + k - 1, tangents.table, carried, going)
        if diverged(going.motion):
            no_samples(k, y_out, y_out[0:0])
            slopes[k:] = np.nan
            return
        y_out[k] = going.motion.y
        for c in range(slopes.shape[1]):
            slopes[k, c] = carried.motion[c]


def slope_tasks_with(terms: Bundle) -> Any:
    """`slope_tasks` with these terms, for Python to call."""

    def slope_tasks(candidates, inputs, segments, scheme, tangents, begin, end, out):
        """Simulate segments begin..end-1 of the first candidate; results land in `out`: offsets, y (samples,) in m and
        slopes (samples, width).

        candidates: the one, then those a FORCE_STEP along each direction.
        """
        offsets, y_out, slopes = out
        owner = -1
        known = np.empty(0), np.zeros((1, 1))
        for s in range(begin, end):
            r, first, count = segments.recording[s], segments.first[s], segments.count[s]
            if r != owner:
                known = forces_of(candidates, terms, inputs, r, scheme, tangents)
                owner = r
            a, b = offsets[s], offsets[s + 1]
            stretches = candidates, inputs, r, first, count
            carry_one(terms, stretches, tangents.begins[s], tangents, s, scheme, known, (y_out[a:b], slopes[a:b]))

    return slope_tasks
