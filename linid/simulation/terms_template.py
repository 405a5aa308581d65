"""First part of the compiled simulation: the terms of motors and effects. The emitter fills the marked places.

Nothing here is run as it stands. `on` says by its bits which effects act; `p` holds the parameters, and with effects
also the recording's number, the campaign's running time and the hidden states (see linid/physics/model.py).
"""

# ruff: noqa
import math

from numba import njit

from linid.physics.friction import glide_weights, gliding_step, lugre_step, stribeck, stribeck_fall
from linid.physics.electrical import WEIGHTS, clarke, current_weights, mode_inductances, phases
from linid.physics.motors import gaussian_force, motor_forces, phase_constants, phase_force, prepare_motor
import numpy as np

# <imports>

# <constants>

START_SAMPLES = 20  # over which the balance of forces at a recording's start is averaged
SETTLING = 20.0  # breakaway deflections of travel, after which a bristle surely slides
SETTLING_TIME = 0.1  # s before a recording for which its first speed is taken to have lasted
REST_AVERAGE = 0.03  # s, over which a resting bristle is drawn to the balance of forces
UNEVEN = 0.1  # relative change of speed between samples, from which the bristle is followed in PIECES
PIECES = 8

FINEST = 12  # a base step is halved at most this often around a reversal
REVERSAL_WEIGHT = 4.0  # how much more a swing of the bristle rate counts where the speed changes its sign
# Fast sliding: where the Stribeck curve has fallen to F_C but for this exponent's power of e, the bristle is steady but
# for this share of F_C, and the step ends where the curve has fallen by SLOWEST at least.
FAST, SLOWEST, STEADY = 40.0, 36.0, 1e-8
REST_SPEED, REST_BRISTLE = 1e-9, 1e-11  # m/s and m, below which what still moves cannot be seen
LEAST_MASS = 0.05  # part of the rigid mass that no effect can take away


@njit(cache=True, error_model="numpy", forceinline=True)
def spline_at(c, k, row, x):
    """A cubic spline x seconds after sample k; c: (n - 1, 4, 4) coefficients, of which the `row`.

    Not by a view of the row: views are counted, which costs more than the spline.
    """
    return ((c[k, row, 3] * x + c[k, row, 2]) * x + c[k, row, 1]) * x + c[k, row, 0]


@njit(cache=True, error_model="numpy", forceinline=True)
def inputs_at(c, k, x):
    """The three inputs x seconds after sample k; c: (n - 1, 4, 4) spline coefficients."""
    return spline_at(c, k, 0, x), spline_at(c, k, 1, x), spline_at(c, k, 2, x)


@njit(cache=True, error_model="numpy", forceinline=True)
def late_inputs(coefficients, dt, x):
    """The three inputs x seconds after the first sample, held at the recording's ends."""
    last = coefficients.shape[0]
    x = min(max(x, 0.0), last * dt)
    k = min(int(x / dt), last - 1)
    return inputs_at(coefficients, k, x - k * dt)


@njit(cache=True, error_model="numpy")
def with_states(params, record, elapsed):
    """A copy of the parameters with room for what the effects need besides."""
    p = np.zeros(WORK_SIZE)
    p[: params.size] = params
    p[RECORD] = record
    p[ELAPSED] = elapsed
    return p


@njit(cache=True, error_model="numpy")
def total_delay(on, p):
    """Time in s by which the inputs act late."""
    delay = 0.0
    # <delay>
    return delay


@njit(cache=True, error_model="numpy")
def extra_mass(on, p):
    """Mass in kg that effects add."""
    record = p[RECORD]
    mass = 0.0
    # <mass>
    return mass


@njit(cache=True, error_model="numpy")
def thrust_factor(on, t, y, v, i_1, i_2, i_3, p):
    """Factor on the motor force."""
    record, elapsed = p[RECORD], p[ELAPSED] + t
    factor = 1.0
    # <thrust>
    return factor


@njit(cache=True, error_model="numpy")
def friction_factor(on, t, y, v, i_1, i_2, i_3, p):
    """Factor on the whole bristle force."""
    record, elapsed = p[RECORD], p[ELAPSED] + t
    factor = 1.0
    # <friction>
    return factor


@njit(cache=True, error_model="numpy")
def level_factor(on, t, y, v, i_1, i_2, i_3, p):
    """Factor on sliding and breakaway friction."""
    record, elapsed = p[RECORD], p[ELAPSED] + t
    factor = 1.0
    # <level>
    return factor


@njit(cache=True, error_model="numpy")
def reading_error(on, t, y, v, i_1, i_2, i_3, p):
    """Reading minus position, m."""
    record, elapsed = p[RECORD], p[ELAPSED] + t
    error = 0.0
    # <sensor>
    return error


