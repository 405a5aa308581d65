"""How forces with effects answer motion and parameters: what a step's derivatives need of them.

By differences of the terms themselves, some evaluations per instant: most columns share them; of own terms exactly
(own_slopes.py). Friction is told in slope_resistance.py, how hidden states go on in slope_states.py.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from linid.physics.model import STATE_START
from linid.physics.own_terms.layout import FORCE_BIT, LEVEL_BIT, LOAD_BIT, MEMORY_BIT
from linid.simulation.binding import allocating, compiled, inlined
from linid.simulation.forces import (
    Axis,
    bristles_of,
    driven_currents,
    reading_error,
    thrust_factor,
    with_effects,
    work_vector,
)
from linid.simulation.own_slopes import add_columns, add_memory, answer_by_motion, own_slopes_of, put_answers
from linid.simulation.own_terms import FORCE

# Steps of differences: of a search coordinate, whose forces are smooth to the last bits, of which it leaves half; of a
# speed with so many m/s, of a place in m, of a force with so many N, of a hidden state with so much in its own unit.
FORCE_STEP, PLACE_STEP = 2e-8, 1e-8
_SPEED_STEP, _SLOW, _PUSH_STEP, _WEAK, _STATE_STEP, _FAINT = 1e-6, 1e-2, 1e-6, 1.0, 1e-7, 1e-2
# Where the columns' own slopes stand, in widths: of the force in the middle of a step and at its end, of friction's
# level at its start and in its middle with its fall, of the reading, of the factor on the bristle; of what has none.
MIDDLE, END, START_LEVEL, MIDDLE_LEVEL, MIDDLE_FALL, READING, FACTOR, NONE, OWN = range(9)


class Acting(NamedTuple):
    """Directions beside a model with effects. moved: (E,) which of them change what effects do; touched: (E,) bits of
    these effects; params: (K, WORK_SIZE) a FORCE_STEP along each, or empty; own: (OWN * width) their own slopes, in the
    unit of what is told; fast, pushing: bits of the effects whose forces hang on speed, and of those that change forces
    beside the motor's own; told: bits of those that the forces at a recording's points hold already, none of which is
    pushing; kept: (n,) places of hidden states, counted from STATE_START; owners: (n,) bits of their
    effects; driven: (3,) bits of those whose states place, speed and acceleration drive; by_state: (OWN * n) how what
    is told answers hidden states; of_own: of `own_slopes_of`."""

    moved: Any
    touched: Any
    params: Any
    own: Any
    fast: Any
    pushing: Any
    told: Any
    kept: Any
    owners: Any
    driven: Any
    by_state: Any
    of_own: Any


class Instant(NamedTuple):
    """t: s in the recording; y: m; v: m/s; currents: inputs; motor: force of the motor alone, N; moves: whether the
    place is the simulated one."""

    t: Any
    y: Any
    v: Any
    currents: Any
    motor: Any
    moves: Any


class Answer(NamedTuple):
    """How something answers the motor's force, the speed and the place; own, state: where in `Acting.own` the columns'
    own slopes begin, and in `Acting.by_state` the answers to hidden states."""

    by_motor: Any
    by_speed: Any
    by_place: Any
    own: Any
    state: Any


@allocating
def acting_on(terms, candidates, tangents):
    """Room for the answers of a model with effects; nothing of it where there are none."""
    acts, on = terms.acts, candidates.on & terms.chosen | terms.always
    count, width = tangents.count, tangents.table.shape[1]
    nothing, none, hidden = np.empty(0, np.int64), np.empty(0), (tangents.kept, tangents.owners, tangents.driven)
    of_own = own_slopes_of(on, candidates.params, count, FORCE_STEP)
    if on & acts.any == 0:
        return Acting(
            nothing, nothing, np.empty((0, 0)), none, 0, 0, 0, nothing, nothing, tangents.driven, none, of_own
        )
    moved, touched = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    found = 0
    for c in range(count):
        if tangents.touched[c] & on:
            moved[found], touched[found] = c, tangents.touched[c] & on
            found += 1
    work = work_vector(candidates.params[0], 0.0, 0.0, 0.0)
    params, own, by_state = np.zeros((count, work.size)), np.zeros(OWN * width), np.zeros(OWN * tangents.kept.size)
    pushing = acts.thrust | acts.force | (acts.drive if on & acts.push_by_inputs else 0)
    bits = tangents.fast, pushing & ~tangents.told, tangents.told & on
    return Acting(moved[:found], touched[:found], params, own, *bits, *hidden, by_state, of_own)


@allocating
def of_recording(p, inputs, r):
    """Parameters with room for what effects need, for recording r."""
    return work_vector(p, inputs.records[r], inputs.elapsed[r], inputs.added_mass[r])


@allocating
def along_directions(candidates, params, inputs, r):
    """Put the parameters of all directions in, for recording r."""
    for c in range(params.shape[0]):
        found = of_recording(candidates.params[1 + c], inputs, r)
        for k in range(found.size):  # an array set as a whole is compiled for seconds
            params[c, k] = found[k]


@inlined
def beside(axis, params, c):
    """The axis a FORCE_STEP along direction c, but for its motor; params: of all directions."""
    return Axis(axis.on, axis.powered, axis.motor, axis.harmonics, axis.wavenumber, axis.phase, params[c], axis.table)


@inlined
def without_own(axis):
    """The axis without what own terms add: their answers come from own_slopes.py."""
    on = axis.on & ~(FORCE_BIT | LEVEL_BIT | LOAD_BIT)
    return Axis(on, axis.powered, axis.motor, axis.harmonics, axis.wavenumber, axis.phase, axis.p, axis.table)


@compiled
def bristles_beside(terms, axis, params, c, added_mass):
    """Friction and mass a FORCE_STEP along direction c."""
    return bristles_of(terms, beside(axis, params, c), added_mass)


@allocating
def table_of(terms, axis, params, added_mass, table):
    """Directions of friction's parameters (8, width) with what effects make of static force and mass."""
    out = table.copy()
    if axis.on & (terms.acts.mass | terms.acts.static) == 0:
        return out
    base = bristles_of(terms, axis, added_mass)
    for c in range(params.shape[0]):
        other = bristles_beside(terms, axis, params, c, added_mass)
        out[1, c] = (other.static - base.static) / FORCE_STEP
        out[7, c] = (other.mass - base.mass) / FORCE_STEP
    return out


