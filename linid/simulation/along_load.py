"""Friction that the motor's force and own terms add along a measured motion, and how directions beside a model change
it."""

from __future__ import annotations

from linid.physics.own_terms.layout import LEVEL_BIT, LOAD_BIT
from linid.simulation.along_own import own_columns
from linid.simulation.binding import compiled, inlined
from linid.simulation.own_slopes import answer_by_motion, put_answers
from linid.simulation.own_terms import LEAST_LEVEL, LEVEL
from linid.simulation.slope_effects import FORCE_STEP, Instant, beside, given_at
from linid.simulation.splines_at import late_inputs


@inlined
def currents_beside(terms, axis, course, place, c, room):
    """The inputs that act at a place (in samples) in direction c, given those of the model."""
    x, currents = place
    if axis.powered and axis.on & terms.acts.delay:
        return late_inputs(course.coefficients, course.dt, x * course.dt - room.lag[c])
    return currents


@inlined
def pressing_at(room, row, place):
    """The motor's own force in N at a sample or in the middle after it; row: of which of those that are known."""
    k = int(place)
    return room.pressing[row, k] if place > k else room.motor[row, k]


@compiled
def load_beside(terms, axis, course, where, room, rows, ways):
    """N that effects and own terms add to the level of friction, and how that answers, put in. where: place in samples,
    time, position, speed, inputs; rows: where what is carried of that and of the motor's force begins; ways: bits of
    directions that change the friction, and that force."""
    (place, t, y, v, currents), (start, push_start), (loads, presses) = where, rows, ways
    carried, push, load = room.carried, 0.0, 0.0
    if axis.powered and axis.on & terms.acts.pressed:
        push = given_at(terms, axis, Instant(t, y, v, currents, pressing_at(room, 0, place), False))[0]
        for c in range(room.lag.size):
            if room.ways[c] & presses:
                given = currents_beside(terms, axis, course, (place, currents), c, room)
                there = Instant(t, y, v, given, pressing_at(room, room.row[c], place), False)
                other = given_at(terms, beside(axis, room.params, c), there)[0]
                carried[push_start + c] = (other - push) / FORCE_STEP
    bits = axis.on & terms.acts.load & ~LEVEL_BIT
    if bits:
        load = terms.load(0.0, bits, push, t, y, v, currents, axis.p)
    for c in range(room.lag.size):
        carried[start + c] = 0.0
        if bits and room.ways[c] & loads:
            given = currents_beside(terms, axis, course, (place, currents), c, room)
            harder = push + FORCE_STEP * carried[push_start + c]
            other = terms.load(0.0, bits, harder, t, y, v, given, room.params[c])
            carried[start + c] = (other - load) / FORCE_STEP
    if axis.on & LEVEL_BIT:
        return own_level(axis, (t, y, v), (push, load), room, rows)
    return load


@compiled
def own_level(axis, when, known, room, rows):
    """`load_beside` with own terms. when: time, position, speed; known: the motor's force in N, and what effects add;
    rows: as there."""
    (t, y, v), (push, load), (start, push_start) = when, known, rows
    least, carried, on = (LEAST_LEVEL - 1.0) * axis.p[0], room.carried, axis.on
    load += put_answers(axis.p, on, LEVEL, push, t, y, v, room.own)
    if load < least:
        for c in range(room.lag.size):
            carried[start + c] = 0.0
        return least
    if on & LOAD_BIT:
        by_push = answer_by_motion(axis.p, on, push, y, v, room.own).by_push
        for c in range(room.lag.size):
            carried[start + c] += by_push * carried[push_start + c]
    own_columns(axis, push, v, room, start)
    return load
