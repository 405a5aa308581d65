"""What motor and effects without hidden states do at all samples of a measured motion at once, in vector instructions.

Effects with hidden states are asked sample by sample, and so is all else that hangs on these.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from linid.physics.model import EFFECT_START, RECORD
from linid.physics.own_terms.layout import ACCELERATION_BIT, MEMORY_BIT, PUSH_BIT, STRIBECK_BIT
from linid.simulation.along_motion import inputs_of_sample
from linid.simulation.binding import allocating, inlined
from linid.simulation.forces import motor_forces
from linid.simulation.own_over import own_sums
from linid.simulation.own_terms import FORCE


class Samples(NamedTuple):
    """All samples of a recording: sampling from t_start in steps of dt, s; y: (n,) m; v: (n,) m/s; i_1, i_2, i_3: (n,)
    inputs."""

    t_start: Any
    dt: Any
    y: Any
    v: Any
    i_1: Any
    i_2: Any
    i_3: Any


class Effected(NamedTuple):
    """What effects did last at the samples (n,) of a recording, for the next candidate. params: of effects and own
    terms that decided it; known: whether this candidate has the same; thrust, friction: factors on the motor's force
    alone and the bristle's; push: all else on the mass in N, but for own terms; own: what these add."""

    params: Any
    known: Any
    thrust: Any
    push: Any
    friction: Any
    own: Any


class Given(NamedTuple):
    """What is known beforehand of the samples (n,), or empty. inputs: what the motor gets, as `Samples` has them;
    motor: its force alone in N; thrust, push, friction: of effects without hidden states, as in `Effected`; own: of own
    terms, empty where hidden states decide these."""

    inputs: Any
    motor: Any
    thrust: Any
    push: Any
    friction: Any
    own: Any


@allocating
def effected_before(samples):
    """Room for what effects do at so many samples at most, of which nothing is known."""
    params, rooms = np.full(RECORD, np.nan), np.empty((4, samples))
    return Effected(params, False, rooms[0], rooms[1], rooms[2], rooms[3])


@allocating
def effects_shared(params, before):
    """What the effects of the candidate before did, unknown if this one's are others."""
    same = True
    for k in range(EFFECT_START, params.size):
        same = same and before.params[k] == params[k]
        before.params[k] = params[k]
    return Effected(before.params, same, before.thrust, before.push, before.friction, before.own)


@allocating
def samples_of(terms, axis, course, motion):
    """All samples with the inputs that act there."""
    inputs = np.zeros((3, motion.y.size))
    if axis.powered:
        for k in range(motion.y.size):
            inputs[0, k], inputs[1, k], inputs[2, k] = inputs_of_sample(terms, axis, course, motion, k)
    return Samples(course.t_start, course.dt, motion.y, motion.v, inputs[0], inputs[1], inputs[2])


@allocating
def driven_samples(terms, axis, samples):
    """The same with what the motor really gets of its inputs."""
    if not (axis.powered and axis.on & terms.acts.drive):
        return samples
    inputs = np.empty((3, samples.y.size))
    for k in range(samples.y.size):
        inputs[0, k], inputs[1, k], inputs[2, k] = samples.i_1[k], samples.i_2[k], samples.i_3[k]
    terms.over.drive(inputs, axis.on, samples, axis.p)
    return Samples(samples.t_start, samples.dt, samples.y, samples.v, inputs[0], inputs[1], inputs[2])


@allocating
def motor_over(terms, axis, candidates, samples):
    """The force of the motor alone in N at all samples; samples: with what it gets."""
    out = np.zeros(samples.y.size)
    if axis.powered and candidates.motor > 0:
        field = samples.y
        if axis.on & terms.acts.field:
            field = samples.y.copy()
            terms.over.field(field, axis.on, samples, axis.p)
        motor_forces(terms, candidates.motor, axis.p, field, (samples.i_1, samples.i_2, samples.i_3), out)
    return out


@allocating
def nothing_given():
    """Nothing is known beforehand."""
    none = np.empty(0)
    return Given((none, none, none), none, none, none, none, none)


@inlined
def is_own_told(terms, on):
    """Whether the motion and the inputs alone tell what own terms add to the forces."""
    if on & (PUSH_BIT | ACCELERATION_BIT) and on & terms.acts.stateful_thrust:
        return False
    return on & terms.acts.pushed != 0 and not on & MEMORY_BIT


@allocating
def own_over(axis, known, samples, motor, thrust, own):
    """Put in what own terms add to the forces in N at all samples, unless it is known and hangs on the motion alone."""
    if known and not axis.on & (PUSH_BIT | ACCELERATION_BIT | STRIBECK_BIT):
        return
    push = np.zeros(own.size)
    if axis.powered:
        for k in range(own.size):
            push[k] = motor[k] * thrust[k]
    own_sums(axis.p, axis.on, FORCE, push, samples, own)


@allocating
def given_over(terms, axis, candidates, samples, effected):
    """What is known of all samples beforehand; nothing where hidden states decide what the motor gets or sees."""
    acts, on, count = terms.acts, axis.on, samples.y.size
    if on & (acts.stateful_drive | acts.stateful_field):
        return nothing_given()
    driven = driven_samples(terms, axis, samples)
    thrust, push, friction = effected.thrust[:count], effected.push[:count], effected.friction[:count]
    if not effected.known:
        if on & acts.push:
            thrust[:] = 1.0
            push[:] = 0.0
            if axis.powered:
                terms.over.thrust(thrust, on, driven, axis.p)
            terms.over.force(push, on, driven, axis.p)
        if on & acts.friction:
            friction[:] = 1.0
            terms.over.friction(friction, on, samples, axis.p)
    motor, own = motor_over(terms, axis, candidates, driven), effected.own[0:0]
    if is_own_told(terms, on):
        own = effected.own[:count]
        own_over(axis, effected.known, samples, motor, thrust, own)
    return Given((driven.i_1, driven.i_2, driven.i_3), motor, thrust, push, friction, own)


@allocating
def readings_over(terms, on, samples, p, out):
    """Fill `out` (n,) with reading minus position in m, of effects without hidden states, at the positions of the
    samples."""
    out[:] = 0.0
    terms.over.sensor(out, on, samples, p)


@allocating
def write_readings_over(terms, on, samples, p, out):
    """`readings_over` at the positions at which the measured ones are read: at the reading first, then there."""
    readings_over(terms, on, samples, p, out)
    there = samples.y - out
    here = Samples(samples.t_start, samples.dt, there, samples.v, samples.i_1, samples.i_2, samples.i_3)
    readings_over(terms, on, here, p, out)


@allocating
def known_beforehand(terms, axis, candidates, course, motion, effected, found):
    """`given_over` where the acceleration is wanted, else nothing; readings that hang on no hidden states are put
    in."""
    given, acts, on = nothing_given(), terms.acts, axis.on
    if found.a.size > 0 or on & acts.sensor:
        samples = samples_of(terms, axis, course, motion)
        if found.a.size > 0:
            given = given_over(terms, axis, candidates, samples, effected)
        if on & acts.sensor and not on & acts.stateful_sensor:
            write_readings_over(terms, on, samples, axis.p, found.reading)
    return given
