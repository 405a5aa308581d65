"""The compiled simulation of a motor that phase voltages drive: its currents are states too.

Per step the back-EMF is evaluated along the predicted motion, then the currents are carried exactly for voltages that
are parabolas in time. Once the step's motion is known, currents, forces and motion answer to the speeds that the
prediction has missed; all of that is linear but for the friction, whose linearisation at mid-step is at hand. a, b and
0 stand for the two parts of a space vector and the mean, of which power takes 3/2, 3/2 and 3 times the products.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.physics.electrical import WEIGHTS, clarke, current_weights, mode_inductances, phases
from linid.physics.friction import lugre_step
from linid.physics.model import WINDING_START
from linid.simulation.binding import allocating, inlined
from linid.simulation.bundle import Bundle
from linid.simulation.course import FINEST, AxisState, Place, course_of, first_inputs, inputs_then, stretch_of
from linid.simulation.forces import axis_of, bristles_of, emf_constants, pushed_force
from linid.simulation.kernel import after, diverged, no_samples, started, write_sample
from linid.simulation.steps import impulse, predicted, reach_of, resisting, settled, to_the_end, to_the_middle

STAR, SEPARATE = 1, 2


class Windings(NamedTuple):
    """winding: its code; resistance of a phase in ohm; inductance in H that the space vector of the currents feels, and
    mean_inductance, that of their mean; space, common: (WEIGHTS,) how both go on within a step of one length."""

    winding: Any
    resistance: Any
    inductance: Any
    mean_inductance: Any
    space: Any
    common: Any


class Flow(NamedTuple):
    """Space vector and mean of the currents in A, and of the voltages less back-EMF in V, at a step's start; weighed:
    for how many halvings of a base step the windings' weights are filled."""

    current: Any
    push: Any
    weighed: Any


class Carried(NamedTuple):
    """What the currents do in a predicted step: their space vector and mean in the middle and at the end in A, thrust
    per current there in N/A, and voltages less back-EMF at the end in V."""

    middle: Any
    end: Any
    constants_middle: Any
    constants_end: Any
    push_end: Any


class Moved(NamedTuple):
    """What the mass does in a step with those currents: speeds in m/s at its start, in its predicted middle and at its
    predicted end, friction's level and fall in N and the bristle in m in the middle with its stiffness and damping; and
    as it came out: v_new in m/s, w in m, displacement in m, and the force at the end in N."""

    h: Any
    v: Any
    v_mid: Any
    v_end: Any
    w_mid: Any
    level: Any
    fall: Any
    spring: Any
    v_new: Any
    w: Any
    displacement: Any
    force_end: Any


@inlined
def push_of(voltages, constants, v):
    """Space vector and mean of the voltages less back-EMF in V, at v in m/s."""
    e_1, e_2, e_3 = constants
    return clarke(voltages[0] - e_1 * v, voltages[1] - e_2 * v, voltages[2] - e_3 * v)


@inlined
def first_flow(windings, axis, voltages, constants, v, given):
    """Currents at the first sample: those given in A, or where these are nan what the voltages hold in the long run."""
    push = push_of(voltages, constants, v)
    if math.isnan(given[0]):
        i_a, i_b, i_0 = push[0] / windings.resistance, push[1] / windings.resistance, push[2] / windings.resistance
    else:
        i_a, i_b, i_0 = clarke(given[0], given[1], given[2])
    if windings.winding == STAR or not axis.powered:
        i_0 = 0.0
    if not axis.powered:  # open windings
        i_a = i_b = 0.0
    return Flow((i_a, i_b, i_0), push, np.int64(-1))


@inlined
def _weighted(weights, first, i, push, push_mid, push_end):
    return (
        weights[first] * i + weights[first + 1] * push + weights[first + 2] * push_mid + weights[first + 3] * push_end
    )


