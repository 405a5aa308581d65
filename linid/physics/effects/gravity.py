"""Gravity: on a rotary axis the weight of an eccentric mass turns with the angle.

Source: Newton's law, the moment of a weight on a lever.
"""

from __future__ import annotations

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.effects.shapes import sine_pair
from linid.physics.parameter import Parameter


@term
def force(t, y, v, i_1, i_2, i_3, record, elapsed, gravity_sine, gravity_cosine):
    """The weight's moment in N m, y in rad: one wave per revolution."""
    return sine_pair(y, gravity_sine, gravity_cosine)


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Rotary axes only: on a linear one, gravity is a constant force."""
    return ({},) if outlook.axis == "rotary" else ()


EFFECT = Effect(
    name="gravity",
    slot="FORCE",
    physics="A rotary axis lifts an eccentric mass: g_s sin y + g_c cos y (an inclined linear axis: `constant_force`).",
    parameters=(
        Parameter("gravity_sine", "g_s", "N", -500.0, 500.0, 0.0, meaning="moment at a quarter turn"),
        Parameter("gravity_cosine", "g_c", "N", -500.0, 500.0, 0.0, meaning="moment at angle 0"),
    ),
    amplitudes=("gravity_sine", "gravity_cosine"),
    grid=grid,
    force=force,
    depends_on=(("position",),),
    exposed_by="slow turns in both directions, or a swing to rest without current",
    confused_with=("constant_force", "cable_force", "cogging"),
)
