"""Acceleration along a measured motion, compiled: what the model says where position and speed are given."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from linid.physics.friction import stribeck
from linid.physics.model import STATE_START
from linid.physics.motors import motor_forces
from linid.simulation.bundle import Bundle
from linid.simulation.forces import (
    advance_states,
    axis_of,
    bristles_of,
    external_force,
    force_once,
    friction_factor,
    friction_load,
    keep_states,
    level_factor,
    reading_error,
    start_states,
    steady_bristle,
    total_delay,
    with_effects,
    work_vector,
)
from linid.simulation.splines_at import inputs_at, late_inputs
from linid.simulation.terms import allocating, compiled, inlined

START_SAMPLES = 20  # over which the balance of forces at a recording's start is averaged
SETTLING = 20.0  # breakaway deflections of travel, after which a bristle surely slides
SETTLING_TIME = 0.1  # s before a recording for which its first speed is taken to have lasted
REST_AVERAGE = 0.03  # s, over which a resting bristle is drawn to the balance of forces
UNEVEN = 0.1  # relative change of speed between samples, from which the bristle is followed in PIECES
PIECES = 8
FORGOTTEN = 22.0  # breakaway deflections of travel, after which a bristle has forgotten all (to 3e-10)


@inlined
def decay_means(x, decay):
    """Means over s in [0, 1] of exp(-x s) and of s exp(-x s), x >= 0; decay: exp(-x)."""
    if x < 0.02:
        return 1.0 - x * (0.5 - x / 6.0), 0.5 - x * (1.0 / 3.0 - 0.125 * x)
    first = (1.0 - decay) / x
    return first, (first - decay) / x


@allocating
def input_samples(coefficients, count, dt):
    """The three inputs at all samples, (3, count)."""
    inputs = np.empty((3, count))
    for n in range(count - 1):
        for row in range(3):
            inputs[row, n] = coefficients[n, row, 0]
    inputs[0, count - 1], inputs[1, count - 1], inputs[2, count - 1] = inputs_at(coefficients, count - 2, dt)
    return inputs


@inlined
def inputs_of_sample(terms, axis, coefficients, k, count, dt, lag):
    """The three inputs that act at sample k."""
    if not axis.powered:
        return 0.0, 0.0, 0.0
    if axis.on & terms.acts.delay:
        return late_inputs(coefficients, dt, k * dt - lag)
    if k < count - 1:
        return coefficients[k, 0, 0], coefficients[k, 1, 0], coefficients[k, 2, 0]
    return inputs_at(coefficients, k - 1, dt)


@compiled
def held_at_start(terms, axis, bristles, coefficients, t, dt, y, v, lag, currents, factor, p, table):
    """Deflection in m of the bristle of an axis that has just set off: it holds what the acceleration leaves."""
    balance = travelled = 0.0
    for n in range(START_SAMPLES):
        inputs = late_inputs(coefficients, dt, n * dt - lag) if axis.powered else currents
        balance += force_once(terms, axis, t + n * dt, y[n], v[n], inputs, p, table)
        balance -= bristles.sigma_2 * v[n]
        travelled += y[n] - y[0]
    balance -= bristles.mass * (v[START_SAMPLES - 1] - v[0]) / ((START_SAMPLES - 1) * dt) * START_SAMPLES
    return (balance / (factor * bristles.sigma_0) - travelled) / START_SAMPLES


@inlined
def bristle_along(bristles, w, travel, v, v_next, dt, level, load, want_means):
    """The bristle after the interval between two samples, in m, its mean, and its mean with a weight that grows from 0
    to 1; the travel between in m, the speeds at both in m/s."""
    coulomb, static, stribeck_velocity, exponent, sigma_0 = bristles[:5]
    pieces = PIECES if abs(v_next - v) > UNEVEN * abs(travel / dt) else 1
    done = mean = late = 0.0  # of the way
    for piece in range(pieces):
        reached = travel
        if piece < pieces - 1:  # cubic through both samples with their speeds
            s = (piece + 1) / pieces
            reached = s * s * (3.0 - 2.0 * s) * travel
            reached += dt * s * (1.0 - s) * ((1.0 - s) * v - s * v_next)
        part = reached - done
        done = reached
        rest = level * (stribeck(part * pieces / dt, coulomb, static, stribeck_velocity, exponent) + load) / sigma_0
        if part < 0.0:
            rest = -rest
        started = w - rest
        passed = abs(part / rest)
        decay = math.exp(-passed)
        w = rest + started * decay
        if want_means:
            first, second = decay_means(passed, decay)
            whole = rest + started * first
            mean += whole / pieces
            late += (piece * whole + 0.5 * rest + started * second) / pieces**2
    return w, mean, late


@compiled
def skipped(k, wanted, y, memory):
    """The next sample whose bristle is wanted (or the number of samples), and the sample from which to follow it:
    what lies farther back than `memory` (m of travel) it has forgotten."""
    goal = k
    while goal < wanted.size and not wanted[goal]:
        goal += 1
    back, travelled = goal, 0.0
    if goal < wanted.size:
        while back > k and travelled < memory:
            travelled += abs(y[back] - y[back - 1])
            back -= 1
    return goal, back


@allocating
def along_one(
    terms,
    params,
    motor,
    on,
    powered,
    coefficients,
    t_start,
    dt,
    count,
    added_mass,
    record,
    elapsed,
    y,
    v,
    w,
    kept,
    standstill,
    wanted,
    a_out,
    w_out,
    states_out,
    reading_out,
):
    """Model acceleration and bristle along a measured motion, the bristle integrated exactly between samples.

    y, v: (count,) smoothed motion; w: start deflection in m; standstill: (count,) true where the axis rests
    (the bristle then balances the other forces); wanted: (count,) where w_out is, or empty for everywhere. a_out:
    (count,) m/s^2, its mean over both neighbouring intervals with triangular weights, as second differences of
    position show it, or empty if not wanted; w_out: (count,) m; states_out: (count, kept) hidden states number `kept`;
    reading_out: (count,) reading error in m, or empty if no effect has one.
    """
    on = on & terms.chosen | terms.always
    acts = terms.acts
    p = params
    if on & acts.any:
        p = work_vector(params, record, elapsed)
    table = np.zeros((3, 12))
    axis = axis_of(motor, on, powered, p, table)
    bristles = bristles_of(terms, on, p, added_mass)
    lag = total_delay(terms, on, p)
    sigma_0, sigma_1, sigma_2, mass = bristles.sigma_0, bristles.sigma_1, bristles.sigma_2, bristles.mass
    factor = level = 1.0
    load = 0.0  # friction by the motor's force, N
    last = before_last = mean = late = force = 0.0
    want_a = a_out.size > 0
    unknown = False
    # Where nothing but the motion acts on the bristle, it can be followed in parts.
    alone = not (on & acts.between or on & acts.sensor)
    skipping = wanted.size > 0 and not want_a and alone
    memory = FORGOTTEN * max(bristles.static, bristles.coulomb) / sigma_0
    goal = -1  # the next wanted sample
    # Where position and inputs alone decide the motor's force, it is computed for all samples at once.
    known = want_a and powered and motor > 0 and not (on & acts.delay or on & acts.drive or on & acts.field)
    motor_force = np.empty(count if known else 0)
    if known:
        inputs = input_samples(coefficients, count, dt)
        motor_forces(motor, p[8:14], y, inputs[0], inputs[1], inputs[2], motor_force)
    k = -1
    while k < count - 1:
        k += 1
        if skipping and k > goal:
            goal, back = skipped(k, wanted, y, memory)
            if goal == count:
                break
            if back > k:
                k = back
                w = math.copysign(bristles.coulomb / sigma_0, v[k])
        t = t_start + k * dt
        currents = inputs_of_sample(terms, axis, coefficients, k, count, dt, lag)
        if k == 0:
            if on & acts.advance:
                start_states(terms, on, t, y[0], v[0], currents, p)
            unknown = math.isnan(w)
            if unknown:
                w = steady_bristle(terms, axis, bristles, t, y[0], v[0], currents, p, table)
        if known:
            force = motor_force[k]
            if on & acts.push:
                force = with_effects(terms, axis, t, y[k], v[k], currents, p, force)
        elif want_a or standstill[k]:
            force = external_force(terms, axis, t, y[k], v[k], currents, p, table)
        if on & acts.friction:
            factor = friction_factor(terms, on, t, y[k], v[k], currents, p)
        if on & acts.level:
            level = level_factor(terms, on, t, y[k], v[k], currents, p)
        if on & acts.load:
            load = friction_load(terms, axis, t, y[k], v[k], currents, p, table)
        if k == 0 and unknown and not standstill[0] and count > START_SAMPLES:
            # An axis that has just set off need not slide yet.
            breakaway = level * (bristles.static + load) / sigma_0
            if abs(v[0]) * SETTLING_TIME < SETTLING * breakaway:
                held = held_at_start(terms, axis, bristles, coefficients, t, dt, y, v, lag, currents, factor, p, table)
                w = min(max(held, -breakaway), breakaway)
        if standstill[k]:  # the balance of forces, averaged: one sample's current noise would shift w by much
            most = level * (bristles.static + load)
            held = min(max(force / factor, -most), most) / sigma_0
            w += min(1.0, dt / REST_AVERAGE) * (held - w)
        w_out[k] = w
        # Triangle-weighted means of what changes smoothly by its three samples (Numerov), of the bristle by integrals.
        bristle = factor / mass
        if want_a:
            outer = (force - sigma_2 * v[k]) / mass
            if k > 1:
                a_out[k - 1] += (before_last + 10.0 * last + outer) / 12.0
            before_last = last
            last = outer
            a_out[k] = -bristle * (sigma_0 * late - sigma_1 * mean / dt)
        if on & acts.advance:
            for place in range(kept.size):
                states_out[k, place] = p[STATE_START + kept[place]]
        if on & acts.sensor:
            error = reading_error(terms, on, t, y[k], v[k], currents, p)  # at the reading, then at the position
            reading_out[k] = reading_error(terms, on, t, y[k] - error, v[k], currents, p)
        if k < count - 1:
            travel = y[k + 1] - y[k]
            if on & acts.between:  # what acts between the samples
                speed = travel / dt
                middle, y_mid = t + 0.5 * dt, y[k] + 0.5 * travel
                if powered:
                    currents = late_inputs(coefficients, dt, (k + 0.5) * dt - lag)
                if on & acts.level:
                    level = level_factor(terms, on, middle, y_mid, speed, currents, p)
                if on & acts.load:
                    load = friction_load(terms, axis, middle, y_mid, speed, currents, p, table)
                if on & acts.advance:
                    advance_states(terms, on, dt, middle, y_mid, speed, (v[k + 1] - v[k]) / dt, currents, p)
                    keep_states(p)
            w, mean, late = bristle_along(bristles, w, travel, v[k], v[k + 1], dt, level, load, want_a)
            # The bristle's rate is a difference of w: the equation's right-hand side would amplify noise.
            if want_a:
                a_out[k] -= bristle * (sigma_0 * (mean - late) + sigma_1 * mean / dt)


def along_tasks_with(terms: Bundle) -> Any:
    """`along_tasks` with these terms, for Python to call."""

    def along_tasks(
        params,
        motor,
        on,
        powered,
        coefficients,
        offsets,
        t_starts,
        dts,
        counts,
        sample_offsets,
        added_mass,
        records,
        elapsed,
        y,
        v,
        kept,
        standstill,
        wanted,
        start_w,
        begin,
        end,
        a_out,
        w_out,
        states_out,
        reading_out,
    ):
        """`along_one` for tasks begin..end-1; task = candidate * recordings + recording. Rows of a_out: candidates."""
        recordings = counts.size
        for task in range(begin, end):
            candidate = task // recordings
            r = task % recordings
            a = sample_offsets[r]
            b = sample_offsets[r + 1]
            along_one(
                terms,
                params[candidate],
                motor,
                on,
                powered[r],
                coefficients[offsets[r] : offsets[r + 1]],
                t_starts[r],
                dts[r],
                counts[r],
                added_mass[r],
                records[r],
                elapsed[r],
                y[a:b],
                v[a:b],
                start_w[candidate, r],
                kept,
                standstill[a:b],
                wanted[a:b] if wanted.size > 0 else wanted,
                a_out[candidate, a:b] if a_out.size > 0 else a_out[0, 0:0],
                w_out[candidate, a:b],
                states_out[candidate, a:b] if states_out.size > 0 else states_out[0, 0:0],
                reading_out[candidate, a:b] if reading_out.size > 0 else reading_out[0, 0:0],
            )

    return along_tasks
