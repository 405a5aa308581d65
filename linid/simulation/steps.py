"""One step of the mass and its bristle: far above the Stribeck velocity, or with the bristle followed."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from linid.physics.friction import gliding_step, lugre_step, stribeck, stribeck_fall
from linid.simulation.binding import inlined
from linid.simulation.course import FINEST, AxisState, inputs_then
from linid.simulation.forces import (
    advance_states,
    external_force,
    force_once,
    friction_factor,
    friction_load,
    keep_states,
    level_factor,
    stays,
)
from linid.simulation.splines_at import spline_at

REVERSAL_WEIGHT = 4.0  # how much more a swing of the bristle rate counts where the speed changes its sign
# Fast sliding: where the Stribeck curve has fallen to F_C but for this exponent's power of e, the bristle is steady but
# for this share of F_C, and the step ends where the curve has fallen by SLOWEST at least.
FAST, SLOWEST, STEADY = 40.0, 36.0, 1e-8
REST_SPEED, REST_BRISTLE = 1e-9, 1e-11  # m/s and m, below which what still moves cannot be seen
HELD = 1e-3  # of both, beside forces: nor do differences of two runs see it, by which some derivatives are found
CALM = 0.3  # share of the allowed swing below which the next step is twice as long


class Borders(NamedTuple):
    """Speeds in m/s above which a step of fast sliding starts, and below which it may not end; alone: only forces
    that vanish act; still: only such as change with the motion alone."""

    fast: Any
    slowest: Any
    alone: Any
    still: Any


class Slide(NamedTuple):
    """A step of fast sliding: its finest steps, whether no force acts, and how fast sliding decays over it."""

    size: Any
    alone: Any
    glide: Any


class Middle(NamedTuple):
    """The predicted middle of a step: v in m/s, w in m, level and fall of friction in N, and the step's halvings;
    swing: share of friction by which the bristle's rate may be off, and the allowed one."""

    v: Any
    w: Any
    level: Any
    fall: Any
    halvings: Any
    swing: Any
    allowed: Any


class Reach(NamedTuple):
    """How far a followed step goes: h in s; x: s from sample n, the one before, to its end; t_mid: s in the recording
    of its middle; y_mid, y_end in m and v_end in m/s: where its forces are taken."""

    n: Any
    h: Any
    x: Any
    t_mid: Any
    y_mid: Any
    y_end: Any
    v_end: Any


@inlined
def borders_of(terms, axis, bristles, guided):
    """Where fast sliding begins and ends; guided: whether forces are taken at the measured position."""
    fast = bristles.stribeck_velocity * FAST ** (1.0 / bristles.exponent)
    slowest = bristles.stribeck_velocity * SLOWEST ** (1.0 / bristles.exponent)
    acts, on = terms.acts, axis.on
    alone = not axis.powered and not (on & acts.push or on & acts.advance)
    if on & acts.friction or on & acts.level or on & acts.load:
        fast = math.inf
    # Under other laws one deflection in balance does not tell that the axis rests.
    still = alone or (not (axis.powered or guided or on & acts.timed) and terms.law.plain == 1)
    return Borders(fast, slowest, alone, still)


@inlined
def rests(terms, axis, borders, h, motion):
    """Whether the bristle holds the axis for good: nothing moves it any more, and hidden states stay as they are for h
    seconds."""
    near = 1.0 if borders.alone else HELD
    if not borders.still or not abs(motion.v) < near * REST_SPEED:
        return False
    if not abs(motion.w - held_by(borders, motion)) < near * REST_BRISTLE:
        return False
    return not axis.on & terms.acts.advance or stays(terms, axis, h, motion.y, motion.currents)


@inlined
def held_by(borders, motion):
    """The bristle in m that holds the axis against all forces."""
    return 0.0 if borders.alone else motion.force / motion.spring[0]


@inlined
def resting(borders, motion):
    """A motion that rests for good."""
    return AxisState(motion.y, 0.0, held_by(borders, motion), motion.force, motion.currents, motion.spring)


@inlined
def is_steady(bristles, motion):
    """Whether the bristle is where steady sliding at Coulomb's level keeps it."""
    away = abs(bristles.sigma_0 * motion.w - math.copysign(bristles.coulomb, motion.v))
    return away < STEADY * bristles.coulomb


