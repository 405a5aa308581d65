"""Forces on the mass, friction that they add, and the bristle at rest: what the kernels ask of motors and effects."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.physics.friction import stribeck
from linid.physics.model import ADDED_MASS, ELAPSED, MEMORY_PLACE, RECORD, STATE_SIZE, STATE_START, WORK_SIZE
from linid.physics.motors.harmonics import phase_forces
from linid.physics.motors.motor import MAX_HARMONICS
from linid.physics.own_terms.layout import CLOCKS
from linid.simulation.binding import allocating, compiled, inlined

LEAST_MASS = 0.05  # part of the rigid mass that no effect can take away
SETTLING = 20.0  # breakaway deflections of travel, after which a bristle surely slides
SETTLING_TIME = 0.1  # s before a recording for which its first speed is taken to have lasted


class Axis(NamedTuple):
    """What stays the same in one simulation: on: bits of the active effects; powered: whether there are inputs;
    motor: its code; harmonics: of its field; wavenumber in rad/m and phase in rad of the first one; p: parameters with
    room for hidden states, which change; table: (3, MAX_HARMONICS) of the harmonics."""

    on: Any
    powered: Any
    motor: Any
    harmonics: Any
    wavenumber: Any
    phase: Any
    p: Any
    table: Any


class Bristles(NamedTuple):
    """LuGre's parameters in SI with the whole moving mass in kg."""

    coulomb: Any
    static: Any
    stribeck_velocity: Any
    exponent: Any
    sigma_0: Any
    sigma_1: Any
    sigma_2: Any
    mass: Any


@allocating
def work_vector(params, record, elapsed, added_mass):
    """A copy of the parameters with room for what the effects need besides."""
    p = np.zeros(WORK_SIZE)
    for k in range(params.size):
        p[k] = params[k]
    p[RECORD] = record
    p[ELAPSED] = elapsed
    p[ADDED_MASS] = added_mass
    return p


@allocating
def axis_of(terms, candidates, stretch):
    """The axis of one candidate; its parameters are copied where effects need room for their states."""
    on = candidates.on & terms.chosen | terms.always
    p = stretch.params
    if on & terms.acts.any or terms.law.elements > 0:
        p = work_vector(stretch.params, stretch.record, stretch.elapsed, stretch.added_mass)
    table = np.zeros((3, MAX_HARMONICS))
    harmonics, wavenumber, phase = terms.motor.prepare(candidates.motor, p, table)
    return Axis(on, stretch.powered, candidates.motor, harmonics, wavenumber, phase, p, table)


@inlined
def bristles_of(terms, axis, added_mass):
    """Friction and mass with these parameters."""
    p = axis.p
    mass = p[7] + added_mass
    if axis.on & terms.acts.mass:
        mass = max(mass + terms.mass(0.0, axis.on, p), LEAST_MASS * mass)
    static = p[1]
    if axis.on & terms.acts.static:
        static = max(static + terms.static(0.0, axis.on, p), p[0])
    return Bristles(p[0], static, p[2], p[3], p[4], p[5], p[6], mass)


@inlined
def total_delay(terms, axis):
    """Time in s by which the inputs act late."""
    if axis.on & terms.acts.delay:
        return terms.delay(0.0, axis.on, axis.p)
    return 0.0


@inlined
def thrust_factor(terms, axis, t, y, v, currents):
    """Factor on the motor force."""
    return terms.thrust(1.0, axis.on, t, y, v, currents, axis.p)


@inlined
def friction_factor(terms, axis, t, y, v, currents):
    """Factor on the whole bristle force."""
    return terms.friction(1.0, axis.on, t, y, v, currents, axis.p)


@inlined
def level_factor(terms, axis, t, y, v, currents):
    """Factor on sliding and breakaway friction."""
    return terms.level(1.0, axis.on, t, y, v, currents, axis.p)


@compiled
def reading_error(terms, on, t, y, v, currents, p):
    """Reading minus position, m."""
    return terms.sensor(0.0, on, t, y, v, currents, p)


@compiled
def keep_states(p):
    """The hidden states as they are now become those at the start of the step."""
    for place in range(STATE_START, STATE_START + STATE_SIZE):
        p[place + STATE_SIZE] = p[place]


@compiled
def start_states(terms, axis, t, y, v, currents):
    """Hidden states at the start of a simulation."""
    terms.initial(axis.on, t, y, v, currents, axis.p)
    keep_states(axis.p)


@inlined
def advance_states(terms, axis, h, t, y, v, a, currents):
    """Hidden states h seconds after the start of the step; t, y, v, currents: of its middle, a: mean acceleration."""
    terms.advance(axis.on, h, t, y, v, a, currents, axis.p)


@compiled
def stays(terms, axis, h, y, currents):
    """Whether hidden states are the same after h seconds at rest, clocks apart, where none hangs on time."""
    p, same = axis.p, True
    advance_states(terms, axis, h, 0.0, y, 0.0, 0.0, currents)
    for k in range(STATE_SIZE):
        now = STATE_START + k
        same = same and (p[now] == p[now + STATE_SIZE] or k - MEMORY_PLACE in CLOCKS)
        p[now] = p[now + STATE_SIZE]
    return same


