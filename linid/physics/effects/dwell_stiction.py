"""Dwell stiction: friction grows with the logarithm of the time at rest, and is worn off by sliding.

Source: Dieterich 1979, J. Geophys. Res. 84, 2161, and Ruina 1983, J. Geophys. Res. 88, 10359 (aging law).
"""

from __future__ import annotations

import math

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.effects.shapes import bounded
from linid.physics.parameter import Parameter


@term
def level(t, y, v, i_1, i_2, i_3, record, elapsed, s_1, dwell_growth, dwell_length, dwell_time):
    """Factor on sliding and breakaway friction."""
    return bounded(1.0 + dwell_growth * math.log(1.0 + max(s_1, 0.0) / dwell_time))


@term
def initial(t, y, v, i_1, i_2, i_3, record, elapsed, s_1, dwell_growth, dwell_length, dwell_time):
    """Age in s at the start: a sliding contact has the age L/|v|, at most 1 s; a resting one is taken to have rested
    for a second.
    """
    return (min(dwell_length / max(abs(v), 1e-12), 1.0),)


@term
def advance(h, t, y, v, a, i_1, i_2, i_3, record, elapsed, s_1, dwell_growth, dwell_length, dwell_time):
    """Age of the contact in s (aging law): s_1' = 1 - |v| s_1 / L, exact while the speed stays."""
    worn = abs(v) * h / dwell_length
    if worn < 1e-9:
        return (s_1 + h,)
    return (s_1 * math.exp(-worn) - h * math.expm1(-worn) / worn,)


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Sliding lengths from a thousandth of the stroke down, each with a short and a long threshold."""
    return tuple(
        {"dwell_length": share * outlook.stroke, "dwell_time": time} for share in (1e-3, 1e-4) for time in (0.05, 0.5)
    )


EFFECT = Effect(
    name="dwell_stiction",
    slot="FORCE",
    physics="Friction grows with the age T of the contact: g (1 + b log(1 + T/T_0)), T' = 1 - |v| T/L.",
    parameters=(
        Parameter("dwell_growth", "b_d", "1", -0.3, 1.0, 0.0, meaning="growth per e-fold of the time at rest"),
        Parameter("dwell_length", "L_d", "m", 1e-7, 1.0, 1e-4, log=True, meaning="travel that wears the growth off"),
        Parameter("dwell_time", "T_0", "s", 1e-3, 10.0, 0.1, log=True, meaning="time at rest from which it grows"),
    ),
    amplitudes=("dwell_growth",),
    grid=grid,
    level=level,
    initial=initial,
    advance=advance,
    told=True,  # it wears off as the axis goes
    depends_on=(("rest_time", "direction"),),
    exposed_by="breakaways by a slow ramp after rests of different length",
    confused_with=("friction_drift",),
)
