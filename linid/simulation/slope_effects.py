"""How forces and friction with effects answer motion and parameters: what a step's derivatives need of them.

By differences of the terms themselves, some evaluations per instant: most columns share them. How hidden states go on
is told in slope_states.py.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from linid.physics.model import STATE_START
from linid.physics.own_terms.layout import ACCELERATION_BIT, MEMORY_BIT, PUSH_BIT, STRIBECK_BIT
from linid.simulation.binding import allocating, compiled, inlined
from linid.simulation.forces import (
    Axis,
    bristles_of,
    driven_currents,
    friction_factor,
    level_factor,
    reading_error,
    thrust_factor,
    with_effects,
    work_vector,
)
from linid.simulation.friction_slopes import LevelSlopes

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
    beside the motor's own; kept: (n,) places of hidden states, counted from STATE_START; owners: (n,) bits of their
    effects; driven: (3,) whether place, speed and acceleration drive them; by_state: (OWN * n) how what is told answers
    them."""

    moved: Any
    touched: Any
    params: Any
    own: Any
    fast: Any
    pushing: Any
    kept: Any
    owners: Any
    driven: Any
    by_state: Any


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


class FrictionAnswer(NamedTuple):
    """Friction at an instant: the factor on its level and N added before, and how level and fall answer."""

    factor: Any
    load: Any
    level: Any
    fall: Any


@allocating
def acting_on(terms, candidates, tangents):
    """Room for the answers of a model with effects; nothing of it where there are none."""
    acts, on = terms.acts, candidates.on & terms.chosen | terms.always
    count, width = tangents.count, tangents.table.shape[1]
    nothing, none, hidden = np.empty(0, np.int64), np.empty(0), (tangents.kept, tangents.owners, tangents.driven)
    if on & acts.any == 0:
        return Acting(nothing, nothing, np.empty((0, 0)), none, 0, 0, nothing, nothing, tangents.driven, none)
    moved, touched = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    found = 0
    for c in range(count):
        if tangents.touched[c] & on:
            moved[found], touched[found] = c, tangents.touched[c] & on
            found += 1
    work = work_vector(candidates.params[0], 0.0, 0.0, 0.0)
    params, own, by_state = np.zeros((count, work.size)), np.zeros(OWN * width), np.zeros(OWN * tangents.kept.size)
    pushing = acts.thrust | acts.force | acts.pushed | (acts.drive if on & acts.push_by_inputs else 0)
    return Acting(moved[:found], touched[:found], params, own, tangents.fast, pushing, *hidden, by_state)


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
def added_by(terms, axis, bits, at, given):
    """What effects and own terms with these bits add to the forces on the mass, N; given: the motor's force with its
    factor in N, and its inputs."""
    push, currents = given
    force = terms.force(0.0, bits, at.t, at.y, at.v, currents, axis.p)
    if bits & terms.acts.pushed:
        bits |= axis.on & (ACCELERATION_BIT | STRIBECK_BIT | MEMORY_BIT)  # what own terms hang on is told them too
        force = terms.pushed(force, bits, push, at.t, at.y, at.v, currents, axis.p)
    return force


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
def part_at(terms, axis, bits, at, given):
    """A part of the forces of `force_at` that holds all that effects with these bits do; given: as of `added_by`."""
    acts, (push, currents) = terms.acts, given
    if bits & acts.drive:
        return force_at(terms, axis, at)
    if bits & acts.thrust == 0:
        return added_by(terms, axis, bits, at, given)
    push = at.motor * thrust_at(terms, axis, at, currents)
    if axis.on & PUSH_BIT:
        bits |= axis.on & acts.pushed
    return push + added_by(terms, axis, bits, at, (push, currents))


@compiled
def given_at(terms, axis, at):
    """The motor's force with its factor in N, and its inputs."""
    currents = driven_currents(terms, axis, at.t, at.y, at.v, at.currents)
    return at.motor * thrust_at(terms, axis, at, currents), currents


@compiled
def force_by_motor(terms, axis, at, given):
    """How the forces of `force_at` answer the motor's."""
    acts, (push, currents) = terms.acts, given
    factor = thrust_at(terms, axis, at, currents)
    if axis.on & PUSH_BIT:
        step = _PUSH_STEP * (abs(push) + _WEAK)
        bits, after = axis.on & acts.pushed, (push + step, currents)
        more = added_by(terms, axis, bits, at, after) - added_by(terms, axis, bits, at, given)
        return factor * (1.0 + more / step)
    return factor


