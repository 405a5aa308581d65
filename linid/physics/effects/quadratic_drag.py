"""Quadratic drag: air resistance or the like, which grows faster than the speed."""

from __future__ import annotations

from linid.physics.effects.effect import Effect, term
from linid.physics.parameter import Parameter


@term
def force(t, y, v, i_1, i_2, i_3, record, elapsed, s_1, s_2, drag_coefficient):
    """The drag, N."""
    return -drag_coefficient * v * abs(v)


EFFECT = Effect(
    name="quadratic_drag",
    slot="FORCE",
    physics="A drag -c v |v| brakes the axis.",
    parameters=(Parameter("drag_coefficient", "c_d", "N s^2/m^2", 0.0, 1e3, 0.0, meaning="drag per squared speed"),),
    amplitudes=("drag_coefficient",),
    force=force,
    exposed_by="fast free wheels beside slow ones",
    confused_with=("eddy_current_drag", "force_saturation"),
)
