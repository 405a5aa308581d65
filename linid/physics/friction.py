"""LuGre friction: the steady (Stribeck) curve, the bristle and their parameters (eqs. 40-42, corrected)."""

from __future__ import annotations

import math

import numpy as np

from linid.arrays import Array
from linid.kernel_cache import kept
from linid.physics.parameter import Parameter

PARAMETERS = (
    Parameter("coulomb_force", "F_C", "N", 1e-3, 1e3, 1.0, log=True, meaning="friction force at speed"),
    Parameter("static_force", "F_S", "N", 1e-3, 2e3, 1.5, log=True, meaning="breakaway force"),
    Parameter("stribeck_velocity", "v_s", "m/s", 1e-4, 1.0, 0.01, log=True, meaning="speed at which F_S decays to F_C"),
    Parameter("stribeck_exponent", "alpha", "1", 0.5, 2.0, 2.0, meaning="shape of the decay"),
    Parameter("bristle_stiffness", "sigma_0", "N/m", 1e2, 1e8, 1e4, log=True, meaning="pre-sliding stiffness"),
    Parameter("bristle_damping", "sigma_1", "N s/m", 1e-2, 1e4, 10.0, log=True, meaning="pre-sliding damping"),
    Parameter("viscous_friction", "sigma_2", "N s/m", 1e-3, 1e4, 1.0, log=True, meaning="force per speed"),
    Parameter("mass", "m", "kg", 1e-3, 1e4, 1.0, log=True, meaning="moving mass without the added one"),
)


# Beyond this exponent the decay is below rounding, and the exponential is not worth its time.
DECAYED = 50.0


@kept(error_model="numpy")
def stribeck(v: float, coulomb: float, static: float, stribeck_velocity: float, exponent: float) -> float:
    """Steady friction level g(v) in N at speed v in m/s (eq. 42 with the sign of the exponent corrected).

    coulomb, static: N; stribeck_velocity: m/s; exponent: alpha, 0.5 to 2.
    """
    return stribeck_fall(v, coulomb, static, stribeck_velocity, exponent)[0]


@kept(error_model="numpy", nogil=True)
def stribeck_levels(v: Array, coulomb: float, static: float, stribeck_velocity: float, exponent: float) -> Array:
    """Steady friction levels (n,) in N at many speeds v (n,) in m/s: `stribeck` of each (eq. 42).

    coulomb, static: N; stribeck_velocity: m/s; exponent: alpha, 0.5 to 2.
    """
    out = np.empty_like(v)
    for k in range(v.size):
        out[k] = stribeck(v[k], coulomb, static, stribeck_velocity, exponent)
    return out


@kept(error_model="numpy")
def stribeck_fall(
    v: float, coulomb: float, static: float, stribeck_velocity: float, exponent: float
) -> tuple[float, float]:
    """Steady friction level g(v) and v dg/dv, both in N (eq. 42). Arguments as in `stribeck`."""
    ratio = abs(v) / stribeck_velocity
    power = ratio * ratio if exponent == 2.0 else ratio**exponent
    if power > DECAYED:
        return coulomb, 0.0
    excess = (static - coulomb) * math.exp(-power)
    return coulomb + excess, -exponent * power * excess


@kept(error_model="numpy")
def _phi(z: float) -> tuple[float, float, float]:
    """phi_1, phi_2, phi_3 of the exponential integrators: phi_k(z) = (phi_{k-1}(z) - 1/(k-1)!) / z, phi_0 = exp."""
    if abs(z) < 0.5:  # the recurrence would cancel; downwards from the series of phi_3 it does not
        last = 1.0 / 3628800.0 + z * (1.0 / 39916800.0 + z * (1.0 / 479001600.0 + z / 6227020800.0))
        last = 1.0 / 5040.0 + z * (1.0 / 40320.0 + z * (1.0 / 362880.0 + z * last))
        third = 1.0 / 6.0 + z * (1.0 / 24.0 + z * (1.0 / 120.0 + z * (1.0 / 720.0 + z * last)))
        second = 0.5 + z * third
        return 1.0 + z * second, second, third
    inverse = 1.0 / z
    first = (math.exp(z) - 1.0) * inverse
    second = (first - 1.0) * inverse
    return first, second, (second - 0.5) * inverse


