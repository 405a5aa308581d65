"""What candidates along one measured motion share of the bristle's way, where nothing that decides it differs.

Candidates that differ in their motor or effects alone, as most columns of a Jacobian do, share most of the bristle's
way: where it begins an interval with the same bits, it ends it with the same ones.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.physics.laws.law import MOST_OWN
from linid.physics.model import LAW_START
from linid.simulation.binding import allocating, inlined

FRICTION = 5  # parameters before sigma_1, which decide the bristle along a motion


class Followed(NamedTuple):
    """How the bristle went last along a recording. params: what decided it, (FRICTION + MOST_OWN,); per sample
    (samples,) the deflections in m that it began (nan: unknown) and ended the way to the next one with, what effects
    made of friction on it, and both means between; all empty where it is not shared."""

    params: Any
    begun: Any
    level: Any
    load: Any
    ended: Any
    mean: Any
    late: Any


@allocating
def followed_before(samples):
    """Room for the way along a recording of at most so many samples, of which nothing is known."""
    params, begun = np.full(FRICTION + MOST_OWN, np.nan), np.full(samples, np.nan)
    level, load = np.empty(samples), np.empty(samples)
    return Followed(params, begun, level, load, np.empty(samples), np.empty(samples), np.empty(samples))


@allocating
def shared_with(terms, on, params, before):
    """The way of the candidate before, forgotten if other parameters decide it, or empty where effects decide it as a
    whole."""
    if terms.law.elements > 0 or on & terms.acts.static:
        nothing = before.begun[0:0]
        return Followed(before.params, nothing, nothing, nothing, nothing, nothing, nothing)
    if not is_followed_before(params, before):
        before.begun[:] = math.nan
    for k in range(FRICTION + MOST_OWN):
        before.params[k] = params[k if k < FRICTION else LAW_START + k - FRICTION]
    return before


@inlined
def is_followed_before(params, before):
    """Whether the candidate before had the same friction, but for what effects make of it."""
    same = True
    for k in range(FRICTION + MOST_OWN):
        same = same and before.params[k] == params[k if k < FRICTION else LAW_START + k - FRICTION]
    return same


@inlined
def bristle_or_before(terms, axis, bristles, resistance, w, way, want_means, shared):
    """The law's `along`, or what it was when it began with the same deflection and effects made the same of friction.
    shared: what is told of the intervals, and the way of the candidate before."""
    k, (told, before) = way[4], shared
    known = before.begun.size > 0
    if known and before.begun[k] == w and before.level[k] == resistance.level and before.load[k] == resistance.load:
        return before.ended[k], before.mean[k], before.late[k]
    ended, mean, late = terms.law.along(axis, bristles, resistance, told, w, way, want_means)
    if known:
        before.begun[k], before.level[k], before.load[k] = w, resistance.level, resistance.load
        before.ended[k], before.mean[k], before.late[k] = ended, mean, late
    return ended, mean, late
