"""Elasto-plastic friction: a bristle that is a pure spring up to a breakaway deflection, and slips from there on.

Source: Dupont et al. 2002.
"""

from __future__ import annotations

import math

from linid.physics.laws.law import Law, Own
from linid.physics.parameter import Parameter
from linid.physics.term import term

_OWN = Parameter(
    "breakaway_share", "z_ba", "1", 0.05, 0.95, 0.7, meaning="elastic part of the deflection at the Coulomb force"
)
_STEP, _NARROW = 0.1, 0.2  # a step along the travel: of the steady deflection, of what lies between it and breakaway
_LONGEST, _PART = 0.25, 0.3  # of the steady deflection, and of the way that what is missing fades in: near the end
_EXACT = 1e-9  # of the steady deflection: what the closed form near the end may leave out
_FAR = 30.0  # steady deflections of travel, after which the bristle surely has its own


@term
def slipping(q: float, rest: float, elastic: float) -> tuple[float, float, float]:
    """How far the bristle slips, 0 to 1, and its slopes by q in 1/m and by log(rest); q: deflection along the motion,
    elastic: of breakaway, in m."""
    if q <= elastic:
        return 0.0, 0.0, 0.0
    if q >= rest:
        return 1.0, 0.0, 0.0
    width = rest - elastic
    phase = math.pi * (q - 0.5 * (rest + elastic)) / width
    slope = 0.5 * math.cos(phase) * math.pi / width
    return 0.5 * (1.0 + math.sin(phase)), slope, -slope * rest * (q - elastic) / width


@term
def moved(w: float, travel: float, rest: float, breakaway: float, own: Own) -> float:
    """The deflection in m after a travel in m: elastic up to breakaway, then dq/dx = 1 - slipping(q) q/rest.

    w, rest, breakaway: deflection, steady deflection and F_C/sigma_0 in m. Beyond the steady deflection it nears that
    exponentially; just below, what is missing, e of it, by Bernoulli's equation de/ds = -e - bend e^2.
    """
    if travel == 0.0:
        return w
    way = math.copysign(1.0, travel)
    q, left = way * w, abs(travel)
    elastic = min(own[0] * breakaway, 0.99 * rest)
    if q < elastic:
        part = min(left, elastic - q)
        q += part
        left -= part
    if left > _FAR * rest:
        return way * rest
    if q >= rest:
        return way * (rest + (q - rest) * math.exp(-left / rest))
    bend = (0.5 * math.pi * rest / (rest - elastic)) ** 2
    step = min(_STEP * rest, _NARROW * (rest - elastic))
    while left > 0.0:
        missing = 1.0 - q / rest
        if bend * missing**3 < _EXACT and (bend * missing**2) ** 2 < _EXACT:
            decay = math.exp(-left / rest)
            return way * rest * (1.0 - missing * decay / (1.0 + bend * missing * (1.0 - decay)))
        fading = rest / (1.0 + 2.0 * bend * max(missing, 0.0))
        h = min(left, max(step, min(_LONGEST * rest, _PART * fading)))
        if left < 2.0 * h:
            h = left if left <= h else 0.5 * left
        k_1 = 1.0 - slipping(q, rest, elastic)[0] * q / rest
        middle = q + 0.5 * h * k_1
        k_2 = 1.0 - slipping(middle, rest, elastic)[0] * middle / rest
        middle = q + 0.5 * h * k_2
        k_3 = 1.0 - slipping(middle, rest, elastic)[0] * middle / rest
        end = q + h * k_3
        k_4 = 1.0 - slipping(end, rest, elastic)[0] * end / rest
        q += h * (k_1 + 2.0 * (k_2 + k_3) + k_4) / 6.0
        left -= h
    return way * q


@term
def rate(w: float, way: float, rest: float, breakaway: float, own: Own) -> tuple[float, float, float]:
    """dw/dy, its slope by w in 1/m, and by log(rest).

    way: factor -1 or 1, the direction of motion; rest, breakaway: steady deflection and F_C/sigma_0 in m.
    """
    q = way * w
    slip, by_q, by_rest = slipping(q, rest, min(own[0] * breakaway, 0.99 * rest))
    load = q / rest
    return 1.0 - slip * load, -(by_q * load + slip / rest) * way, slip * load - by_rest * load


LAW = Law(
    name="elasto_plastic",
    title="elasto-plastic",
    meaning="one bristle that is a pure spring up to a breakaway deflection and does not drift below it",
    source="Dupont, Hayward, Armstrong and Altpeter 2002, IEEE Trans. Autom. Control 47, 787",
    own=(_OWN,),
    moved=moved,
    rate=rate,
)