@compiled
def force_at(terms, axis, at):
    """All forces on the mass but friction in N, by the motor's."""
    currents = driven_currents(terms, axis, at.t, at.y, at.v, at.currents)
    return with_effects(terms, axis, at.t, at.y, at.v, currents, at.motor)


@inlined
def live(axis, acting):
    """Bits of the effects and own terms that the forces at a recording's points do not hold."""
    return axis.on & ~acting.told


@compiled
def force_beside(terms, axis, acting, at):
    """`force_at`, given in place of the motor's force all that is told beforehand."""
    if acting.told == 0:
        return force_at(terms, axis, at)
    on, given = live(axis, acting), (at.t, at.y, at.v, at.currents)
    force = terms.force(at.motor, on, *given, axis.p)
    if on & terms.acts.pushed:
        force = terms.pushed(force, on, at.motor, *given, axis.p)
    return force


@compiled
def library_force_at(terms, axis, at):
    """`force_at` without own terms."""
    return force_at(terms, without_own(axis), at)


@inlined
def faster_by(v):
    """A little more speed, m/s."""
    return _SPEED_STEP * (abs(v) + _SLOW)


@inlined
def nudged(p, place):
    """Put a little more of a hidden state in place of it; returns the state itself and how much more, in its unit."""
    value = p[place]
    step = _STATE_STEP * (abs(value) + _FAINT)
    p[place] = value + step
    return value, step


