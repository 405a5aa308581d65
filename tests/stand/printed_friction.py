"""LuGre friction as the equations are printed, for integrators that share no code with the stand."""

from __future__ import annotations

import math

from linid.physics.described import Friction


def printed_friction(friction: Friction, v: float, w: float) -> tuple[float, float]:
    """The bristles' rate in m/s and the force against the motion in N (eqs. 40 to 42, alpha = 2).

    v: m/s; w: m.
    """
    g = friction.coulomb_force_n + (friction.static_force_n - friction.coulomb_force_n) * math.exp(
        -((v / friction.stribeck_velocity_m_per_s) ** 2)
    )
    w_rate = v - friction.bristle_stiffness_n_per_m * abs(v) * w / g
    resist = (
        friction.bristle_stiffness_n_per_m * w
        + friction.bristle_damping_n_s_per_m * w_rate
        + friction.viscous_friction_n_s_per_m * v
    )
    return w_rate, resist
