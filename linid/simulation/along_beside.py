"""What directions beside a model do along a measured motion: to forces, friction and hidden states.

By differences of the terms themselves, of those alone that a direction changes.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.physics.model import EFFECT_START, MOTOR_START, STATE_SIZE, STATE_START, WORK_SIZE
from linid.physics.own_terms.layout import FORCE_BIT, LEVEL_BIT, MEMORY_BIT, PUSH_BIT
from linid.simulation.along import begun, factor_at
from linid.simulation.along_between_slopes import answers_at_once
from linid.simulation.along_effects import Samples, nothing_given
from linid.simulation.along_load import currents_beside, load_beside
from linid.simulation.along_motion import advance_by, advance_on, inputs_of_sample, midway
from linid.simulation.along_own import own_columns, own_forces
from linid.simulation.along_ways import (
    ASKED,
    BRISTLE,
    DERATED,
    DERATES,
    FACTOR,
    FORCE,
    GRIPS,
    HEARD,
    HOLDS,
    LEVEL,
    LEVELS,
    LOAD,
    LOADS,
    MOVES,
    PRESS,
    PRESSES,
    READS,
    ROWS,
    TOLD,
)
from linid.simulation.binding import allocating, inlined
from linid.simulation.course import measured_course, stretch_of
from linid.simulation.forces import (
    axis_of,
    bristles_of,
    driven_currents,
    field_position,
    friction_factor,
    level_factor,
    motor_forces,
)
from linid.simulation.own_slopes import own_slopes_of
from linid.simulation.slope_effects import (
    FORCE_STEP,
    Instant,
    added_by,
    along_directions,
    beside,
    given_at,
    library_force_at,
    of_motor,
    part_at,
    table_of,
)


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
    states; lag: (K,) s by which the inputs act late; motor: the motor's own forces in N, (rows, samples), of the model
    and of those directions that change them; pressing: these in the middle after each sample, or empty where no
    friction is made of them, or of all at once; row: (K,) which of these is a direction's; ways: (K,) bits of its ways;
    forces: (K, samples) N, so far as told beforehand; part: (K,) bits of the effects that change these otherwise, for
    `part_at`; width: of a row of what follows; table: (8 * width) as of `Directions`, with what effects do to mass and
    static force; carried: (ROWS * width); own: of `own_slopes_of`.

    Functions that are called for every sample and are not inlined take as long to be handed this as for their work.
    """

    params: Any
    lag: Any
    motor: Any
    pressing: Any
    row: Any
    ways: Any
    forces: Any
    part: Any
    width: Any
    table: Any
    carried: Any
    own: Any


class Here(NamedTuple):
    """Sample k. t: s in the recording; y: m; v: m/s; currents: inputs; force: N on the mass but friction; derating: the
    factor that hidden states make on the thrust."""

    k: Any
    t: Any
    y: Any
    v: Any
    currents: Any
    force: Any
    derating: Any


@allocating
def motor_of(terms, candidates, candidate, axis, course, motion, between, out):
    """Forces in N of one candidate's motor alone at all samples: `out` (samples,) is filled. between: in the middle
    after each but the last one instead. The hidden states of `axis`, of the first sample, are taken to the last one
    where they decide what the motor gets."""
    p, acts, i = candidates.params[candidate], terms.acts, motion.inputs
    if axis.on & (acts.delay | acts.drive | acts.field) == 0 and not between:
        motor_forces(terms, candidates.motor, p, motion.y, (i[0], i[1], i[2]), out)
        return
    seen, deciding = np.zeros((4, out.size)), axis.on & (acts.stateful_drive | acts.stateful_field) != 0
    for k in range(out.size - 1 if between else out.size):
        t, y, v = course.t_start + k * course.dt, motion.y[k], motion.v[k]
        currents = inputs_of_sample(terms, axis, course, motion, k)
        if between:
            _, t, y, v, currents = midway(terms, axis, course, motion, k)
        currents = driven_currents(terms, axis, t, y, v, currents)
        seen[0, k] = field_position(terms, axis, t, y, v, currents)
        seen[1, k], seen[2, k], seen[3, k] = currents
        if deciding and k < out.size - 1:
            advance_on(terms, axis, course, motion, midway(terms, axis, course, motion, k))
    motor_forces(terms, candidates.motor, p, seen[0], (seen[1], seen[2], seen[3]), out)


