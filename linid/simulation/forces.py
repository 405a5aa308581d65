"""Forces on the mass, friction that they add, and the bristle at rest: what the kernels ask of motors and effects."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.physics.friction import stribeck
from linid.physics.model import ELAPSED, RECORD, STATE_SIZE, STATE_START
from linid.physics.motors import THETA, phase_constants, prepare_motor
from linid.simulation.terms import allocating, compiled, inlined

WORK_SIZE = STATE_START + 2 * STATE_SIZE
LEAST_MASS = 0.05  # part of the rigid mass that no effect can take away


class Axis(NamedTuple):
    """What stays the same in one simulation: on: bits of the active effects; powered: whether there are inputs;
    motor: its code; harmonics: of its field; wavenumber in rad/m and phase in rad of the first one."""

    on: Any
    powered: Any
    motor: Any
    harmonics: Any
    wavenumber: Any
    phase: Any


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


@inlined
def axis_of(motor, on, powered, p, table):
    """The axis with these parameters; table: (3, 12) is filled with the harmonics."""
    harmonics = prepare_motor(motor, p[8:14], table)
    wavenumber, phase = p[9], p[11]
    if motor == THETA:
        wavenumber, phase = 2.0 * wavenumber, 2.0 * phase
    return Axis(on, powered, motor, harmonics, wavenumber, phase)


@allocating
def work_vector(params, record, elapsed):
    """A copy of the parameters with room for what the effects need besides."""
    p = np.zeros(WORK_SIZE)
    for k in range(params.size):
        p[k] = params[k]
    p[RECORD] = record
    p[ELAPSED] = elapsed
    return p


@inlined
def bristles_of(terms, on, p, added_mass):
    """Friction and mass with these parameters."""
    mass = p[7] + added_mass
    if on & terms.acts.mass:
        mass = max(mass + terms.mass(0.0, on, p), LEAST_MASS * mass)
    return Bristles(p[0], p[1], p[2], p[3], p[4], p[5], p[6], mass)


@inlined
def total_delay(terms, on, p):
    """Time in s by which the inputs act late."""
    if on & terms.acts.delay:
        return terms.delay(0.0, on, p)
    return 0.0


@compiled
def thrust_factor(terms, on, t, y, v, currents, p):
    """Factor on the motor force."""
    return terms.thrust(1.0, on, t, y, v, currents, p)


@compiled
def friction_factor(terms, on, t, y, v, currents, p):
    """Factor on the whole bristle force."""
    return terms.friction(1.0, on, t, y, v, currents, p)


@compiled
def level_factor(terms, on, t, y, v, currents, p):
    """Factor on sliding and breakaway friction."""
    return terms.level(1.0, on, t, y, v, currents, p)


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
def start_states(terms, on, t, y, v, currents, p):
    """Hidden states at the start of a simulation."""
    terms.initial(on, t, y, v, currents, p)
    keep_states(p)


@compiled
def advance_states(terms, on, h, t, y, v, a, currents, p):
    """Hidden states h seconds after the start of the step; t, y, v, currents: of its middle, a: mean acceleration."""
    terms.advance(on, h, t, y, v, a, currents, p)


@compiled
def with_effects(terms, axis, t, y, v, currents, p, motor_force):
    """All forces on the mass but friction, in N, given that of the motor alone."""
    if axis.powered and axis.on & terms.acts.thrust:
        motor_force *= thrust_factor(terms, axis.on, t, y, v, currents, p)
    return terms.force(motor_force, axis.on, t, y, v, currents, p)


@inlined
def driven_currents(terms, axis, t, y, v, currents, p):
    """What the motor really gets of its inputs."""
    if axis.on & terms.acts.drive:
        return terms.drive(axis.on, t, y, v, currents, p)
    return currents


@inlined
def field_position(terms, axis, t, y, v, currents, p):
    """The position in m that the motor's field sees."""
    if axis.on & terms.acts.field:
        return terms.field(y, axis.on, t, y, v, currents, p)
    return y


@inlined
def motor_force_at(terms, axis, y, currents, p, table):
    """Force of the motor alone, N."""
    return terms.motor(axis.motor, y, currents, p, table, axis.harmonics, axis.wavenumber, axis.phase)


@compiled
def pushed_force(terms, axis, t, y, v, currents, p, table):
    """`external_force` where effects change it."""
    motor_force = 0.0
    if axis.powered:
        currents = driven_currents(terms, axis, t, y, v, currents, p)
        field = field_position(terms, axis, t, y, v, currents, p)
        motor_force = motor_force_at(terms, axis, field, currents, p, table)
    return with_effects(terms, axis, t, y, v, currents, p, motor_force)


@inlined
def external_force(terms, axis, t, y, v, currents, p, table):
    """All forces on the mass but friction, in N."""
    if axis.on & terms.acts.push:
        return pushed_force(terms, axis, t, y, v, currents, p, table)
    if axis.powered:
        return motor_force_at(terms, axis, y, currents, p, table)
    return 0.0


@compiled
def force_once(terms, axis, t, y, v, currents, p, table):
    """`external_force` where it is needed once: not inlined, which takes less time to compile."""
    return external_force(terms, axis, t, y, v, currents, p, table)


@compiled
def friction_load(terms, axis, t, y, v, currents, p, table):
    """Sliding and breakaway friction in N that the motor's force adds."""
    push = 0.0
    if axis.powered:
        driven = driven_currents(terms, axis, t, y, v, currents, p)
        field = field_position(terms, axis, t, y, v, driven, p)
        push = motor_force_at(terms, axis, field, driven, p, table)
        if axis.on & terms.acts.thrust:
            push *= thrust_factor(terms, axis.on, t, y, v, driven, p)
    return terms.load(0.0, axis.on, push, t, y, v, currents, p)


@compiled
def emf_constants(terms, axis, t, y, v, currents, p, table):
    """Thrust per phase current (N/A) and thus back-EMF per speed (V s/m) of the three windings."""
    field = field_position(terms, axis, t, y, v, currents, p)
    e_1, e_2, e_3 = phase_constants(axis.motor, field, p[8:14], table, axis.harmonics, axis.wavenumber, axis.phase)
    if axis.on & terms.acts.thrust:
        factor = thrust_factor(terms, axis.on, t, y, v, currents, p)
        e_1, e_2, e_3 = factor * e_1, factor * e_2, factor * e_3
    return e_1, e_2, e_3


@compiled
def steady_bristle(terms, axis, bristles, t, y, v, currents, p, table):
    """Bristle deflection in m of steady sliding, or of a resting axis (v = 0) under the outer forces at time t."""
    level, load = 1.0, 0.0
    if axis.on & terms.acts.load:
        load = friction_load(terms, axis, t, y, v, currents, p, table)
    if axis.on & terms.acts.level:
        level = level_factor(terms, axis.on, t, y, v, currents, p)
    coulomb, static, stribeck_velocity, exponent, sigma_0 = bristles[:5]
    if v != 0.0:
        return math.copysign(level * (stribeck(v, coulomb, static, stribeck_velocity, exponent) + load), v) / sigma_0
    force = force_once(terms, axis, t, y, v, currents, p, table)
    if axis.on & terms.acts.friction:
        force /= friction_factor(terms, axis.on, t, y, v, currents, p)
    breakaway = level * (static + load)
    return min(max(force, -breakaway), breakaway) / sigma_0
