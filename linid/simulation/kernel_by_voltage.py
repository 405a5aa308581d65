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
from linid.simulation.bundle import Bundle
from linid.simulation.forces import advance_states, emf_constants, keep_states, pushed_force
from linid.simulation.kernel import AxisState, diverged, first_inputs, no_samples, prepared, started, write_sample
from linid.simulation.splines_at import inputs_then, spline_at
from linid.simulation.steps import FINEST, Middle, bristle_now, friction_at, impulse, predicted
from linid.simulation.terms import allocating, inlined

STAR, SEPARATE = 1, 2


class Windings(NamedTuple):
    """winding: its code; resistance of a phase in ohm; inductance in H that the space vector of the currents feels, and
    mean_inductance, that of their mean."""

    winding: Any
    resistance: Any
    inductance: Any
    mean_inductance: Any


class Flow(NamedTuple):
    """Space vector and mean of the currents in A, and of the voltages less back-EMF in V, at a step's start."""

    current: Any
    push: Any


class Carried(NamedTuple):
    """What the currents do in a predicted step: their space vector and mean in the middle and at the end in A, thrust
    per current there in N/A, and voltages less back-EMF at the end in V."""

    middle: Any
    end: Any
    constants_middle: Any
    constants_end: Any
    push_end: Any


@inlined
def first_flow(windings, axis, voltages, constants, v, given):
    """Currents at the first sample: those given in A, or where these are nan what the voltages hold in the long run."""
    e_1, e_2, e_3 = constants
    push = clarke(voltages[0] - e_1 * v, voltages[1] - e_2 * v, voltages[2] - e_3 * v)
    if math.isnan(given[0]):
        i_a, i_b, i_0 = push[0] / windings.resistance, push[1] / windings.resistance, push[2] / windings.resistance
    else:
        i_a, i_b, i_0 = clarke(given[0], given[1], given[2])
    if windings.winding == STAR or not axis.powered:
        i_0 = 0.0
    if not axis.powered:  # open windings
        i_a = i_b = 0.0
    return Flow((i_a, i_b, i_0), push)


@inlined
def _weighted(weights, first, i, push, push_mid, push_end):
    return (
        weights[first] * i + weights[first + 1] * push + weights[first + 2] * push_mid + weights[first + 3] * push_end
    )


