"""One step of the mass and its bristle: far above the Stribeck velocity, or with the bristle followed."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from linid.physics.friction import stribeck, stribeck_fall
from linid.simulation.forces import friction_factor, friction_load, level_factor
from linid.simulation.terms import compiled, inlined

FINEST = 12  # a base step is halved at most this often around a reversal
REVERSAL_WEIGHT = 4.0  # how much more a swing of the bristle rate counts where the speed changes its sign
# Fast sliding: where the Stribeck curve has fallen to F_C but for this exponent's power of e, the bristle is steady but
# for this share of F_C, and the step ends where the curve has fallen by SLOWEST at least.
FAST, SLOWEST, STEADY = 40.0, 36.0, 1e-8
REST_SPEED, REST_BRISTLE = 1e-9, 1e-11  # m/s and m, below which what still moves cannot be seen


class Borders(NamedTuple):
    """Speeds in m/s above which a step of fast sliding starts, and below which it may not end; alone: only forces
    that vanish act."""

    fast: Any
    slowest: Any
    alone: Any


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


@inlined
def borders_of(terms, axis, bristles):
    """Where fast sliding begins and ends."""
    fast = bristles.stribeck_velocity * FAST ** (1.0 / bristles.exponent)
    slowest = bristles.stribeck_velocity * SLOWEST ** (1.0 / bristles.exponent)
    acts, on = terms.acts, axis.on
    alone = not axis.powered and not (on & acts.push or on & acts.advance)
    if on & acts.friction or on & acts.level or on & acts.load or on & acts.advance:
        fast = math.inf
    return Borders(fast, slowest, alone)


@inlined
def is_steady(bristles, motion):
    """Whether the bristle is where steady sliding at Coulomb's level keeps it."""
    away = abs(bristles.sigma_0 * motion.w - math.copysign(bristles.coulomb, motion.v))
    return away < STEADY * bristles.coulomb


@inlined
def friction_at(terms, axis, bristles, t, y, v, currents, p, table):
    """Level of friction in N and how it falls with speed, v dg/dv in N, with what effects do to both."""
    coulomb, static, stribeck_velocity, exponent = bristles[:4]
    level, fall = stribeck_fall(v, coulomb, static, stribeck_velocity, exponent)
    if axis.on & terms.acts.load:
        level += friction_load(terms, axis, t, y, v, currents, p, table)
    if axis.on & terms.acts.level:
        factor = level_factor(terms, axis.on, t, y, v, currents, p)
        level, fall = factor * level, factor * fall
    return level, fall


@inlined
def bristle_now(terms, axis, bristles, t, y, v, currents, p):
    """Factor on the bristle, its stiffness in N/m and its damping in N s/m."""
    if axis.on & terms.acts.friction:
        factor = friction_factor(terms, axis.on, t, y, v, currents, p)
        return factor, factor * bristles.sigma_0, factor * bristles.sigma_1
    return 1.0, bristles.sigma_0, bristles.sigma_1


@compiled
def predicted(terms, axis, bristles, spring, t, y, v, w, currents, p, table, force, halvings, tick, tolerance):
    """The middle of a followed step, halved until the bristle's rate swings little within it.

    spring: stiffness and damping of the bristle; force: on the mass at the start, N; tick: s of the finest step.
    """
    coulomb, static, stribeck_velocity, exponent, sigma_0, _, sigma_2, mass = bristles
    stiffness, damping = spring
    added = 0.0
    rate = sigma_0 * abs(v) / stribeck(v, coulomb, static, stribeck_velocity, exponent)
    if axis.on & terms.acts.load:
        added = friction_load(terms, axis, t, y, v, currents, p, table)
        rate = sigma_0 * abs(v) / (stribeck(v, coulomb, static, stribeck_velocity, exponent) + added)
    if axis.on & terms.acts.level:
        rate /= level_factor(terms, axis.on, t, y, v, currents, p)
    while True:  # until the step is short enough
        h = (1 << (FINEST - halvings)) * tick
        half = 0.5 * h
        # Half a step by implicit Euler: first order and L-stable, which is enough for a predictor.
        relax = 1.0 / (1.0 + half * rate)
        pull = half * (stiffness - damping * rate) * relax
        v_mid = (mass * v + half * force - pull * w) / (mass + half * (damping + sigma_2 + pull))
        w_mid = (w + half * v_mid) * relax
        level, fall = stribeck_fall(v_mid, coulomb, static, stribeck_velocity, exponent)
        if axis.on & terms.acts.load:
            level += added
        if axis.on & terms.acts.level:
            factor = level_factor(terms, axis.on, t + half, y + 0.5 * half * (v + v_mid), v_mid, currents, p)
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
def impulse(force, force_mid, force_end):
    """Mean and rise of the straight line nearest to the parabola through three forces: it has the same impulse."""
    return (force + 4.0 * force_mid + force_end) / 6.0, force_end - force


@inlined
def too_slow(borders, v, v_new):
    """Whether a step of fast sliding has ended where the bristle must be followed."""
    return math.copysign(v_new, v) != v_new or abs(v_new) <= borders.slowest
