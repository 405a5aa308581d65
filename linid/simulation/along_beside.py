"""What directions beside a model do along a measured motion: to forces, friction, hidden states and readings.

By differences of the terms themselves, of those alone that a direction changes.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.physics.model import EFFECT_START, MOTOR_START, STATE_SIZE, STATE_START, WORK_SIZE
from linid.simulation.along import begun, inputs_of_sample
from linid.simulation.along_before import effected_before
from linid.simulation.binding import allocating, compiled, inlined
from linid.simulation.course import Scheme, course_of, stretch_of
from linid.simulation.forces import (
    advance_states,
    axis_of,
    bristles_of,
    driven_currents,
    field_position,
    friction_factor,
    keep_states,
    level_factor,
    motor_forces,
    reading_error,
)
from linid.simulation.slope_effects import FORCE_STEP, Instant, beside, force_at
from linid.simulation.splines_at import late_inputs

# Rows of what is carried along, each of one number per direction: the bristle's deflection, its mean over an interval
# and that with a growing weight; what the interval before leaves for the next sample; the forces and the factor on the
# bristle at a sample, the level of friction between two; outer acceleration at the last sample and the one before; what
# is being written.
BRISTLE, MEAN, LATE, LEFT, FORCE, FACTOR, LEVEL, LAST, BEFORE_LAST, WRITTEN, ROWS = range(11)


class Directions(NamedTuple):
    """K directions. touched: (K,) bits of the effects whose parameters they change; table: (8, width) how they change
    those of friction, SI, padded to lanes."""

    touched: Any
    table: Any


class AlongSlopes(NamedTuple):
    """Where derivatives land, (K, samples): of the acceleration in m/s^2 as `AlongTraces.a` is one, and of the reading
    in m, which is empty where no effect has a reading error."""

    a: Any
    reading: Any


class Beside(NamedTuple):
    """What the directions are in one recording. params: (K, WORK_SIZE) a FORCE_STEP along each, with its own hidden
    states; lag: (K,) s by which the inputs act late; driven: (D,) directions that change the motor's force; motor: the
    motor's own forces in N, (1 + D, samples) of the model and of these; pushed, held, level, moving, reading: (K,)
    whether a direction changes the other forces, the factor on the bristle, the level of friction, hidden states and
    the reading; width: of a row; table: (8 * width) as of `Directions`, with what effects do to mass and static force;
    carried: (ROWS * width)."""

    params: Any
    lag: Any
    driven: Any
    motor: Any
    pushed: Any
    held: Any
    level: Any
    moving: Any
    reading: Any
    width: Any
    table: Any
    carried: Any


class Here(NamedTuple):
    """Sample k. t: s in the recording; y: m; v: m/s; currents: inputs; force: N on the mass but friction."""

    k: Any
    t: Any
    y: Any
    v: Any
    currents: Any
    force: Any


@inlined
def midway(terms, axis, course, motion, k):
    """Place in samples, time, position, speed and inputs in the middle between sample k and the next."""
    dt, travel = course.dt, motion.y[k + 1] - motion.y[k]
    currents = 0.0, 0.0, 0.0
    if axis.powered:
        currents = late_inputs(course.coefficients, dt, (k + 0.5) * dt - course.lag)
    return k + 0.5, course.t_start + k * dt + 0.5 * dt, motion.y[k] + 0.5 * travel, travel / dt, currents


@compiled
def advance_on(terms, axis, course, motion, where):
    """Bring hidden states to the next sample; where: as of `midway`."""
    place, t, y, v, currents = where
    k = int(place)
    advance_states(terms, axis, course.dt, t, y, v, (motion.v[k + 1] - motion.v[k]) / course.dt, currents)
    keep_states(axis.p)


@allocating
def motor_of(terms, candidates, candidate, axis, course, motion, out):
    """Forces in N of one candidate's motor alone at all samples: `out` (samples,) is filled. The hidden states of
    `axis`, of the first sample, are taken to the last one where they decide what the motor gets."""
    p, acts, i = candidates.params[candidate], terms.acts, motion.inputs
    if axis.on & (acts.delay | acts.drive | acts.field) == 0:
        motor_forces(terms, candidates.motor, p, motion.y, (i[0], i[1], i[2]), out)
        return
    seen = np.empty((4, out.size))
    for k in range(out.size):
        t, y, v = course.t_start + k * course.dt, motion.y[k], motion.v[k]
        currents = driven_currents(terms, axis, t, y, v, inputs_of_sample(terms, axis, course, motion, k))
        seen[0, k] = field_position(terms, axis, t, y, v, currents)
        seen[1, k], seen[2, k], seen[3, k] = currents
        if axis.on & acts.advance and k < out.size - 1:
            advance_on(terms, axis, course, motion, midway(terms, axis, course, motion, k))
    motor_forces(terms, candidates.motor, p, seen[0], (seen[1], seen[2], seen[3]), out)


@allocating
def room_beside(terms, axis, directions, candidates, samples):
    """Room for what the directions are in a recording of so many samples."""
    count, width = directions.touched.size, directions.table.shape[1]
    acts, touched = terms.acts, directions.touched
    before = acts.delay | acts.drive | acts.field
    driven = np.empty(count, dtype=np.int64)
    found = 0
    for c in range(count):
        moves = touched[c] & before != 0
        for k in range(MOTOR_START, EFFECT_START):
            moves = moves or candidates.params[1 + c, k] != candidates.params[0, k]
        if moves and axis.powered:
            driven[found] = c
            found += 1
    pushed = touched & (acts.push | acts.delay) != 0
    if axis.on & (acts.thrust | acts.pushed):  # no longer the motor's force alone
        for j in range(found):
            pushed[driven[j]] = True
    return Beside(
        np.zeros((count, WORK_SIZE)),
        np.zeros(count),
        driven[:found],
        np.zeros((1 + found, samples)),
        pushed,
        touched & acts.friction != 0,
        touched & acts.level != 0,
        touched & acts.advance != 0,
        touched & acts.sensor != 0,
        width,
        directions.table.flatten(),
        np.zeros(ROWS * width),
    )


@allocating
def started_beside(terms, candidates, stretch_data, motion, room):
    """Put in how model and directions begin, and their motor's forces; returns the model's bristle in m. stretch_data:
    inputs and number of the recording."""
    inputs, r = stretch_data
    count, width, j = room.lag.size, room.width, 0
    w = mass = static = 0.0
    for candidate in range(1 + count):
        stretch = stretch_of(candidates, inputs, candidate, r, 0, motion.y.size)
        axis = axis_of(terms, candidates, stretch)
        bristles = bristles_of(terms, axis, stretch.added_mass)
        course = course_of(terms, axis, stretch, Scheme(True, stretch.params[0:0], 1, 0.0, None), stretch.params[0:0])
        currents = inputs_of_sample(terms, axis, course, motion, 0)
        begins = begun(terms, axis, bristles, course, motion, currents, effected_before(0), math.nan)
        c = candidate - 1
        if c < 0:
            w, mass, static = begins, bristles.mass, bristles.static
        else:
            room.carried[BRISTLE * width + c] = (begins - w) / FORCE_STEP
            room.lag[c] = course.lag
            for k in range(axis.p.size):
                room.params[c, k] = axis.p[k]
            if axis.on & (terms.acts.mass | terms.acts.static):
                room.table[width + c] = (bristles.static - static) / FORCE_STEP
                room.table[7 * width + c] = (bristles.mass - mass) / FORCE_STEP
        if axis.powered and (c < 0 or (j < room.driven.size and room.driven[j] == c)):
            motor_of(terms, candidates, candidate, axis, course, motion, room.motor[j + 1 if c >= 0 else 0])
            j += c >= 0
    return w


@inlined
def currents_beside(terms, axis, course, motion, place, c, room):
    """The inputs that act at a place (in samples) in direction c, given those of the model."""
    x, currents = place
    if axis.powered and axis.on & terms.acts.delay:
        return late_inputs(course.coefficients, course.dt, x * course.dt - room.lag[c])
    return currents


@compiled
def forces_beside(terms, axis, course, motion, here, room):
    """Put in how forces and the factor on the bristle answer at a sample."""
    k, t, y, v, currents, force = here
    carried, of_force, of_factor = room.carried, FORCE * room.width, FACTOR * room.width
    factor = 1.0
    if axis.on & terms.acts.friction:
        factor = friction_factor(terms, axis, t, y, v, currents)
    for j in range(room.driven.size):
        carried[of_force + room.driven[j]] = (room.motor[1 + j, k] - room.motor[0, k]) / FORCE_STEP
    for c in range(room.lag.size):
        if not (room.pushed[c] or room.held[c]):
            continue
        other = beside(axis, room, c)
        given = currents_beside(terms, axis, course, motion, (k, currents), c, room)
        if room.pushed[c]:
            motor = room.motor[0, k]
            for j in range(room.driven.size):
                if room.driven[j] == c:
                    motor = room.motor[1 + j, k]
            carried[of_force + c] = (force_at(terms, other, Instant(t, y, v, given, motor)) - force) / FORCE_STEP
        if room.held[c]:
            carried[of_factor + c] = (friction_factor(terms, other, t, y, v, given) - factor) / FORCE_STEP
    return factor


@compiled
def level_beside(terms, axis, course, motion, where, room):
    """Put in how the level of friction answers; returns it. where: place in samples, time, position, speed, inputs."""
    place, t, y, v, currents = where
    level = level_factor(terms, axis, t, y, v, currents)
    for c in range(room.lag.size):
        if room.level[c]:
            given = currents_beside(terms, axis, course, motion, (place, currents), c, room)
            other = level_factor(terms, beside(axis, room, c), t, y, v, given)
            room.carried[LEVEL * room.width + c] = (other - level) / FORCE_STEP
    return level


@compiled
def states_beside(terms, axis, course, motion, where, room):
    """Bring the hidden states of model and directions to the next sample; where: as of `midway`."""
    place, t, y, v, currents = where
    advance_on(terms, axis, course, motion, where)
    for c in range(room.lag.size):
        p = room.params[c]
        if room.moving[c]:
            given = currents_beside(terms, axis, course, motion, (place, currents), c, room)
            advance_on(terms, beside(axis, room, c), course, motion, (place, t, y, v, given))
        else:
            for k in range(STATE_START, STATE_START + STATE_SIZE):
                p[k] = axis.p[k]


@compiled
def write_readings(terms, axis, course, motion, here, found, room):
    """Put in how the reading at sample k answers (`write_hidden`)."""
    k, t, y, v, currents, _ = here
    on = axis.on
    error = reading_error(terms, on, t, y, v, currents, axis.p)
    reading = reading_error(terms, on, t, y - error, v, currents, axis.p)
    for c in range(room.lag.size):
        if room.reading[c]:
            p = room.params[c]
            given = currents_beside(terms, axis, course, motion, (k, currents), c, room)
            error = reading_error(terms, on, t, y, v, given, p)
            found.reading[c, k] = (reading_error(terms, on, t, y - error, v, given, p) - reading) / FORCE_STEP
