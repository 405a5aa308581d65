"""Many simulations at once, each in a lane of its own: LuGre friction.

For models whose outer forces position and inputs alone decide, effects among them if these are told already
(`Scheme.forces`), or that have none. Where that is the measured position,
all forces are known beforehand; where it is the simulated one, a lane has them as it goes. A lane keeps its own place
in time and its own length of step. Two blocks of lanes are driven in turn, one of simulations that slide fast and one
of those whose bristle is followed; one that has come to its end, or must go over to the other kind, leaves its lane to
the next. What goes along with each simulation, such as its derivatives (lockstep_slopes.py), is told by functions that
the terms name `beside`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.simulation.binding import allocating, compiled, inlined
from linid.simulation.bundle import Bundle
from linid.simulation.course import FINEST, AxisState, still_known
from linid.simulation.forces import Axis, bristles_of, forces_along, motor_axis
from linid.simulation.kernel import started
from linid.simulation.lanes import LANES
from linid.simulation.lockstep_block import (
    ALONE,
    BRISTLES,
    CANDIDATE,
    DONE,
    END,
    FAST,
    FIELD,
    FORCE,
    GLIDE_H,
    GOING,
    INTERVAL,
    LEAPS,
    LEFT,
    NEXT,
    OWNER,
    PLACES,
    RECORDING,
    ROWS,
    SIZE,
    SLOWEST,
    SPLINES,
    TABLED,
    TICK,
    Block,
    V,
    W,
    Way,
    Y,
)
from linid.simulation.lockstep_lanes import follow, slide
from linid.simulation.lockstep_steps import WHOLE
from linid.simulation.splines_at import inputs_at
from linid.simulation.steps import borders_of, is_steady, rests

OPEN = 64  # simulations that are open at a time
FOLLOWED, SLIDING, FREE, SIZES = np.arange(4)  # rows of a pool's stacks


# What is told along the way: forces that become known, a simulation that begins or rests for good, is put into the
# pool, takes a step of either kind, and has come to samples.
BESIDE = ("pushed", "begun", "kept", "put_in", "slid", "followed", "written")


class Pool(NamedTuple):
    """Simulations that are open. values: (OPEN, rows) and places: (OPEN, PLACES) of each, as blocks hold them; stacks:
    (4, OPEN) numbers of those that wait to be followed, of those that wait to slide, of free ones, and how many each of
    these are; lanes: (2, LANES) which are in the lanes of both blocks, -1 where none is."""

    values: Any
    places: Any
    stacks: Any
    lanes: Any


class Tasks(NamedTuple):
    """What there is to simulate, as `simulate_tasks` takes it; offsets: (segments + 1,) of samples in the results."""

    candidates: Any
    inputs: Any
    segments: Any
    starts: Any
    scheme: Any
    offsets: Any


@allocating
def new_pool(rows):
    """A pool without simulations, of which blocks hold so many rows."""
    stacks, lanes = np.empty((4, OPEN), np.int64), np.empty((2, LANES), np.int64)
    for k in range(OPEN):
        stacks[FREE, k] = k
    stacks[SIZES, FOLLOWED] = stacks[SIZES, SLIDING] = 0
    stacks[SIZES, FREE] = OPEN
    for lane in range(LANES):
        lanes[FOLLOWED, lane] = lanes[SLIDING, lane] = -1
    return Pool(np.empty((OPEN, rows)), np.empty((OPEN, PLACES), np.int64), stacks, lanes)


@allocating
def new_block(rows):
    """A block whose lanes are free; with what they hold is computed all the same."""
    block = Block(
        np.empty((rows, LANES)),
        np.empty((PLACES, LANES), np.int64),
        np.empty((SPLINES, LANES)),
        np.full((OWNER + 1, LANES), -1.0),
        np.empty((4, LANES)),
    )
    for lane in range(LANES):
        for k in range(rows):
            block.values[k, lane] = 1.0
        for k in range(SPLINES):
            block.splines[k, lane] = -1.0
        block.values[GOING, lane] = 0.0
    return block


@inlined
def push(pool, stack, number):
    """Put a simulation on a stack."""
    pool.stacks[stack, pool.stacks[SIZES, stack]] = number
    pool.stacks[SIZES, stack] += 1


@inlined
def pop(pool, stack):
    """Take the last one from a stack."""
    pool.stacks[SIZES, stack] -= 1
    return pool.stacks[stack, pool.stacks[SIZES, stack]]


@compiled
def put_in(pool, motion, bristles, borders, moment, places):
    """Put a simulation that begins into the pool; returns its number there. moment: its interval, its recording, s of
    its finest step, and 1 where inputs leap at samples; places: its candidate, the number of its next sample in the
    results and of that behind the last."""
    number = pop(pool, FREE)
    of, to = pool.values, pool.places
    to[number, CANDIDATE], to[number, NEXT], to[number, END] = places
    of[number, Y], of[number, V], of[number, W], of[number, FORCE] = motion.y, motion.v, motion.w, motion.force
    of[number, SIZE], of[number, DONE], of[number, LEFT] = WHOLE, 0.0, places[2] - places[1]
    of[number, INTERVAL], of[number, RECORDING], of[number, TICK] = moment[:3]
    of[number, GOING], of[number, ALONE], of[number, LEAPS] = 1.0, 1.0 if borders.alone else 0.0, moment[3]
    of[number, FAST], of[number, SLOWEST], of[number, GLIDE_H] = borders.fast, borders.slowest, 0.0
    for k, value in enumerate(bristles):
        of[number, BRISTLES + k] = value
    slides = abs(motion.v) > borders.fast and is_steady(bristles, motion)
    push(pool, SLIDING if slides else FOLLOWED, number)
    return number


@inlined
def put_field(block, lane, fields):
    """Have the motor's field of the candidate that a lane simulates. fields: as in `Way`."""
    candidate = block.places[CANDIDATE, lane]
    if block.field[OWNER, lane] != candidate:
        block.field[OWNER, lane] = candidate
        for k in range(fields.shape[1]):
            block.field[k, lane] = fields[candidate, k]


