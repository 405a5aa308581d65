"""What is called of an exported model from outside, in the simulation's own words; translated, never run here.

A model's vector `p` holds, behind what a simulation works with, what an export prepares once (`layout.py`).
"""

from __future__ import annotations

import math
from typing import Any

from linid.export.program.layout import HARMONICS, PHASE, WAVENUMBER
from linid.physics.model import ADDED_MASS
from linid.simulation.course import FINEST, Course, inputs_then
from linid.simulation.forces import (
    Axis,
    bristles_of,
    driven_currents,
    field_position,
    reading_error,
    thrust_factor,
    total_delay,
)
from linid.simulation.kernel import Going, over_sample, started
from linid.simulation.law_steps import own_of
from linid.simulation.steps import after_sample, borders_of, friction_at


def prepare(terms, fixed, memory):
    """Work out what hangs on parameters alone: the harmonics of the motor's field."""
    p, table, _ = memory
    harmonics, wavenumber, phase = terms.motor.prepare(fixed.motor, p, table)
    p[HARMONICS] = float(harmonics)
    p[WAVENUMBER] = wavenumber
    p[PHASE] = phase


def axis_of(fixed, p, table):
    """The axis, as the simulation's functions take it."""
    harmonics = fixed.harmonics if fixed.harmonics is not None else int(p[HARMONICS])
    return Axis(fixed.on, fixed.powered, fixed.motor, harmonics, p[WAVENUMBER], p[PHASE], p, table)


def course_of(terms, axis, coefficients, clock):
    """The way from the first sample of the coefficients on."""
    t, dt, substeps, tolerance = clock
    lag = total_delay(terms, axis)
    return Course(t, dt, substeps, dt / (substeps << FINEST), lag, False, tolerance, coefficients, ())


def start(terms, fixed, memory, clock, start_of_axis):
    """Begin at a time in s, with the axis at y in m, with v in m/s and the bristle bent by w in m (nan: as it is then).

    Returns the motion: y, v, w, the forces on the mass but friction in N, the inputs, the bristle's stiffness in N/m
    and damping in N s/m.
    """
    p, table, coefficients = memory
    axis = axis_of(fixed, p, table)
    bristles = bristles_of(terms, axis, p[ADDED_MASS])
    course = course_of(terms, axis, coefficients, clock)
    currents = (0.0, 0.0, 0.0)
    if fixed.powered:
        currents = inputs_then(terms, axis, course, 0, 0.0, 0.0)
    return started(terms, axis, bristles, clock[0], start_of_axis, (), currents)


def advance(terms, fixed, memory, clock, n, stepping, going):
    """Go on from sample n to the next one. stepping: whether inputs may differ before and after the sample."""
    p, table, coefficients = memory
    axis = axis_of(fixed, p, table)
    bristles = bristles_of(terms, axis, p[ADDED_MASS])
    course = course_of(terms, axis, coefficients, clock)
    borders = borders_of(terms, axis, bristles, course.guided)
    motion = going.motion
    if fixed.powered and stepping:
        motion = after_sample(terms, axis, course, n, motion)
    going = Going(motion, going.followed, going.glide, going.glide_h, going.halvings, going.steps)
    return over_sample(terms, axis, bristles, course, borders, n, going)


def bristle_rate(terms, fixed, axis, bristles, t, motion):
    """How fast the bristle bends, m/s."""
    y, v, w = motion.y, motion.v, motion.w
    level = friction_at(terms, axis, bristles, t, y, v, motion.currents)[0]
    if fixed.shape is not None:
        return 0.0
    if fixed.rate is not None:
        rest, breakaway = level / bristles.sigma_0, bristles.coulomb / bristles.sigma_0
        return v * fixed.rate(w, math.copysign(1.0, v), rest, breakaway, own_of(axis))[0]
    return v - bristles.sigma_0 * abs(v) * w / level


def outputs(terms, fixed, memory, t, motion):
    """What is seen of a motion at t seconds: reading in m, speed in m/s, friction and thrust in N."""
    p, table, _ = memory
    axis = axis_of(fixed, p, table)
    bristles = bristles_of(terms, axis, p[ADDED_MASS])
    y, v, currents = motion.y, motion.v, motion.currents
    reading = y
    if axis.on & terms.acts.sensor:
        reading += reading_error(terms, axis.on, t, y, v, currents, p)
    thrust = 0.0
    if axis.powered:
        driven = driven_currents(terms, axis, t, y, v, currents)
        field = field_position(terms, axis, t, y, v, driven)
        thrust = terms.motor.thrust(axis, field, driven)
        if axis.on & terms.acts.thrust:
            thrust *= thrust_factor(terms, axis, t, y, v, driven)
    stiffness, damping = motion.spring
    rate = bristle_rate(terms, fixed, axis, bristles, t, motion)
    friction = stiffness * motion.w + damping * rate + bristles.sigma_2 * v
    return reading, v, friction, thrust


ENTRIES: dict[str, Any] = {"prepare": prepare, "start": start, "advance": advance, "outputs": outputs}