@compiled
def answer_of_force(terms, axis, acting, at, places):
    """How the forces of `force_at` answer, by differences of the part that changes; places: `places_of`."""
    own, state = places
    given = given_at(terms, axis, at)
    by_speed = by_place = by_motor = 0.0
    bits = acting.fast & axis.on & acting.pushing
    if bits:
        quick, speed = faster(at)
        by_speed = (part_at(terms, axis, bits, quick, given) - part_at(terms, axis, bits, at, given)) / speed
    if at.moves:
        by_place = (force_at(terms, axis, farther(at)) - force_at(terms, axis, at)) / PLACE_STEP
    if axis.powered:
        by_motor = force_by_motor(terms, axis, at, given)
    last, plain = 0, 0.0
    for i in range(acting.moved.size):
        bits, c = acting.touched[i] & acting.pushing, acting.moved[i]
        if bits:
            if bits != last:
                last, plain = bits, part_at(terms, axis, bits, at, given)
            other = part_at(terms, beside(axis, acting.params, c), bits, at, given)
            acting.own[own + c] = (other - plain) / FORCE_STEP
    for k in range(acting.kept.size):
        bits, place = acting.owners[k] & acting.pushing, STATE_START + acting.kept[k]
        if bits:
            if bits != last:
                last, plain = bits, part_at(terms, axis, bits, at, given)
            value, step = nudged(axis.p, place)
            acting.by_state[state + k] = (part_at(terms, axis, bits, at, given) - plain) / step
            axis.p[place] = value
    return Answer(by_motor, by_speed, by_place, own, state)


@compiled
def friction_by(terms, axis, at):
    """Factor on the level of friction, and N added before it."""
    factor, load = 1.0, 0.0
    if axis.on & terms.acts.load:
        push = 0.0
        if axis.powered and axis.on & terms.acts.pressed:
            push = at.motor
            if axis.on & terms.acts.thrust:
                driven = driven_currents(terms, axis, at.t, at.y, at.v, at.currents)
                push *= thrust_factor(terms, axis, at.t, at.y, at.v, driven)
        load = terms.load(0.0, axis.on, push, at.t, at.y, at.v, at.currents, axis.p)
    if axis.on & terms.acts.level:
        factor = level_factor(terms, axis, at.t, at.y, at.v, at.currents)
    return factor, load


@compiled
def answer_of_factor(terms, axis, acting, at, places):
    """The factor on the bristle, and how it answers, which is not by hidden states; places: `places_of`."""
    currents = at.currents
    factor = friction_factor(terms, axis, at.t, at.y, at.v, currents)
    quick, speed = faster(at)
    by_speed, by_place = (friction_factor(terms, axis, at.t, at.y, quick.v, currents) - factor) / speed, 0.0
    if at.moves:
        by_place = (friction_factor(terms, axis, at.t, at.y + PLACE_STEP, at.v, currents) - factor) / PLACE_STEP
    for i in range(acting.moved.size):
        if acting.touched[i] & terms.acts.friction:
            c = acting.moved[i]
            other = friction_factor(terms, beside(axis, acting.params, c), at.t, at.y, at.v, currents)
            acting.own[places[0] + c] = (other - factor) / FORCE_STEP
    return factor, Answer(0.0, by_speed, by_place, *places)


@inlined
def changes(found, other, curve, step):
    """Slopes of level and fall by what changes factor and load from one pair to the other within a step."""
    factor, load = (other[0] - found[0]) / step, (other[1] - found[1]) / step
    return found[0] * load + (curve[0] + found[1]) * factor, curve[1] * factor


@compiled
def answer_of_friction(terms, axis, acting, at, curve, places):
    """How friction answers. curve: level and fall in N without effects; places: `places_of` level and fall."""
    of_level, of_fall = places
    acts = terms.acts
    found = friction_by(terms, axis, at)
    quick, speed = faster(at)
    level_speed, fall_speed = changes(found, friction_by(terms, axis, quick), curve, speed)
    level_place = fall_place = level_motor = fall_motor = 0.0
    if at.moves:
        level_place, fall_place = changes(found, friction_by(terms, axis, farther(at)), curve, PLACE_STEP)
    if axis.powered and axis.on & terms.acts.pressed:
        hard, push = harder(at)
        level_motor, fall_motor = changes(found, friction_by(terms, axis, hard), curve, push)
    changing = acts.load | acts.level | (acts.drive | acts.thrust if axis.on & acts.pressed else 0)
    for i in range(acting.moved.size):
        if acting.touched[i] & changing:
            c = acting.moved[i]
            level, fall = changes(found, friction_by(terms, beside(axis, acting.params, c), at), curve, FORCE_STEP)
            acting.own[of_level[0] + c], acting.own[of_fall[0] + c] = level, fall
    for k in range(acting.kept.size):
        if acting.owners[k] & changing:
            place = STATE_START + acting.kept[k]
            value, step = nudged(axis.p, place)
            level, fall = changes(found, friction_by(terms, axis, at), curve, step)
            acting.by_state[of_level[1] + k], acting.by_state[of_fall[1] + k] = level, fall
            axis.p[place] = value
    return FrictionAnswer(
        found[0],
        found[1],
        Answer(level_motor, level_speed, level_place, *of_level),
        Answer(fall_motor, fall_speed, fall_place, *of_fall),
    )


@inlined
def with_answer(plain, answer):
    """Level and fall of friction as effects make them, with their derivatives by speed and by friction's parameters."""
    f, level, fall = answer.factor, plain.level_by, plain.fall_by
    return LevelSlopes(
        f * (plain.level + answer.load),
        f * plain.fall,
        (f * level[0] + answer.level.by_speed, f * level[1], f * level[2], f * level[3], f * level[4]),
        (f * fall[0] + answer.fall.by_speed, f * fall[1], f * fall[2], f * fall[3], f * fall[4]),
    )


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
