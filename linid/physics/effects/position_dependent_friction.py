"""Position-dependent friction: the guideway is tighter in some places than in others."""

from __future__ import annotations

import math

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.effects.shapes import bounded, share_of, sine_pair
from linid.physics.parameter import Parameter


@term
def friction(
    t, y, v, i_1, i_2, i_3, record, elapsed, s_1, s_2, slope, sine_1, cosine_1, sine_2, cosine_2, low, high
):  # fmt: skip
    """Factor on the whole bristle force: a straight line and two sine waves over the stroke."""
    share = share_of(y, low, high)
    angle = 2.0 * math.pi * share
    return bounded(
        1.0
        + slope * (2.0 * share - 1.0)
        + sine_pair(angle, sine_1, cosine_1)
        + sine_pair(2.0 * angle, sine_2, cosine_2)
    )


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """The ends of the stroke."""
    return ({"friction_low": outlook.stroke_low, "friction_high": outlook.stroke_high},)


_AMPLITUDES = (
    Parameter("friction_slope", "f_l", "1", -0.9, 0.9, 0.0, meaning="growth from the middle of the stroke to its end"),
    *(
        Parameter(f"friction_{shape}_{n}", f"f_{shape[0]}{n}", "1", -0.9, 0.9, 0.0, meaning=f"{shape}, {n} per stroke")
        for n in (1, 2)
        for shape in ("sine", "cosine")
    ),
)

EFFECT = Effect(
    name="position_dependent_friction",
    slot="FORCE",
    physics="The bristle force is scaled along the guideway: 1 + a straight line + two sine waves over the stroke.",
    parameters=(
        *_AMPLITUDES,
        Parameter("friction_low", "y_1", "m", -1e3, 1e3, 0.0, meaning="lower end of the stroke"),
        Parameter("friction_high", "y_2", "m", -1e3, 1e3, 1.0, meaning="upper end of the stroke"),
    ),
    amplitudes=tuple(p.name for p in _AMPLITUDES),
    structural=("friction_low", "friction_high"),
    grid=grid,
    friction=friction,
    exposed_by="slow moves and free wheels over the whole stroke in both directions",
    confused_with=("cable_force", "friction_drift"),
)
