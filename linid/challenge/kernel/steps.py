"""One Runge-Kutta step of the hidden plant, free or led along a path, and what happens at its end."""

from __future__ import annotations

import math
from typing import NamedTuple

from linid.arrays import Array
from linid.challenge.kernel.friction import plain_sliding, sliding, slip
from linid.challenge.kernel.inputs import Memory, Plant, PlantState
from linid.challenge.kernel.layout import (
    DWELT,
    FELT,
    FRICTION_ROWS,
    HIDDEN,
    OUTSIDE_FRICTION_ROWS,
    PLAY,
    RATED,
    SLACK,
    STATE_ROWS,
)
from linid.challenge.kernel.motor import Field, Lag, delayed
from linid.challenge.kernel.outside import outside_friction
from linid.challenge.kernel.rates import Moment, rates
from linid.simulation.binding import inlined

CONTACT = 8  # power of the part of the play that is taken up: it gives way over its last tenth


class Lead(NamedTuple):
    """The part of a path along which a loop period leads: rows `now` and `ahead` of path, see `Orders`."""

    led: bool
    path: Array
    now: int
    ahead: int


class Step(NamedTuple):
    """A step: its number in the recording, its length h in s, and what it holds: q-current reference in A, push in
    N."""

    number: int
    h: float
    i_reference: float
    push: float


class Forces(NamedTuple):
    """Motor force in N and acceleration in m/s^2 where a step starts, and the motor force where it ends."""

    thrust: float
    acceleration: float
    last_thrust: float


@inlined
def placed(s: PlantState, y: float, v: float, i_q: float) -> PlantState:
    """The same elsewhere: y in m, v in m/s, q-current in A."""
    return PlantState(y, v, s.w, i_q, s.base_w, s.work, s.loss)


@inlined
def led_motion(s: PlantState, row: Array) -> PlantState:
    """The same at a row (4,) of a path."""
    there: PlantState = placed(s, row[0], row[1], row[3])
    return there


@inlined
def _halfway(at: PlantState, s: PlantState, h: float, lead: Lead) -> PlantState:
    """`at` moved to the middle of a step of h seconds from s along a path."""
    now, ahead = lead.path[lead.now], lead.path[lead.ahead]
    y = 0.5 * (s.y + ahead[0]) + 0.125 * h * (s.v - ahead[1])
    v = 0.5 * (s.v + ahead[1]) + 0.125 * h * (now[2] - ahead[2])
    middle: PlantState = placed(at, y, v, 0.5 * (s.i_q + ahead[3]))
    return middle


@inlined
def runge_kutta(s: PlantState, step: Step, lead: Lead, lag: Lag, memory: Memory, p: Plant) -> tuple[PlantState, Forces]:
    """Kernel: the motion one step later, memory.hidden with it; elements that slip and delays wait for its end.

    The right-hand side is called in a loop over the stages, so that it is compiled once.
    """
    angle = p.density * s.y + p.shift
    sine, cosine = math.sin(angle), math.cos(angle)
    h, at, total = step.h, s, PlantState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    acceleration, thrust, first_thrust, leading, a, b = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if p.on & STATE_ROWS:
        for k in range(HIDDEN):
            memory.stage[k], memory.total[k] = memory.hidden[k], 0.0
    for stage in range(4):
        part = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
        ahead = h if stage == 2 else 0.5 * h
        weight = 2.0 if stage == 1 or stage == 2 else 1.0
        if lead.led:
            leading = lead.path[lead.now, 2] * (1.0 - part) + lead.path[lead.ahead, 2] * part
            if stage == 1:
                at = _halfway(at, s, h, lead)
            elif stage == 3:
                at = led_motion(at, lead.path[lead.ahead])
        if lag.late:
            a = delayed(memory.history, 0, step.number, lag.dead - part)
            b = delayed(memory.history, 1, step.number, lag.dead - part)
        now = Moment((step.number + part) * h, step.push, lead.led, leading)
        r = rates(at, now, Field(s.y, sine, cosine, lag.late, a, b), memory, p)
        thrust = r.thrust
        if stage == 0:
            first_thrust, acceleration = r.thrust, r.acceleration
        i_rate = (step.i_reference - at.i_q) * (1.0 / p.current_lag)
        slope = PlantState(at.v, r.acceleration, r.w, i_rate, r.base_w, r.work, r.loss)
        total = moved(total, slope, weight)
        there = moved(s, slope, ahead)
        at = placed(there, at.y, at.v, at.i_q) if lead.led else there
        if p.on & STATE_ROWS:
            for k in range(RATED):
                memory.total[k] += weight * memory.rate[k]
                memory.stage[k] = memory.hidden[k] + ahead * memory.rate[k]
    sixth = h / 6.0
    if p.on & STATE_ROWS:
        for k in range(RATED):
            memory.hidden[k] += sixth * memory.total[k]
    end = moved(s, total, sixth)
    if lead.led:
        end = led_motion(end, lead.path[lead.ahead])
    return end, Forces(first_thrust, acceleration, thrust)


@inlined
def moved(s: PlantState, slope: PlantState, h: float) -> PlantState:
    """The motion h seconds on along its rates."""
    return PlantState(
        s.y + h * slope.y,
        s.v + h * slope.v,
        s.w + h * slope.w,
        s.i_q + h * slope.i_q,
        s.base_w + h * slope.base_w,
        s.work + h * slope.work,
        s.loss + h * slope.loss,
    )


@inlined
def take_up_play(travel: float, hidden: Array, p: Plant) -> None:
    """Move the encoder's play, one of the hidden (HIDDEN,) states, by `travel` m: what is read stands still at first,
    and follows more and more as the play is taken up; it never moves against the motor.
    """
    side = math.copysign(1.0, travel)
    taken_up = 0.5 * (1.0 + side * hidden[SLACK])
    slack = hidden[SLACK] + 2.0 * travel / p.number[PLAY, 0] * (1.0 - taken_up**CONTACT)
    hidden[SLACK] = min(max(slack, -1.0), 1.0)


@inlined
def slip_elements(s: PlantState, travel: float, t: float, thrust: float, memory: Memory, p: Plant) -> None:
    """Move Maxwell's elements, and those of the base model, by `travel` m to the motion s; t in s, thrust in N."""
    g = plain_sliding(s.v, p)
    slip(memory.base_slips, travel, g, p)
    if p.on & FRICTION_ROWS:
        g = sliding(s.y, s.v, memory.hidden[FELT], memory.hidden[DWELT], t, thrust, p)
        if p.on & OUTSIDE_FRICTION_ROWS:
            g *= outside_friction(s.y, memory.hidden, t, thrust, p)
    slip(memory.slips, travel, g, p)
