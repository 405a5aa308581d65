"""Third part of the compiled simulation: acceleration along a measured motion.

Appended to terms_template.py by the emitter; not run as it stands.
"""

# ruff: noqa
# <body>


@njit(cache=True, error_model="numpy", forceinline=True)
def decay_means(x, decay):
    """Means over s in [0, 1] of exp(-x s) and of s exp(-x s), x >= 0; decay: exp(-x)."""
    if x < 0.02:
        return 1.0 - x * (0.5 - x / 6.0), 0.5 - x * (1.0 / 3.0 - 0.125 * x)
    first = (1.0 - decay) / x
    return first, (first - decay) / x


@njit(cache=True, error_model="numpy")
def along_one(
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
    (the bristle then balances the other forces); wanted: (count,) where w_out is, or empty for everywhere. a_out: (count,) m/s^2, its mean over both
    neighbouring intervals with triangular weights, as second differences of position show it, or empty if not wanted;
    w_out: (count,) m; states_out: (count, kept) hidden states number `kept`; reading_out: (count,) reading error in m,
    or empty if no effect has one.
    """
    # <on>
    p = params
    mass = p[7] + added_mass
    lag = 0.0
    if on:
        p = with_states(params, record, elapsed)
        if on & MASSES:
            mass = max(mass + extra_mass(on, p), LEAST_MASS * mass)
        if on & DELAYS:
            lag = total_delay(on, p)
    coulomb, static, v_s, alpha = p[0], p[1], p[2], p[3]
    sigma_0, sigma_1, sigma_2 = p[4], p[5], p[6]
    table = np.zeros((3, 12))
    harmonics = prepare_motor(motor, p[8:14], table)
    wavenumber, phase = p[9], p[11]
    if motor == 3:
        wavenumber, phase = 2.0 * wavenumber, 2.0 * phase
    i_1 = i_2 = i_3 = 0.0
    factor = level = 1.0
    load = 0.0  # friction by the motor's force, N
    last = before_last = mean = late = force = 0.0
    want_a = a_out.size > 0
    unknown = False
    # Where nothing but the motion acts on the bristle, it has forgotten all that lies this far back (22: 3e-10).
    skipping = wanted.size > 0 and not want_a and not on & (LEVELS | LOADS | STATES | SENSORS)
    memory = 22.0 * max(static, coulomb) / sigma_0
    goal = -1  # the next wanted sample
    # Where position and inputs alone decide the motor's force, it is computed for all samples at once.
    known = want_a and powered and motor > 0 and not on & (DELAYS | DRIVES | FIELDS)
    motor_force = np.empty(count if known else 0)
    if known:
        inputs = np.empty((3, count))
        for n in range(count - 1):
            for row in range(3):
                inputs[row, n] = coefficients[n, row, 0]
        inputs[0, count - 1], inputs[1, count - 1], inputs[2, count - 1] = inputs_at(coefficients, count - 2, dt)
        motor_forces(motor, p[8:14], y, inputs[0], inputs[1], inputs[2], motor_force)
    k = -1
    while k < count - 1:
        k += 1
        if skipping and k > goal:
            goal = k
            while goal < count and not wanted[goal]:
                goal += 1
            if goal == count:
                break
            back, travelled = goal, 0.0
            while back > k and travelled < memory:
                travelled += abs(y[back] - y[back - 1])
                back -= 1
            if back > k:
                k = back
                w = math.copysign(coulomb / sigma_0, v[k])
        t = t_start + k * dt
        if powered:
            if on & DELAYS:
                i_1, i_2, i_3 = late_inputs(coefficients, dt, k * dt - lag)
            elif k < count - 1:
                i_1, i_2, i_3 = coefficients[k, 0, 0], coefficients[k, 1, 0], coefficients[k, 2, 0]
            else:
                i_1, i_2, i_3 = inputs_at(coefficients, k - 1, dt)
        if k == 0:
            if on & STATES:
                start_states(on, t, y[0], v[0], i_1, i_2, i_3, p)
            unknown = math.isnan(w)
            if unknown:
                w = steady_bristle(
                    p, motor, on, powered, i_1, i_2, i_3, t, y[0], v[0], table, harmonics, wavenumber, phase
                )
        if known:
            force = motor_force[k]
            if on & PUSHES:
                force = with_effects(on, powered, t, y[k], v[k], i_1, i_2, i_3, p, force)
        elif want_a or standstill[k]:
            force = external_force(
                motor, on, powered, t, y[k], v[k], i_1, i_2, i_3, p, table, harmonics, wavenumber, phase
            )
        if on & FRICTIONS:
            factor = friction_factor(on, t, y[k], v[k], i_1, i_2, i_3, p)
        if on & LEVELS:
            level = level_factor(on, t, y[k], v[k], i_1, i_2, i_3, p)
        if on & LOADS:
            load = friction_load(
                motor, on, powered, t, y[k], v[k], i_1, i_2, i_3, p, table, harmonics, wavenumber, phase
            )
        if k == 0 and unknown and not standstill[0] and count > START_SAMPLES:
            # An axis that has just set off need not slide yet: its bristle holds what the acceleration leaves.
            breakaway = level * (static + load) / sigma_0
            if abs(v[0]) * SETTLING_TIME < SETTLING * breakaway:
                balance = travelled = 0.0
                for n in range(START_SAMPLES):
                    j_1, j_2, j_3 = i_1, i_2, i_3
                    if powered:
                        j_1, j_2, j_3 = late_inputs(coefficients, dt, n * dt - lag)
                    balance += external_force(
                        motor,
                        on,
                        powered,
                        t + n * dt,
                        y[n],
                        v[n],
                        j_1,
                        j_2,
                        j_3,
                        p,
                        table,
                        harmonics,
                        wavenumber,
                        phase,
                    )
                    balance -= sigma_2 * v[n]
                    travelled += y[n] - y[0]
                balance -= mass * (v[START_SAMPLES - 1] - v[0]) / ((START_SAMPLES - 1) * dt) * START_SAMPLES
                held = (balance / (factor * sigma_0) - travelled) / START_SAMPLES
                w = min(max(held, -breakaway), breakaway)
        if standstill[k]:  # the balance of forces, averaged: one sample's current noise would shift w by much
            most = level * (static + load)
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
        if on & STATES:
            for place in range(kept.size):
                states_out[k, place] = p[STATE_START + kept[place]]
        if on & SENSORS:
            error = reading_error(on, t, y[k], v[k], i_1, i_2, i_3, p)  # at the reading, then at the position
            reading_out[k] = reading_error(on, t, y[k] - error, v[k], i_1, i_2, i_3, p)
        if k < count - 1:
            travel = y[k + 1] - y[k]
            speed = travel / dt
            middle = t + 0.5 * dt
            if on & MOVING:  # what acts between the samples
                y_mid = y[k] + 0.5 * travel
                if powered:
                    i_1, i_2, i_3 = late_inputs(coefficients, dt, (k + 0.5) * dt - lag)
                if on & LEVELS:
                    level = level_factor(on, middle, y_mid, speed, i_1, i_2, i_3, p)
                if on & LOADS:
                    load = friction_load(
                        motor, on, powered, middle, y_mid, speed, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase
                    )
                if on & STATES:
                    advance_states(on, dt, middle, y_mid, speed, (v[k + 1] - v[k]) / dt, i_1, i_2, i_3, p)
                    keep_states(p)
            pieces = 1
            if abs(v[k + 1] - v[k]) > UNEVEN * abs(speed):
                pieces = PIECES
            done = mean = late = (
                0.0  # of the way; mean of w over the interval, and with a weight that grows from 0 to 1
            )
            for piece in range(pieces):
                reached = travel
                if piece < pieces - 1:  # cubic through both samples with their speeds
                    s = (piece + 1) / pieces
                    reached = s * s * (3.0 - 2.0 * s) * travel
                    reached += dt * s * (1.0 - s) * ((1.0 - s) * v[k] - s * v[k + 1])
                part = reached - done
                done = reached
                rest = level * (stribeck(part * pieces / dt, coulomb, static, v_s, alpha) + load) / sigma_0
                if part < 0.0:
                    rest = -rest
                started = w - rest
                passed = abs(part / rest)
                decay = math.exp(-passed)
                w = rest + started * decay
                if want_a:
                    first, second = decay_means(passed, decay)
                    whole = rest + started * first
                    mean += whole / pieces
                    late += (piece * whole + 0.5 * rest + started * second) / pieces**2
            # The bristle's rate is a difference of w: the equation's right-hand side would amplify noise.
            if want_a:
                a_out[k] -= bristle * (sigma_0 * (mean - late) + sigma_1 * mean / dt)


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