@kept(error_model="numpy")
def exponential(half_trace: float, square: float) -> tuple[float, float]:
    """Exponential e I + o B of the 2 x 2 matrix half_trace I + B with B^2 = square I, all dimensionless, square up to
    0.0625: e and o. Source: Cayley and Hamilton's theorem."""
    decay = math.exp(half_trace)
    if square < 0.0:
        root = math.sqrt(-square)
        return decay * math.cos(root), decay * math.sin(root) / root
    # cosh and sinh(x)/x by their series: the two eigenvalues may coincide.
    even = decay * (1.0 + square * (0.5 + square * (1.0 / 24.0 + square * (1.0 / 720.0 + square / 40320.0))))
    tail = square * (1.0 / 5040.0 + square / 362880.0)
    odd = decay * (1.0 + square * (1.0 / 6.0 + square * (1.0 / 120.0 + tail)))
    return even, odd


@kept(error_model="numpy")
def _phi_pairs(half_trace: float, square: float) -> tuple[float, float, float, float, float, float]:
    """phi_1, phi_2, phi_3 of the 2 x 2 matrix half_trace I + B with B^2 = square I: e_1, o_1, e_2 ... in e I + o B."""
    if square > 0.0625:
        root = math.sqrt(square)
        slow_1, slow_2, slow_3 = _phi(half_trace + root)
        fast_1, fast_2, fast_3 = _phi(half_trace - root)
        odd = 0.5 / root
        return (
            0.5 * (slow_1 + fast_1),
            odd * (slow_1 - fast_1),
            0.5 * (slow_2 + fast_2),
            odd * (slow_2 - fast_2),
            0.5 * (slow_3 + fast_3),
            odd * (slow_3 - fast_3),
        )
    if abs(half_trace) < 0.5 and square > -0.0625:
        # Small matrix: the series of phi_3 by Horner, whatever the eigenvalues are.
        even, odd, coefficient = 0.0, 0.0, 1.0 / 20922789888000.0
        for k in range(16, 2, -1):
            even, odd = coefficient + half_trace * even + square * odd, even + half_trace * odd
            coefficient *= k
        even_2, odd_2 = 0.5 + half_trace * even + square * odd, even + half_trace * odd
        return 1.0 + half_trace * even_2 + square * odd_2, even_2 + half_trace * odd_2, even_2, odd_2, even, odd
    even, odd = exponential(half_trace, square)
    inverse = 1.0 / (half_trace * half_trace - square)
    even -= 1.0
    even_1, odd_1 = inverse * (half_trace * even - square * odd), inverse * (half_trace * odd - even)
    even = even_1 - 1.0
    even_2, odd_2 = inverse * (half_trace * even - square * odd_1), inverse * (half_trace * odd_1 - even)
    even = even_2 - 0.5
    return (
        even_1,
        odd_1,
        even_2,
        odd_2,
        inverse * (half_trace * even - square * odd_2),
        inverse * (half_trace * odd_2 - even),
    )