@inlined
def with_effects(terms, axis, t, y, v, currents, motor_force):
    """All forces on the mass but friction, in N, given that of the motor alone."""
    if axis.powered and axis.on & terms.acts.thrust:
        motor_force *= thrust_factor(terms, axis, t, y, v, currents)
    force = terms.force(motor_force, axis.on, t, y, v, currents, axis.p)
    if axis.on & terms.acts.pushed:
        force = terms.pushed(force, axis.on, motor_force, t, y, v, currents, axis.p)
    return force


@inlined
def driven_currents(terms, axis, t, y, v, currents):
    """What the motor really gets of its inputs."""
    if axis.on & terms.acts.drive:
        return terms.drive(axis.on, t, y, v, currents, axis.p)
    return currents


@inlined
def field_position(terms, axis, t, y, v, currents):
    """The position in m that the motor's field sees."""
    if axis.on & terms.acts.field:
        return terms.field(y, axis.on, t, y, v, currents, axis.p)
    return y


@inlined
def pushed_force(terms, axis, t, y, v, currents):
    """`external_force` where effects change it."""
    motor_force = 0.0
    if axis.powered:
        currents = driven_currents(terms, axis, t, y, v, currents)
        field = field_position(terms, axis, t, y, v, currents)
        motor_force = terms.motor.thrust(axis, field, currents)
    return with_effects(terms, axis, t, y, v, currents, motor_force)


@inlined
def external_force(terms, axis, t, y, v, currents):
    """All forces on the mass but friction, in N."""
    if axis.on & terms.acts.push:
        return pushed_force(terms, axis, t, y, v, currents)
    if axis.powered:
        return terms.motor.thrust(axis, y, currents)
    return 0.0


@allocating
def motor_axis(terms, motor, p):
    """The axis of a motor alone, with parameters p (VECTOR_SIZE,)."""
    table = np.zeros((3, MAX_HARMONICS))
    harmonics, wavenumber, phase = terms.motor.prepare(motor, p, table)
    return Axis(0, True, motor, harmonics, wavenumber, phase, p, table)


@allocating
def forces_along(terms, axis, y, currents, out):
    """Forces in N of the motor alone at many positions y (n,) in m under inputs (n,) each: `out` (n,) is filled."""
    if axis.harmonics > 0:
        phase_forces(y, currents, axis.wavenumber, axis.phase, axis.table, axis.harmonics, out)
        return
    i_1, i_2, i_3 = currents
    for k in range(y.size):
        out[k] = terms.motor.untabled(axis, y[k], (i_1[k], i_2[k], i_3[k]))


@allocating
def motor_forces(terms, motor, p, y, currents, out):
    """`forces_along` of a motor with parameters p (VECTOR_SIZE,)."""
    forces_along(terms, motor_axis(terms, motor, p), y, currents, out)


@compiled
def force_once(terms, axis, t, y, v, currents):
    """`external_force` where it is needed once: not inlined, which takes less time to compile."""
    return external_force(terms, axis, t, y, v, currents)


@compiled
def friction_load(terms, axis, t, y, v, currents):
    """Sliding and breakaway friction in N that the motor's force adds, or that own terms add."""
    push = 0.0
    if axis.powered and axis.on & terms.acts.pressed:
        driven = driven_currents(terms, axis, t, y, v, currents)
        field = field_position(terms, axis, t, y, v, driven)
        push = terms.motor.thrust(axis, field, driven)
        if axis.on & terms.acts.thrust:
            push *= thrust_factor(terms, axis, t, y, v, driven)
    return terms.load(0.0, axis.on, push, t, y, v, currents, axis.p)


@compiled
def emf_constants(terms, axis, t, y, v, currents):
    """Thrust per phase current (N/A) and thus back-EMF per speed (V s/m) of the three windings."""
    field = field_position(terms, axis, t, y, v, currents)
    e_1, e_2, e_3 = terms.motor.constants(axis, field)
    if axis.on & terms.acts.thrust:
        factor = thrust_factor(terms, axis, t, y, v, currents)
        e_1, e_2, e_3 = factor * e_1, factor * e_2, factor * e_3
    return e_1, e_2, e_3


@inlined
def just_set_off(v, breakaway):
    """Whether an axis with this speed need not slide yet; breakaway: its bristle's largest deflection in m."""
    return abs(v) * SETTLING_TIME < SETTLING * breakaway


@compiled
def steady_bristle(terms, axis, bristles, t, y, v, currents):
    """Bristle deflection in m of steady sliding, or of a resting axis (v = 0) under the outer forces at time t."""
    level, load = 1.0, 0.0
    if axis.on & terms.acts.load:
        load = friction_load(terms, axis, t, y, v, currents)
    if axis.on & terms.acts.level:
        level = level_factor(terms, axis, t, y, v, currents)
    coulomb, static, stribeck_velocity, exponent, sigma_0 = bristles[:5]
    if v != 0.0:
        return math.copysign(level * (stribeck(v, coulomb, static, stribeck_velocity, exponent) + load), v) / sigma_0
    force = force_once(terms, axis, t, y, v, currents)
    if axis.on & terms.acts.friction:
        force /= friction_factor(terms, axis, t, y, v, currents)
    breakaway = level * (static + load)
    return min(max(force, -breakaway), breakaway) / sigma_0
