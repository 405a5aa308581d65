"""Pole pitch error: magnets sit further and further from their places, so that the field's phase drifts.

Source: linid's own form, the first Legendre polynomials that change the field.
"""

from __future__ import annotations

from linid.physics.effects.effect import PHASE_MOTORS, Effect, Outlook, Values, term
from linid.physics.effects.shapes import share_of
from linid.physics.parameter import Parameter


@term
def field(t, y, v, i_1, i_2, i_3, record, elapsed, error_2, error_3, low, high):
    """Position in m that the field sees: the Legendre polynomials P_2 and P_3 over the stroke are added.

    A constant and a straight line would belong to the field's phase and to the pole pitch itself.
    """
    x = 2.0 * share_of(y, low, high) - 1.0
    return y + error_2 * (1.5 * x * x - 0.5) + error_3 * (2.5 * x * x - 1.5) * x


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """The ends of the stroke."""
    return ({"pitch_low": outlook.stroke_low, "pitch_high": outlook.stroke_high},)


EFFECT = Effect(
    name="pole_pitch_error",
    slot="FORCE",
    physics="The field is displaced slowly along the stroke: y + e_2 P_2(x) + e_3 P_3(x), x from -1 to 1.",
    parameters=(
        Parameter("pitch_error_2", "e_2", "m", -0.02, 0.02, 0.0, meaning="displacement at both ends (parabola)"),
        Parameter("pitch_error_3", "e_3", "m", -0.02, 0.02, 0.0, meaning="displacement at the ends, opposite (cubic)"),
        Parameter("pitch_low", "y_1", "m", -1e3, 1e3, 0.0, meaning="lower end of the stroke"),
        Parameter("pitch_high", "y_2", "m", -1e3, 1e3, 1.0, meaning="upper end of the stroke"),
    ),
    amplitudes=("pitch_error_2", "pitch_error_3"),
    preset=("pitch_low", "pitch_high"),
    kinds=PHASE_MOTORS,
    grid=grid,
    field=field,
    # A field out of phase: thrust that falls off slowly along the stroke.
    depends_on=(("position", "motor_force"),),
    exposed_by="strong accelerations in the middle and at both ends of the stroke, with reactive current",
    confused_with=("end_effect",),
)
