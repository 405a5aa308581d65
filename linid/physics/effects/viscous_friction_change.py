"""Changed viscous friction: more or less of it than the given model says, as with other grease or another temperature.

Source: linid's own form, linear in the speed.
"""

from __future__ import annotations

from linid.physics.effects.effect import Effect, term
from linid.physics.parameter import Parameter


@term
def force(t, y, v, i_1, i_2, i_3, record, elapsed, viscous_change):
    """Viscous friction beyond the model's, N."""
    return -viscous_change * v


EFFECT = Effect(
    name="viscous_friction_change",
    slot="FORCE",
    physics="Viscous friction is another one: -c v beside the model's. Sought beside a given model only.",
    parameters=(Parameter("viscous_change", "c_v", "N s/m", -1e3, 1e3, 0.0, meaning="change of the viscous friction"),),
    amplitudes=("viscous_change",),
    changes="viscous_friction",
    force=force,
    depends_on=(("velocity",),),
    exposed_by="slow and fast moves at constant speed",
    confused_with=("quadratic_drag", "eddy_current_drag", "friction_level_change"),
)
