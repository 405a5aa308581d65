"""Force ripple: harmonics of the field (5th, 7th ...) let the thrust per current vary within the pole pitch.

Source: Jahns and Soong 1996, IEEE Trans. Ind. Electron. 43, 321.
"""

from __future__ import annotations

from linid.physics.effects.effect import MOTORS, Effect, Outlook, Values, term
from linid.physics.effects.shapes import bounded, sine_pair, wavenumbers
from linid.physics.parameter import Parameter


@term
def thrust(t, y, v, i_1, i_2, i_3, record, elapsed, ripple_wavenumber, sine_6, cosine_6, sine_12, cosine_12):
    """Factor on the thrust: 5th and 7th harmonic give the order 6, 11th and 13th the order 12."""
    angle = 6.0 * ripple_wavenumber * y
    return bounded(1.0 + sine_pair(angle, sine_6, cosine_6) + sine_pair(2.0 * angle, sine_12, cosine_12))


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """The field's wavenumber; without a phase motor all that the stroke can tell apart."""
    if outlook.field_wavenumber is not None:
        return ({"ripple_wavenumber": outlook.field_wavenumber},)
    values = wavenumbers("ripple_wavenumber", outlook, outlook.stroke, outlook.stroke / 60.0, 250)
    return tuple({"ripple_wavenumber": value["ripple_wavenumber"] / 6.0} for value in values)


_AMPLITUDES = tuple(
    Parameter(f"ripple_{shape}_{n}", f"r_{shape[0]}{n}", "1", -0.9, 0.9, 0.0, meaning=f"{shape} of {n} times the angle")
    for n in (6, 12)
    for shape in ("sine", "cosine")
)

EFFECT = Effect(
    name="force_ripple",
    slot="FORCE",
    physics="Thrust per current varies with position: factor 1 + sines of 6 and 12 times the field's angle.",
    parameters=(
        Parameter(
            "ripple_wavenumber",
            "k_r",
            "1/m",
            1e-2,
            1e4,
            200.0,
            log=True,
            meaning="the field's angle per travel: pi / pole pitch",
            reach=1.02,
        ),
        *_AMPLITUDES,
    ),
    amplitudes=tuple(p.name for p in _AMPLITUDES),
    kinds=MOTORS,
    grid=grid,
    thrust=thrust,
    # The commutation keeps the current's amplitude with the force: both are one argument.
    depends_on=(("position", "motor_force"),),
    exposed_by="strong accelerations over several pole pitches, in both directions",
    confused_with=("cogging", "phase_gain_imbalance", "encoder_periodic_error"),
)