@inlined
def friction_at(terms, axis, bristles, t, y, v, currents):
    """Level of friction in N and how it falls with speed, v dg/dv in N, with what effects do to both."""
    coulomb, static, stribeck_velocity, exponent = bristles[:4]
    level, fall = stribeck_fall(v, coulomb, static, stribeck_velocity, exponent)
    if axis.on & terms.acts.load:
        level += friction_load(terms, axis, t, y, v, currents)
    if axis.on & terms.acts.level:
        factor = level_factor(terms, axis, t, y, v, currents)
        level, fall = factor * level, factor * fall
    return level, fall


@inlined
def bristle_now(terms, axis, bristles, t, y, v, currents):
    """Factor on the bristle, its stiffness in N/m and its damping in N s/m."""
    if axis.on & terms.acts.friction:
        factor = friction_factor(terms, axis, t, y, v, currents)
        return factor, factor * bristles.sigma_0, factor * bristles.sigma_1
    return 1.0, bristles.sigma_0, bristles.sigma_1


@inlined
def half_step(bristles, motion, spring, rate, half):
    """Speed in m/s and bristle in m after half a step of `half` seconds by implicit Euler: first order and L-stable,
    which is enough for a predictor. spring: the bristle's stiffness in N/m and damping in N s/m; rate: its own, 1/s."""
    stiffness, damping = spring
    relax = 1.0 / (1.0 + half * rate)
    pull = half * (stiffness - damping * rate) * relax
    pushed = bristles.mass * motion.v + half * motion.force - pull * motion.w
    v_mid = pushed / (bristles.mass + half * (damping + bristles.sigma_2 + pull))
    return v_mid, (motion.w + half * v_mid) * relax


@inlined
def predicted(terms, axis, bristles, motion, t, halvings, tick, tolerance):
    """The middle of a followed step that begins at t seconds, halved until the bristle's rate swings little within it.

    tick: s of the finest step; tolerance: share of friction by which the rate may be off.
    """
    coulomb, static, stribeck_velocity, exponent, sigma_0 = bristles[:5]
    y, v, currents = motion.y, motion.v, motion.currents
    added = 0.0
    rate = sigma_0 * abs(v) / stribeck(v, coulomb, static, stribeck_velocity, exponent)
    if axis.on & terms.acts.load:
        added = friction_load(terms, axis, t, y, v, currents)
        rate = sigma_0 * abs(v) / (stribeck(v, coulomb, static, stribeck_velocity, exponent) + added)
    if axis.on & terms.acts.level:
        rate /= level_factor(terms, axis, t, y, v, currents)
    while True:  # until the step is short enough
        h = (1 << (FINEST - halvings)) * tick
        half = 0.5 * h
        v_mid, w_mid = half_step(bristles, motion, motion.spring, rate, half)
        level, fall = stribeck_fall(v_mid, coulomb, static, stribeck_velocity, exponent)
        if axis.on & terms.acts.load:
            level += added
        if axis.on & terms.acts.level:
            factor = level_factor(terms, axis, t + half, y + 0.5 * half * (v + v_mid), v_mid, currents)
            level, fall = factor * level, factor * fall
        rate_mid = sigma_0 * abs(v_mid) / level
        # How far the frozen bristle rate is off within the step, in parts of the friction force; it matters as far as
        # the bristle is from steady sliding. At a reversal |v| has a kink, which no order of the method covers: there
        # the whole swing of the rate counts.
        change = abs(rate_mid - rate)
        if v * (2.0 * v_mid - v) < 0.0:
            change = REVERSAL_WEIGHT * sigma_0 * abs(v_mid - v) / level
        swing = change * h * abs(1.0 - math.copysign(sigma_0 * w_mid / level, v_mid * w_mid))
        allowed = tolerance * (1.0 + rate_mid * h)
        if halvings >= FINEST or not swing > allowed:
            return Middle(v_mid, w_mid, level, fall, halvings, swing, allowed)
        halvings += 1


@inlined
def followed_bristle(axis, bristles, v, w, at_middle, outer, body, h):
    """LuGre's step as the kernel takes it from a law; outer: force in N and its rate in N/s; see `lugre_step`."""
    force, force_rate = outer
    return lugre_step(v, w, at_middle, force, force_rate, body, h)