@inlined
def carried(windings, flow, voltages_mid, voltages_end, e, d, v_mid, v_end):
    """The currents of a step with these voltages (V) and speeds (m/s); e, d: thrust per current in the middle, at the
    end."""
    space, common = windings.space, windings.common
    u_a, u_b, u_0 = clarke(voltages_mid[0], voltages_mid[1], voltages_mid[2])
    z_a, z_b, z_0 = clarke(voltages_end[0], voltages_end[1], voltages_end[2])
    e_a, e_b, e_0 = clarke(e[0], e[1], e[2])
    d_a, d_b, d_0 = clarke(d[0], d[1], d[2])
    mid_a, mid_b, mid_0 = u_a - e_a * v_mid, u_b - e_b * v_mid, u_0 - e_0 * v_mid
    end_a, end_b, end_0 = z_a - d_a * v_end, z_b - d_b * v_end, z_0 - d_0 * v_end
    i_a, i_b, i_0 = flow.current
    push_a, push_b, push_0 = flow.push
    m_a = _weighted(space, 4, i_a, push_a, mid_a, end_a)
    m_b = _weighted(space, 4, i_b, push_b, mid_b, end_b)
    n_a = _weighted(space, 0, i_a, push_a, mid_a, end_a)
    n_b = _weighted(space, 0, i_b, push_b, mid_b, end_b)
    m_0 = n_0 = 0.0
    if windings.winding == SEPARATE:
        m_0 = _weighted(common, 4, i_0, push_0, mid_0, end_0)
        n_0 = _weighted(common, 0, i_0, push_0, mid_0, end_0)
    return Carried((m_a, m_b, m_0), (n_a, n_b, n_0), (e_a, e_b, e_0), (d_a, d_b, d_0), (end_a, end_b, end_0))


@inlined
def force_by_gaps(windings, moved):
    """Force in N that gaps in speed take away per m/s: in the middle of the step by that in the middle and at the end,
    at its end likewise."""
    space, common = windings.space, windings.common
    e_a, e_b, e_0 = moved.constants_middle
    d_a, d_b, d_0 = moved.constants_end
    both = e_a * d_a + e_b * d_b
    mid_mid, mid_end = 1.5 * space[6] * (e_a * e_a + e_b * e_b), 1.5 * space[7] * both
    end_mid, end_end = 1.5 * space[2] * both, 1.5 * space[3] * (d_a * d_a + d_b * d_b)
    if windings.winding == SEPARATE:
        mid_mid, mid_end = mid_mid + 3.0 * common[6] * e_0 * e_0, mid_end + 3.0 * common[7] * e_0 * d_0
        end_mid, end_end = end_mid + 3.0 * common[2] * e_0 * d_0, end_end + 3.0 * common[3] * d_0 * d_0
    return mid_mid, mid_end, end_mid, end_end


@inlined
def yielding(bristles, moved):
    """How the bristle takes part in a speed that is added within a step, and the speed in m/s that a lasting force adds
    per N: its drag is linearised as in the step itself."""
    stiffness, damping = moved.spring
    half = 0.5 * moved.h
    rate_mid = stiffness * abs(moved.v_mid) / moved.level
    load = math.copysign(stiffness * moved.w_mid / moved.level, moved.w_mid * moved.v_mid)
    grip = min(max(1.0 - load * (1.0 - moved.fall / moved.level), 0.0), 2.0) / (1.0 + half * rate_mid)
    ease = moved.h / (bristles.mass + half * (bristles.sigma_2 + grip * (damping + half * stiffness)))
    return grip, ease


@inlined
def corrected(windings, bristles, carried_on, moved, flow):
    """Speed, bristle, displacement, force and currents at a step's end, once they answer to the speeds that the
    prediction has missed. carried_on: the `Carried` currents; moved: the mass with them."""
    space, common = windings.space, windings.common
    e_a, e_b, e_0 = carried_on.constants_middle
    d_a, d_b, d_0 = carried_on.constants_end
    # Of the parabola with the step's first and last speed and its travel, less those that the back-EMF was taken at.
    gap_mid = 1.5 * moved.displacement / moved.h - 0.25 * (moved.v + moved.v_new) - moved.v_mid
    gap_end = moved.v_new - moved.v_end
    mid_mid, mid_end, end_mid, end_end = force_by_gaps(windings, carried_on)
    grip, ease = yielding(bristles, moved)
    # Gaps bring forth forces, whose parabola changes the gaps: one linear equation for both.
    a_11, a_12 = 1.0 + ease * (8.0 * mid_mid - end_mid) / 24.0, ease * (8.0 * mid_end - end_end) / 24.0
    a_21, a_22 = ease * (4.0 * mid_mid + end_mid) / 6.0, 1.0 + ease * (4.0 * mid_end + end_end) / 6.0
    whole = 1.0 / (a_11 * a_22 - a_12 * a_21)
    gap_mid, gap_end = (a_22 * gap_mid - a_12 * gap_end) * whole, (a_11 * gap_end - a_21 * gap_mid) * whole
    farther = -ease * moved.h * (mid_mid * gap_mid + mid_end * gap_end) / 3.0
    n_a, n_b, n_0 = carried_on.end
    i_0 = flow.current[2]
    if windings.winding == SEPARATE:
        i_0 = n_0 - common[2] * e_0 * gap_mid - common[3] * d_0 * gap_end
    current = (
        n_a - space[2] * e_a * gap_mid - space[3] * d_a * gap_end,
        n_b - space[2] * e_b * gap_mid - space[3] * d_b * gap_end,
        i_0,
    )
    end_a, end_b, end_0 = carried_on.push_end
    push = (end_a - d_a * gap_end, end_b - d_b * gap_end, end_0 - d_0 * gap_end)
    force_end = moved.force_end - (end_mid * gap_mid + end_end * gap_end)
    w, displacement = moved.w + grip * farther, moved.displacement + farther
    return moved.v_end + gap_end, w, displacement, force_end, Flow(current, push, flow.weighed)


