"""The compiled simulation. The emitter copies this text and fills the marked place with motors and effects.

One function advances one simulation; effects enter through `external_force` only. Not run as it stands.
"""

# ruff: noqa
import math

from numba import njit

from linid.physics.friction import lugre_step, stribeck, stribeck_fall
from linid.physics.motors import gaussian_force, phase_force, prepare_motor
import numpy as np

# <imports>

REST_AVERAGE = 0.03  # s, over which a resting bristle is drawn to the balance of forces

FINEST = 12  # a base step is halved at most this often around a reversal
REVERSAL_WEIGHT = 4.0  # how much more a swing of the bristle rate counts where the speed changes its sign


@njit(cache=True, error_model="numpy")
def spline_at(c, x):
    """A cubic spline x seconds after a sample; c: (4,) coefficients."""
    return ((c[3] * x + c[2]) * x + c[1]) * x + c[0]


@njit(cache=True, error_model="numpy")
def inputs_at(c, x):
    """The three inputs x seconds after a sample; c: (4, 4) spline coefficients."""
    return spline_at(c[0], x), spline_at(c[1], x), spline_at(c[2], x)


@njit(cache=True, error_model="numpy")
def external_force(motor, on, powered, t, y, v, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase):
    """All forces on the mass but friction, in N."""
    force = 0.0
    # <forces>
    return force


@njit(cache=True, error_model="numpy")
def steady_bristle(p, motor, on, powered, c, t, y, v, table, harmonics, wavenumber, phase):
    """Bristle deflection in m of steady sliding, or of a resting axis (v = 0) under the outer forces at time t."""
    if v != 0.0:
        return math.copysign(stribeck(v, p[0], p[1], p[2], p[3]), v) / p[4]
    force = external_force(
        motor, on, powered, t, y, v, c[0, 0], c[1, 0], c[2, 0], p, table, harmonics, wavenumber, phase
    )
    return min(max(force, -p[1]), p[1]) / p[4]


@njit(cache=True, error_model="numpy")
def simulate_one(
    p,
    motor,
    on,
    powered,
    coefficients,
    t_start,
    dt,
    first,
    count,
    added_mass,
    y,
    v,
    w,
    guided,
    substeps,
    tolerance,
    y_out,
    v_out,
):
    """Simulate `count` samples from sample `first`; returns the number of internal steps.

    p: flat parameters; coefficients: (n - 1, 4, 4) splines of the inputs and of the measured position; guided:
    outer forces act at the measured position; y_out: (count,) m; v_out: (count,) m/s, or empty if not wanted.
    A diverged run is nan from there on.
    """
    coulomb, static, v_s, alpha = p[0], p[1], p[2], p[3]
    sigma_0, sigma_1, sigma_2 = p[4], p[5], p[6]
    mass = p[7] + added_mass
    table = np.zeros((3, 12))
    harmonics = prepare_motor(motor, p[8:14], table)
    wavenumber, phase = p[9], p[11]
    if motor == 3:
        wavenumber, phase = 2.0 * wavenumber, 2.0 * phase
    if math.isnan(w):  # not given: the bristle that goes with steady sliding, or holds the resting axis
        w = steady_bristle(
            p, motor, on, powered, coefficients[first], t_start + first * dt, y, v, table, harmonics, wavenumber, phase
        )
    want_v = v_out.size > 0
    y_out[0] = y
    if want_v:
        v_out[0] = v
    steps = 0
    level = 0
    ticks_per_interval = substeps << FINEST
    tick = dt / ticks_per_interval
    i_1 = i_2 = i_3 = 0.0
    if powered and count > 1:
        i_1, i_2, i_3 = inputs_at(coefficients[first], 0.0)
    force = external_force(
        motor, on, powered, t_start + first * dt, y, v, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase
    )
    for k in range(count - 1):
        t_k = t_start + (first + k) * dt
        done = 0
        while done < ticks_per_interval:
            rate = sigma_0 * abs(v) / stribeck(v, coulomb, static, v_s, alpha)
            while True:  # until the step is short enough
                size = 1 << (FINEST - level)
                h = size * tick
                half = 0.5 * h
                # Half a step by implicit Euler: first order and L-stable, which is enough for a predictor.
                relax = 1.0 / (1.0 + half * rate)
                pull = half * (sigma_0 - sigma_1 * rate) * relax
                v_mid = (mass * v + half * force - pull * w) / (mass + half * (sigma_1 + sigma_2 + pull))
                w_mid = (w + half * v_mid) * relax
                level_mid, fall = stribeck_fall(v_mid, coulomb, static, v_s, alpha)
                rate_mid = sigma_0 * abs(v_mid) / level_mid
                # How far the frozen bristle rate is off within the step, in parts of the friction force; it matters as
                # far as the bristle is from steady sliding. At a reversal |v| has a kink, which no order of the
                # method covers: there the whole swing of the rate counts.
                change = abs(rate_mid - rate)
                if v * (2.0 * v_mid - v) < 0.0:
                    change = REVERSAL_WEIGHT * sigma_0 * abs(v_mid - v) / level_mid
                swing = change * h * abs(1.0 - math.copysign(sigma_0 * w_mid / level_mid, v_mid * w_mid))
                allowed = tolerance * (1.0 + rate_mid * h)
                if level >= FINEST or not swing > allowed:
                    break
                level += 1
            done += size
            x = done * tick
            v_end = 2.0 * v_mid - v
            y_mid = y + 0.5 * half * (v + v_mid)
            y_end = y + h * v_mid
            c = coefficients[first + k]
            if guided:
                y_mid = spline_at(c[3], x - half)
                y_end = spline_at(c[3], x)
            if powered:
                i_1, i_2, i_3 = inputs_at(c, x - half)
            force_mid = external_force(
                motor, on, powered, t_k + x - half, y_mid, v_mid, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase
            )
            if powered:
                i_1, i_2, i_3 = inputs_at(c, x)
            force_end = external_force(
                motor, on, powered, t_k + x, y_end, v_end, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase
            )
            # The straight line nearest to the parabola through the three forces: it has the same impulse.
            rise = force_end - force
            mean = (force + 4.0 * force_mid + force_end) / 6.0
            v, w, displacement = lugre_step(
                v, w, v_mid, w_mid, level_mid, fall, mean - 0.5 * rise, rise / h, mass, sigma_0, sigma_1, sigma_2, h
            )
            force = force_end
            y += displacement
            steps += 1
            if level > 0 and done % (size << 1) == 0 and swing < 0.3 * allowed:
                level -= 1
        if not abs(y) < 1e6 or not abs(v) < 1e4:
            for rest in range(k + 1, count):
                y_out[rest] = np.nan
                if want_v:
                    v_out[rest] = np.nan
            return steps
        y_out[k + 1] = y
        if want_v:
            v_out[k + 1] = v
    return steps


