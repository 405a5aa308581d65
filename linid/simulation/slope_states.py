"""Derivatives of hidden states along a step: how they answer motion, their own start and the parameters of effects.

By differences of the effects' own `advance`, some per step: all columns share them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from linid.physics.model import STATE_SIZE, STATE_START
from linid.physics.own_terms.layout import MEMORY_BIT
from linid.simulation.binding import allocating, compiled, inlined
from linid.simulation.lanes import lanes_at, put_lanes
from linid.simulation.own_slopes import answers_of_memory
from linid.simulation.slope_effects import FORCE_STEP, PLACE_STEP, beside, faster_by, nudged

ACCELERATION_STEP, CALM = 1e-6, 1.0  # of an acceleration with so many m/s^2
# The parts of a step along which a state goes, and where its slopes stand: at the start of the step, after each part.
TO_MIDDLE, TO_END, SETTLED, PARTS = range(4)
AT_START, AT_MIDDLE, AT_END = 0, 1 + TO_MIDDLE, 1 + TO_END


class Hidden(NamedTuple):
    """n hidden states. now, after: (n,) of the model, at the start of a step and as the simulation leaves them; then:
    (n,) after a part of it; slopes: ((1 + PARTS) * n * width) by the columns, at the start and after the parts; by:
    (PARTS * n * (n + 3)) how each after a part answers those at the start, the place, the speed and the acceleration;
    own: (PARTS * n * width) the columns' own slopes."""

    now: Any
    after: Any
    then: Any
    slopes: Any
    by: Any
    own: Any


class Way(NamedTuple):
    """How the axis moves along a part of a step while states advance: h in s; t in s, y in m, v in m/s in its middle; a
    in m/s^2; currents: inputs."""

    part: Any
    h: Any
    t: Any
    y: Any
    v: Any
    a: Any
    currents: Any


@allocating
def hidden_of(n, width):
    """Room for n hidden states and this many columns."""
    slopes, by, own = np.zeros((1 + PARTS) * n * width), np.zeros(PARTS * n * (n + 3)), np.zeros(PARTS * n * width)
    return Hidden(np.zeros(n), np.zeros(n), np.zeros(n), slopes, by, own)


@compiled
def advanced(terms, axis, bits, way):
    """Bring the hidden states of effects with these bits from the start of the step to the end of a way."""
    terms.advance(axis.on & bits, way.h, way.t, way.y, way.v, way.a, way.currents, axis.p)


@inlined
def way_to_middle(reach, motion, v_mid):
    """That of `to_the_middle`."""
    half = 0.5 * reach.h
    place, speed = motion.y + 0.25 * half * (motion.v + v_mid), 0.5 * (motion.v + v_mid)
    return Way(TO_MIDDLE, half, reach.t_mid - 0.5 * half, place, speed, (v_mid - motion.v) / half, motion.currents)


@inlined
def way_to_end(reach, motion, v_mid, currents):
    """That of `to_the_end`."""
    return Way(TO_END, reach.h, reach.t_mid, reach.y_mid, v_mid, (v_mid - motion.v) / (0.5 * reach.h), currents)


@inlined
def way_as_settled(reach, motion, reached, currents):
    """That of `settled`."""
    h, displacement = reach.h, reached.y - motion.y
    place, faster = motion.y + 0.5 * displacement, reached.v - motion.v
    return Way(SETTLED, h, reach.t_mid, place, displacement / h, faster / h, currents)


@inlined
def states_are_now(along):
    """Put the hidden states of model and directions to those of the model at the start of the step."""
    axis, acting, hidden = along.axis, along.acting, along.hidden
    for k in range(acting.kept.size):
        place = STATE_START + acting.kept[k]
        axis.p[place] = axis.p[place + STATE_SIZE] = hidden.now[k]
        for c in acting.moved:
            acting.params[c, place] = acting.params[c, place + STATE_SIZE] = hidden.now[k]


@inlined
def step_begins(along):
    """Take hidden states back to where the step began; where the simulation has brought them is remembered."""
    for k in range(along.acting.kept.size):
        along.hidden.after[k] = along.axis.p[STATE_START + along.acting.kept[k]]
    states_are_now(along)


@inlined
def step_ends(along):
    """Put the hidden states of the model back to where the simulation has brought them."""
    axis, acting, hidden = along.axis, along.acting, along.hidden
    for k in range(acting.kept.size):
        place = STATE_START + acting.kept[k]
        hidden.now[k] = axis.p[place] = axis.p[place + STATE_SIZE] = hidden.after[k]


@inlined
def other_way(way, j):
    """A way a little farther on (j = 0), faster (1) or with more acceleration (2), and how much of that."""
    place, speed, acceleration = way.y, way.v, way.a
    if j == 0:
        step = PLACE_STEP
        place += step
    elif j == 1:
        step = faster_by(speed)
        speed += step
    else:
        step = ACCELERATION_STEP * (abs(acceleration) + CALM)
        acceleration += step
    return Way(way.part, way.h, way.t, place, speed, acceleration, way.currents), step


