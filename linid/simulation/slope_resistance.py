"""How friction with effects answers motion and parameters, as slope_effects.py tells it of forces."""

from __future__ import annotations

from typing import Any, NamedTuple

from linid.physics.model import STATE_START
from linid.physics.own_terms.layout import LEVEL_BIT, LOAD_BIT, MEMORY_BIT
from linid.simulation.binding import compiled, inlined
from linid.simulation.forces import friction_factor, level_factor
from linid.simulation.friction_slopes import LevelSlopes
from linid.simulation.own_slopes import OwnAnswer, add_columns, add_memory, answer_by_motion, put_answers
from linid.simulation.own_terms import LEAST_LEVEL, LEVEL
from linid.simulation.slope_effects import (
    FORCE_STEP,
    PLACE_STEP,
    Answer,
    beside,
    farther,
    faster,
    given_at,
    harder,
    nudged,
    with_own_answer,
    without_own,
)


class FrictionAnswer(NamedTuple):
    """Friction at an instant: the factor on its level and N added before, and how level and fall answer."""

    factor: Any
    load: Any
    level: Any
    fall: Any


@compiled
def friction_by(terms, axis, at):
    """Factor on the level of friction, and N added before it."""
    factor, load = 1.0, 0.0
    if axis.on & terms.acts.load:
        push = given_at(terms, axis, at)[0] if axis.powered and axis.on & terms.acts.pressed else 0.0
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
    acts, plain = terms.acts, without_own(axis)
    found = friction_by(terms, plain, at)
    factor, load = friction_by(terms, axis, at) if axis.on & LEVEL_BIT else found
    curve = (curve[0] + load - found[1], curve[1])
    quick, speed = faster(at)
    level_speed, fall_speed = changes(found, friction_by(terms, plain, quick), curve, speed)
    level_place = fall_place = level_motor = fall_motor = 0.0
    if at.moves:
        level_place, fall_place = changes(found, friction_by(terms, plain, farther(at)), curve, PLACE_STEP)
    if axis.powered and plain.on & acts.pressed:
        hard, push = harder(at)
        level_motor, fall_motor = changes(found, friction_by(terms, plain, hard), curve, push)
    changing = acts.level | (acts.load & ~LEVEL_BIT) | (acts.drive | acts.thrust if plain.on & acts.pressed else 0)
    for i in range(acting.moved.size):
        c, level, fall = acting.moved[i], 0.0, 0.0
        if acting.touched[i] & changing:
            level, fall = changes(found, friction_by(terms, beside(plain, acting.params, c), at), curve, FORCE_STEP)
        acting.own[of_level[0] + c], acting.own[of_fall[0] + c] = level, fall
    for k in range(acting.kept.size):
        level = fall = 0.0
        if acting.owners[k] & changing:
            place = STATE_START + acting.kept[k]
            value, step = nudged(axis.p, place)
            level, fall = changes(found, friction_by(terms, plain, at), curve, step)
            axis.p[place] = value
        acting.by_state[of_level[1] + k], acting.by_state[of_fall[1] + k] = level, fall
    by_level = Answer(level_motor, level_speed, level_place, *of_level)
    if axis.on & LEVEL_BIT:
        by_level = with_own_level(terms, axis, acting, at, (factor, found[1]), by_level)
    return FrictionAnswer(factor, load, by_level, Answer(fall_motor, fall_speed, fall_place, *of_fall))


@compiled
def with_own_level(terms, axis, acting, at, found, answer):
    """How the level of friction answers with own terms; found, answer: the factor on it and N added before, and how it
    answers, without them."""
    p, of_own, factor = axis.p, acting.of_own, found[0]
    push = given_at(terms, axis, at)[0] if axis.powered and axis.on & LOAD_BIT else 0.0
    level = put_answers(p, axis.on, LEVEL, push, at.t, at.y, at.v, of_own)
    if found[1] + level < (LEAST_LEVEL - 1.0) * p[0]:
        return answer
    mine = answer_by_motion(p, axis.on, push, at.y, at.v, of_own)
    mine = OwnAnswer(factor * mine.by_push, factor * mine.by_speed, factor * mine.by_place)
    beside_it, to = (acting.params, FORCE_STEP), (acting.own, answer.own, factor)
    add_columns(p, axis.on, (push, at.v), beside_it, of_own, to)
    if axis.on & MEMORY_BIT:
        add_memory(p, at.y, of_own, factor, acting.by_state, (answer.state, answer.state + acting.kept.size))
    return with_own_answer(terms, axis, acting, at, push, mine, answer)


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
