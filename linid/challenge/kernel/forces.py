"""Forces of hidden effects beside motor and guideway friction, and of loads that swing behind the forcer."""

from __future__ import annotations

import math
from typing import NamedTuple

from linid.arrays import Array
from linid.challenge.kernel.friction import walked
from linid.challenge.kernel.inputs import Plant, PlantState
from linid.challenge.kernel.layout import (
    CABLE,
    CABLE_FORCE,
    COGGING,
    CONSTANT,
    DISTURBANCE,
    DRAG,
    EDDY,
    GEAR,
    GEAR_PLAY,
    GEAR_RATE,
    GRAVITY,
    LOAD,
    LOAD_RATE,
    LOAD_SPRING,
    RELUCTANCE,
    SPEED_COGGING,
    VIBRATION,
    WANDER,
)
from linid.simulation.binding import inlined


class Coupling(NamedTuple):
    """Forces on the forcer in N: from all loads together and from that behind a play; loss in their dampers in W."""

    force: float
    gear: float
    loss: float


@inlined
def extra_force(s: PlantState, hidden: Array, t: float, p: Plant) -> float:
    """Forces in N that neither motor nor guideway friction cause; hidden: (HIDDEN,) states, t: s."""
    y, v = s.y, s.v
    n, force, pole = p.number, 0.0, 2.0 * p.density * y
    if p.on & 1 << CONSTANT:
        force += n[CONSTANT, 0]
    if p.on & 1 << COGGING:
        swell = 1.0 + n[COGGING, 1] * math.sin(2.0 * math.pi * y / n[COGGING, 2])
        second = n[COGGING, 4] * math.sin(2.0 * pole + n[COGGING, 5])
        force += n[COGGING, 0] * swell * (math.sin(pole + n[COGGING, 3]) + second)
    if p.on & 1 << CABLE_FORCE:
        pull = math.tanh((y - n[CABLE_FORCE, 1]) / n[CABLE_FORCE, 2]) + n[CABLE_FORCE, 3] * hidden[CABLE]
        force -= n[CABLE_FORCE, 0] * pull
    if p.on & 1 << DRAG:
        force -= n[DRAG, 0] * abs(v) ** n[DRAG, 1] * (1.0 if v > 0 else -1.0)
    if p.on & 1 << DISTURBANCE:
        for k in range(p.pushes.shape[0]):
            since = (t - p.pushes[k, 1]) / p.pushes[k, 2]
            if 0.0 < since < 1.0:
                force += p.pushes[k, 0] * math.sin(math.pi * since)
    if p.on & 1 << VIBRATION:
        force += n[VIBRATION, 0] * math.sin(2.0 * math.pi * n[VIBRATION, 1] * t + n[VIBRATION, 2])
    if p.on & 1 << SPEED_COGGING:
        turn = 2.0 * math.pi * abs(v) / n[SPEED_COGGING, 1] + n[SPEED_COGGING, 2]
        force += n[SPEED_COGGING, 0] * abs(v) / (abs(v) + 0.05) * math.sin(pole + turn)
    if p.on & 1 << RELUCTANCE:
        force += n[RELUCTANCE, 0] * s.i_q * s.i_q * math.sin(pole + n[RELUCTANCE, 1])
    if p.on & 1 << EDDY:
        force -= n[EDDY, 0] * v / n[EDDY, 1] * math.exp(1.0 - abs(v) / n[EDDY, 1])
    if p.on & 1 << GRAVITY:
        turn = n[GRAVITY, 1] * y
        force += n[GRAVITY, 0] * (math.sin(turn + n[GRAVITY, 2]) + n[GRAVITY, 3] * math.sin(2.0 * turn + n[GRAVITY, 4]))
    if p.on & 1 << WANDER:
        force += n[WANDER, 0] * walked(p.wander, t, p)
    return force


@inlined
def coupling_of(hidden: Array, p: Plant) -> Coupling:
    """What a load on a spring and one behind a soft play do to the forcer; hidden: (HIDDEN,) states."""
    force, gear, loss = 0.0, 0.0, 0.0
    if p.on & 1 << LOAD_SPRING:
        rate = 2.0 * math.pi * p.number[LOAD_SPRING, 1]
        damping = 2.0 * p.number[LOAD_SPRING, 2] * rate * p.load_mass
        force = p.load_mass * rate * rate * hidden[LOAD] + damping * hidden[LOAD_RATE]
        loss = damping * hidden[LOAD_RATE] * hidden[LOAD_RATE]
    if p.on & 1 << GEAR_PLAY:
        n = p.number[GEAR_PLAY]
        rate = 2.0 * math.pi * n[2]
        damping = 2.0 * n[3] * rate * p.gear_mass
        touch = math.tanh(hidden[GEAR] / n[1])
        gear = p.gear_mass * rate * rate * (hidden[GEAR] - n[1] * touch) + damping * touch * touch * hidden[GEAR_RATE]
        force += gear
        loss += damping * touch * touch * hidden[GEAR_RATE] * hidden[GEAR_RATE]
    return Coupling(force, gear, loss)
