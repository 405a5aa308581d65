"""The equations as a user would write them for numba: for numbalsoda, and for Runge-Kutta with fixed steps."""

from __future__ import annotations

import math
from functools import cache

from numba import carray, cfunc, njit

_HEAD, _HARMONICS = 16, 12


@njit(cache=True, error_model="numpy")
def rates(t, y, v, w, d):  # type: ignore[no-untyped-def]
    """Acceleration in m/s^2 and bristle rate in m/s; d: `simulators.candidate`, then the currents' splines."""
    ratio = abs(v) / d[2]
    decay = math.exp(-(ratio * ratio)) if d[3] == 2.0 else math.exp(-(ratio ** d[3]))
    level = d[0] + (d[1] - d[0]) * decay
    w_rate = v - d[4] * abs(v) * w / level
    force = 0.0
    intervals = int(d[14])
    if intervals > 0:
        s = t - d[12]
        k = min(max(int(s / d[13]), 0), intervals - 1)
        s -= k * d[13]
        for j in range(3):
            angle = d[8] * y + d[9] * (j - 1) + d[10]
            field = d[_HEAD] * math.sin(angle)
            for h in range(1, int(d[11])):
                field += d[_HEAD + h] * math.sin((2 * h + 1) * angle)
            b = _HEAD + _HARMONICS + 12 * k + 4 * j
            force += field * (d[b] + s * (d[b + 1] + s * (d[b + 2] + s * d[b + 3])))
    return (force - d[4] * w - d[5] * w_rate - d[6] * v) / d[7], w_rate


@njit(cache=True, error_model="numpy")
def runge_kutta(start, t_0, dt, substeps, d, out):  # type: ignore[no-untyped-def]
    """Fill out (n,) with positions in m every dt seconds, `substeps` classical Runge-Kutta steps between two."""
    y, v, w = start[0], start[1], start[2]
    h = dt / substeps
    half = 0.5 * h
    out[0] = y
    for k in range(1, out.size):
        for i in range(substeps):
            t = t_0 + (k - 1) * dt + i * h
            a_1, r_1 = rates(t, y, v, w, d)
            v_2 = v + half * a_1
            a_2, r_2 = rates(t + half, y + half * v, v_2, w + half * r_1, d)
            v_3 = v + half * a_2
            a_3, r_3 = rates(t + half, y + half * v_2, v_3, w + half * r_2, d)
            v_4 = v + h * a_3
            a_4, r_4 = rates(t + h, y + h * v_3, v_4, w + h * r_3, d)
            y += h / 6.0 * (v + 2.0 * v_2 + 2.0 * v_3 + v_4)
            v += h / 6.0 * (a_1 + 2.0 * a_2 + 2.0 * a_3 + a_4)
            w += h / 6.0 * (r_1 + 2.0 * r_2 + 2.0 * r_3 + r_4)
        out[k] = y


@cache
def address() -> int:
    """Address of the right-hand side that numbalsoda calls."""
    from numbalsoda import lsoda_sig

    def right_hand_side(t, u, du, p):  # type: ignore[no-untyped-def]
        d = carray(p, (1_000_000,))
        a, w_rate = rates(t, u[0], u[1], u[2], d)
        du[0] = u[1]
        du[1] = a
        du[2] = w_rate

    return int(cfunc(lsoda_sig)(right_hand_side).address)