@inlined
def _force(terms, axis, t, y, v, currents, constants):
    """Forces on the mass but friction in N; constants: thrust per current, which are at hand."""
    if axis.on & terms.acts.push:
        return pushed_force(terms, axis, t, y, v, currents)
    if axis.powered:
        return constants[0] * currents[0] + constants[1] * currents[1] + constants[2] * currents[2]
    return 0.0


@inlined
def weighed(windings, flow, middle, h):
    """The flow, once the windings' weights are those of a step of h seconds."""
    if middle.halvings == flow.weighed:
        return flow
    current_weights(windings.resistance, windings.inductance, h, windings.space)
    current_weights(windings.resistance, windings.mean_inductance, h, windings.common)
    return Flow(flow.current, flow.push, middle.halvings)


@inlined
def currents_within(terms, axis, windings, course, reach, v_mid, flow, last):
    """What the currents do in a predicted step; last: currents at its start in A."""
    n, h, x, t_mid, y_mid, y_end, v_end = reach
    half = 0.5 * h
    voltages = inputs_then(terms, axis, course, n, x, half)
    voltages_end = inputs_then(terms, axis, course, n, x, 0.0)
    e = emf_constants(terms, axis, t_mid, y_mid, v_mid, last)
    d = emf_constants(terms, axis, course.t_start + n * course.dt + x, y_end, v_end, last)
    return carried(windings, flow, voltages, voltages_end, e, d, v_mid, v_end), e, d


@inlined
def voltage_step(terms, axis, bristles, windings, course, place, motion, flow):
    """A step of mass, bristle and currents; returns motion, currents and the predicted middle."""
    y, v, w, force, last, _ = motion
    t_n = course.t_start + place.n * course.dt
    begin = t_n + place.done * course.tick
    middle = predicted(terms, axis, bristles, motion, begin, place.halvings, course.tick, course.tolerance)
    reach = reach_of(course, place, motion, middle, course.guided)
    _, h, x, t_mid, y_mid, y_end, v_end = reach
    states = axis.on & terms.acts.advance
    if states:
        to_the_middle(terms, axis, reach, motion, middle.v)
    currents = currents_end = last
    e = d = (0.0, 0.0, 0.0)
    carried_on = Carried(flow.current, flow.current, e, d, flow.push)
    if axis.powered:
        flow = weighed(windings, flow, middle, h)
        carried_on, e, d = currents_within(terms, axis, windings, course, reach, middle.v, flow, last)
        currents = phases(carried_on.middle[0], carried_on.middle[1], carried_on.middle[2])
        currents_end = phases(carried_on.end[0], carried_on.end[1], carried_on.end[2])
    force_mid = _force(terms, axis, t_mid, y_mid, middle.v, currents, e)
    level, fall, spring = resisting(terms, axis, bristles, reach, middle, currents)
    if states:
        to_the_end(terms, axis, reach, motion, middle.v, currents)
    force_end = _force(terms, axis, t_n + x, y_end, v_end, currents_end, d)
    mean, rise = impulse(force, force_mid, force_end)
    at_middle, body = (middle.v, middle.w, level, fall), (bristles.mass, spring[0], spring[1], bristles.sigma_2)
    v_new, w_new, displacement = lugre_step(v, w, at_middle, mean - 0.5 * rise, rise / h, body, h)
    if states:
        settled(terms, axis, reach, motion, v_new, displacement, currents)
    if axis.powered:
        moved = Moved(h, v, middle.v, v_end, middle.w, level, fall, spring, v_new, w_new, displacement, force_end)
        v_new, w_new, displacement, force_end, flow = corrected(windings, bristles, carried_on, moved, flow)
        currents_end = phases(flow.current[0], flow.current[1], flow.current[2])
    return AxisState(y + displacement, v_new, w_new, force_end, currents_end, spring), flow, middle


