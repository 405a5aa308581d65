"""Derivatives taken along a step of a simulation."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.simulation.binding import inlined
from linid.simulation.course import FINEST, inputs_then, parabola_at
from linid.simulation.forces import force_once
from linid.simulation.lanes import LANES, lanes_at, put_lanes
from linid.simulation.slope_effects import (
    END,
    FACTOR,
    MIDDLE,
    MIDDLE_FALL,
    MIDDLE_LEVEL,
    NONE,
    START_LEVEL,
    Answer,
    Instant,
    answer_of_force,
    force_beside,
    live,
    places_of,
)
from linid.simulation.slope_resistance import FrictionAnswer, answer_of_factor, answer_of_friction, with_answer
from linid.simulation.slope_states import (
    AT_END,
    AT_MIDDLE,
    AT_START,
    answers_of_states,
    carry_settled,
    carry_to_end,
    step_begins,
    step_ends,
    way_as_settled,
    way_to_end,
    way_to_middle,
)
from linid.simulation.slope_steps import (
    Motions,
    Pushes,
    bristle_lanes,
    columns_at,
    curve_at,
    level_lanes,
    linear_lanes,
    linear_of,
    predicted_lanes,
    predictor_of,
    scaled_bristles,
    scaled_columns,
    slid_lanes,
)
from linid.simulation.splines_at import spline_at
from linid.simulation.steps import Middle, Reach, impulse, reach_of


class Carried(NamedTuple):
    """What goes along with a simulation: slopes (3 * width) of y, v and w; (width) of the outer force now, and of the
    factor on the bristle as it was last; (points * width) of the motor's forces at the recording's points, those of one
    point without a motor; bent: whether alpha is a direction."""

    motion: Any
    force: Any
    factor: Any
    forces: Any
    bent: Any


class Along(NamedTuple):
    """A simulation and its directions: axis, bristles, course; table: (8, width) directions of friction and mass;
    carried; acting: what effects need (slope_effects.py); motor: its force in N at the recording's points, or empty;
    hidden: states of effects (slope_states.py)."""

    axis: Any
    bristles: Any
    course: Any
    table: Any
    carried: Any
    acting: Any
    motor: Any
    hidden: Any


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


@inlined
def answered(along, answer, block, push, speed, place, when):
    """Slopes of what answers the motor's force, the speed and the place, given those of these, and hidden states as
    they are then."""
    known = answer.by_motor * push + answer.by_speed * speed + answer.by_place * place
    return known + by_states(along, answer, block, when)


@inlined
def by_states(along, answer, block, when):
    """Slopes of what answers hidden states, and the columns' own."""
    acting, hidden, width = along.acting, along.hidden, along.table.shape[1]
    n = acting.kept.size
    total = lanes_at(acting.own, answer.own + block)
    for k in range(n):
        slopes = lanes_at(hidden.slopes, (when * n + k) * width + block)
        total = total + acting.by_state[answer.state + k] * slopes
    return total


@inlined
def no_answer(width, acting):
    """Of what nothing changes."""
    return Answer(0.0, 0.0, 0.0, np.int64(NONE * width), NONE * acting.kept.size)


@inlined
def unanswered(width, acting):
    """What `answers_of_step` gives where nothing changes."""
    push = no_answer(width, acting)
    friction = FrictionAnswer(1.0, 0.0, push, push)
    return push, push, friction, friction, (1.0, push)


