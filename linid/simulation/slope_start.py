"""Derivatives that a simulation starts with: of hidden states, forces and the bristle, as the model has them."""

from __future__ import annotations

import math

from linid.physics.model import STATE_START
from linid.simulation.binding import compiled
from linid.simulation.lanes import LANES, lanes_at, put_lanes
from linid.simulation.slope_carry import answered, beyond, motions_at, no_answer
from linid.simulation.slope_effects import (
    FACTOR,
    FORCE_STEP,
    MIDDLE,
    MIDDLE_FALL,
    PLACE_STEP,
    START_LEVEL,
    answer_of_force,
    beside,
    faster_by,
    places_of,
)
from linid.simulation.slope_resistance import FrictionAnswer, answer_of_factor, answer_of_friction, with_answer
from linid.simulation.slope_states import AT_START, states_are_now
from linid.simulation.slope_steps import columns_at, curve_at, level_lanes


@compiled
def begun(terms, axis, at, y, v):
    """Put in the effects' own hidden states of an axis that starts at an instant, but for its place and speed."""
    terms.initial(axis.on, at.t, y, v, at.currents, axis.p)


@compiled
def start_hidden(terms, along, at, start):
    """Put in the hidden states at the start, and their slopes where they are the effects' own (`started`)."""
    axis, acting, hidden, width = along.axis, along.acting, along.hidden, along.table.shape[1]
    p, n, motion = axis.p, acting.kept.size, along.carried.motion
    for k in range(n):
        hidden.now[k] = p[STATE_START + acting.kept[k]]
    if start.size <= 3 or math.isnan(start[3]):
        begun(terms, axis, at, at.y + PLACE_STEP, at.v)
        for k in range(n):
            by_place = (p[STATE_START + acting.kept[k]] - hidden.now[k]) / PLACE_STEP
            for c in range(width):
                hidden.slopes[k * width + c] = by_place * motion[c]
        step = faster_by(at.v) if at.v != 0.0 else 0.0  # an axis at rest stays at rest
        begun(terms, axis, at, at.y, at.v + step)
        for k in range(n if step > 0.0 else 0):
            by_speed = (p[STATE_START + acting.kept[k]] - hidden.now[k]) / step
            for c in range(width):
                hidden.slopes[k * width + c] += by_speed * motion[width + c]
        for i in range(acting.moved.size):
            c = acting.moved[i]
            if acting.touched[i] & terms.acts.advance:
                for k in range(n):  # which an effect without a start of its own leaves
                    acting.params[c, STATE_START + acting.kept[k]] = 0.0
                begun(terms, beside(axis, acting.params, c), at, at.y, at.v)
                for k in range(n):
                    own = (acting.params[c, STATE_START + acting.kept[k]] - hidden.now[k]) / FORCE_STEP
                    hidden.slopes[k * width + c] += own
    states_are_now(along)


@compiled
def lean(along, step):
    """Put the hidden states of directions a step off those of the model, each along its own slopes."""
    axis, acting, slopes, width = along.axis, along.acting, along.hidden.slopes, along.table.shape[1]
    for c in acting.moved:
        for k in range(acting.kept.size):
            place = STATE_START + acting.kept[k]
            acting.params[c, place] = axis.p[place] + step * slopes[k * width + c]


@compiled
def start_forces(terms, along, at):
    """Put in the slopes of the outer force at the start, where effects change it."""
    carried, acting, width = along.carried, along.acting, along.table.shape[1]
    lean(along, FORCE_STEP)  # each column at its own start: a load may lean on the side of a gap
    answer = answer_of_force(terms, along.axis, acting, at, places_of(MIDDLE, width, acting))
    lean(along, 0.0)
    for i in range(acting.moved.size):
        c = acting.moved[i]
        for k in range(acting.kept.size):
            if acting.touched[i] & acting.owners[k] & terms.acts.push:
                acting.own[answer.own + c] -= acting.by_state[answer.state + k] * along.hidden.slopes[k * width + c]
    for block in range(0, width, LANES):
        motions, push = motions_at(carried, width, block), lanes_at(carried.force, block)
        put_lanes(carried.force, block, answered(along, answer, block, push, motions.v, motions.y, AT_START))


@compiled
def start_factor(terms, along, at):
    """Put in the slopes of the factor on the bristle at the start; returns it."""
    carried, acting, width = along.carried, along.acting, along.table.shape[1]
    factor, answer = answer_of_factor(terms, along.axis, acting, at, places_of(FACTOR, width, acting))
    for block in range(0, width, LANES):
        motions = motions_at(carried, width, block)
        by = answered(along, answer, block, lanes_at(carried.force, block), motions.v, motions.y, AT_START)
        put_lanes(carried.factor, block, by)
    return factor


@compiled
def start_bristles(terms, along, at, motion, motor, factor):
    """Put in the slopes of a bristle that follows from the model at the start (`started`). at: `Instant`; motor: slopes
    (width) of the motor's force then; factor: on the bristle."""
    axis, bristles, table, carried = along.axis, along.bristles, along.table, along.carried
    acting, width, sigma_0 = along.acting, table.shape[1], bristles.sigma_0
    slides = abs(motion.v) > 0.0
    level = curve_at(bristles, motion.v, carried.bent)
    nothing = no_answer(width, acting)
    answer = FrictionAnswer(1.0, 0.0, nothing, nothing)
    if axis.on & terms.acts.load or axis.on & terms.acts.level:
        curve = (level.level, level.fall) if slides else (bristles.static, 0.0)
        places = places_of(START_LEVEL, width, acting), places_of(MIDDLE_FALL, width, acting)
        answer = answer_of_friction(terms, axis, acting, at, curve, places)
        level = with_answer(level, answer)
    turn = math.copysign(1.0, motion.w)
    breakaway = answer.factor * (bristles.static + answer.load)
    asked = motion.force / factor
    breaks = 1.0 if not slides and abs(asked) >= breakaway else 0.0
    for block in range(0, width, LANES):
        columns, motions = columns_at(table, width, block), motions_at(carried, width, block)
        most = answer.factor * columns.static
        if slides:
            most = level_lanes(level.level_by, motions.v, columns)
        most = most + beyond(along, answer.level, block, lanes_at(motor, block), motions.y, AT_START)
        held = turn * most
        if not slides:
            free = (1.0 / factor) * (lanes_at(carried.force, block) - asked * lanes_at(carried.factor, block))
            held = (turn * breaks) * most + (1.0 - breaks) * free
        put_lanes(carried.motion, block + 2 * width, (1.0 / sigma_0) * (held - motion.w * columns.sigma_0))