@allocating
def windings_of(candidates, axis):
    """The windings with these parameters."""
    p, winding = axis.p, candidates.winding
    inductance, mean_inductance = mode_inductances(winding, p[WINDING_START + 1], p[WINDING_START + 2])
    return Windings(winding, p[WINDING_START], inductance, mean_inductance, np.zeros(WEIGHTS), np.zeros(WEIGHTS))


@inlined
def _write_currents(k, currents, i_out):
    if i_out.size > 0:
        i_out[0, k], i_out[1, k], i_out[2, k] = currents


@allocating
def simulate_one(terms, candidates, stretch, start, i_start, kept, scheme, out):
    """Simulate one stretch; returns the number of internal steps.

    i_start: (3,) A, nan where not given; out: y and v as in `kernel.simulate_one`, and currents (3, count) in A or
    empty if not wanted; the rest as there.
    """
    y_out, v_out, i_out = out
    axis = axis_of(terms, candidates, stretch)
    bristles = bristles_of(terms, axis, stretch.added_mass)
    course = course_of(terms, axis, stretch, scheme, y_out[0:0])
    windings = windings_of(candidates, axis)
    whole = scheme.substeps << FINEST
    t = stretch.t_start + stretch.first * stretch.dt
    voltages = first_inputs(terms, axis, course, stretch)
    constants = emf_constants(terms, axis, t, start[0], start[1], voltages)
    flow = first_flow(windings, axis, voltages, constants, start[1], i_start)
    currents = phases(flow.current[0], flow.current[1], flow.current[2])
    motion = started(terms, axis, bristles, t, start, kept, currents)
    steps, halvings = 0, np.int64(0)  # a literal 0 would have a type of its own, and compile all twice
    write_sample(terms, axis, 0, t, motion, y_out, v_out)
    _write_currents(0, motion.currents, i_out)
    for k in range(stretch.count - 1):
        n = stretch.first + k
        done = 0
        if stretch.steps:
            voltages = inputs_then(terms, axis, course, n, 0.0, 0.0)
            constants = emf_constants(terms, axis, t + k * stretch.dt, motion.y, motion.v, motion.currents)
            flow = Flow(flow.current, push_of(voltages, constants, motion.v), flow.weighed)
        while done < whole:
            place = Place(n, done, halvings)
            motion, flow, middle = voltage_step(terms, axis, bristles, windings, course, place, motion, flow)
            done, halvings = after(done, middle)
            steps += 1
        if diverged(motion):
            no_samples(k + 1, y_out, v_out)
            for rest in range(k + 1, stretch.count):
                _write_currents(rest, (np.nan, np.nan, np.nan), i_out)
            return steps
        write_sample(terms, axis, k + 1, stretch.t_start + n * stretch.dt + stretch.dt, motion, y_out, v_out)
        _write_currents(k + 1, motion.currents, i_out)
    return steps


def simulate_tasks_with(terms: Bundle) -> Any:
    """`simulate_tasks` with these terms, for Python to call."""

    def simulate_tasks(candidates, inputs, segments, starts, scheme, begin, end, out):
        """Simulate tasks begin..end-1, as `kernel.simulate_tasks`; the inputs are phase voltages."""
        count_of_segments = segments.recording.size
        steps = 0
        for number in range(begin, end):
            candidate = number // count_of_segments
            s = number % count_of_segments
            r, first, count = segments.recording[s], segments.first[s], segments.count[s]
            stretch = stretch_of(candidates, inputs, candidate, r, first, count)
            a = out.offsets[s]
            b = a + count
            traces = (
                out.y[candidate, a:b],
                out.v[candidate, a:b] if out.v.size > 0 else out.v[0, 0:0],
                out.currents[candidate, :, a:b] if out.currents.size > 0 else out.currents[0],
            )
            start, i_start = starts.values[candidate, s], starts.currents[candidate, s]
            steps += simulate_one(terms, candidates, stretch, start, i_start, starts.kept, scheme, traces)
        return steps

    return simulate_tasks
