"""What the kernels take and pass on: candidates, stretches of recordings, the way through them."""

from __future__ import annotations

from typing import Any, NamedTuple

from linid.simulation.binding import allocating, inlined
from linid.simulation.forces import total_delay
from linid.simulation.splines_at import inputs_at, late_inputs

FINEST = 12  # a base step is halved at most this often around a reversal


class Candidates(NamedTuple):
    """Parameters to be simulated with. params: (candidates, VECTOR_SIZE) SI; motor: its code; on: bits of the active
    effects; winding: code of the windings, 0 for a motor that currents drive."""

    params: Any
    motor: Any
    on: Any
    winding: Any


class Starts(NamedTuple):
    """values: (candidates, segments, 3 or 3 + kept) y in m, v in m/s, w in m and hidden states; kept: places of those
    among all hidden states; currents: (candidates, segments, 3) A, of motors that voltages drive, nan if not given."""

    values: Any
    kept: Any
    currents: Any


class Scheme(NamedTuple):
    """guided: whether outer forces act at the measured position; guide: (4, points) measured position and inputs at the
    ends and middles of all base steps, if these alone decide the motor's force, or empty; forces: (points,) in N there,
    where they are told already, or empty; substeps: base steps per sample; tolerance: of a followed step; steering: by
    a drive that closes its loops, or one without reference."""

    guided: Any
    guide: Any
    forces: Any
    substeps: Any
    tolerance: Any
    steering: Any


class Traces(NamedTuple):
    """Where results land. offsets: (segments + 1,) of each segment's samples; y: (candidates, samples) m; v: likewise
    in m/s, currents: (candidates, 3, samples) in A, both empty if not wanted."""

    offsets: Any
    y: Any
    v: Any
    currents: Any


class Stretch(NamedTuple):
    """One candidate over one stretch of a recording: `count` samples from sample `first`.

    params: (VECTOR_SIZE,) SI; coefficients: (n - 1, 4, 4) splines of the inputs and of the measured position; steps:
    whether inputs differ before and after a sample; t_start, dt: s; added_mass: kg; record: number of the recording;
    elapsed: s of the campaign at t = 0.
    """

    params: Any
    powered: Any
    coefficients: Any
    steps: Any
    t_start: Any
    dt: Any
    first: Any
    count: Any
    added_mass: Any
    record: Any
    elapsed: Any


class Course(NamedTuple):
    """The way through a recording.

    t_start, dt: s; substeps: base steps per sample; tick: s of the finest step; lag: s by which inputs act late;
    coefficients: of its splines; forces: the motor's at the ends and middles of all base steps, or empty; guided,
    tolerance: as in `Scheme`.
    """

    t_start: Any
    dt: Any
    substeps: Any
    tick: Any
    lag: Any
    guided: Any
    tolerance: Any
    coefficients: Any
    forces: Any


class Place(NamedTuple):
    """Where a step begins: `done` finest steps after sample n, its base step halved `halvings` times."""

    n: Any
    done: Any
    halvings: Any


class AxisState(NamedTuple):
    """Where a simulation stands: y in m, v in m/s, w in m, forces on the mass but friction in N, the inputs, and the
    bristle's stiffness and damping as they are now."""

    y: Any
    v: Any
    w: Any
    force: Any
    currents: Any
    spring: Any


@allocating  # as it hands on arrays
def stretch_of(candidates, inputs, candidate, r, first, count):
    """A candidate over `count` samples of recording r from sample `first`."""
    return Stretch(
        candidates.params[candidate],
        inputs.powered[r],
        inputs.coefficients[inputs.offsets[r] : inputs.offsets[r + 1]],
        inputs.steps[r],
        inputs.t_starts[r],
        inputs.dts[r],
        first,
        count,
        inputs.added_mass[r],
        inputs.records[r],
        inputs.elapsed[r],
    )


@allocating
def course_of(terms, axis, stretch, scheme, forces):
    """The way through the recording."""
    return Course(
        stretch.t_start,
        stretch.dt,
        scheme.substeps,
        stretch.dt / (scheme.substeps << FINEST),
        total_delay(terms, axis),
        scheme.guided,
        scheme.tolerance,
        stretch.coefficients,
        forces,
    )


@allocating
def measured_course(terms, axis, stretch):
    """The way through a recording along its measured motion, where no steps are taken."""
    nothing = stretch.params[0:0]
    return course_of(terms, axis, stretch, Scheme(True, nothing, nothing, 1, 0.0, None), nothing)


@inlined
def still_known(known, start):
    """From and to which point something is known, for a stretch that begins at point `start`: as `known` says, which
    overlapping stretches share, or nothing where that does not reach it."""
    begin, end = known
    if start < begin or start > end:
        begin = end = start
    return begin, end


@inlined
def parabola_at(share):
    """Weights of the three points of a base step, a share of it after the first one."""
    first, last = (1.0 - share) * (1.0 - 2.0 * share), share * (2.0 * share - 1.0)
    return first, 1.0 - first - last, last


@inlined
def inputs_then(terms, axis, course, n, x, back):
    """The three inputs that act x - back seconds after sample n."""
    if axis.on & terms.acts.delay:
        return late_inputs(course.coefficients, course.dt, n * course.dt + x - back - course.lag)
    return inputs_at(course.coefficients, n, x - back)


@inlined
def first_inputs(terms, axis, course, stretch):
    """The three inputs at the first sample; none where there is no interval to act in."""
    if axis.powered and stretch.count > 1:
        return inputs_then(terms, axis, course, stretch.first, 0.0, 0.0)
    return 0.0, 0.0, 0.0
