"""Thermal derating: the winding's losses heat the motor, and thrust per ampere falls.

Source: linid's own form: one heat capacity, one thermal resistance.
"""

from __future__ import annotations

import math

from linid.physics.effects.effect import MOTORS, Effect, Outlook, Values, term
from linid.physics.effects.shapes import bounded
from linid.physics.parameter import Parameter


@term
def thrust(t, y, v, i_1, i_2, i_3, record, elapsed, s_1, derating, thermal_time):
    """Factor on the thrust: magnets and winding lose in proportion, whatever the current."""
    return 1.0 / bounded(1.0 + derating * s_1)


@term
def advance(h, t, y, v, a, i_1, i_2, i_3, record, elapsed, s_1, derating, thermal_time):
    """Heat s_1 in A^2: s_1' = (I_1^2 + I_2^2 + I_3^2 - s_1) / tau, exact for constant currents."""
    losses = i_1 * i_1 + i_2 * i_2 + i_3 * i_3
    return (losses + (s_1 - losses) * math.exp(-h / thermal_time),)


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Time constants around the length of a recording; a longer one only looks like its own start."""
    longest = max(outlook.durations)
    return tuple({"thermal_time": share * longest} for share in (1.0, 0.3, 0.1, 3.0))


EFFECT = Effect(
    name="thermal_derating",
    slot="DRIVE",
    physics="Thrust falls with the heat T of the winding: F = F_motor / (1 + c T), T' = (sum I^2 - T) / tau.",
    parameters=(
        Parameter("derating", "c", "1/A^2", -1.0, 10.0, 0.0, meaning="loss of thrust per steady squared current"),
        Parameter("thermal_time", "tau", "s", 0.02, 1e3, 1.0, log=True, meaning="thermal time constant"),
    ),
    amplitudes=("derating",),
    kinds=MOTORS,
    grid=grid,
    thrust=thrust,
    advance=advance,
    told=True,  # the inputs alone decide it
    # Heat: a running time, of the recording with a fast part and of the campaign with a slow one.
    depends_on=(("motor_force", "campaign_time"), ("motor_force", "time"), ("motor_force", "recording")),
    exposed_by="the same moves again and again without a pause, after one that starts cold",
    confused_with=("force_saturation", "friction_drift"),
)
