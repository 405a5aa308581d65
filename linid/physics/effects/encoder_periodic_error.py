"""Periodic error of the position reading: interpolation of the scale, or its mounting.

Source: Heydemann 1981, Appl. Opt. 20, 3382: offsets of the two signals err once, unequal gains and phases twice per
period.
"""

from __future__ import annotations

import math

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.effects.shapes import sine_pair
from linid.physics.parameter import Parameter


@term
def sensor(
    t,
    y,
    v,
    i_1,
    i_2,
    i_3,
    record,
    elapsed,
    encoder_period,
    encoder_sine_1,
    encoder_cosine_1,
    encoder_sine_2,
    encoder_cosine_2,
):
    """Reading minus position, m."""
    angle = 2.0 * math.pi * y / encoder_period
    return sine_pair(angle, encoder_sine_1, encoder_cosine_1) + sine_pair(2.0 * angle, encoder_sine_2, encoder_cosine_2)


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """The pole pitch and its parts, usual graduations; other periods are sought in the residual."""
    pitch = [2.0 * math.pi / outlook.field_wavenumber] if outlook.field_wavenumber else [2.0 * math.pi]
    usual = [1e-3, 2e-3, 0.5e-3, 4e-3, 0.25e-3, 5e-3, 10e-3]
    periods = [p / n for p in pitch for n in (1, 2, 4, 8, 12)] + usual
    seen = 2.0 * outlook.top_speed * outlook.period  # faster than the sampling can follow at any speed above a tenth
    return tuple({"encoder_period": p} for p in periods if 0.1 * seen < p < outlook.stroke)


def _amplitude(name: str, symbol: str, meaning: str) -> Parameter:
    return Parameter(name, symbol, "m", -1e-3, 1e-3, 0.0, meaning=meaning)


EFFECT = Effect(
    name="encoder_periodic_error",
    slot="SENSOR",
    physics="The position reading errs by sines of the position: the period of the scale and its second harmonic.",
    parameters=(
        Parameter("encoder_period", "p_e", "m", 1e-5, 10.0, 1e-3, log=True, meaning="period of the error", reach=1.02),
        _amplitude("encoder_sine_1", "e_s1", "sine of the first harmonic"),
        _amplitude("encoder_cosine_1", "e_c1", "cosine of the first harmonic"),
        _amplitude("encoder_sine_2", "e_s2", "sine of the second harmonic"),
        _amplitude("encoder_cosine_2", "e_c2", "cosine of the second harmonic"),
    ),
    amplitudes=("encoder_sine_1", "encoder_cosine_1", "encoder_sine_2", "encoder_cosine_2"),
    period="encoder_period",
    grid=grid,
    sensor=sensor,
    # As a force: the error's second derivative, a wave in position that grows with the speed's square.
    depends_on=(("position", "velocity"),),
    exposed_by="free wheels or moves at a steady speed of some periods per 0.1 s",
    confused_with=("cogging", "force_ripple"),
)