@inlined
def carried(windings, space, common, flow, voltages_mid, voltages_end, e, d, v_mid, v_end):
    """The currents of a step with these voltages (V) and speeds (m/s); e, d: thrust per current in the middle, at the
    end."""
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
def corrected(
    windings, space, common, bristles, spring, middle, moved, flow, h, v, v_end, v_new, w, displacement, force_end
):
    """Motion, force and currents at a step's end, once they answer to the speeds that the prediction has missed.

    middle: predicted; moved: the `Carried` currents; w in m, displacement in m and force_end in N: of the step as it
    came out with them, v_new its speed in m/s.
    """
    v_mid, w_mid, level, fall, _, _, _ = middle
    stiffness, damping = spring
    half = 0.5 * h
    e_a, e_b, e_0 = moved.constants_middle
    d_a, d_b, d_0 = moved.constants_end
    # Of the parabola with the step's first and last speed and its travel, less those that the back-EMF was taken at.
    gap_mid = 1.5 * displacement / h - 0.25 * (v + v_new) - v_mid
    gap_end = v_new - v_end
    # Force that a gap takes away, N s/m: at mid-step (first) and at the end, by the gap at mid-step and at the end.
    both = e_a * d_a + e_b * d_b
    mid_mid, mid_end = 1.5 * space[6] * (e_a * e_a + e_b * e_b), 1.5 * space[7] * both
    end_mid, end_end = 1.5 * space[2] * both, 1.5 * space[3] * (d_a * d_a + d_b * d_b)
    if windings.winding == SEPARATE:
        mid_mid, mid_end = mid_mid + 3.0 * common[6] * e_0 * e_0, mid_end + 3.0 * common[7] * e_0 * d_0
        end_mid, end_end = end_mid + 3.0 * common[2] * e_0 * d_0, end_end + 3.0 * common[3] * d_0 * d_0
    # Speed that a lasting force adds within the step, m/s per N: drag of the bristle linearised as in its step.
    rate_mid = stiffness * abs(v_mid) / level
    load = math.copysign(stiffness * w_mid / level, w_mid * v_mid)
    grip = min(max(1.0 - load * (1.0 - fall / level), 0.0), 2.0) / (1.0 + half * rate_mid)
    ease = h / (bristles.mass + half * (bristles.sigma_2 + grip * (damping + half * stiffness)))
    # Gaps bring forth forces, whose parabola changes the gaps: one linear equation for both.
    a_11, a_12 = 1.0 + ease * (8.0 * mid_mid - end_mid) / 24.0, ease * (8.0 * mid_end - end_end) / 24.0
    a_21, a_22 = ease * (4.0 * mid_mid + end_mid) / 6.0, 1.0 + ease * (4.0 * mid_end + end_end) / 6.0
    whole = 1.0 / (a_11 * a_22 - a_12 * a_21)
    gap_mid, gap_end = (a_22 * gap_mid - a_12 * gap_end) * whole, (a_11 * gap_end - a_21 * gap_mid) * whole
    farther = -ease * h * (mid_mid * gap_mid + mid_end * gap_end) / 3.0
    n_a, n_b, n_0 = moved.end
    i_0 = flow.current[2]
    if windings.winding == SEPARATE:
        i_0 = n_0 - common[2] * e_0 * gap_mid - common[3] * d_0 * gap_end
    current = (
        n_a - space[2] * e_a * gap_mid - space[3] * d_a * gap_end,
        n_b - space[2] * e_b * gap_mid - space[3] * d_b * gap_end,
        i_0,
    )
    end_a, end_b, end_0 = moved.push_end
    push = (end_a - d_a * gap_end, end_b - d_b * gap_end, end_0 - d_0 * gap_end)
    force_end -= end_mid * gap_mid + end_end * gap_end
    return v_end + gap_end, w + grip * farther, displacement + farther, force_end, Flow(current, push)


@inlined
def _force(terms, axis, t, y, v, currents, constants, p, table):
    """Forces on the mass but friction in N; constants: thrust per current, which are at hand."""
    if axis.on & terms.acts.push:
        return pushed_force(terms, axis, t, y, v, currents, p, table)
    if axis.powered:
        return constants[0] * currents[0] + constants[1] * currents[1] + constants[2] * currents[2]
    return 0.0


