"""How friction between the samples of a measured motion answers directions, of all intervals at once.

Where the motion and the inputs alone tell what effects and own terms do to it (along_between.py); else it is asked
sample by sample (along_load.py).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from linid.simulation.along_between import is_told_between, push_between, put_loads, samples_between, travel_between
from linid.simulation.along_ways import GRIPS, LEVEL, LEVELS, LOAD, LOADS, PRESSES, some_have
from linid.simulation.binding import allocating, inlined
from linid.simulation.forces import Axis
from linid.simulation.slope_effects import FORCE_STEP


class BetweenSlopes(NamedTuple):
    """Of each direction and interval, (K, n): how the factor on the level of friction, and the N added before, answer;
    empty where nothing changes them or they are asked sample by sample."""

    level: Any
    load: Any


@inlined
def answers_at_once(terms, on):
    """Whether friction between samples answers all directions at once: inputs that act late differ by direction."""
    return is_told_between(terms, on) and not on & terms.acts.delay


@allocating
def with_parameters(axis, p):
    """`beside` for who counts references to arrays: the axis with other parameters, but for its motor's table."""
    return Axis(axis.on, axis.powered, axis.motor, axis.harmonics, axis.wavenumber, axis.phase, p, axis.table)


@allocating
def between_slopes(terms, axis, candidates, course, motion, told, room):
    """The answers of all intervals, by differences. told: as of `told_between`; room: as of `room_beside`."""
    count, directions, on = motion.y.size - 1, room.ways.size, axis.on
    levels, loads = some_have(room.ways, LEVELS), some_have(room.ways, LOADS | GRIPS)
    if not answers_at_once(terms, on):
        levels = loads = False
    level, load = np.zeros((directions if levels else 0, count)), np.zeros((directions if loads else 0, count))
    if not (levels or loads):
        return BetweenSlopes(level, load)
    travel = travel_between(motion)
    samples = samples_between(axis, course, motion, travel, on & terms.acts.by_inputs != 0)
    push, there = push_between(terms, axis, candidates, samples), np.empty(count)
    for c in range(directions):
        other = with_parameters(axis, room.params[c])
        if room.ways[c] & LEVELS:
            there[:] = 1.0
            terms.over.level(there, on, samples, other.p)
            for k in range(count):
                level[c, k] = (there[k] - told.level[k]) / FORCE_STEP
        if room.ways[c] & (LOADS | GRIPS):
            pushed = push
            if room.ways[c] & PRESSES:
                pushed = push_between(terms, other, candidates, samples)
            there[:] = 0.0
            put_loads(terms, other, samples, pushed, there)
            for k in range(count):
                load[c, k] = (there[k] - told.load[k]) / FORCE_STEP
    return BetweenSlopes(level, load)


@inlined
def put_between(slopes, k, room):
    """Put in the answers of interval k."""
    for c in range(slopes.level.shape[0]):
        room.carried[LEVEL * room.width + c] = slopes.level[c, k]
    for c in range(slopes.load.shape[0]):
        room.carried[LOAD * room.width + c] = slopes.load[c, k]
