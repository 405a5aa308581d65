"""Position-dependent friction: the guideway is tighter in some places than in others."""

from __future__ import annotations

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.effects.shapes import bounded, share_of
from linid.physics.parameter import Parameter

# Places in percent of the stroke; in its middle the factor is one, or it could not be told from the friction itself.
_PLACES = (0, 10, 20, 30, 40, 60, 70, 80, 90, 100)


@term
def friction(
    t, y, v, i_1, i_2, i_3, record, elapsed, s_1, s_2,
    at_0, at_10, at_20, at_30, at_40, at_60, at_70, at_80, at_90, at_100, low, high,
):  # fmt: skip
    """Factor on the whole bristle force: straight lines from place to place."""
    knots = (at_0, at_10, at_20, at_30, at_40, 0.0, at_60, at_70, at_80, at_90, at_100)
    place = 10.0 * min(max(share_of(y, low, high), 0.0), 1.0)
    left = min(int(place), 9)
    part = place - left
    return bounded(1.0 + (1.0 - part) * knots[left] + part * knots[left + 1])


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """The ends of the stroke."""
    return ({"friction_low": outlook.stroke_low, "friction_high": outlook.stroke_high},)


_AMPLITUDES = tuple(
    Parameter(
        f"friction_at_{place}", f"f_{place}", "1", -0.95, 20.0, 0.0,
        meaning=f"at {place} % of the stroke, relative to its middle",
    )
    for place in _PLACES
)  # fmt: skip

EFFECT = Effect(
    name="position_dependent_friction",
    slot="FORCE",
    physics="The bristle force is scaled along the guideway: 1 + f(y), straight lines between eleven places.",
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
