"""Forces at the points of base steps, told before simulations that read places as measured, with how they answer.

Of the motor and of effects that measured place, inputs and time decide (told.py), many points at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from linid.physics.model import WORK_SIZE
from linid.simulation.along_effects import Samples
from linid.simulation.binding import allocating, compiled
from linid.simulation.bundle import Bundle
from linid.simulation.course import still_known
from linid.simulation.forces import motor_forces
from linid.simulation.own_over import own_sums
from linid.simulation.own_terms import FORCE
from linid.simulation.slope_effects import FORCE_STEP, along_directions, of_recording
from linid.simulation.splines_at import late_inputs


@compiled
def seen_by_motor(terms, on, p, clock, guide, coefficients, out):
    """Fill in the places in m that the motor's field sees, and the inputs that it gets (4, points).

    clock: s of the recording's first point, between points and between samples, and the number of the first one here;
    guide: measured places and three logged inputs, (points,) each; coefficients: of the splines of the inputs.
    """
    places, i_1, i_2, i_3 = guide
    for k in range(places.size):
        x, y = (clock[3] + k) * clock[1], places[k]
        t = clock[0] + x
        currents = i_1[k], i_2[k], i_3[k]
        if on & terms.acts.delay:
            currents = late_inputs(coefficients, clock[2], x - terms.delay(0.0, on, p))
        if on & terms.acts.drive:
            currents = terms.drive(on, t, y, 0.0, currents, p)
        out[0, k] = y
        if on & terms.acts.field:
            out[0, k] = terms.field(y, on, t, y, 0.0, currents, p)
        out[1, k], out[2, k], out[3, k] = currents


@allocating
def put_told(terms, motor, bits, p, points, seen, out):
    """Put the forces in N at points in: `out` (points,).

    bits: of all effects and of those that are told beforehand; p: parameters for this recording, with room for what
    effects need; points: clock, guide and coefficients as in `seen_by_motor`; seen: (4, points), room for what that
    fills in.
    """
    (on, told), (clock, guide, coefficients) = bits, points
    y, i_1, i_2, i_3 = guide
    field = y
    if on & (terms.acts.delay | terms.acts.drive | terms.acts.field):
        seen_by_motor(terms, on, p, clock, guide, coefficients, seen)
        field, i_1, i_2, i_3 = seen[0], seen[1], seen[2], seen[3]
    motor_forces(terms, motor, p, field, (i_1, i_2, i_3), out)
    samples = Samples(clock[0] + clock[3] * clock[1], clock[1], y, y, i_1, i_2, i_3)  # nothing asks for the speed
    if told & (terms.acts.thrust | terms.acts.force):
        terms.over.thrust(out, told, samples, p)
        terms.over.force(out, told, samples, p)
    if told & terms.acts.pushed:
        own = np.empty(out.size)
        own_sums(p, told, FORCE, y, samples, own)  # nor for the motor's force
        for k in range(out.size):
            out[k] += own[k]


@allocating
def points_of(inputs, scheme, r, begin, end):
    """Clock, guide and coefficients, as `put_told` takes them, of a recording's points from and to which it is."""
    pieces, guide = 2 * scheme.substeps, scheme.guide
    first = pieces * inputs.offsets[r] + r
    a, b = first + begin, first + end
    clock = inputs.t_starts[r], inputs.dts[r] / pieces, inputs.dts[r], begin
    coefficients = inputs.coefficients[inputs.offsets[r] : inputs.offsets[r + 1]]
    # A slice of the whole would have strides that nothing knows, and no vector instructions.
    return clock, (guide[0, a:b], guide[1, a:b], guide[2, a:b], guide[3, a:b]), coefficients


def told_tasks_with(terms: Bundle) -> Any:
    """`told_tasks` with these terms, for Python to call."""

    def told_tasks(candidates, inputs, segments, scheme, bits, begin, end, out):
        """Put in the forces in N at the points of segments begin..end-1, out[0] (points of all recordings,), of the
        first candidate, and how they answer the others, a FORCE_STEP away, per unit: out[1] (others, points).

        bits: as in `put_told`; segments of one recording lie side by side.
        """
        forces, slopes = out
        others = candidates.params.shape[0] - 1
        p, own = np.zeros((others, WORK_SIZE)), np.zeros(WORK_SIZE)
        owner, known, pieces = -1, (np.int64(0), np.int64(0)), 2 * scheme.substeps
        for s in range(begin, end):
            r, first, count = segments.recording[s], segments.first[s], segments.count[s]
            if r != owner:
                own = of_recording(candidates.params[0], inputs, r)
                along_directions(candidates, p, inputs, r)
                owner, known = r, (np.int64(0), np.int64(0))
            start, stop = pieces * first, pieces * (first + count - 1) + 1
            known_from, known_to = still_known(known, start)
            if stop > known_to:
                a, points = pieces * inputs.offsets[r] + r + known_to, points_of(inputs, scheme, r, known_to, stop)
                # Put in once they are whole: another thread may have windows over the same points.
                here, there, seen = np.empty(stop - known_to), np.empty(stop - known_to), np.empty((4, stop - known_to))
                put_told(terms, candidates.motor, bits, own, points, seen, here)
                for k in range(here.size):
                    forces[a + k] = here[k]
                for c in range(others):
                    put_told(terms, candidates.motor, bits, p[c], points, seen, there)
                    for k in range(here.size):
                        slopes[c, a + k] = (there[k] - here[k]) / FORCE_STEP
                known_to = stop
            known = known_from, known_to

    return told_tasks
