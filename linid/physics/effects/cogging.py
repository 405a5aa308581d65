"""Cogging: the magnets pull at iron teeth and ends, a force that repeats with the pole pitch without any current."""

from __future__ import annotations

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.effects.shapes import sine_pair, wavenumbers
from linid.physics.parameter import Parameter


@term
def force(
    t, y, v, i_1, i_2, i_3, record, elapsed, s_1, s_2,
    cogging_wavenumber, sine_1, cosine_1, sine_2, cosine_2, sine_4, cosine_4, sine_6, cosine_6,
):  # fmt: skip
    """Sum over the orders 1, 2, 4 and 6 of the field's angle, N."""
    angle = cogging_wavenumber * y
    return (
        sine_pair(angle, sine_1, cosine_1)
        + sine_pair(2.0 * angle, sine_2, cosine_2)
        + sine_pair(4.0 * angle, sine_4, cosine_4)
        + sine_pair(6.0 * angle, sine_6, cosine_6)
    )


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """The field's wavenumber; without a phase motor all that the stroke can tell apart."""
    if outlook.field_wavenumber is not None:
        return ({"cogging_wavenumber": outlook.field_wavenumber},)
    return wavenumbers("cogging_wavenumber", outlook, outlook.stroke, outlook.stroke / 60.0, 250)


ORDERS = (1, 2, 4, 6)
_AMPLITUDES = tuple(
    Parameter(
        f"cogging_{shape}_{n}", f"C_{shape[0]}{n}", "N", -500.0, 500.0, 0.0, meaning=f"{shape} of {n} times the angle"
    )
    for n in ORDERS
    for shape in ("sine", "cosine")
)

EFFECT = Effect(
    name="cogging",
    slot="FORCE",
    physics="A force periodic in position acts without current: sines of 1, 2, 4 and 6 times the field's angle.",
    parameters=(
        Parameter(
            "cogging_wavenumber", "k_c", "1/m", 1e-2, 1e4, 200.0, log=True,
            meaning="angle per travel of the lowest order: pi / pole pitch", reach=1.02,
        ),
        *_AMPLITUDES,
    ),
    amplitudes=tuple(p.name for p in _AMPLITUDES),
    grid=grid,
    force=force,
    exposed_by="slow free wheels, or slow steady moves over several pole pitches",
    confused_with=("current_offset", "force_ripple", "encoder_periodic_error"),
)  # fmt: skip