@compiled
def enter(pool, stack, block, fields):
    """Put simulations that wait into free lanes of a block; how many lanes are taken then. fields: as in `Way`."""
    taken = 0
    places, lanes = block.places.shape  # not constants, as short loops of known length would be unrolled
    for lane in range(lanes):
        if pool.lanes[stack, lane] < 0 and pool.stacks[SIZES, stack] > 0:
            number = pop(pool, stack)
            pool.lanes[stack, lane] = number
            for k in range(block.values.shape[0]):
                block.values[k, lane] = pool.values[number, k]
            for k in range(places):
                block.places[k, lane] = pool.places[number, k]
            put_field(block, lane, fields)
        taken += pool.lanes[stack, lane] >= 0
    return taken


@compiled
def leave(pool, stack, block, over, on):
    """Take simulations out of their lanes: of the bits `over` for good, of the bits `on` to the other stack."""
    places, lanes = block.places.shape
    for lane in range(lanes):
        if (over | on) >> lane & 1:
            number = pool.lanes[stack, lane]
            pool.lanes[stack, lane] = -1
            for k in range(block.values.shape[0]):
                pool.values[number, k] = block.values[k, lane]
            for k in range(places):
                pool.places[number, k] = block.places[k, lane]
            block.values[GOING, lane] = 0.0
            push(pool, FREE if over >> lane & 1 else SLIDING - stack, number)


@allocating
def known_forces(terms, axis, guide, way, points, known):
    """Have the motor's forces at points from and to `points`: overlapping stretches share what is known already.

    guide: as in `Scheme`; known: from and to which point forces are known; returns the same, as it is then.
    """
    start, stop = points
    begin, end = still_known(known, start)
    if stop > end:
        currents = (guide[1, end:stop], guide[2, end:stop], guide[3, end:stop])
        forces_along(terms, axis, guide[0, end:stop], currents, way.forces[end:stop])
        terms.beside.pushed(terms, axis, way.beside, guide, way.forces, (end, stop))
        end = stop
    return begin, end


@inlined
def under_given_force(motion, bristles, start, force):
    """The motion at a first sample under a force in N that is told already, which a bristle that is not given holds
    where the axis rests."""
    w = motion.w
    if math.isnan(start[2]) and motion.v == 0.0:
        w = min(max(force, -bristles.static), bristles.static) / bristles.sigma_0
    return AxisState(motion.y, motion.v, w, force, motion.currents, motion.spring)


@allocating
def open_task(terms, tasks, number, motor, known, way, pool):
    """Open a simulation, task `number`; its first sample is written.

    motor: the axis that all open ones share as far as their motor goes; known: from and to which point the forces are
    known; returns the same, as it is then.
    """
    candidates, inputs, segments, starts, scheme, offsets = tasks
    candidate, s = number // segments.recording.size, number % segments.recording.size
    r, first, count = segments.recording[s], segments.first[s], segments.count[s]
    pieces = 2 * scheme.substeps
    interval = inputs.offsets[r] + first
    powered, p = inputs.powered[r], candidates.params[candidate]
    axis = Axis(0, powered, motor.motor, motor.harmonics, motor.wavenumber, motor.phase, p, motor.table)
    bristles = bristles_of(terms, axis, inputs.added_mass[r])
    currents, point = (0.0, 0.0, 0.0), pieces * interval + r
    if powered and count > 1:
        if not (way.free or way.given):
            points = point, point + pieces * (count - 1) + 1
            known = known_forces(terms, axis, scheme.guide, way, points, known)
        currents = inputs_at(inputs.coefficients, interval, 0.0)
    start, a = starts.values[candidate, s], offsets[s]
    motion = started(terms, axis, bristles, 0.0, start, starts.kept, currents)
    if powered and way.given:
        motion = under_given_force(motion, bristles, start, way.forces[point])
    way.y_out[candidate, a] = motion.y
    if way.v_out.size > 0:
        way.v_out[candidate, a] = motion.v
    borders = borders_of(terms, axis, bristles, scheme.guided)
    over = rests(terms, axis, borders, inputs.dts[r], motion)
    terms.beside.begun(way.beside, bristles, motion, (s, start[2], point if powered else -1), a)
    if over:
        terms.beside.kept(way.beside, a + 1, a + count)
        for k in range(a + 1, a + count):
            way.y_out[candidate, k] = motion.y
            if way.v_out.size > 0:
                way.v_out[candidate, k] = 0.0
    elif count > 1:
        tick, leaps = inputs.dts[r] / (scheme.substeps << FINEST), 1.0 if inputs.steps[r] else 0.0
        moment = float(interval), float(r), tick, leaps
        place = put_in(pool, motion, bristles, borders, moment, (candidate, a + 1, a + count))
        terms.beside.put_in(way.beside, pool.values, place)
    return known


