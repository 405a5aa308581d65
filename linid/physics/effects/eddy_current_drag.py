"""Eddy-current drag: braking by currents induced in moving iron or aluminium, strongest at a critical speed.

Source: Wouterse 1991, IEE Proc. B 138, 153 (drag over speed with a critical speed).
"""

from __future__ import annotations

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.parameter import Parameter


@term
def force(t, y, v, i_1, i_2, i_3, record, elapsed, eddy_damping, eddy_speed):
    """The drag, N."""
    ratio = v / eddy_speed
    return -eddy_damping * v / (1.0 + ratio * ratio)


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Critical speeds within the speeds driven; above them the drag is viscous friction."""
    return tuple({"eddy_speed": share * outlook.top_speed} for share in (0.5, 0.25, 1.0, 0.12))


EFFECT = Effect(
    name="eddy_current_drag",
    slot="FORCE",
    physics="Induced currents brake with -c v / (1 + (v/v_c)^2): most at the critical speed v_c.",
    parameters=(
        Parameter("eddy_damping", "c_e", "N s/m", 0.0, 1e3, 0.0, meaning="drag per speed at low speed"),
        Parameter("eddy_speed", "v_c", "m/s", 1e-2, 1e3, 1.0, log=True, meaning="speed of the largest drag"),
    ),
    amplitudes=("eddy_damping",),
    grid=grid,
    force=force,
    depends_on=(("velocity",),),
    exposed_by="free wheels from the highest speed down to standstill",
    confused_with=("quadratic_drag",),
)