@inlined
def faster(at):
    """The instant with a little more speed, and how much more."""
    step = faster_by(at.v)
    return Instant(at.t, at.y, at.v + step, at.currents, at.motor, at.moves), step


@inlined
def farther(at):
    """The instant a little farther on."""
    return Instant(at.t, at.y + PLACE_STEP, at.v, at.currents, at.motor, at.moves)


@inlined
def harder(at):
    """The instant with a little more of the motor's force, and how much more."""
    step = _PUSH_STEP * (abs(at.motor) + _WEAK)
    return Instant(at.t, at.y, at.v, at.currents, at.motor + step, at.moves), step


@inlined
def places_of(kind, width, acting):
    """Where answers of a kind stand: the columns' own, and those to hidden states."""
    return kind * width, kind * acting.kept.size


@compiled
def added_by(terms, axis, bits, at, currents):
    """What effects with these bits add to the forces on the mass, N; currents: what the motor gets."""
    return terms.force(0.0, bits, at.t, at.y, at.v, currents, axis.p)


@inlined
def of_motor(terms):
    """Bits of what changes the motor's force itself."""
    return terms.acts.drive | terms.acts.field | terms.acts.thrust


@inlined
def thrust_at(terms, axis, at, currents):
    """The factor on the motor's force; currents: the inputs that it gets."""
    if axis.powered and axis.on & terms.acts.thrust:
        return thrust_factor(terms, axis, at.t, at.y, at.v, currents)
    return 1.0


@compiled
def part_at(terms, axis, bits, at, currents):
    """A part of the forces of `library_force_at` that holds all that effects with these bits do; currents: what the
    motor gets but for them."""
    acts = terms.acts
    if bits & acts.drive:
        return library_force_at(terms, axis, at)
    if bits & acts.thrust == 0:
        return added_by(terms, axis, bits, at, currents)
    return at.motor * thrust_at(terms, axis, at, currents) + added_by(terms, axis, bits, at, currents)


@compiled
def given_at(terms, axis, at):
    """The motor's force with its factor in N, and its inputs."""
    currents = driven_currents(terms, axis, at.t, at.y, at.v, at.currents)
    return at.motor * thrust_at(terms, axis, at, currents), currents


@inlined
def answer_of_force(terms, axis, acting, at, places):
    """How all forces on the mass but friction answer: those of effects by differences of the part that changes.

    at: with all forces that are told beforehand in place of the motor's; places: `places_of`."""
    own, state = places
    push, currents = at.motor, at.currents
    if acting.told == 0:
        push, currents = given_at(terms, axis, at)
    by_speed = by_place = by_motor = 0.0
    bits = acting.fast & axis.on & acting.pushing
    if bits:
        quick, speed = faster(at)
        by_speed = (part_at(terms, axis, bits, quick, currents) - part_at(terms, axis, bits, at, currents)) / speed
    if at.moves:
        by_place = (library_force_at(terms, axis, farther(at)) - library_force_at(terms, axis, at)) / PLACE_STEP
    if axis.powered:
        by_motor = 1.0 if acting.told else thrust_at(terms, axis, at, currents)
    last, plain = 0, 0.0
    for i in range(acting.moved.size):
        bits, c = acting.touched[i] & acting.pushing, acting.moved[i]
        acting.own[own + c] = 0.0
        if bits:
            if bits != last:
                last, plain = bits, part_at(terms, axis, bits, at, currents)
            other = part_at(terms, beside(axis, acting.params, c), bits, at, currents)
            acting.own[own + c] = (other - plain) / FORCE_STEP
    for k in range(acting.kept.size):
        bits, place = acting.owners[k] & acting.pushing, STATE_START + acting.kept[k]
        acting.by_state[state + k] = 0.0
        if bits:
            if bits != last:
                last, plain = bits, part_at(terms, axis, bits, at, currents)
            value, step = nudged(axis.p, place)
            acting.by_state[state + k] = (part_at(terms, axis, bits, at, currents) - plain) / step
            axis.p[place] = value
    answer = Answer(by_motor, by_speed, by_place, own, state)
    return with_own_force(terms, axis, acting, at, push, answer) if axis.on & FORCE_BIT else answer


