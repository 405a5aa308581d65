"""Forces and friction of causes outside the library, and what a plant remembers of its motion for them.

A cause is a function of what `linid.challenge.outside` says it depends on, and of nothing else.
"""

from __future__ import annotations

import math

from linid.arrays import Array
from linid.challenge.kernel.inputs import Plant, PlantState
from linid.challenge.kernel.layout import (
    BALL_PASS,
    CHAIN,
    COOLANT,
    EXTREME,
    FEED_LINE,
    FELT,
    FILM,
    GATED_VIBRATION,
    GRIP,
    LOOSE,
    MAGNET,
    ORIGIN,
    PLACE_DAMPING,
    RESONANCE,
    RESTED,
    RESTING,
    REVERSAL,
    SLID,
    SOFT_RAIL,
    SUPPLY,
    WAY,
)
from linid.simulation.binding import compiled

BAND = 5e-5  # m: a smaller move back is no reversal; presliding and encoder noise stay below it
REST_SPEED = 1e-3  # m/s: slower than this is rest
LEAST_REST = 0.02  # s: shorter stops are turning points, no rests
TURN_SPEED = 5e-3  # m/s, over which a force that knows the direction goes from one way to the other


@compiled
def place_of(y: float, centre: float, width: float) -> float:
    """1 at a place and falling to nothing a few widths away; y, centre, width: m."""
    away = (y - centre) / width
    return math.exp(-0.5 * away * away)


@compiled
def outside_force(s: PlantState, hidden: Array, t: float, thrust: float, p: Plant) -> float:
    """Forces in N; hidden: (HIDDEN,) states, t: s, thrust: motor force in N."""
    y, v, n, force = s.y, s.v, p.number, 0.0
    if p.on & 1 << GATED_VIBRATION:
        k = n[GATED_VIBRATION]
        gate = 0.5 + 0.5 * math.tanh((abs(v) - k[3]) / k[4])
        force += k[0] * gate * math.sin(2.0 * math.pi * k[1] * t + k[2])
    if p.on & 1 << SOFT_RAIL:
        k = n[SOFT_RAIL]
        push = (thrust / k[3]) ** 3
        force -= k[0] * place_of(y, k[1], k[2]) * push / (1.0 + abs(push))
    if p.on & 1 << PLACE_DAMPING:
        k = n[PLACE_DAMPING]
        force -= k[0] * v * place_of(y, k[1], k[2])
    if p.on & 1 << CHAIN:
        k = n[CHAIN]
        forth = 0.5 + 0.5 * math.tanh(v / TURN_SPEED)
        there, back = math.sin(2.0 * math.pi * y / k[1] + k[2]), math.sin(2.0 * math.pi * y / k[3] + k[4])
        force += k[0] * (forth * there + (1.0 - forth) * back)
    if p.on & 1 << MAGNET:
        k = n[MAGNET]
        force -= k[0] * (y - k[1]) / k[2] * math.exp(0.5) * place_of(y, k[1], k[2])
    if p.on & 1 << RESONANCE:
        k = n[RESONANCE]
        off = (abs(v) - k[1]) / k[2]
        force -= k[0] * math.tanh(v / TURN_SPEED) / (1.0 + off * off)
    if p.on & 1 << FEED_LINE:
        k = n[FEED_LINE]
        far = 0.5 + 0.5 * math.tanh((y - k[1]) / k[2])
        force += thrust * (1.0 / (1.0 + k[0] * abs(v) * far) - 1.0)
    if p.on & 1 << SUPPLY:
        k = n[SUPPLY]
        force += k[0] * thrust * math.sin(2.0 * math.pi * k[1] * t + k[2])
    if p.on & 1 << LOOSE:
        felt = (hidden[FELT] / n[LOOSE, 1]) ** 3
        force -= n[LOOSE, 0] * felt / (1.0 + abs(felt))
    return force


@compiled
def outside_friction(y: float, hidden: Array, t: float, thrust: float, p: Plant) -> float:
    """Factor on the sliding force; y: m, hidden: (HIDDEN,) states, t: s, thrust: motor force in N."""
    n, factor = p.number, 1.0
    if p.on & 1 << REVERSAL:
        factor *= 1.0 + n[REVERSAL, 0] * math.exp(-abs(y - hidden[ORIGIN]) / n[REVERSAL, 1])
    if p.on & 1 << GRIP:
        factor *= 1.0 + n[GRIP, 0] * place_of(abs(thrust), n[GRIP, 1], n[GRIP, 2])
    if p.on & 1 << COOLANT:
        factor *= 1.0 + n[COOLANT, 0] * math.sin(2.0 * math.pi * (p.begun + t) / n[COOLANT, 1] + n[COOLANT, 2])
    if p.on & 1 << BALL_PASS:
        factor *= 1.0 + n[BALL_PASS, 0] * math.sin(2.0 * math.pi * y / n[BALL_PASS, 1] + n[BALL_PASS, 2])
    if p.on & 1 << FILM:
        resting = hidden[RESTING] >= LEAST_REST
        rest = hidden[RESTING] if resting else hidden[RESTED]
        slid = 0.0 if resting else hidden[SLID]
        factor *= 1.0 - n[FILM, 0] * rest / (rest + n[FILM, 1]) * math.exp(-slid / n[FILM, 2])
    return factor


@compiled
def note_motion(y: float, v: float, travel: float, h: float, hidden: Array) -> None:
    """Note in the hidden states (HIDDEN,) where the axis last turned back, and how long it rested.

    y in m and v in m/s at the end of a step of h seconds in which it moved by `travel` m. Before the first reversal
    ORIGIN is the place of the start.
    """
    if hidden[WAY] == 0.0:
        if abs(y - hidden[ORIGIN]) > BAND:
            hidden[WAY], hidden[EXTREME] = math.copysign(1.0, y - hidden[ORIGIN]), y
    elif (y - hidden[EXTREME]) * hidden[WAY] >= 0.0:
        hidden[EXTREME] = y
    elif abs(y - hidden[EXTREME]) > BAND:
        hidden[ORIGIN], hidden[EXTREME], hidden[WAY] = hidden[EXTREME], y, -hidden[WAY]
    hidden[SLID] += abs(travel)
    if abs(v) < REST_SPEED:
        hidden[RESTING] += h
    else:
        if hidden[RESTING] >= LEAST_REST:
            hidden[RESTED], hidden[SLID] = hidden[RESTING], 0.0
        hidden[RESTING] = 0.0