@inlined
def voltage_step(
    terms,
    axis,
    bristles,
    windings,
    space,
    common,
    weighed,
    clock,
    coefficients,
    n,
    done,
    motion,
    flow,
    halvings,
    p,
    table,
):
    """A step of mass, bristle and currents; returns motion, currents, the predicted middle and for how many halvings
    `space` and `common` are filled (`weighed`: so far)."""
    y, v, w, force, last, spring = motion
    t_n = clock.t_start + n * clock.dt
    middle = predicted(
        terms,
        axis,
        bristles,
        spring,
        t_n + done * clock.tick,
        y,
        v,
        w,
        last,
        p,
        table,
        force,
        halvings,
        clock.tick,
        clock.tolerance,
    )
    v_mid, level, fall = middle.v, middle.level, middle.fall
    size = 1 << (FINEST - middle.halvings)
    h = size * clock.tick
    half = 0.5 * h
    x = (done + size) * clock.tick
    y_mid, y_end, v_end = y + 0.5 * half * (v + v_mid), y + h * v_mid, 2.0 * v_mid - v
    if clock.guided:
        y_mid, y_end = spline_at(coefficients, n, 3, x - half), spline_at(coefficients, n, 3, x)
    t_mid = t_n + x - half
    states = axis.on & terms.acts.advance
    if states:
        advance_states(
            terms,
            axis.on,
            half,
            t_mid - 0.5 * half,
            y + 0.25 * half * (v + v_mid),
            0.5 * (v + v_mid),
            (v_mid - v) / half,
            last,
            p,
        )
    currents = currents_end = last
    e = d = (0.0, 0.0, 0.0)
    moved = Carried(flow.current, flow.current, e, d, flow.push)
    if axis.powered:
        if middle.halvings != weighed:
            current_weights(windings.resistance, windings.inductance, h, space)
            current_weights(windings.resistance, windings.mean_inductance, h, common)
            weighed = middle.halvings
        voltages = inputs_then(terms, axis.on, coefficients, clock.dt, n, x, half, clock.lag)
        voltages_end = inputs_then(terms, axis.on, coefficients, clock.dt, n, x, 0.0, clock.lag)
        e = emf_constants(terms, axis, t_mid, y_mid, v_mid, last, p, table)
        d = emf_constants(terms, axis, t_n + x, y_end, v_end, last, p, table)
        moved = carried(windings, space, common, flow, voltages, voltages_end, e, d, v_mid, v_end)
        currents = phases(moved.middle[0], moved.middle[1], moved.middle[2])
        currents_end = phases(moved.end[0], moved.end[1], moved.end[2])
    force_mid = _force(terms, axis, t_mid, y_mid, v_mid, currents, e, p, table)
    if axis.on & terms.acts.load or (states and axis.on & terms.acts.level):
        level, fall = friction_at(terms, axis, bristles, t_mid, y_mid, v_mid, currents, p, table)
    factor, stiffness, damping = bristle_now(terms, axis, bristles, t_mid, y_mid, v_mid, currents, p)
    level, fall = factor * level, factor * fall
    if states:
        advance_states(terms, axis.on, h, t_mid, y_mid, v_mid, (v_mid - v) / half, currents, p)
    force_end = _force(terms, axis, t_n + x, y_end, v_end, currents_end, d, p, table)
    mean, rise = impulse(force, force_mid, force_end)
    v_new, w_new, displacement = lugre_step(
        v,
        w,
        v_mid,
        middle.w,
        level,
        fall,
        mean - 0.5 * rise,
        rise / h,
        bristles.mass,
        stiffness,
        damping,
        bristles.sigma_2,
        h,
    )
    if states:  # once more along the step as it came out, so that they keep to the motion
        advance_states(terms, axis.on, h, t_mid, y + 0.5 * displacement, displacement / h, (v_new - v) / h, currents, p)
        keep_states(p)
    if axis.powered:
        found = Middle(v_mid, middle.w, level, fall, middle.halvings, middle.swing, middle.allowed)
        v_new, w_new, displacement, force_end, flow = corrected(
            windings,
            space,
            common,
            bristles,
            (stiffness, damping),
            found,
            moved,
            flow,
            h,
            v,
            v_end,
            v_new,
            w_new,
            displacement,
            force_end,
        )
        currents_end = phases(flow.current[0], flow.current[1], flow.current[2])
    motion = AxisState(y + displacement, v_new, w_new, force_end, currents_end, (stiffness, damping))
    return motion, flow, middle, weighed


