"""Changed commutation offset: the field stands elsewhere than the given model says, as where an encoder was remounted.

Source: linid's own form, a displacement. While currents keep with the field, its thrust differs from that of another
force constant by the ripple of uneven windings only.
"""

from __future__ import annotations

from linid.physics.effects.effect import PHASE_MOTORS, Effect, term
from linid.physics.parameter import Parameter


@term
def field(t, y, v, i_1, i_2, i_3, record, elapsed, field_displacement):
    """Position in m that the field sees."""
    return y + field_displacement


EFFECT = Effect(
    name="commutation_change",
    slot="FORCE",
    physics="The field is displaced as a whole: y + d. Sought beside a given model only.",
    parameters=(Parameter("field_displacement", "d_f", "m", -0.1, 0.1, 0.0, meaning="displacement of the field"),),
    amplitudes=("field_displacement",),
    kinds=PHASE_MOTORS,
    changes="commutation_offset",
    field=field,
    depends_on=(("motor_force",), ("position", "motor_force")),
    exposed_by="the same motion with a reactive current beside the one that pushes",
    confused_with=("force_constant_change", "pole_pitch_error"),
)