@allocating
def room_beside(terms, axis, directions, candidates, recording):
    """Room for what the directions are in a recording; recording: inputs of all and its number."""
    count, width = directions.touched.size, directions.table.shape[1]
    acts, touched, (inputs, r) = terms.acts, directions.touched, recording
    row, rows = np.zeros(count, dtype=np.int64), 1
    for c in range(count):
        moves = touched[c] & (acts.delay | acts.drive | acts.field) != 0
        for k in range(MOTOR_START, EFFECT_START):
            moves = moves or candidates.params[1 + c, k] != candidates.params[0, k]
        if moves and axis.powered:
            row[c] = rows
            rows += 1
    params, ways = np.zeros((count, WORK_SIZE)), np.zeros(count, dtype=np.int64)
    along_directions(candidates, params, inputs, r)
    for c in range(count):
        ways[c] |= HOLDS if touched[c] & acts.friction else 0
        ways[c] |= LEVELS if touched[c] & acts.level else 0
        ways[c] |= MOVES if touched[c] & acts.advance & ~MEMORY_BIT else 0
        ways[c] |= READS if touched[c] & acts.sensor else 0
        moves = row[c] > 0 or touched[c] & (acts.thrust | acts.drive | acts.field | acts.delay) != 0
        ways[c] |= PRESSES if axis.powered and axis.on & acts.pressed and moves else 0
        ways[c] |= LOADS if ways[c] & PRESSES or touched[c] & acts.load & ~LEVEL_BIT else 0
        ways[c] |= GRIPS if touched[c] & LEVEL_BIT else 0
    samples = inputs.sample_offsets[r + 1] - inputs.sample_offsets[r]
    return Beside(
        params,
        np.zeros(count),
        np.zeros((rows, samples)),
        np.zeros((rows, samples if axis.on & acts.pressed and not answers_at_once(terms, axis.on) else 0)),
        row,
        ways,
        np.zeros((count, samples)),
        np.zeros(count, dtype=np.int64),
        width,
        table_of(terms, axis, params, inputs.added_mass[r], directions.table).flatten(),
        np.zeros(ROWS * width),
        own_slopes_of(axis.on, candidates.params, count, FORCE_STEP),
    )


@allocating
def begun_anew(terms, axis, bristles, course, motion):
    """The bristle at the first sample in m, which nothing tells; hidden states start too."""
    currents = inputs_of_sample(terms, axis, course, motion, 0)
    return begun(terms, axis, bristles, course, motion, currents, nothing_given(), math.nan)


@allocating
def started_beside(terms, candidates, recording, motion, w, given, room):
    """Put in how the directions begin, and the motor's forces; recording: as of `room_beside`; w: the model's bristle
    in m; given: as of `given_over`."""
    inputs, r = recording
    for candidate in range(1 + room.lag.size):
        stretch = stretch_of(candidates, inputs, candidate, r, 0, motion.y.size)
        axis = axis_of(terms, candidates, stretch)
        bristles = bristles_of(terms, axis, stretch.added_mass)
        course = measured_course(terms, axis, stretch)
        begins = begun_anew(terms, axis, bristles, course, motion)
        c, row = candidate - 1, 0
        if c >= 0:
            room.carried[BRISTLE * room.width + c] = (begins - w) / FORCE_STEP
            room.lag[c] = course.lag
            for k in range(STATE_START, axis.p.size):
                room.params[c, k] = axis.p[k]
            row = room.row[c]
        if c < 0 and given.motor.size > 0:
            room.motor[0] = given.motor
        elif axis.powered and (c < 0 or row > 0):
            motor_of(terms, candidates, candidate, axis, course, motion, False, room.motor[row])
        if room.pressing.size > 0 and axis.powered and (c < 0 or row > 0):
            begun_anew(terms, axis, bristles, course, motion)
            motor_of(terms, candidates, candidate, axis, course, motion, True, room.pressing[row])