@inlined
def answers_of_slide(terms, along, motion, slid, v_mid, moment, points):
    """Force in the middle of a step of fast sliding in N, how that and the one at its end answer, and how hidden states
    do, put in. slid: the motion after it; moment: (n, x, h) of the step's end, x s after sample n; points: those of the
    motor's forces in its middle and at its end."""
    axis, course, width = along.axis, along.course, along.table.shape[1]
    acting, hidden, moving = along.acting, along.hidden, axis.on & terms.acts.advance
    n, x, h = moment
    half, moves = 0.5 * h, not course.guided
    t = course.t_start + n * course.dt + x
    y_mid, y_end = motion.y + 0.5 * half * (motion.v + v_mid), motion.y + h * v_mid
    if course.guided:
        y_mid, y_end = spline_at(course.coefficients, n, 3, x - half), spline_at(course.coefficients, n, 3, x)
    now = then = motion.currents
    push = push_end = 0.0
    if axis.powered:
        now = inputs_then(terms, axis, course, n, x, half)
        then = inputs_then(terms, axis, course, n, x, 0.0)
        push, push_end = along.motor[points[0]], along.motor[points[1]]
    middle = Instant(t - half, y_mid, v_mid, now, push, moves)
    end = Instant(t, y_end, 2.0 * v_mid - motion.v, then, push_end, moves)
    reach = Reach(n, h, x, t - half, y_mid, y_end, 2.0 * v_mid - motion.v)
    if moving:
        step_begins(along)
        answers_of_states(terms, axis, acting, hidden, way_to_middle(reach, motion, v_mid))
    force = force_beside(terms, axis, acting, middle)
    at_middle = answer_of_force(terms, axis, acting, middle, places_of(MIDDLE, width, acting))
    if moving:
        answers_of_states(terms, axis, acting, hidden, way_to_end(reach, motion, v_mid, now))
    at_end = answer_of_force(terms, axis, acting, end, places_of(END, width, acting))
    if moving:
        answers_of_states(terms, axis, acting, hidden, way_as_settled(reach, motion, slid, now))
        step_ends(along)
    return force, at_middle, at_end


@inlined
def carry_sliding(terms, along, motion, slid, weights, moment, points):
    """Take the slopes along a step of fast sliding. weights: of the step; moment, points: as in `answers_of_slide`."""
    axis, bristles, carried, width = along.axis, along.bristles, along.carried, along.table.shape[1]
    v, h = motion.v, moment[2]
    force = along.motor[points[0]] if axis.powered else 0.0
    turn = math.copysign(1.0, v)
    per_mass = 0.5 * h / bristles.mass
    v_mid = v + per_mass * (motion.force - turn * bristles.coulomb - bristles.sigma_2 * v)
    at_middle = at_end = no_answer(width, along.acting)
    answers = live(axis, along.acting) & (terms.acts.push | terms.acts.advance) != 0
    if answers:
        force, at_middle, at_end = answers_of_slide(terms, along, motion, slid, v_mid, moment, points)
    mean, rise = impulse(motion.force, force, slid.force)
    for block in range(0, width, LANES):
        start = lanes_at(carried.force, block)
        middle = lanes_at(carried.forces, points[0] * width + block)
        end = lanes_at(carried.forces, points[1] * width + block)
        columns, motions = columns_at(along.table, width, block), motions_at(carried, width, block)
        if answers:
            pull = start - turn * columns.coulomb - bristles.sigma_2 * motions.v - v * columns.sigma_2
            by_mass = (v_mid - v) / bristles.mass
            faster = motions.v + per_mass * pull - by_mass * columns.mass
            place, place_end = motions.y + 0.25 * h * (motions.v + faster), motions.y + h * faster
            if axis.on & terms.acts.advance:
                carry_to_end(along, block, h, motions, faster)
            middle = answered(along, at_middle, block, middle, faster, place, AT_MIDDLE)
            end = answered(along, at_end, block, end, 2.0 * faster - motions.v, place_end, AT_END)
        both = Pushes(start, middle, end), columns
        new = slid_lanes(weights, bristles, v, mean, rise, h, motions, both)
        if axis.on & terms.acts.advance:
            carry_settled(along, block, h, motions, new)
        put_motions(carried, width, block, new)
        put_lanes(carried.force, block, end)


@inlined
def push_between(carried, at, share, width, block):
    """Slopes of the motor's force a share of the base step after its first point, by the parabola through its three."""
    first, middle, last = parabola_at(share)
    f = carried.forces
    value = first * lanes_at(f, at * width + block) + middle * lanes_at(f, (at + 1) * width + block)
    return value + last * lanes_at(f, (at + 2) * width + block)


