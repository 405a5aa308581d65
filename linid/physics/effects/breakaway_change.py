"""Changed breakaway force: the axis sticks more or less at rest than the given model says, sliding as before.

Source: linid's own form, added to the static force of LuGre's Stribeck curve.
"""

from __future__ import annotations

from linid.physics.effects.effect import Effect, term
from linid.physics.parameter import Parameter


@term
def static(static_change):
    """Static force beyond the model's, N."""
    return static_change


EFFECT = Effect(
    name="breakaway_change",
    slot="FORCE",
    physics="The static force is another one: F_S + c, at least F_C. Sought beside a given model only.",
    parameters=(Parameter("static_change", "c_S", "N", -1e3, 1e3, 0.0, meaning="change of the static force"),),
    amplitudes=("static_change",),
    static=static,
    changes="static_force",
    depends_on=(("velocity", "direction"), ("velocity",)),
    exposed_by="slow reversals, and ramps of force from rest until the axis breaks away",
    confused_with=("friction_level_change", "dwell_stiction", "viscous_friction_change"),
)
