"""LuGre friction: the steady (Stribeck) curve, the bristle and their parameters (eqs. 40-42, corrected)."""

from __future__ import annotations

import math

from numba import njit

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


@njit(cache=True)
def stribeck(v: float, coulomb: float, static: float, stribeck_velocity: float, exponent: float) -> float:
    """Steady friction level g(v) in N at speed v in m/s (eq. 42 with the sign of the exponent corrected).

    coulomb, static: N; stribeck_velocity: m/s; exponent: alpha, 0.5 to 2.
    """
    ratio = abs(v) / stribeck_velocity
    if exponent == 2.0:
        return coulomb + (static - coulomb) * math.exp(-ratio * ratio)
    return coulomb + (static - coulomb) * math.exp(-(ratio**exponent))


@njit(cache=True)
def lugre_step(
    v: float, w: float, v_mid: float, w_mid: float, level: float, force: float, force_rate: float,
    mass: float, sigma_0: float, sigma_1: float, sigma_2: float, h: float,
) -> tuple[float, float, float]:
    """Advance the sliding mass and its bristle over h, exactly for the equations linearised at mid-step.

    m v' = force - sigma_0 w - sigma_1 w' - sigma_2 v and, with rate = sigma_0 |v_mid|/g(v_mid),
    w' = v_mid - rate w + slope (v - v_mid) (eq. 41 linearised in v), solved in closed form, so that no
    bristle stiffness limits the step. force: at the start in N, growing by force_rate in N/s; level: g(v_mid)
    in N. The slope lies in [0, 1]: 0 when sliding
    (bristle saturated), 1 when sticking; the bounds keep reversals stable and cost no order.
    Returns v in m/s, w in m and the displacement in m after h seconds.
    """
    rate = sigma_0 * abs(v_mid) / level
    load = sigma_0 * w_mid / level
    if v_mid < 0.0:
        load = -load
    elif v_mid == 0.0:
        load = 0.0
    slope = min(max(1.0 - load, 0.0), 1.0)
    drift = (1.0 - slope) * v_mid
    damping = (sigma_1 * slope + sigma_2) / mass
    spring = (sigma_0 - sigma_1 * rate) / mass
    stiffness = rate * sigma_2 + slope * sigma_0
    # The particular solution (v_rest, w_rest) + (v_ramp, w_ramp) t of the linear system.
    v_ramp = rate * force_rate / stiffness
    w_ramp = slope * force_rate / stiffness
    inverse = mass / stiffness
    v_rest = (rate * force - sigma_0 * drift) / stiffness + inverse * (spring * w_ramp - rate * v_ramp)
    w_rest = (slope * force + sigma_2 * drift) / stiffness - inverse * (slope * v_ramp + damping * w_ramp)
    half_trace = -0.5 * (damping + rate)
    half_difference = 0.5 * (rate - damping)
    discriminant = half_difference * half_difference - spring * slope
    if discriminant > 0.0:
        root = math.sqrt(discriminant)
        fast = half_trace - root
        slow = stiffness / (mass * fast)  # half_trace + root would cancel
        exp_slow = math.exp(slow * h)
        exp_fast = math.exp(fast * h)
        even = 0.5 * (exp_slow + exp_fast)
        odd = 0.5 * (exp_slow - exp_fast) / root if root * h > 1e-4 else even * h
    else:
        root = math.sqrt(-discriminant)
        decay = math.exp(half_trace * h)
        even = decay * math.cos(root * h)
        odd = decay * math.sin(root * h) / root if root * h > 1e-4 else decay * h
    delta_v = v - v_rest
    delta_w = w - w_rest
    v_new = v_rest + v_ramp * h + (even + odd * half_difference) * delta_v - odd * spring * delta_w
    w_new = w_rest + w_ramp * h + odd * slope * delta_v + (even - odd * half_difference) * delta_w
    displacement = (v_rest + 0.5 * v_ramp * h) * h + inverse * (
        spring * (w_new - w - w_ramp * h) - rate * (v_new - v - v_ramp * h)
    )
    return v_new, w_new, displacement