@njit(cache=True, error_model="numpy", nogil=True)
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
    starts,
    out_offsets,
    guided,
    substeps,
    tolerance,
    begin,
    end,
    y_out,
    v_out,
):
    """Simulate tasks begin..end-1; task = candidate * segments + segment. Results land in y_out[candidate].

    params: (candidates, VECTOR_SIZE); recording, first, count, out_offsets: (segments,) integers;
    coefficients: (intervals of all recordings, 4, 4); offsets: first interval of each recording;
    starts: (candidates, segments, 3) y, v, w. Returns the internal steps taken.
    """
    segments = recording.size
    steps = 0
    for task in range(begin, end):
        candidate = task // segments
        s = task % segments
        r = recording[s]
        a = out_offsets[s]
        b = a + count[s]
        v_row = v_out[candidate, a:b] if v_out.size > 0 else v_out[0, 0:0]
        steps += simulate_one(
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
            starts[candidate, s, 0],
            starts[candidate, s, 1],
            starts[candidate, s, 2],
            guided,
            substeps,
            tolerance,
            y_out[candidate, a:b],
            v_row,
        )
    return steps


@njit(cache=True, error_model="numpy")
def along_one(p, motor, on, powered, coefficients, t_start, dt, count, added_mass, y, v, w, standstill, a_out, w_out):
    """Model acceleration and bristle along a measured motion, the bristle integrated exactly between samples.

    y, v: (count,) smoothed motion; w: start deflection in m; standstill: (count,) true where the axis rests
    (the bristle then balances the other forces). a_out: (count,) m/s^2; w_out: (count,) m.
    """
    coulomb, static, v_s, alpha = p[0], p[1], p[2], p[3]
    sigma_0, sigma_1, sigma_2 = p[4], p[5], p[6]
    mass = p[7] + added_mass
    table = np.zeros((3, 12))
    harmonics = prepare_motor(motor, p[8:14], table)
    wavenumber, phase = p[9], p[11]
    if motor == 3:
        wavenumber, phase = 2.0 * wavenumber, 2.0 * phase
    if math.isnan(w):
        w = steady_bristle(
            p, motor, on, powered, coefficients[0], t_start, y[0], v[0], table, harmonics, wavenumber, phase
        )
    i_1 = i_2 = i_3 = 0.0
    for k in range(count):
        if powered:
            if k < count - 1:
                i_1, i_2, i_3 = coefficients[k, 0, 0], coefficients[k, 1, 0], coefficients[k, 2, 0]
            else:
                i_1, i_2, i_3 = inputs_at(coefficients[k - 1], dt)
        force = external_force(
            motor, on, powered, t_start + k * dt, y[k], v[k], i_1, i_2, i_3, p, table, harmonics, wavenumber, phase
        )
        if standstill[k]:  # the balance of forces, averaged: one sample's current noise would shift w by much
            w += min(1.0, dt / REST_AVERAGE) * (min(max(force, -static), static) / sigma_0 - w)
        w_out[k] = w
        a_out[k] = (force - sigma_0 * w - sigma_2 * v[k]) / mass
        if k < count - 1:
            travel = y[k + 1] - y[k]
            speed = travel / dt
            rest = stribeck(speed, coulomb, static, v_s, alpha) / sigma_0
            if travel < 0.0:
                rest = -rest
            w = rest + (w - rest) * math.exp(-abs(travel / rest))
    # The bristle's rate is the difference of w: the equation's right-hand side would amplify noise.
    for k in range(1, count - 1):
        a_out[k] -= sigma_1 * (w_out[k + 1] - w_out[k - 1]) / (2.0 * dt * mass)


@njit(cache=True, error_model="numpy", nogil=True)
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
    y,
    v,
    standstill,
    start_w,
    begin,
    end,
    a_out,
    w_out,
):
    """`along_one` for tasks begin..end-1; task = candidate * recordings + recording. Rows of a_out: candidates."""
    recordings = counts.size
    for task in range(begin, end):
        candidate = task // recordings
        r = task % recordings
        a = sample_offsets[r]
        b = sample_offsets[r + 1]
        along_one(
            params[candidate],
            motor,
            on,
            powered[r],
            coefficients[offsets[r] : offsets[r + 1]],
            t_starts[r],
            dts[r],
            counts[r],
            added_mass[r],
            y[a:b],
            v[a:b],
            start_w[candidate, r],
            standstill[a:b],
            a_out[candidate, a:b],
            w_out[candidate, a:b],
        )