@kept(error_model="numpy")
def lugre_step(
    v: float,
    w: float,
    middle: tuple[float, float, float, float],
    force: float,
    force_rate: float,
    body: tuple[float, float, float, float],
    h: float,
) -> tuple[float, float, float]:
    """Advance the sliding mass and its bristle over h, exactly for the equations linearised at mid-step.

    m v' = force - sigma_0 w - sigma_1 w' - sigma_2 v and w' = v - rate(v) w (eq. 41) with rate = sigma_0 |v|/g(v),
    linearised in the middle; solved in closed form, so that no bristle stiffness limits the step.
    v: m/s and w: m at the start; middle: v in m/s, w in m, g and v dg/dv in N there; force: at the start in N, growing
    by force_rate in N/s; body: m in kg, sigma_0 in N/m, sigma_1 and sigma_2 in N s/m; h: s.
    Returns v in m/s, w in m and the displacement in m after h seconds.
    Method: exponential Rosenbrock midpoint (second order), with phi functions (Hochbruck & Ostermann 2010).
    """
    v_mid, w_mid, level, fall = middle
    mass, sigma_0, sigma_1, _ = body
    rate = sigma_0 * abs(v_mid) / level
    load = sigma_0 * w_mid / level
    if v_mid < 0.0:
        load = -load
    elif v_mid == 0.0:
        load = 0.0
    # dw'/dv: 1 when sticking, 0 in steady sliding, below 0 where friction falls with speed. The bounds hold back
    # a predictor that is far off and a growth that would last for the whole step; they cost no order.
    lowest = max(-1.0, -0.5 * mass * rate / (h * (sigma_0 + sigma_1 * rate)))
    slope = min(max(1.0 - load * (1.0 - fall / level), lowest), 2.0)
    w_rate = v_mid - rate * w + slope * (v - v_mid)
    return linear_step(v, w, (w_rate, rate, slope), force, force_rate, body, h)


@kept(error_model="numpy", forceinline=True)
def linear_step(
    v: float,
    w: float,
    bristle: tuple[float, float, float],
    force: float,
    force_rate: float,
    body: tuple[float, float, float, float],
    h: float,
) -> tuple[float, float, float]:
    """Advance a mass and its bristle over h, exactly where the bristle's rate is linear in v and w.

    bristle: its rate at the start in m/s, how it falls with w in 1/s and rises with v; the rest as in `lugre_step`.
    Returns v in m/s, w in m and the displacement in m after h seconds. Method: Hochbruck & Ostermann 2010.
    """
    w_rate, rate, slope = bristle
    mass, sigma_0, sigma_1, sigma_2 = body
    per_mass = 1.0 / mass
    v_rate = (force - sigma_0 * w - sigma_1 * w_rate - sigma_2 * v) * per_mass
    jerk = force_rate * per_mass * h
    damping = (sigma_1 * slope + sigma_2) * per_mass * h
    spring = (sigma_0 - sigma_1 * rate) * per_mass * h
    rate *= h
    slope *= h
    difference = 0.5 * (rate - damping)
    even_1, odd_1, even_2, odd_2, even_3, odd_3 = _phi_pairs(
        -0.5 * (damping + rate), difference * difference - spring * slope
    )
    v_turn = difference * v_rate - spring * w_rate
    w_turn = slope * v_rate - difference * w_rate
    v_new = v + h * (even_1 * v_rate + odd_1 * v_turn + (even_2 + odd_2 * difference) * jerk)
    w_new = w + h * (even_1 * w_rate + odd_1 * w_turn + odd_2 * slope * jerk)
    gain = even_2 * v_rate + odd_2 * v_turn + (even_3 + odd_3 * difference) * jerk
    return v_new, w_new, h * (v + h * gain)


@kept(error_model="numpy", forceinline=True)
def glide_weights(sigma_2: float, mass: float, h: float) -> tuple[float, float, float]:
    """phi_1, phi_2, phi_3 (Hochbruck & Ostermann 2010) of the decay by viscous friction, for `gliding_step`;
    dimensionless.

    sigma_2: N s/m; mass: kg; h: s.
    """
    return _phi(-sigma_2 * h / mass)


@kept(error_model="numpy", forceinline=True)
def gliding_step(
    v: float, force: float, rise: float, mass: float, sigma_2: float, h: float, weights: tuple[float, float, float]
) -> tuple[float, float]:
    """Advance a mass on which only viscous friction and outer forces act over h, exactly: m v' = force - sigma_2 v.

    This is LuGre friction far above the Stribeck velocity, once the bristle has come to rest against the sliding
    surface. force: at the start in N without the viscous part, growing by `rise` in N until the end; weights: of the
    step, by `glide_weights`. Returns v in m/s and the displacement in m after h seconds (eq. 40 with w' = 0).
    """
    first, second, third = weights
    v_rate = (force - sigma_2 * v) / mass
    jerk = rise / mass
    return v + h * (first * v_rate + second * jerk), h * (v + h * (second * v_rate + third * jerk))
