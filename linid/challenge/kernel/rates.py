"""Right-hand side of the hidden plant's equations, and the acceleration that the model without effects gives."""

from __future__ import annotations

import math
from typing import NamedTuple

from linid.arrays import Array
from linid.challenge.kernel.forces import Coupling, coupling_of, extra_force
from linid.challenge.kernel.friction import drifted, plain_bristle_rate, plain_sliding, resistance, sliding, slipped
from linid.challenge.kernel.inputs import Memory, Plant, PlantState
from linid.challenge.kernel.layout import (
    ACCELERATION_FRICTION,
    CABLE,
    CABLE_FORCE,
    DAHL,
    DRIFT,
    DWELL,
    DWELT,
    FELT,
    FORCE_ROWS,
    FRICTION_ROWS,
    GEAR,
    GEAR_PLAY,
    GEAR_RATE,
    HEAT_FAST,
    HEAT_SLOW,
    LOAD,
    LOAD_RATE,
    LOAD_SPRING,
    LOOSE,
    MAXWELL,
    OUTSIDE_FORCE_ROWS,
    OUTSIDE_FRICTION_ROWS,
    STATE_ROWS,
    THERMAL,
)
from linid.challenge.kernel.motor import Field, contract, currents, motor_force, with_offsets
from linid.challenge.kernel.outside import outside_force, outside_friction
from linid.simulation.binding import compiled, inlined


class Moment(NamedTuple):
    """When and under what: t in s, push in N; led: the axis moves with the acceleration lead, m/s^2, whatever acts."""

    t: float
    push: float
    led: bool
    lead: float


class Rates(NamedTuple):
    """Motor force in N, acceleration in m/s^2, rates of the bristles w and base_w in m/s, of work and loss in W."""

    thrust: float
    acceleration: float
    w: float
    base_w: float
    work: float
    loss: float


@inlined
def rates(s: PlantState, now: Moment, field: Field, memory: Memory, p: Plant) -> Rates:
    """Rates of the states at memory.stage; those of the hidden states go into memory.rate."""
    hidden = memory.stage
    thrust = motor_force(s, field, hidden, p)
    drive, viscous = now.push, p.sigma_2
    if p.on & FORCE_ROWS:
        drive += extra_force(s, hidden, now.t, p)
    if p.on & 1 << DRIFT:
        viscous *= drifted(now.t, p)
    coupling = coupling_of(hidden, p)
    drive += thrust
    if p.on & OUTSIDE_FORCE_ROWS:
        drive += outside_force(s, hidden, now.t, thrust, p)
    if p.on & FRICTION_ROWS:
        g = sliding(s.y, s.v, hidden[FELT], hidden[DWELT], now.t, thrust, p)
        if p.on & OUTSIDE_FRICTION_ROWS:
            g *= outside_friction(s.y, hidden, now.t, thrust, p)
    else:
        g = plain_sliding(s.v, p)
    resist, w_rate, loss = resistance(s, s.y - field.y0, g, viscous, memory.slips, p)
    acceleration = (drive - resist + coupling.force) * (1.0 / p.mass)
    base_rate = w_rate
    if p.on & FRICTION_ROWS and p.law != MAXWELL:
        base_rate = plain_bristle_rate(s.v, s.base_w, p)
    if p.on & STATE_ROWS:
        _hidden_rates(s, now.lead if now.led else acceleration, coupling, memory, p)
    return Rates(thrust, acceleration, w_rate, base_rate, drive * s.v, loss + coupling.loss)


@inlined
def _hidden_rates(s: PlantState, moved: float, coupling: Coupling, memory: Memory, p: Plant) -> None:
    """Rates of the hidden states of a forcer with the acceleration `moved` in m/s^2, into memory.rate."""
    n, hidden, out = p.number, memory.stage, memory.rate
    if p.on & 1 << THERMAL:
        out[HEAT_FAST] = (s.i_q * s.i_q - hidden[HEAT_FAST]) / n[THERMAL, 1]
        out[HEAT_SLOW] = (s.i_q * s.i_q - hidden[HEAT_SLOW]) / n[THERMAL, 2]
    if p.on & 1 << CABLE_FORCE:
        out[CABLE] = (s.v - abs(s.v) * hidden[CABLE]) / n[CABLE_FORCE, 4]
    if p.on & 1 << LOAD_SPRING:
        out[LOAD], out[LOAD_RATE] = hidden[LOAD_RATE], -(coupling.force - coupling.gear) / p.load_mass - moved
    if p.on & 1 << GEAR_PLAY:
        out[GEAR], out[GEAR_RATE] = hidden[GEAR_RATE], -coupling.gear / p.gear_mass - moved
    if p.on & 1 << ACCELERATION_FRICTION:
        out[FELT] = (moved - hidden[FELT]) / n[ACCELERATION_FRICTION, 2]
    if p.on & 1 << LOOSE:
        out[FELT] = (moved - hidden[FELT]) / n[LOOSE, 2]
    if p.on & 1 << DWELL:
        out[DWELT] = (1.0 - hidden[DWELT]) / n[DWELL, 1] - abs(s.v) * hidden[DWELT] / n[DWELL, 2]


@compiled
def base_acceleration(s: PlantState, push: float, slips: Array, p: Plant) -> float:
    """Acceleration in m/s^2 that the model without effects gives along this motion under the logged currents; slips:
    (ELEMENTS,) its deflections of Maxwell's elements in m, push in N."""
    v, w = s.v, s.base_w
    a, b = currents(s.y, s.i_q, p)
    angle = p.density * s.y + p.shift
    force: float = with_offsets(contract(p.base_field, math.sin(angle), math.cos(angle), a, b), s.y, p)
    g: float = plain_sliding(v, p)
    if p.law == MAXWELL:
        stuck, sticking = slipped(slips, 0.0, g, p)
        left: float = force + push - stuck - (p.sigma_1 * sticking + p.sigma_2) * v
        return left / p.base_mass
    if p.law == DAHL:
        return (force + push - p.sigma_0 * w - p.sigma_2 * v) / p.base_mass
    w_rate: float = plain_bristle_rate(v, w, p)
    left = force + push - p.sigma_0 * w - p.sigma_1 * w_rate - p.sigma_2 * v
    return left / p.base_mass
