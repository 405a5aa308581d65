"""Second part of the compiled simulation: the motion of one or many simulations.

Appended to terms_template.py by the emitter; not run as it stands.
"""

# ruff: noqa
# <body>


@njit(cache=True, error_model="numpy")
def simulate_one(
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
    forces,
    # <voltage arguments>
    y_out,
    v_out,
):
    """Simulate `count` samples from sample `first`; returns the number of internal steps.

    params: flat parameters; coefficients: (n - 1, 4, 4) splines of the inputs and of the measured position; start:
    y, v, w and, if given, the hidden states number `kept`; guided: outer forces act at the measured position; forces:
    the motor's at the ends and middles of all base steps of the recording, or empty;
    y_out: (count,) m; v_out: (count,) m/s, or empty if not wanted. A diverged run is nan from there on.
    """
    # <on>
    y, v, w = start[0], start[1], start[2]
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
    if powered and count > 1:
        if on & DELAYS:
            i_1, i_2, i_3 = late_inputs(coefficients, dt, first * dt - lag)
        else:
            i_1, i_2, i_3 = inputs_at(coefficients, first, 0.0)
    t_k = t_start + first * dt
    # Speeds between which a step of fast sliding stays; where only forces that vanish act, and where friction does not
    # change with anything but speed.
    fast, slowest = v_s * FAST ** (1.0 / alpha), v_s * SLOWEST ** (1.0 / alpha)
    alone = not powered and not on & (PUSHES | STATES)
    if on & (FRICTIONS | LEVELS | LOADS | STATES):
        fast = math.inf
    followed = False  # the bristle, where fast sliding turned out to end
    glide, glide_h = (1.0, 0.5, 1.0 / 6.0), 0.0  # how fast sliding decays over a step of that length
    # <voltage start>
    if on & STATES:
        start_states(on, t_k, y, v, i_1, i_2, i_3, p)
        if start.size > 3 and not math.isnan(start[3]):
            for place in range(kept.size):
                p[STATE_START + kept[place]] = start[3 + place]
            keep_states(p)
    if math.isnan(w):  # not given: the bristle that goes with steady sliding, or holds the resting axis
        w = steady_bristle(p, motor, on, powered, i_1, i_2, i_3, t_k, y, v, table, harmonics, wavenumber, phase)
    want_v = v_out.size > 0
    y_out[0] = y
    if on & SENSORS:
        y_out[0] += reading_error(on, t_k, y, v, i_1, i_2, i_3, p)
    if want_v:
        v_out[0] = v
    steps = 0
    level = 0
    added = 0.0  # to sliding and breakaway friction by the motor's force, N
    ticks_per_interval = substeps << FINEST
    tick = dt / ticks_per_interval
    force = external_force(motor, on, powered, t_k, y, v, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase)
    stiffness, damping = sigma_0, sigma_1  # of the bristle as it is in this step
    if on & FRICTIONS:
        factor = friction_factor(on, t_k, y, v, i_1, i_2, i_3, p)
        stiffness, damping = factor * sigma_0, factor * sigma_1
    for k in range(count - 1):
        t_k = t_start + (first + k) * dt
        done = 0
        if alone and abs(v) < REST_SPEED and abs(w) < REST_BRISTLE:  # nothing will ever move it
            done = ticks_per_interval
            v = w = 0.0
        if not on and (alone or forces.size > 0) and level == 0 and abs(v) > fast and not followed:
            # The same steps as below, for the usual case that all forces are known beforehand.
            drag = math.copysign(coulomb, v)
            if abs(sigma_0 * w - drag) < STEADY * coulomb:
                size = ticks_per_interval if alone else 1 << FINEST
                h = size * tick
                if h != glide_h:
                    glide, glide_h = glide_weights(sigma_2, mass, h), h
                while done < ticks_per_interval and abs(v) > fast:
                    force_mid = force_end = 0.0
                    if not alone:
                        point = 2 * ((first + k) * substeps + (done >> FINEST))
                        force_mid, force_end = forces[point + 1], forces[point + 2]
                    rise = force_end - force
                    mean = (force + 4.0 * force_mid + force_end) / 6.0
                    v_new, displacement = gliding_step(v, mean - drag - 0.5 * rise, rise, mass, sigma_2, h, glide)
                    followed = math.copysign(v_new, v) != v_new or abs(v_new) <= slowest
                    if followed:
                        break
                    v, w, force = v_new, drag / sigma_0, force_end
                    y += displacement
                    steps += 1
                    done += size
        while done < ticks_per_interval:
            steady = abs(sigma_0 * w - math.copysign(coulomb, v)) < STEADY * coulomb
            gliding = level == 0 and abs(v) > fast and steady and not followed
            if gliding:
                # Nothing but the outer forces changes here, and these smoothly: no bristle need be followed. Without
                # any, the step is exact however long it is.
                drag = math.copysign(coulomb, v)
                size = ticks_per_interval - done if alone else 1 << FINEST
                h = size * tick
                half = 0.5 * h
                if h != glide_h:
                    glide, glide_h = glide_weights(sigma_2, mass, h), h
                v_mid = v + half * (force - drag - sigma_2 * v) / mass
            else:
                rate = sigma_0 * abs(v) / stribeck(v, coulomb, static, v_s, alpha)
                if on & LOADS:
                    added = friction_load(
                        motor,
                        on,
                        powered,
                        t_k + done * tick,
                        y,
                        v,
                        i_1,
                        i_2,
                        i_3,
                        p,
                        table,
                        harmonics,
                        wavenumber,
                        phase,
                    )
                    rate = sigma_0 * abs(v) / (stribeck(v, coulomb, static, v_s, alpha) + added)
                if on & LEVELS:
                    rate /= level_factor(on, t_k + done * tick, y, v, i_1, i_2, i_3, p)
                # <voltage step>
                while True:  # until the step is short enough
                    size = 1 << (FINEST - level)
                    h = size * tick
                    half = 0.5 * h
                    # Half a step by implicit Euler: first order and L-stable, which is enough for a predictor.
                    relax = 1.0 / (1.0 + half * rate)
                    pull = half * (stiffness - damping * rate) * relax
                    v_mid = (mass * v + half * force - pull * w) / (mass + half * (damping + sigma_2 + pull))
                    w_mid = (w + half * v_mid) * relax
                    level_mid, fall = stribeck_fall(v_mid, coulomb, static, v_s, alpha)
                    if on & LOADS:
                        level_mid += added
                    if on & LEVELS:
                        factor = level_factor(
                            on, t_k + done * tick + half, y + 0.5 * half * (v + v_mid), v_mid, i_1, i_2, i_3, p
                        )
                        level_mid, fall = factor * level_mid, factor * fall
                    rate_mid = sigma_0 * abs(v_mid) / level_mid
                    # How far the frozen bristle rate is off within the step, in parts of the friction force; it matters
                    # as far as the bristle is from steady sliding. At a reversal |v| has a kink, which no order of the
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
            known = level == 0 and forces.size > 0
            if guided and not known:
                y_mid = spline_at(coefficients, first + k, 3, x - half)
                y_end = spline_at(coefficients, first + k, 3, x)
            t_mid = t_k + x - half
            if on & STATES:
                advance_states(
                    on, half, t_mid - 0.5 * half, y + 0.25 * half * (v + v_mid), 0.5 * (v + v_mid), (v_mid - v) / half,
                    i_1, i_2, i_3, p,
                )  # fmt: skip
                if on & LEVELS:
                    factor = level_factor(on, t_mid, y_mid, v_mid, i_1, i_2, i_3, p)
                    level_mid, fall = stribeck_fall(v_mid, coulomb, static, v_s, alpha)
                    level_mid, fall = factor * level_mid, factor * fall
            if powered and not known:
                if on & DELAYS:
                    i_1, i_2, i_3 = late_inputs(coefficients, dt, (first + k) * dt + x - half - lag)
                else:
                    i_1, i_2, i_3 = inputs_at(coefficients, first + k, x - half)
            # <voltage middle>
            # <only by current>
            point = 2 * ((first + k) * substeps + (done >> FINEST))
            if known:
                force_mid = forces[point - 1]
            else:
                force_mid = external_force(
                    motor, on, powered, t_mid, y_mid, v_mid, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase
                )
            # <end by current>
            if on & LOADS:  # of the motor's force at mid-step
                level_mid, fall = stribeck_fall(v_mid, coulomb, static, v_s, alpha)
                level_mid += friction_load(
                    motor, on, powered, t_mid, y_mid, v_mid, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase
                )
                if on & LEVELS:
                    factor = level_factor(on, t_mid, y_mid, v_mid, i_1, i_2, i_3, p)
                    level_mid, fall = factor * level_mid, factor * fall
            if on & FRICTIONS:
                factor = friction_factor(on, t_mid, y_mid, v_mid, i_1, i_2, i_3, p)
                stiffness, damping = factor * sigma_0, factor * sigma_1
                level_mid, fall = factor * level_mid, factor * fall
            j_1, j_2, j_3 = i_1, i_2, i_3
            if on & STATES:
                advance_states(on, h, t_mid, y_mid, v_mid, (v_mid - v) / half, i_1, i_2, i_3, p)
            if powered and not known:
                if on & DELAYS:
                    i_1, i_2, i_3 = late_inputs(coefficients, dt, (first + k) * dt + x - lag)
                else:
                    i_1, i_2, i_3 = inputs_at(coefficients, first + k, x)
            # <voltage end>
            # <only by current>
            if known:
                force_end = forces[point]
            else:
                force_end = external_force(
                    motor, on, powered, t_k + x, y_end, v_end, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase
                )
            # <end by current>
            # The straight line nearest to the parabola through the three forces: it has the same impulse.
            rise = force_end - force
            mean = (force + 4.0 * force_mid + force_end) / 6.0
            if gliding:
                v_new, displacement = gliding_step(v, mean - drag - 0.5 * rise, rise, mass, sigma_2, h, glide)
                followed = math.copysign(v_new, v) != v_new or abs(v_new) <= slowest
                if followed:  # it slows down too much: the same step once more
                    done -= size
                    continue
                w = drag / sigma_0
            else:
                v_new, w, displacement = lugre_step(
                    v, w, v_mid, w_mid, level_mid, fall, mean - 0.5 * rise, rise / h, mass, stiffness, damping, sigma_2,
                    h,
                )  # fmt: skip
                followed = False
            if on & STATES:  # once more along the step as it came out, so that they keep to the motion
                advance_states(
                    on, h, t_mid, y + 0.5 * displacement, displacement / h, (v_new - v) / h, j_1, j_2, j_3, p
                )
                keep_states(p)
            # <voltage corrected>
            v = v_new
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
                # <voltage diverged>
            return steps
        y_out[k + 1] = y
        if on & SENSORS:
            y_out[k + 1] += reading_error(on, t_k + dt, y, v, i_1, i_2, i_3, p)
        if want_v:
            v_out[k + 1] = v
        # <voltage sample>
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
    # <voltage task arguments>
    y_out,
    v_out,
):
    """Simulate tasks begin..end-1; task = candidate * segments + segment. Results land in y_out[candidate].

    params: (candidates, VECTOR_SIZE); recording, first, count, out_offsets: (segments,) integers;
    coefficients: (intervals of all recordings, 4, 4); offsets: first interval of each recording;
    starts: (candidates, segments, 3 or 3 + kept) y, v, w and hidden states, those in the places `kept`; guide:
    (4, points) measured position and inputs at the ends and middles of all base steps, if these alone decide the
    motor's force, or empty. Returns the internal steps taken.
    """
    segments = recording.size
    steps = 0
    # The motor's forces at measured positions: segments overlap and share them.
    pieces = 2 * substeps
    longest = 0
    if guide.shape[1] > 0:
        for r in range(powered.size):
            longest = max(longest, pieces * (offsets[r + 1] - offsets[r]) + 1)
    forces = np.empty(longest)
    filled, filled_from, filled_to = -1, 0, 0
    for task in range(begin, end):
        candidate = task // segments
        s = task % segments
        r = recording[s]
        known = forces[0:0]
        if longest > 0 and powered[r]:
            known = forces
            start, stop = pieces * first[s], pieces * (first[s] + count[s] - 1) + 1
            if filled != candidate * powered.size + r or start < filled_from or start > filled_to:
                filled = candidate * powered.size + r
                filled_from = filled_to = start
            if stop > filled_to:
                a, b = pieces * offsets[r] + r + filled_to, pieces * offsets[r] + r + stop
                motor_forces(
                    motor, params[candidate, 8:14], guide[0, a:b], guide[1, a:b], guide[2, a:b], guide[3, a:b],
                    forces[filled_to:stop],
                )  # fmt: skip
                filled_to = stop
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
            records[r],
            elapsed[r],
            starts[candidate, s],
            kept,
            guided,
            substeps,
            tolerance,
            known,
            # <voltage task values>
            y_out[candidate, a:b],
            v_row,
        )
    return steps


@njit(cache=True, error_model="numpy", nogil=True)
def reading_tasks(params, on, y, v, begin, end, out):
    """Reading errors in m of candidates begin..end-1 along positions y and speeds v, for errors that hang on nothing
    else. out: (candidates, samples)."""
    for candidate in range(begin, end):
        p = with_states(params[candidate], 0.0, 0.0)
        for k in range(y.size):
            out[candidate, k] = reading_error(on, 0.0, y[k], v[k], 0.0, 0.0, 0.0, p)
