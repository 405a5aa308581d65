"""Position-dependent friction: the guideway is tighter in some places than in others."""

from __future__ import annotations

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.effects.shapes import bounded
from linid.physics.parameter import Parameter

_PLACES = tuple(range(1, 12))
_MIDDLE = 6  # where the factor is one, or it could not be told from the friction itself


@term
def friction(
    t,
    y,
    v,
    i_1,
    i_2,
    i_3,
    record,
    elapsed,
    at_1,
    at_2,
    at_3,
    at_4,
    at_5,
    at_7,
    at_8,
    at_9,
    at_10,
    at_11,
    y_1,
    y_2,
    y_3,
    y_4,
    y_5,
    y_6,
    y_7,
    y_8,
    y_9,
    y_10,
    y_11,
):
    """Factor on the whole bristle force: a smooth curve from place to place, constant beyond the outer ones.

    Between two places the cubic that has there the slopes to the next but one (Catmull and Rom 1974).
    """
    knots = (at_1, at_2, at_3, at_4, at_5, 0.0, at_7, at_8, at_9, at_10, at_11)
    places = (y_1, y_2, y_3, y_4, y_5, y_6, y_7, y_8, y_9, y_10, y_11)
    left = 0
    while left < 9 and y > places[left + 1]:
        left += 1
    part = (y - places[left]) / max(places[left + 1] - places[left], 1e-12)
    part = min(max(part, 0.0), 1.0)
    low, high = knots[left], knots[left + 1]
    leaving = 0.5 * (high - knots[max(left - 1, 0)])
    arriving = 0.5 * (knots[min(left + 2, 10)] - low)
    bend = part * (1.0 - part) * ((1.0 - part) * (leaving - high + low) + part * (high - low - arriving))
    return bounded(1.0 + low + part * (high - low) + bend)


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Places that share out evenly where the recordings have been: each has been visited."""
    return ({f"friction_place_{k}": outlook.place(0.1 * (k - 1)) for k in _PLACES},)


_AMPLITUDES = tuple(
    Parameter(
        f"friction_at_{k}",
        f"f_{k}",
        "1",
        -0.95,
        20.0,
        0.0,
        meaning=f"at place {k}, relative to that at place {_MIDDLE}",
    )
    for k in _PLACES
    if k != _MIDDLE
)
_POSITIONS = tuple(
    Parameter(f"friction_place_{k}", f"y_{k}", "m", -1e3, 1e3, 0.1 * (k - 1), meaning=f"position of place {k}")
    for k in _PLACES
)

EFFECT = Effect(
    name="position_dependent_friction",
    slot="FORCE",
    physics="The bristle force is scaled along the guideway: 1 + f(y), a smooth curve through eleven places.",
    parameters=(*_AMPLITUDES, *_POSITIONS),
    amplitudes=tuple(p.name for p in _AMPLITUDES),
    preset=tuple(p.name for p in _POSITIONS),
    grid=grid,
    friction=friction,
    depends_on=(("position", "direction"),),
    exposed_by="slow moves and free wheels over the whole stroke in both directions",
    confused_with=("cable_force", "friction_drift"),
)