@inlined
def reach_of(course, place, motion, middle, guided):
    """Where a followed step with this predicted middle ends; guided: forces are taken at the measured position."""
    y, v = motion.y, motion.v
    v_mid = middle.v
    size = 1 << (FINEST - middle.halvings)
    h = size * course.tick
    half = 0.5 * h
    x = (place.done + size) * course.tick
    y_mid, y_end, v_end = y + 0.5 * half * (v + v_mid), y + h * v_mid, 2.0 * v_mid - v
    if guided:
        c = course.coefficients
        y_mid, y_end = spline_at(c, place.n, 3, x - half), spline_at(c, place.n, 3, x)
    return Reach(place.n, h, x, course.t_start + place.n * course.dt + x - half, y_mid, y_end, v_end)


@inlined
def to_the_middle(terms, axis, reach, motion, v_mid):
    """Bring the hidden states to the middle of a step."""
    y, v = motion.y, motion.v
    half = 0.5 * reach.h
    t, speed = reach.t_mid - 0.5 * half, 0.5 * (v + v_mid)
    advance_states(terms, axis, half, t, y + 0.25 * half * (v + v_mid), speed, (v_mid - v) / half, motion.currents)


@inlined
def to_the_end(terms, axis, reach, motion, v_mid, currents):
    """Bring the hidden states to the end of a step, as far as its prediction tells."""
    half = 0.5 * reach.h
    advance_states(terms, axis, reach.h, reach.t_mid, reach.y_mid, v_mid, (v_mid - motion.v) / half, currents)


@inlined
def settled(terms, axis, reach, motion, v_new, displacement, currents):
    """Bring the hidden states along a step as it came out, so that they keep to the motion."""
    h, y = reach.h, motion.y + 0.5 * displacement
    advance_states(terms, axis, h, reach.t_mid, y, displacement / h, (v_new - motion.v) / h, currents)
    keep_states(axis.p)


@inlined
def resisting(terms, axis, bristles, reach, middle, currents):
    """Level and fall of friction in N in the middle of a step with what effects do to it there, and its spring."""
    level, fall = middle.level, middle.fall
    if axis.on & terms.acts.load or (axis.on & terms.acts.advance and axis.on & terms.acts.level):
        level, fall = friction_at(terms, axis, bristles, reach.t_mid, reach.y_mid, middle.v, currents)
    factor, stiffness, damping = bristle_now(terms, axis, bristles, reach.t_mid, reach.y_mid, middle.v, currents)
    return factor * level, factor * fall, (stiffness, damping)


@inlined
def impulse(force, force_mid, force_end):
    """Mean and rise of the straight line nearest to the parabola through three forces: it has the same impulse."""
    return (force + 4.0 * force_mid + force_end) / 6.0, force_end - force


@inlined
def too_slow(borders, v, v_new):
    """Whether a step of fast sliding has ended where the bristle must be followed."""
    return math.copysign(v_new, v) != v_new or abs(v_new) <= borders.slowest


@inlined
def force_then(terms, axis, course, moment, y, v, currents):
    """Forces on the mass but friction in N, and inputs, with the axis at y and v; moment: (n, x, back), which is
    x - back seconds after sample n."""
    n, x, back = moment
    if axis.powered:
        currents = inputs_then(terms, axis, course, n, x, back)
    return external_force(terms, axis, course.t_start + n * course.dt + x - back, y, v, currents), currents


@inlined
def after_sample(terms, axis, course, n, motion):
    """The motion with the inputs that act from sample n on, where they differ from those before it."""
    y = spline_at(course.coefficients, n, 3, 0.0) if course.guided else motion.y
    currents = inputs_then(terms, axis, course, n, 0.0, 0.0)
    force = force_once(terms, axis, course.t_start + n * course.dt, y, motion.v, currents)
    return AxisState(motion.y, motion.v, motion.w, force, currents, motion.spring)