@compiled
def own_answers(terms, axis, acting, hidden, way, i):
    """Put in how the states of an effect after a way answer its parameters, along the i-th column that
    moves them: from where that column has them at the start, since a load may lean on the side of a gap that moves.

    Those of other effects are left alone: differences of nothing would be rounding, step after step."""
    kept, n, c, bits = acting.kept, acting.kept.size, acting.moved[i], acting.touched[i]
    row, own, width = way.part * n * (n + 3), way.part * n, hidden.own.size // (PARTS * n)
    q, slopes = acting.params[c], hidden.slopes
    for j in range(n):
        if acting.owners[j] & bits:
            q[STATE_START + STATE_SIZE + kept[j]] += FORCE_STEP * slopes[j * width + c]
    advanced(terms, beside(axis, acting.params, c), bits, way)
    for k in range(n):
        if acting.owners[k] & bits:
            known = 0.0
            for j in range(n):
                if acting.owners[j] & bits:
                    known += hidden.by[row + k * (n + 3) + j] * slopes[j * width + c]
            change = (q[STATE_START + kept[k]] - hidden.then[k]) / FORCE_STEP
            hidden.own[(own + k) * width + c] = change - known
    for j in range(n):
        q[STATE_START + STATE_SIZE + kept[j]] = axis.p[STATE_START + STATE_SIZE + kept[j]]


@inlined
def answers_of_states(terms, axis, acting, hidden, way):
    """Bring the hidden states along a way, and put in how they answer: those of an effect know nothing of others'."""
    p, kept, n, then = axis.p, acting.kept, acting.kept.size, hidden.then
    row = way.part * n * (n + 3)
    advanced(terms, axis, axis.on, way)
    for k in range(n):
        then[k] = p[STATE_START + kept[k]]
    if axis.on & MEMORY_BIT:
        answers_of_memory(p, way.h, way.y + 0.5 * way.h * way.v, hidden.by, row, n)
    for j in range(n):
        place, bits = STATE_START + STATE_SIZE + kept[j], acting.owners[j]
        before, step = nudged(p, place)
        advanced(terms, axis, bits, way)
        p[place] = before
        for k in range(n):
            if acting.owners[k] & bits:
                hidden.by[row + k * (n + 3) + j] = (p[STATE_START + kept[k]] - then[k]) / step
    for j in range(3):
        bits = acting.driven[j]
        if bits:
            other, step = other_way(way, j)
            advanced(terms, axis, bits, other)
            for k in range(n):
                if acting.owners[k] & bits:
                    hidden.by[row + k * (n + 3) + n + j] = (p[STATE_START + kept[k]] - then[k]) / step
    for i in range(acting.moved.size):
        if acting.touched[i] & terms.acts.advance & ~MEMORY_BIT:
            own_answers(terms, axis, acting, hidden, way, i)
        for k in range(n):
            acting.params[acting.moved[i], STATE_START + kept[k]] = then[k]
    for k in range(n):
        p[STATE_START + kept[k]] = then[k]


@inlined
def carry_part(along, block, part, motion):
    """Slopes of the hidden states after a part of the step, by those of (place, speed, acceleration) along it."""
    hidden, n, width = along.hidden, along.acting.kept.size, along.table.shape[1]
    place, speed, faster = motion
    by = hidden.by
    for k in range(n):
        row = (part * n + k) * (n + 3)
        slopes = by[row + n] * place + by[row + n + 1] * speed + by[row + n + 2] * faster
        slopes = slopes + lanes_at(hidden.own, (part * n + k) * width + block)
        for j in range(n):
            slopes = slopes + by[row + j] * lanes_at(hidden.slopes, j * width + block)
        put_lanes(hidden.slopes, ((1 + part) * n + k) * width + block, slopes)


@inlined
def carry_to_end(along, block, h, motions, v_mid):
    """Slopes of the hidden states in the middle of a step and, as predicted, at its end; v_mid: those of the speed."""
    half, rise = 0.5 * h, (2.0 / h) * (v_mid - motions.v)
    mean = 0.5 * (motions.v + v_mid)
    carry_part(along, block, TO_MIDDLE, (motions.y + (0.5 * half) * mean, mean, rise))
    moves = 0.0 if along.course.guided else 1.0
    carry_part(along, block, TO_END, (moves * (motions.y + half * mean), v_mid, rise))


@inlined
def carry_settled(along, block, h, motions, new):
    """Slopes of the hidden states after a step from those of the motion before it to the new ones."""
    hidden, n, width = along.hidden, along.acting.kept.size, along.table.shape[1]
    place = 0.5 * (motions.y + new.y)
    carry_part(along, block, SETTLED, (place, (1.0 / h) * (new.y - motions.y), (1.0 / h) * (new.v - motions.v)))
    for k in range(n):
        put_lanes(hidden.slopes, k * width + block, lanes_at(hidden.slopes, ((1 + SETTLED) * n + k) * width + block))