@inlined
def pushes_between(along, at, shares, block):
    """Those at the start, in the middle and at the end of a step; without a motor those of the force as it was."""
    carried, width = along.carried, along.table.shape[1]
    motor = half = end = lanes_at(carried.force, block)
    if along.axis.powered:
        motor = push_between(carried, at, shares[0], width, block)
        half = push_between(carried, at, shares[1], width, block)
        end = push_between(carried, at, shares[2], width, block)
    return motor, half, end


@inlined
def motor_between(along, at, share):
    """The motor's force in N there; 0 without one."""
    if not along.axis.powered:
        return 0.0
    first, middle, last = parabola_at(share)
    return first * along.motor[at] + middle * along.motor[at + 1] + last * along.motor[at + 2]


@inlined
def answers_of_step(terms, along, motion, followed, reach, currents, at):
    """Force in N in the middle of a followed step; how that and the one at its end answer, friction at its start and in
    its middle, and the factor on the bristle there; how hidden states do. followed: the motion after it and its middle;
    currents: inputs in the middle; at: first point of its base step, and shares of that at start, middle and end."""
    axis, course, bristles, width = along.axis, along.course, along.bristles, along.table.shape[1]
    acting, acts = along.acting, terms.acts
    (point, shares), (reached, middle), bent = at, followed, along.carried.bent
    moves, half, v_mid = not course.guided, 0.5 * reach.h, middle.v
    here = Instant(reach.t_mid, reach.y_mid, v_mid, currents, motor_between(along, point, shares[1]), moves)
    push_mid, push_end, first, second, factor = unanswered(width, acting)
    by_level, moving, pushes = (
        axis.on & acts.load or axis.on & acts.level,
        axis.on & acts.advance,
        is_pushed(terms, along),
    )
    if moving:
        step_begins(along)
    if by_level:
        push = motor_between(along, point, shares[0])
        start = Instant(reach.t_mid - half, motion.y, motion.v, motion.currents, push, True)
        curve = curve_at(bristles, motion.v, bent)
        places = places_of(START_LEVEL, width, acting), places_of(MIDDLE_FALL, width, acting)  # which is written anew
        first = answer_of_friction(terms, axis, acting, start, (curve.level, curve.fall), places)
    if moving:
        way = way_to_middle(reach, motion, v_mid)
        answers_of_states(terms, axis, acting, along.hidden, way)
    force = 0.0
    if acting.told:
        force = force_beside(terms, axis, acting, here)
    elif axis.powered or axis.on & acts.push:
        force = force_once(terms, axis, reach.t_mid, reach.y_mid, v_mid, currents)
    if pushes:
        push_mid = answer_of_force(terms, axis, acting, here, places_of(MIDDLE, width, acting))
    if axis.on & acts.friction:
        factor = answer_of_factor(terms, axis, acting, here, places_of(FACTOR, width, acting))
    if by_level:
        then = here
        if not (axis.on & acts.load or moving):  # as predicted
            place = motion.y + 0.5 * half * (motion.v + v_mid)
            then = Instant(reach.t_mid, place, v_mid, motion.currents, here.motor, True)
        curve = curve_at(bristles, v_mid, bent)
        places = places_of(MIDDLE_LEVEL, width, acting), places_of(MIDDLE_FALL, width, acting)
        second = answer_of_friction(terms, axis, acting, then, (curve.level, curve.fall), places)
    if moving:
        way = way_to_end(reach, motion, v_mid, currents)
        answers_of_states(terms, axis, acting, along.hidden, way)
    if pushes:
        given = currents
        if axis.powered:
            given = inputs_then(terms, axis, course, reach.n, reach.x, 0.0)
        push = motor_between(along, point, shares[2])
        end = Instant(reach.t_mid + half, reach.y_end, reach.v_end, given, push, moves)
        push_end = answer_of_force(terms, axis, acting, end, places_of(END, width, acting))
    if moving:
        way = way_as_settled(reach, motion, reached, currents)
        answers_of_states(terms, axis, acting, along.hidden, way)
        step_ends(along)
    return force, (push_mid, push_end, first, second, factor)


@inlined
def is_pushed(terms, along):
    """Whether effects or own terms change the forces beside what is told beforehand."""
    return live(along.axis, along.acting) & terms.acts.push != 0


