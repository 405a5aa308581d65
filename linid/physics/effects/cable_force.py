"""Cable force: the cable chain pulls like a spring over the stroke, with hysteresis and a preload.

Source of the hysteresis: Dahl 1976, AIAA J. 14, 1675, with exponent 1; the spring is a straight line.
"""

from __future__ import annotations

import math

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.parameter import Parameter


@term
def force(t, y, v, i_1, i_2, i_3, record, elapsed, s_1, preload, stiffness, hysteresis, length, middle):
    """Preload, spring and hysteresis, N."""
    return preload - stiffness * (y - middle) - hysteresis * s_1


@term
def initial(t, y, v, i_1, i_2, i_3, record, elapsed, s_1, preload, stiffness, hysteresis, length, middle):
    """The state at the start (dimensionless, -1 to 1): a moving chain has been moving for a while, a resting one is
    relaxed.
    """
    return ((0.0 if v == 0.0 else math.copysign(1.0, v)),)


@term
def advance(h, t, y, v, a, i_1, i_2, i_3, record, elapsed, s_1, preload, stiffness, hysteresis, length, middle):
    """Hysteresis s_1' = (v - |v| s_1) / L, s_1 dimensionless; exact in the travel."""
    travel = v * h
    end = math.copysign(1.0, travel)
    return (end + (s_1 - end) * math.exp(-abs(travel) / length),)


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Lengths of the hysteresis from a fiftieth of the stroke up; the middle of the stroke."""
    middle = 0.5 * (outlook.stroke_low + outlook.stroke_high)
    return tuple(
        {"cable_hysteresis_length": share * outlook.stroke, "cable_middle": middle} for share in (0.05, 0.02, 0.15)
    )


EFFECT = Effect(
    name="cable_force",
    slot="FORCE",
    physics="The cable chain pulls with F_p - k (y - y_m) - F_h z, z' = (v - |v| z)/L: spring with hysteresis.",
    parameters=(
        Parameter("cable_preload", "F_p", "N", -200.0, 200.0, 0.0, meaning="force in the middle of the stroke"),
        Parameter("cable_stiffness", "k_p", "N/m", -1e3, 1e3, 0.0, meaning="fall of the force over the stroke"),
        Parameter("cable_hysteresis", "F_h", "N", -200.0, 200.0, 0.0, meaning="half the width of the hysteresis"),
        Parameter("cable_hysteresis_length", "L_h", "m", 1e-4, 10.0, 0.02, log=True, meaning="travel to turn it round"),
        Parameter("cable_middle", "y_m", "m", -1e3, 1e3, 0.0, meaning="middle of the stroke"),
    ),
    amplitudes=("cable_preload", "cable_stiffness", "cable_hysteresis"),
    preset=("cable_middle",),
    grid=grid,
    force=force,
    initial=initial,
    advance=advance,
    told=True,  # some hysteresis lengths on, the travel alone decides it
    # A spring over the stroke; its hysteresis shows after reversals, or as a direction.
    depends_on=(("position",), ("position", "direction"), ("travel", "position")),
    exposed_by="slow moves and free wheels over the whole stroke, with reversals at several places",
    confused_with=("constant_force", "position_dependent_friction"),
    includes=("constant_force",),
)
