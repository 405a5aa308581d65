"""A drive's cascade inside the compiled simulation: position P, velocity PI, current limit, commutation."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.simulation.binding import compiled
from linid.simulation.forces import reading_error
from linid.simulation.steps import after_sample


class Steering(NamedTuple):
    """What a drive does in every cycle, one of which lasts from sample to sample.

    y, v: (n,) reference in m and m/s, empty where no drive acts; ahead: (n,) A, feed-forward that is added to the
    command; current: (n,) A, its currents land there; integral: (1,) A, of the velocity loop; position_gain in 1/s,
    velocity_gain in A s/m, integral_gain in A/m, feedforward of the reference's speed, limit in A; share: of the way to
    its command that the current goes in a cycle; wavenumber in rad/m, offset in rad, polarity: of the commutation;
    phases: 3, or 1 where the one input is that current.
    """

    y: Any
    v: Any
    ahead: Any
    current: Any
    integral: Any
    position_gain: Any
    velocity_gain: Any
    integral_gain: Any
    feedforward: Any
    limit: Any
    share: Any
    wavenumber: Any
    offset: Any
    polarity: Any
    phases: Any


_NOTHING = np.empty(0)
UNSTEERED = Steering(_NOTHING, _NOTHING, _NOTHING, _NOTHING, _NOTHING, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0)


@compiled
def steered(terms, axis, course, steering, n, motion):
    """The motion with what the drive makes of its reading at sample n.

    Commutation turns with the speed within the cycle, by the third order: the cycle of current loops is much shorter.
    The integral stands still while the current is limited, unless the error leads out of the limit.
    """
    y, v = motion.y, motion.v
    if axis.on & terms.acts.sensor:
        y += reading_error(terms, axis.on, course.t_start + n * course.dt, y, v, motion.currents, axis.p)
    error = steering.position_gain * (steering.y[n] - y) + steering.feedforward * steering.v[n] - v
    wanted = steering.velocity_gain * error + steering.integral[0] + steering.ahead[n]
    if abs(wanted) <= steering.limit or wanted * error < 0.0:
        steering.integral[0] += steering.integral_gain * error * course.dt
    command = min(max(wanted, -steering.limit), steering.limit)
    before = steering.current[n - 1] if n > 0 else 0.0
    current = before + steering.share * (command - before)
    steering.current[n] = current
    c = course.coefficients
    if steering.phases == 1:
        c[n, 0, 0] = steering.polarity * current
    else:
        turn = steering.wavenumber * v
        for j in range(3):
            angle = steering.wavenumber * y + steering.offset + (j - 1) * 2.0 * math.pi / 3.0
            c[n, j, 0] = steering.polarity * current * math.sin(angle)
            c[n, j, 1] = steering.polarity * current * math.cos(angle) * turn
            c[n, j, 2] = -0.5 * turn * turn * c[n, j, 0]
            c[n, j, 3] = -turn * turn * c[n, j, 1] / 6.0
    return after_sample(terms, axis, course, n, motion)
