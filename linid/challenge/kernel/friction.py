"""Friction laws of the hidden plant, and what hidden effects make of the sliding force."""

from __future__ import annotations

import math

from linid.arrays import Array
from linid.challenge.kernel.inputs import Plant, PlantState
from linid.challenge.kernel.layout import (
    ACCELERATION_FRICTION,
    ASYMMETRY,
    BUMP,
    DAHL,
    DRIFT,
    DWELL,
    ELASTO_PLASTIC,
    ELEMENTS,
    LEVEL,
    LUGRE,
    THRUST_FRICTION,
    WALK,
)
from linid.simulation.binding import compiled, inlined


@inlined
def _fade(v: float, p: Plant) -> float:
    """exp(-|v/v_s|^alpha)."""
    x = abs(v) * (1.0 / p.stribeck)
    power: float = x * x if p.exponent == 2.0 else x**p.exponent
    return math.exp(-power) if power < 45.0 else 0.0


@inlined
def plain_sliding(v: float, p: Plant) -> float:
    """g(v) in N without hidden effects."""
    g: float = p.coulomb + (p.static - p.coulomb) * _fade(v, p)
    return g


@inlined
def drifted(t: float, p: Plant) -> float:
    """Factor on friction after t seconds."""
    factor: float = 1.0 - p.number[DRIFT, 0] * math.expm1(-t / p.number[DRIFT, 1])
    return factor


@inlined
def walked(walk: Array, t: float, p: Plant) -> float:
    """A random walk (k,) at t in s, linear between its knots."""
    place = t / p.walk_step
    k = min(int(place), walk.shape[0] - 2)
    value: float = walk[k] + (place - k) * (walk[k + 1] - walk[k])
    return value


@inlined
def sliding(y: float, v: float, felt: float, dwelt: float, t: float, thrust: float, p: Plant) -> float:
    """g(v) in N with what hidden effects make of it; felt: filtered acceleration in m/s^2; dwelt: 0 to 1, how far the
    contact has grown."""
    n = p.number
    coulomb, static = p.coulomb, p.static
    if p.on & 1 << ASYMMETRY:
        side = 1.0 if v > 0 else -1.0
        coulomb *= 1.0 + n[ASYMMETRY, 0] * side
        static *= 1.0 + n[ASYMMETRY, 0] * n[ASYMMETRY, 1] * side
    g: float = coulomb + (static - coulomb) * _fade(v, p)
    if p.on & 1 << DRIFT:
        g *= drifted(t, p)
    if p.on & 1 << BUMP:
        g *= 1.0 + n[BUMP, 0] * math.exp(-(((y - n[BUMP, 1]) / n[BUMP, 2]) ** 2))
    if p.on & 1 << WALK:
        g *= math.exp(n[WALK, 0] * walked(p.walk, t, p))
    if p.on & 1 << THRUST_FRICTION:
        g *= 1.0 + n[THRUST_FRICTION, 0] * abs(thrust) / p.coulomb
    if p.on & 1 << ACCELERATION_FRICTION:
        g *= 1.0 + n[ACCELERATION_FRICTION, 0] * abs(felt) / (abs(felt) + n[ACCELERATION_FRICTION, 1])
    if p.on & 1 << DWELL:
        g *= 1.0 + n[DWELL, 0] * dwelt
    if p.on & 1 << LEVEL:
        g *= 1.0 + n[LEVEL, 0]
    return g


@inlined
def _dahl(v: float, w: float, g: float, p: Plant) -> float:
    """Rate of the bristle after Dahl, m/s: v sgn(1 - u) |1 - u|^bend, u the share of the sliding force against v."""
    rest = 1.0 - p.sigma_0 * w / g * (1.0 if v > 0 else -1.0)
    return v * math.copysign(abs(rest) ** p.bend, rest)


@inlined
def _elasto_plastic(v: float, w: float, g: float, p: Plant) -> float:
    """Rate of a bristle in m/s that holds like a spring up to the share `bend` of the Coulomb force."""
    pull, hold = p.sigma_0 * w * (1.0 if v > 0 else -1.0), p.bend * p.coulomb
    if pull <= hold:
        return v
    part = 1.0
    if pull < g:
        part = 0.5 - 0.5 * math.cos(math.pi * (pull - hold) / (g - hold))
    return v * (1.0 - part * pull / g)


@compiled
def slipped(slips: Array, travel: float, g: float, p: Plant) -> tuple[float, float]:
    """Force in N of Maxwell's elements after `travel` m from the deflections `slips` (ELEMENTS,), and the share of
    stiffness that is not yet strained to its limit; g: sliding force in N."""
    force, sticking = 0.0, 0.0
    for k in range(ELEMENTS):
        most, pull = p.shares[k] * g, p.stiffness[k] * (slips[k] + travel)
        if abs(pull) >= most:
            force += math.copysign(most, pull)
        else:
            force += pull
            sticking += p.stiffness[k] * (1.0 - abs(pull) / most)
    return force, sticking / p.sigma_0


@compiled
def slip(slips: Array, travel: float, g: float, p: Plant) -> None:
    """Move the deflections of Maxwell's elements, slips (ELEMENTS,) in m, on by `travel` m; each gives way at its share
    of g.
    """
    for k in range(ELEMENTS):
        most = p.shares[k] * g / p.stiffness[k]
        slips[k] = min(max(slips[k] + travel, -most), most)


@inlined
def resistance(
    s: PlantState, travel: float, g: float, viscous: float, slips: Array, p: Plant
) -> tuple[float, float, float]:
    """Friction force in N, rate of the bristle in m/s and lost power in W; travel in m since the deflections slips
    (ELEMENTS,) in m, g: sliding force in N, viscous: friction in N s/m.
    """
    v, w = s.v, s.w
    if p.law == LUGRE or p.law == ELASTO_PLASTIC:
        pull = p.sigma_0 * abs(v) * w / g if p.law == LUGRE else v - _elasto_plastic(v, w, g, p)
        w_rate = v - pull
        resist = p.sigma_0 * w + p.sigma_1 * w_rate + viscous * v
        loss = p.sigma_0 * w * pull + p.sigma_1 * w_rate * v + viscous * v * v
    elif p.law == DAHL:
        w_rate = _dahl(v, w, g, p)
        resist = p.sigma_0 * w + viscous * v
        loss = p.sigma_0 * w * (v - w_rate) + viscous * v * v
    else:
        # What the elements store counts as lost while they hold it.
        stuck, sticking = slipped(slips, travel, g, p)
        w_rate = 0.0
        resist = stuck + (p.sigma_1 * sticking + viscous) * v
        loss = resist * v
    return resist, w_rate, loss


@inlined
def plain_bristle_rate(v: float, w: float, p: Plant) -> float:
    """Rate in m/s of a bristle w in m without hidden effects; not of Maxwell's law."""
    g = plain_sliding(v, p)
    if p.law == ELASTO_PLASTIC:
        return float(_elasto_plastic(v, w, g, p))
    rate: float = v - p.sigma_0 * abs(v) * w / g if p.law == LUGRE else _dahl(v, w, g, p)
    return rate


@inlined
def steady_bristle(g: float, v: float, p: Plant) -> float:
    """Deflection in m that steady sliding at v m/s against g N keeps."""
    return math.copysign(g / p.sigma_0, v)
