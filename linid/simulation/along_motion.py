"""A measured motion, and what acts at its samples and in the middle between two of them."""

from __future__ import annotations

from typing import Any, NamedTuple

from linid.simulation.binding import compiled, inlined
from linid.simulation.forces import advance_states, keep_states
from linid.simulation.splines_at import late_inputs


class MeasuredMotion(NamedTuple):
    """A measured motion: y (n,) in m and v (n,) in m/s, smoothed; inputs: (3, n); standstill: (n,) true where the axis
    rests, and its bristle balances the other forces; wanted: (n,) where the bristle is, or empty for everywhere."""

    y: Any
    v: Any
    inputs: Any
    standstill: Any
    wanted: Any


@inlined
def inputs_of_sample(terms, axis, course, motion, k):
    """The three inputs that act at sample k."""
    if not axis.powered:
        return 0.0, 0.0, 0.0
    if axis.on & terms.acts.delay:
        return late_inputs(course.coefficients, course.dt, k * course.dt - course.lag)
    return motion.inputs[0, k], motion.inputs[1, k], motion.inputs[2, k]


@inlined
def midway(terms, axis, course, motion, k):
    """Place in samples, time, position, speed and inputs in the middle between sample k and the next; no inputs where
    nothing there hangs on them."""
    dt, travel = course.dt, motion.y[k + 1] - motion.y[k]
    currents = 0.0, 0.0, 0.0
    if axis.powered and axis.on & terms.acts.by_inputs:
        currents = late_inputs(course.coefficients, dt, (k + 0.5) * dt - course.lag)
    return k + 0.5, course.t_start + k * dt + 0.5 * dt, motion.y[k] + 0.5 * travel, travel / dt, currents


@inlined
def midway_if(asked, terms, axis, course, motion, k):
    """`midway` where it is asked for, else of no meaning."""
    return midway(terms, axis, course, motion, k) if asked else (0.0, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0))


@inlined
def advance_on(terms, axis, course, motion, where):
    """Bring hidden states to the next sample; where: as of `midway`."""
    k = int(where[0])
    advance_by(terms, axis, course.dt, (motion.v[k + 1] - motion.v[k]) / course.dt, where)


@compiled
def advance_by(terms, axis, dt, a, where):
    """Bring hidden states on by dt seconds; a: mean acceleration in m/s^2; where: as of `midway`."""
    _, t, y, v, currents = where
    advance_states(terms, axis, dt, t, y, v, a, currents)
    keep_states(axis.p)