@inlined
def is_told(terms, axis, bits, moved, known):
    """Whether what a direction does to the forces hangs on no hidden state, neither of its own nor of others. bits: of
    the effects that it changes; moved: whether it changes the motor's force; known: whether that is told beforehand."""
    acts, on = terms.acts, axis.on
    states = acts.stateful_field | acts.stateful_thrust | acts.stateful_force
    if bits & states:
        return False
    if bits & (acts.delay | acts.drive) and on & acts.push_by_inputs:
        return False
    if moved and (on & acts.stateful_thrust or on & PUSH_BIT) and bits & acts.force:
        return False
    if moved and on & acts.thrust:
        return known
    return known or not bits & (acts.thrust | acts.force)


@inlined
def is_derating(terms, axis, bits, moved):
    """Whether all that a direction does to the forces is to change the factor on the thrust, by hidden states and
    whatever the inputs are. Arguments as in `is_told`; moved: whether it changes the motor's own force."""
    acts = terms.acts
    alone = bits & acts.stateful_thrust != 0 and bits & (acts.push & ~acts.thrust) == 0
    return alone and not moved and not bits & acts.push_by_inputs


@allocating
def told_beforehand(terms, axis, touched, samples, given, room):
    """Put in the forces of all directions at all samples, where they can be told so. touched: as of `Directions`;
    given: as of `given_over` for these samples."""
    acts, on, n = terms.acts, axis.on, samples.y.size
    driven = Samples(samples.t_start, samples.dt, samples.y, samples.v, *given.inputs)
    before, after, factor = np.empty(n), np.empty(n), np.empty(n)
    asks = HOLDS | READS | (0 if answers_at_once(terms, on) else LEVELS | LOADS)
    done = 0  # bits of the effects whose forces `before` holds
    for c in range(touched.size):
        bits, p, out, row = touched[c] & on & ~(FORCE_BIT | LEVEL_BIT), room.params[c], room.forces[c], room.row[c]
        moved = row > 0 or bits & acts.thrust != 0
        known = given.motor.size > 0
        told = is_told(terms, axis, bits, moved, known)
        derates = known and is_derating(terms, axis, bits, row > 0)
        whole = row > 0 or bits & (acts.delay | of_motor(terms)) != 0
        room.part[c] = bits & acts.thrust if derates else of_motor(terms) if whole else bits & acts.push
        asked = not told or room.ways[c] & asks != 0
        room.ways[c] |= (TOLD if told else 0) | (DERATES if derates else 0) | (ASKED if asked else 0)
        room.ways[c] |= DERATED if told and moved and on & acts.stateful_thrust else 0
        room.ways[c] |= HEARD if on & PUSH_BIT and (whole or derates or moved) else 0
        if not told:
            continue
        if bits & acts.force:
            if done != bits & acts.force:
                done = bits & acts.force
                before[:] = 0.0
                terms.over.force(before, done, driven, axis.p)
            after[:] = 0.0
            terms.over.force(after, done, driven, p)
            for k in range(n):
                out[k] = (after[k] - before[k]) / FORCE_STEP
        if moved and axis.powered:
            if bits & acts.thrust:
                factor[:] = 1.0
                terms.over.thrust(factor, on, driven, p)
            for k in range(n):
                thrust = given.thrust[k] if on & acts.thrust else 1.0
                other = factor[k] if bits & acts.thrust else thrust
                out[k] += (room.motor[row, k] * other - room.motor[0, k] * thrust) / FORCE_STEP