@compiled
def with_own_force(terms, axis, acting, at, push, answer):
    """`answer_of_force` with own terms; push: the motor's force with its factor in N, answer: without them."""
    p, of_own = axis.p, acting.of_own
    put_answers(p, axis.on, FORCE, push, at.t, at.y, at.v, of_own)
    mine = answer_by_motion(p, axis.on, push, at.y, at.v, of_own)
    beside_it, to = (acting.params, FORCE_STEP), (acting.own, answer.own, 1.0)
    add_columns(p, axis.on, (push, at.v), beside_it, of_own, to)
    if axis.on & MEMORY_BIT:
        add_memory(p, at.y, of_own, 1.0, acting.by_state, (answer.state, answer.state + acting.kept.size))
    return with_own_answer(terms, axis, acting, at, push, mine, answer)


@compiled
def with_own_answer(terms, axis, acting, at, push, mine, answer):
    """An answer with that of own terms, by what moves the motor's force too. push: that with its factor in N; mine: of
    own terms (`OwnAnswer`); answer: without them, but for what columns change of them."""
    by_motor, by_speed, by_place = answer.by_motor, answer.by_speed + mine.by_speed, answer.by_place
    if at.moves:
        by_place += mine.by_place
    by_push, moving = mine.by_push, axis.on & (terms.acts.thrust | terms.acts.drive)
    if by_push != 0.0 and axis.powered:
        by_motor += by_push * thrust_at(terms, axis, at, given_at(terms, axis, at)[1])
    if by_push != 0.0 and moving:
        quick, speed = faster(at)
        by_speed += by_push * (given_at(terms, axis, quick)[0] - push) / speed
        if at.moves:
            by_place += by_push * (given_at(terms, axis, farther(at))[0] - push) / PLACE_STEP
        for i in range(acting.moved.size):
            if acting.touched[i] & moving:
                c = acting.moved[i]
                other = given_at(terms, beside(axis, acting.params, c), at)[0]
                acting.own[answer.own + c] += by_push * (other - push) / FORCE_STEP
        for k in range(acting.kept.size):
            if acting.owners[k] & moving:
                value, step = nudged(axis.p, STATE_START + acting.kept[k])
                acting.by_state[answer.state + k] += by_push * (given_at(terms, axis, at)[0] - push) / step
                axis.p[STATE_START + acting.kept[k]] = value
    return Answer(by_motor, by_speed, by_place, answer.own, answer.state)


@compiled
def answer_of_reading(terms, axis, acting, at, places):
    """How the reading error in m answers speed and place; places: `places_of`."""
    own, state = places
    on, p = axis.on, axis.p
    error = reading_error(terms, on, at.t, at.y, at.v, at.currents, p)
    quick, speed = faster(at)
    by_speed = (reading_error(terms, on, at.t, at.y, quick.v, at.currents, p) - error) / speed
    by_place = (reading_error(terms, on, at.t, at.y + PLACE_STEP, at.v, at.currents, p) - error) / PLACE_STEP
    for i in range(acting.moved.size):
        if acting.touched[i] & terms.acts.sensor:
            c = acting.moved[i]
            other = reading_error(terms, on, at.t, at.y, at.v, at.currents, acting.params[c])
            acting.own[own + c] = (other - error) / FORCE_STEP
    for k in range(acting.kept.size):
        if acting.owners[k] & terms.acts.sensor:
            place = STATE_START + acting.kept[k]
            value, step = nudged(p, place)
            acting.by_state[state + k] = (reading_error(terms, on, at.t, at.y, at.v, at.currents, p) - error) / step
            p[place] = value
    return Answer(0.0, by_speed, by_place, own, state)