@njit(cache=True, error_model="numpy")
def start_states(on, t, y, v, i_1, i_2, i_3, p):
    """Hidden states at the start of a simulation."""
    record, elapsed = p[RECORD], p[ELAPSED] + t
    # <initial>
    keep_states(p)


@njit(cache=True, error_model="numpy")
def keep_states(p):
    """The hidden states as they are now become those at the start of the step."""
    for place in range(STATE_START, STATE_START + STATE_SIZE):
        p[place + STATE_SIZE] = p[place]


@njit(cache=True, error_model="numpy")
def advance_states(on, h, t, y, v, a, i_1, i_2, i_3, p):
    """Hidden states h seconds after the start of the step; t, y, v, i: of its middle, a: its mean acceleration."""
    record, elapsed = p[RECORD], p[ELAPSED] + t
    # <advance>


@njit(cache=True, error_model="numpy")
def with_effects(on, powered, t, y, v, i_1, i_2, i_3, p, motor_force):
    """All forces on the mass but friction, in N, given that of the motor alone."""
    record, elapsed = p[RECORD], p[ELAPSED] + t
    if powered and on & THRUSTS:
        motor_force *= thrust_factor(on, t, y, v, i_1, i_2, i_3, p)
    force = motor_force
    # <force>
    return force


@njit(cache=True, error_model="numpy")
def pushed_force(motor, on, powered, t, y, v, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase):
    """`external_force` where effects change it."""
    record, elapsed = p[RECORD], p[ELAPSED] + t
    motor_force = 0.0
    if powered:
        if on & DRIVES:
            # <drive>
            pass
        field = y
        if on & FIELDS:
            # <field>
            pass
        motor_force = motor_force_at(motor, field, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase)
    return with_effects(on, powered, t, y, v, i_1, i_2, i_3, p, motor_force)


@njit(cache=True, error_model="numpy")
def friction_load(motor, on, powered, t, y, v, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase):
    """Sliding and breakaway friction in N that the motor's force adds."""
    record, elapsed = p[RECORD], p[ELAPSED] + t
    push = 0.0
    j_1, j_2, j_3 = i_1, i_2, i_3
    if powered:
        if on & DRIVES:
            # <drive>
            pass
        field = y
        if on & FIELDS:
            # <field>
            pass
        push = motor_force_at(motor, field, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase)
        if on & THRUSTS:
            push *= thrust_factor(on, t, y, v, i_1, i_2, i_3, p)
    i_1, i_2, i_3 = j_1, j_2, j_3
    load = 0.0
    # <load>
    return load


@njit(cache=True, error_model="numpy")
def emf_constants(motor, on, t, y, v, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase):
    """Thrust per phase current (N/A) and thus back-EMF per speed (V s/m) of the three windings."""
    record, elapsed = 0.0, t
    if on:
        record, elapsed = p[RECORD], p[ELAPSED] + t
    field = y
    if on & FIELDS:
        # <field>
        pass
    e_1, e_2, e_3 = phase_constants(motor, field, p[8:14], table, harmonics, wavenumber, phase)
    if on & THRUSTS:
        factor = thrust_factor(on, t, y, v, i_1, i_2, i_3, p)
        e_1, e_2, e_3 = factor * e_1, factor * e_2, factor * e_3
    return e_1, e_2, e_3


@njit(cache=True, error_model="numpy", forceinline=True)
def motor_force_at(motor, y, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase):
    """Force of the motor alone, N."""
    force = 0.0
    # <motors>
    return force


@njit(cache=True, error_model="numpy", forceinline=True)
def external_force(motor, on, powered, t, y, v, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase):
    """All forces on the mass but friction, in N."""
    if on & PUSHES:
        return pushed_force(motor, on, powered, t, y, v, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase)
    force = 0.0
    if powered:
        # <motors>
        pass
    return force


@njit(cache=True, error_model="numpy")
def steady_bristle(p, motor, on, powered, i_1, i_2, i_3, t, y, v, table, harmonics, wavenumber, phase):
    """Bristle deflection in m of steady sliding, or of a resting axis (v = 0) under the outer forces at time t."""
    level, load = 1.0, 0.0
    if on & LOADS:
        load = friction_load(motor, on, powered, t, y, v, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase)
    if on & LEVELS:
        level = level_factor(on, t, y, v, i_1, i_2, i_3, p)
    if v != 0.0:
        return math.copysign(level * (stribeck(v, p[0], p[1], p[2], p[3]) + load), v) / p[4]
    force = external_force(motor, on, powered, t, y, v, i_1, i_2, i_3, p, table, harmonics, wavenumber, phase)
    if on & FRICTIONS:
        force /= friction_factor(on, t, y, v, i_1, i_2, i_3, p)
    breakaway = level * (p[1] + load)
    return min(max(force, -breakaway), breakaway) / p[4]