@allocating
def motor_of(terms, candidates, way, candidate):
    """The motor of a candidate, whose field is put into `way.fields`."""
    axis = motor_axis(terms, candidates.motor, candidates.params[candidate])
    if way.fields.shape[1] > 0:
        field = way.fields[candidate]
        field[0], field[1], field[TABLED] = axis.wavenumber, axis.phase, 1.0 if axis.harmonics > 0 else 0.0
        for k in range(axis.table.shape[1]):
            for j in range(axis.table.shape[0]):
                field[2 + 3 * k + j] = axis.table[j, k]
    return axis


@allocating
def open_tasks(terms, tasks, number, until, motor, known, way, pool):
    """Open tasks from `number` on, all of one candidate, as long as there are any before `until` and room; the number
    of the next one, and what is known of forces then. A function of its own: with the motor of other candidates in the
    same loop, to open a simulation took four times as long."""
    while number < until and pool.stacks[SIZES, FREE] > 0:
        known = open_task(terms, tasks, number, motor, known, way, pool)
        number += 1
    return number, known


@allocating
def simulate_all(terms, tasks, begin, end, way, rows):
    """Simulate tasks begin..end-1; returns the number of steps. rows: that blocks hold of a simulation."""
    of_each = tasks.segments.recording.size
    pool, sliding, following = new_pool(rows), new_block(rows), new_block(rows)
    steps, number = 0, np.int64(begin)
    while number < end:
        candidate = number // of_each
        motor = motor_of(terms, tasks.candidates, way, candidate)
        most = motor.harmonics  # of all whose simulations may be open
        # Where forces are known beforehand, simulations that are open together share those of one candidate.
        last = (candidate + 1) * of_each
        until = min(end, last) if way.powered and not way.free else end
        known = np.int64(0), np.int64(0)
        while True:
            if number < until and pool.stacks[SIZES, FREE] > 0:
                number, known = open_tasks(terms, tasks, number, min(until, last), motor, known, way, pool)
            while last < until and number == last and pool.stacks[SIZES, FREE] > 0:
                motor = motor_of(terms, tasks.candidates, way, number // of_each)
                most = max(most, motor.harmonics)
                last += of_each
                number, known = open_tasks(terms, tasks, number, min(until, last), motor, known, way, pool)
            slides = enter(pool, SLIDING, sliding, way.fields)
            follows = enter(pool, FOLLOWED, following, way.fields)
            if slides + follows == 0:
                break
            if follows == LANES or slides == 0:
                over, on, more = follow(terms, (motor.motor, most, motor.table), following, way)
                leave(pool, FOLLOWED, following, over, on)
            else:
                over, on, more = slide(terms, (motor.motor, most, motor.table), sliding, way)
                leave(pool, SLIDING, sliding, over, on)
            steps += more
    return steps


@allocating
def way_of(candidates, inputs, scheme, traces, beside):
    """What all simulations share; traces: y and v as in `Traces`; beside: what goes along with them."""
    powered = False
    for r in range(inputs.powered.size):
        powered = powered or inputs.powered[r]
    free = powered and not scheme.guided
    forces, given = scheme.forces, scheme.forces.size > 0
    if not given:
        forces = np.empty(scheme.guide.shape[1] if powered and not free else 2)
    fields = np.empty((candidates.params.shape[0], FIELD if powered else 0))
    pieces, whole = 2.0 * scheme.substeps, float(scheme.substeps << FINEST)
    inner = candidates.params, inputs.coefficients, powered, free, fields, forces, given, pieces, whole
    return Way(*inner, scheme.tolerance, traces[0], traces[1], beside)


@inlined
def _nothing(*_):
    """Where nothing goes along."""


def lockstep_tasks_with(terms: Bundle) -> Any:
    """`lockstep_tasks` with these terms, for Python to call."""
    beside = Bundle(**{name: _nothing for name in BESIDE})
    terms = Bundle(**dict(terms), beside=beside)

    def lockstep_tasks(candidates, inputs, segments, starts, scheme, begin, end, out):
        """Simulate tasks begin..end-1; task = candidate * segments + segment. Results land in `out`.

        Arguments and result as those of `simulate_tasks`.
        """
        tasks = Tasks(candidates, inputs, segments, starts, scheme, out.offsets)
        return simulate_all(terms, tasks, begin, end, way_of(candidates, inputs, scheme, (out.y, out.v), 0.0), ROWS)

    return lockstep_tasks
