"""Quadratic drag: air resistance or the like, which grows faster than the speed.

Source: the drag equation (Rayleigh 1876), its power left free.
"""

from __future__ import annotations

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.parameter import Parameter


@term
def force(t, y, v, i_1, i_2, i_3, record, elapsed, drag_coefficient, power, speed):
    """The drag, N."""
    if v == 0.0:
        return 0.0
    return -drag_coefficient * v * speed * (abs(v) / speed) ** (power - 1.0)


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """A square law; the coefficient is that at half the top speed, whatever the power."""
    return ({"drag_power": 2.0, "drag_speed": 0.5 * outlook.top_speed},)


EFFECT = Effect(
    name="quadratic_drag",
    slot="FORCE",
    physics="A drag -c v v_d |v/v_d|^(p-1) brakes the axis, about quadratic: -c v |v| where p is 2.",
    parameters=(
        Parameter("drag_coefficient", "c_d", "N s^2/m^2", 0.0, 1e3, 0.0, meaning="drag per squared speed, at v_d"),
        Parameter("drag_power", "p", "1", 1.3, 4.0, 2.0, log=True, meaning="power of the speed"),
        Parameter("drag_speed", "v_d", "m/s", 1e-6, 1e6, 1.0, log=True, meaning="half the top speed"),
    ),
    amplitudes=("drag_coefficient",),
    preset=("drag_speed",),
    grid=grid,
    force=force,
    depends_on=(("velocity",),),
    exposed_by="fast free wheels beside slow ones",
    confused_with=("eddy_current_drag", "force_saturation"),
)