@inlined
def sliding_step(terms, axis, bristles, course, place, motion, slide):
    """A step of fast sliding: nothing but the outer forces changes, and these smoothly; no bristle need be followed.

    Without any force the step is exact however long it is. Returns the motion after it, to which hidden states are
    brought once it is taken (`slid_on`).
    """
    y, v = motion.y, motion.v
    n, end = place.n, place.done + slide.size
    drag = math.copysign(bristles.coulomb, v)
    h = slide.size * course.tick
    half = 0.5 * h
    v_mid = v + half * (motion.force - drag - bristles.sigma_2 * v) / bristles.mass
    x = end * course.tick
    currents = motion.currents
    force_mid = force_end = 0.0
    if course.forces.size > 0:
        point = 2 * (n * course.substeps + (end >> FINEST))
        force_mid, force_end = course.forces[point - 1], course.forces[point]
    elif not slide.alone:
        y_mid, y_end = y + 0.5 * half * (v + v_mid), y + h * v_mid
        if course.guided:
            y_mid, y_end = spline_at(course.coefficients, n, 3, x - half), spline_at(course.coefficients, n, 3, x)
        reach = Reach(n, h, x, course.t_start + n * course.dt + x - half, y_mid, y_end, 2.0 * v_mid - v)
        if axis.on & terms.acts.advance:
            to_the_middle(terms, axis, reach, motion, v_mid)
        force_mid, currents = force_then(terms, axis, course, (n, x, half), y_mid, v_mid, currents)
        if axis.on & terms.acts.advance:
            to_the_end(terms, axis, reach, motion, v_mid, currents)
        force_end, currents = force_then(terms, axis, course, (n, x, 0.0), y_end, 2.0 * v_mid - v, currents)
    mean, rise = impulse(motion.force, force_mid, force_end)
    v, displacement = gliding_step(v, mean - drag - 0.5 * rise, rise, bristles.mass, bristles.sigma_2, h, slide.glide)
    return AxisState(y + displacement, v, drag / bristles.sigma_0, force_end, currents, motion.spring)


@inlined
def slid_on(terms, axis, course, place, motion, slid, size):
    """Bring the hidden states along a step of fast sliding of `size` finest steps, from one motion to the other."""
    n, x, h = place.n, (place.done + size) * course.tick, size * course.tick
    half, currents = 0.5 * h, motion.currents
    if axis.powered:
        currents = inputs_then(terms, axis, course, n, x, half)
    reach = Reach(n, h, x, course.t_start + n * course.dt + x - half, 0.0, 0.0, 0.0)
    settled(terms, axis, reach, motion, slid.v, slid.y - motion.y, currents)


@inlined
def followed_step(terms, axis, bristles, course, place, motion):
    """A step in which the bristle is followed; returns the motion after it and its predicted middle."""
    y, v, w, force, currents, _ = motion
    begin = course.t_start + place.n * course.dt + place.done * course.tick
    middle = terms.law.predicted(terms, axis, bristles, motion, begin, place.halvings, course.tick, course.tolerance)
    known = middle.halvings == 0 and course.forces.size > 0
    reach = reach_of(course, place, motion, middle, course.guided and not known)
    n, h, x, _, y_mid, y_end, v_end = reach
    states = axis.on & terms.acts.advance
    if states:
        to_the_middle(terms, axis, reach, motion, middle.v)
    force_mid = force_end = 0.0
    if known:
        point = 2 * (n * course.substeps + (place.done >> FINEST) + 1)
        force_mid, force_end = course.forces[point - 1], course.forces[point]
    else:
        force_mid, currents = force_then(terms, axis, course, (n, x, 0.5 * h), y_mid, middle.v, currents)
    level, fall, spring = resisting(terms, axis, bristles, reach, middle, currents)
    inner = currents
    if states:
        to_the_end(terms, axis, reach, motion, middle.v, currents)
    if not known:
        force_end, currents = force_then(terms, axis, course, (n, x, 0.0), y_end, v_end, currents)
    mean, rise = impulse(force, force_mid, force_end)
    at_middle, body = (middle.v, middle.w, level, fall), (bristles.mass, spring[0], spring[1], bristles.sigma_2)
    outer = (mean - 0.5 * rise, rise / h)
    v_new, w_new, displacement = terms.law.step(axis, bristles, v, w, at_middle, outer, body, h)
    if states:
        settled(terms, axis, reach, motion, v_new, displacement, inner)
    return AxisState(y + displacement, v_new, w_new, force_end, currents, spring), middle