@allocating
def simulate_one(
    terms,
    params,
    motor,
    on,
    powered,
    coefficients,
    t_start,
    dt,
    first,
    count,
    added_mass,
    record,
    elapsed,
    start,
    kept,
    guided,
    substeps,
    tolerance,
    winding,
    i_start,
    i_out,
    y_out,
    v_out,
):
    """Simulate `count` samples from sample `first`; returns the number of internal steps.

    winding: 1 star, 2 separate; i_start: (3,) A, nan where not given; i_out: (3, count) A, or empty if not wanted; the
    rest as in `kernel.simulate_one`.
    """
    axis, bristles, clock, p, table = prepared(
        terms, params, motor, on, powered, t_start, dt, added_mass, record, elapsed, guided, substeps, tolerance
    )
    whole = substeps << FINEST
    windings = Windings(
        winding, p[WINDING_START], *mode_inductances(winding, p[WINDING_START + 1], p[WINDING_START + 2])
    )
    space, common = np.zeros(WEIGHTS), np.zeros(WEIGHTS)
    weighed = -1
    t = t_start + first * dt
    voltages = first_inputs(terms, axis, clock, coefficients, first, count)
    constants = emf_constants(terms, axis, t, start[0], start[1], voltages, p, table)
    flow = first_flow(windings, axis, voltages, constants, start[1], i_start)
    currents = phases(flow.current[0], flow.current[1], flow.current[2])
    motion = started(terms, axis, bristles, t, start, kept, currents, p, table)
    steps, halvings = 0, np.int64(0)  # a literal 0 would have a type of its own, and compile all twice
    write_sample(terms, axis.on, 0, t, motion, p, y_out, v_out)
    _write_currents(0, motion.currents, i_out)
    for k in range(count - 1):
        done = 0
        while done < whole:
            motion, flow, middle, weighed = voltage_step(
                terms,
                axis,
                bristles,
                windings,
                space,
                common,
                weighed,
                clock,
                coefficients,
                first + k,
                done,
                motion,
                flow,
                halvings,
                p,
                table,
            )
            halvings = middle.halvings
            size = 1 << (FINEST - halvings)
            done += size
            steps += 1
            if halvings > 0 and done % (size << 1) == 0 and middle.swing < 0.3 * middle.allowed:
                halvings -= 1
        if diverged(motion):
            no_samples(k + 1, y_out, v_out)
            for rest in range(k + 1, count):
                _write_currents(rest, (np.nan, np.nan, np.nan), i_out)
            return steps
        write_sample(terms, axis.on, k + 1, t_start + (first + k) * dt + dt, motion, p, y_out, v_out)
        _write_currents(k + 1, motion.currents, i_out)
    return steps


@inlined
def _write_currents(k, currents, i_out):
    if i_out.size > 0:
        i_out[0, k], i_out[1, k], i_out[2, k] = currents


def simulate_tasks_with(terms: Bundle) -> Any:
    """`simulate_tasks` with these terms, for Python to call."""

    def simulate_tasks(
        params,
        motor,
        on,
        powered,
        coefficients,
        offsets,
        t_starts,
        dts,
        recording,
        first,
        count,
        added_mass,
        records,
        elapsed,
        starts,
        kept,
        out_offsets,
        guided,
        guide,
        substeps,
        tolerance,
        begin,
        end,
        winding,
        i_starts,
        i_out,
        y_out,
        v_out,
    ):
        """Simulate tasks begin..end-1, as `kernel.simulate_tasks`; i_starts: (candidates, segments, 3) A; i_out:
        (candidates, 3, samples) A, or empty if not wanted."""
        segments = recording.size
        steps = 0
        for task in range(begin, end):
            candidate = task // segments
            s = task % segments
            r = recording[s]
            a = out_offsets[s]
            b = a + count[s]
            steps += simulate_one(
                terms,
                params[candidate],
                motor,
                on,
                powered[r],
                coefficients[offsets[r] : offsets[r + 1]],
                t_starts[r],
                dts[r],
                first[s],
                count[s],
                added_mass[r],
                records[r],
                elapsed[r],
                starts[candidate, s],
                kept,
                guided,
                substeps,
                tolerance,
                winding,
                i_starts[candidate, s],
                i_out[candidate, :, a:b] if i_out.size > 0 else i_out[0],
                y_out[candidate, a:b],
                v_out[candidate, a:b] if v_out.size > 0 else v_out[0, 0:0],
            )
        return steps

    return simulate_tasks