@inlined
def within_base_step(course, place, halvings):
    """The first point of the base step that a followed step is part of, and shares of it at its start, middle and
    end."""
    base_step = place.done >> FINEST
    begin = (place.done - (base_step << FINEST)) / (1 << FINEST)
    share = (1 << (FINEST - halvings)) / (1 << FINEST)
    return 2 * (place.n * course.substeps + base_step), (begin, begin + 0.5 * share, begin + share)


@inlined
def carry_followed(terms, along, place, motion, followed):
    """Take the slopes along a followed step from `motion` to what `followed_step` gave."""
    axis, course, table, carried = along.axis, along.course, along.table, along.carried
    bristles = along.bristles
    reached, middle = followed
    width, (at, shares) = table.shape[1], within_base_step(course, place, middle.halvings)
    reach = reach_of(course, place, motion, middle, course.guided)
    h, currents = reach.h, motion.currents
    if axis.powered:
        currents = inputs_then(terms, axis, course, place.n, reach.x, 0.5 * h)
    level, level_mid = curve_at(bristles, motion.v, carried.bent), curve_at(bristles, middle.v, carried.bent)
    force, answers = answers_of_step(terms, along, motion, followed, reach, currents, (at, shares))
    push_mid, push_end, first, second, (factor, stronger) = answers
    level, level_mid = with_answer(level, first), with_answer(level_mid, second)
    strong = scaled_bristles(bristles, factor)
    high, fall = factor * level_mid.level, factor * level_mid.fall
    middle = Middle(middle.v, middle.w, high, fall, middle.halvings, middle.swing, middle.allowed)
    predictor = predictor_of(bristles, motion, middle, h, level.level)
    mean, rise = impulse(motion.force, force, reached.force)
    linear = linear_of(strong, motion, middle, mean, rise, h)
    last = motion.spring[0] / bristles.sigma_0
    base = motion.v, motion.w, middle.v
    for block in range(0, width, LANES):
        columns, motions = columns_at(table, width, block), motions_at(carried, width, block)
        start = lanes_at(carried.force, block)
        motor, half, end = pushes_between(along, at, shares, block)
        steady = level_lanes(level.level_by, motions.v, columns)
        steady = steady + beyond(along, first.level, block, motor, motions.y, AT_START)
        spring = scaled_columns(bristles, columns, last, lanes_at(carried.factor, block))
        v_mid, w_mid = predicted_lanes(predictor, motions, start, steady, columns, spring)
        high, fall = level_lanes(level_mid.level_by, v_mid, columns), level_lanes(level_mid.fall_by, v_mid, columns)
        y_mid = motions.y + 0.25 * h * (motions.v + v_mid)
        if axis.on & terms.acts.advance:
            carry_to_end(along, block, h, motions, v_mid)
        high = high + beyond(along, second.level, block, half, y_mid, AT_MIDDLE)
        fall = fall + beyond(along, second.fall, block, half, y_mid, AT_MIDDLE)
        if axis.on & terms.acts.friction:
            by = answered(along, stronger, block, half, v_mid, y_mid, AT_MIDDLE)
            put_lanes(carried.factor, block, by)
            columns = scaled_columns(bristles, columns, factor, by)
            high, fall = factor * high + level_mid.level * by, factor * fall + level_mid.fall * by
        if is_pushed(terms, along):
            half = answered(along, push_mid, block, half, v_mid, y_mid, AT_MIDDLE)
            end = answered(along, push_end, block, end, 2.0 * v_mid - motions.v, motions.y + h * v_mid, AT_END)
        rates = (*bristle_lanes(linear, strong, middle, (v_mid, w_mid, high, fall), columns), v_mid)
        new = linear_lanes(linear, strong, base, h, rates, motions, Pushes(start, half, end), columns)
        if axis.on & terms.acts.advance:
            carry_settled(along, block, h, motions, new)
        put_motions(carried, width, block, new)
        put_lanes(carried.force, block, end)


@inlined
def beyond(along, answer, block, push, place, when):
    """Slopes of friction's level or fall beyond those by speed and by its own parameters."""
    known = answer.by_motor * push + answer.by_place * place
    return known + by_states(along, answer, block, when)
