"""What own terms answer along a measured motion."""

from __future__ import annotations

from linid.physics.own_terms.layout import PUSH_BIT
from linid.simulation.binding import compiled
from linid.simulation.own_slopes import CHANGED, HANGING, add_columns, answer_by_motion, put_answers
from linid.simulation.own_terms import FORCE
from linid.simulation.slope_effects import FORCE_STEP, Instant, given_at


@compiled
def own_forces(terms, axis, here, given, room):
    """Put in how the forces of own terms answer at a sample, as of `forces_beside`; returns the motor's force in N and
    how they answer it."""
    k, t, y, v, currents = here[:5]
    if given.motor.size > 0:
        push = given.motor[k] * given.thrust[k] * here.derating
    else:
        push = given_at(terms, axis, Instant(t, y, v, currents, room.motor[0, k], False))[0]
    if room.own[CHANGED] == 0.0 and room.own[HANGING] == 0.0 and axis.on & PUSH_BIT == 0:
        return push, 0.0
    put_answers(axis.p, axis.on, FORCE, push, t, y, v, room.own)
    return push, answer_by_motion(axis.p, axis.on, push, y, v, room.own).by_push


@compiled
def own_columns(axis, push, v, room, start):
    """Add what the directions do to own terms (`put_answers`) to a row of what is carried, from `start` on."""
    add_columns(axis.p, axis.on, (push, v), (room.params, FORCE_STEP), room.own, (room.carried, start, 1.0))