@inlined
def forces_beside(terms, axis, course, here, given, asks, room):
    """Put in how forces and the factor on the bristle answer at a sample; returns that factor. given: as of
    `given_over`; asks: whether not all of it is told beforehand."""
    of_force, k = FORCE * room.width, here.k
    factor = factor_at(terms, axis, k, here[1:5], given)
    push = heard = 0.0
    if axis.on & FORCE_BIT:
        push, heard = own_forces(terms, axis, here, given, room)
    for c in range(room.lag.size):
        if room.ways[c] & TOLD:
            told = room.forces[c, k]
            room.carried[of_force + c] = told * here.derating if room.ways[c] & DERATED else told
        elif room.ways[c] & DERATES:
            bits, (t, y, v, currents) = room.part[c], here[1:5]
            of_model = terms.thrust(1.0, bits, t, y, v, currents, axis.p)
            other = terms.thrust(1.0, bits, t, y, v, currents, room.params[c])
            thrust = given.motor[k] * given.thrust[k] * here.derating
            room.carried[of_force + c] = thrust * (other / of_model - 1.0) / FORCE_STEP
    if heard != 0.0:
        for c in range(room.lag.size):
            room.carried[of_force + c] *= 1.0 + heard if room.ways[c] & HEARD else 1.0
    if asks:
        ask_forces(terms, axis, course, here, factor, heard, room)
    if axis.on & FORCE_BIT:
        own_columns(axis, push, here.v, room, of_force)
    return factor


@inlined
def ask_forces(terms, axis, course, here, factor, heard, room):
    """Put in the answers of `forces_beside` that are not told beforehand; heard: how own terms answer the motor's
    force."""
    k, t, y, v, currents = here[:5]
    carried, of_force, of_factor = room.carried, FORCE * room.width, FACTOR * room.width
    at, done, plain, known = Instant(t, y, v, currents, room.motor[0, k], False), -1, 0.0, (0.0, currents)
    for c in range(room.lag.size):
        if not room.ways[c] & ASKED:
            continue
        other = beside(axis, room.params, c)
        given = currents_beside(terms, axis, course, (k, currents), c, room)
        if not room.ways[c] & (TOLD | DERATES):
            bits, there = room.part[c], Instant(t, y, v, given, room.motor[room.row[c], k], False)
            if bits != done:
                done, known = bits, given_at(terms, axis, at)
                plain = part_at(terms, axis, bits, at, known[1])
            if bits & of_motor(terms):  # as `part_at` does it, which is a sixth slower here
                force = library_force_at(terms, other, there)
            else:
                force = added_by(terms, other, bits, at, known[1])
            if room.ways[c] & HEARD:
                force += heard * (given_at(terms, other, there)[0] - known[0])
            carried[of_force + c] = (force - plain) / FORCE_STEP
        if room.ways[c] & HOLDS:
            carried[of_factor + c] = (friction_factor(terms, other, t, y, v, given) - factor) / FORCE_STEP


@inlined
def level_beside(terms, axis, course, where, room):
    """Put in how the level of friction answers; returns the factor on it and N added before. where: place in samples,
    time, position, speed, inputs."""
    (place, t, y, v, currents), (level, load), carried = where, (1.0, 0.0), room.carried
    if axis.on & terms.acts.level:
        level = level_factor(terms, axis, t, y, v, currents)
        for c in range(room.lag.size):
            if room.ways[c] & LEVELS:
                other = beside(axis, room.params, c)
                given = currents_beside(terms, axis, course, (place, currents), c, room)
                carried[LEVEL * room.width + c] = (level_factor(terms, other, t, y, v, given) - level) / FORCE_STEP
    if axis.on & terms.acts.load:
        rows = LOAD * room.width, PRESS * room.width
        load = load_beside(terms, axis, course, where, room, rows, (LOADS, PRESSES))
    return level, load


@inlined
def states_beside(terms, axis, course, where, a, room):
    """Bring the hidden states of directions to the next sample, where those of the model are. where: as of `midway`; a:
    mean acceleration in m/s^2."""
    place, t, y, v, currents = where
    for c in range(room.lag.size):
        if room.ways[c] & MOVES:
            given = currents_beside(terms, axis, course, (place, currents), c, room)
            advance_by(terms, beside(axis, room.params, c), course.dt, a, (place, t, y, v, given))
        elif room.ways[c] & ASKED:
            for k in range(STATE_START, STATE_START + STATE_SIZE):
                room.params[c, k] = axis.p[k]
