"""What acts on the bristle between the samples of a measured motion, told beforehand by lanes of intervals.

The measured motion alone tells the friction curve, and with it how far steady sliding bends the bristle and how much of
what it was bent by before it keeps, where nothing that is known only sample by sample makes more or less of friction.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from linid.physics.friction import DECAYED
from linid.simulation.along_effects import Samples
from linid.simulation.binding import allocating, compiled, inlined
from linid.simulation.lane_functions import exp_lanes, power_lanes
from linid.simulation.lanes import LANES, lanes_at, put_lanes, select

UNEVEN = 0.1  # relative change of speed between samples, from which the bristle is followed in PIECES
UNTOLD = -1.0  # for what an uneven interval keeps: it has none that holds for all of it
SHORT = 0.02  # deflections of steady sliding, within which means are taken by their series


class Between(NamedTuple):
    """Of each interval between samples (n or more,), or empty where not told. curve: friction at the mean speed in N;
    power: of that speed in Stribeck velocities, by the exponent; decayed: exp(-power); level: the factor that effects
    make on the curve; rest: deflection of steady sliding in m, with the sign of the travel; kept: share that is left of
    how far the bristle was off that, `UNTOLD` where the speed changes by much; mean, late: of that share over the
    interval, and with a weight that grows from 0 to 1."""

    curve: Any
    power: Any
    decayed: Any
    level: Any
    rest: Any
    kept: Any
    mean: Any
    late: Any


@inlined
def is_uneven(travel, v, v_next, dt):
    """Whether the speed changes by much between two samples."""
    return abs(v_next - v) > UNEVEN * abs(travel / dt)


@inlined
def room_for(count):
    """The next number of intervals that fills all lanes."""
    return (count + LANES - 1) // LANES * LANES


@inlined
def decay_means_lanes(x, decay):
    """`decay_means` for lanes."""
    small = x < SHORT
    first = (1.0 - decay) / x
    second = (first - decay) / x
    return (
        select(small, 1.0 - x * (0.5 - x * (1.0 / 6.0)), first),
        select(small, 0.5 - x * ((1.0 / 3.0) - 0.125 * x), second),
    )


@compiled
def put_curves(bristles, dt, travel, curve, power, decayed):
    """Put the friction curve at the mean speeds in; travel: in m, between samples dt seconds apart."""
    coulomb, static, stribeck_velocity, exponent = bristles[:4]
    for block in range(0, travel.size, LANES):
        ratio = abs(lanes_at(travel, block)) / dt / stribeck_velocity
        raised = ratio * ratio if exponent == 2.0 else power_lanes(ratio, exponent)
        left = select(raised > DECAYED, 0.0, exp_lanes(-raised))
        put_lanes(power, block, raised)
        put_lanes(decayed, block, left)
        put_lanes(curve, block, coulomb + (static - coulomb) * left)


@compiled
def put_shares(sigma_0, travel, between):
    """Put in what each interval makes of the bristle."""
    for block in range(0, travel.size, LANES):
        way = lanes_at(travel, block)
        rest = lanes_at(between.level, block) * lanes_at(between.curve, block) / sigma_0
        passed = abs(way) / rest
        decay = exp_lanes(-passed)
        mean, late = decay_means_lanes(passed, decay)
        put_lanes(between.rest, block, select(way < 0.0, -rest, rest))
        put_lanes(between.kept, block, decay)
        put_lanes(between.mean, block, mean)
        put_lanes(between.late, block, late)


@allocating
def put_levels(terms, axis, course, motion, travel, level):
    """Put the factor of effects on friction in the middle between samples in; no effect there reads the inputs."""
    count, dt = motion.y.size - 1, course.dt
    y, v, none = np.empty(count), np.empty(count), np.zeros(count)
    for k in range(count):
        y[k], v[k] = motion.y[k] + 0.5 * travel[k], travel[k] / dt
    terms.over.level(level[:count], axis.on, Samples(course.t_start + 0.5 * dt, dt, y, v, none, none, none), axis.p)


@allocating
def nothing_between():
    """Nothing is told beforehand."""
    none = np.empty(0)
    return Between(none, none, none, none, none, none, none, none)


@allocating
def told_between(terms, axis, bristles, course, motion):
    """What is told of all intervals of a recording: the curve, and all else where it hangs on the motion alone."""
    count, dt, acts, on = motion.y.size - 1, course.dt, terms.acts, axis.on
    size = room_for(count)
    travel, curve, power, decayed = np.zeros(size), np.empty(size), np.empty(size), np.empty(size)
    for k in range(count):
        travel[k] = motion.y[k + 1] - motion.y[k]
    put_curves(bristles, dt, travel, curve, power, decayed)
    if terms.law.plain == 0 or on & (acts.load | acts.stateful_level | acts.level & acts.by_inputs):
        none = np.empty(0)
        return Between(curve, power, decayed, none, none, none, none, none)
    level = np.ones(size)
    if on & acts.level:
        put_levels(terms, axis, course, motion, travel, level)
    rooms = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    between = Between(curve, power, decayed, level, *rooms)
    put_shares(bristles.sigma_0, travel, between)
    for k in range(count):
        if is_uneven(travel[k], motion.v[k], motion.v[k + 1], dt):
            between.kept[k] = UNTOLD
    return between
