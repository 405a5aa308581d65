"""Cogging: the magnets pull at iron teeth and ends, a force that repeats along the way without any current.

Source: Jahns and Soong 1996, IEEE Trans. Ind. Electron. 43, 321; here as a Fourier series.
"""

from __future__ import annotations

import math

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.effects.shapes import sine_pair
from linid.physics.motors.harmonics import sine_cosine
from linid.physics.parameter import Parameter


@term
def force(
    t,
    y,
    v,
    i_1,
    i_2,
    i_3,
    record,
    elapsed,
    cogging_wavenumber,
    order_1,
    order_2,
    order_3,
    order_4,
    order_5,
    order_6,
    order_7,
    order_8,
    sine_1,
    cosine_1,
    sine_2,
    cosine_2,
    sine_3,
    cosine_3,
    sine_4,
    cosine_4,
    sine_5,
    cosine_5,
    sine_6,
    cosine_6,
    sine_7,
    cosine_7,
    sine_8,
    cosine_8,
):
    """Sum over eight orders of the angle, N."""
    angle = cogging_wavenumber * y
    if order_1 == 1.0 and order_2 == 2.0 and order_3 == 4.0 and order_4 == 6.0:  # of the field: by angle addition
        s, c = sine_cosine(angle)
        s_2, c_2 = 2.0 * s * c, 1.0 - 2.0 * s * s
        s_4, c_4 = 2.0 * s_2 * c_2, 1.0 - 2.0 * s_2 * s_2
        s_6, c_6 = s_4 * c_2 + c_4 * s_2, c_4 * c_2 - s_4 * s_2
        first = sine_1 * s + cosine_1 * c + sine_2 * s_2 + cosine_2 * c_2
        total = first + sine_3 * s_4 + cosine_3 * c_4 + sine_4 * s_6 + cosine_4 * c_6
    else:
        total = (
            sine_pair(order_1 * angle, sine_1, cosine_1)
            + sine_pair(order_2 * angle, sine_2, cosine_2)
            + sine_pair(order_3 * angle, sine_3, cosine_3)
            + sine_pair(order_4 * angle, sine_4, cosine_4)
        )
    if sine_5 != 0.0 or cosine_5 != 0.0 or sine_6 != 0.0 or cosine_6 != 0.0:
        total += sine_pair(order_5 * angle, sine_5, cosine_5) + sine_pair(order_6 * angle, sine_6, cosine_6)
    if sine_7 != 0.0 or cosine_7 != 0.0 or sine_8 != 0.0 or cosine_8 != 0.0:
        total += sine_pair(order_7 * angle, sine_7, cosine_7) + sine_pair(order_8 * angle, sine_8, cosine_8)
    return total


# With three phase currents: orders of the field's angle, which poles, teeth and ends cause.
_FIELD_ORDERS = (1, 2, 4, 6)
_MOST, _HIGHEST = 300, 2000  # candidate orders where nothing is known of the poles
_ORDERS = tuple(
    Parameter(
        f"cogging_order_{k}",
        f"n_{k}",
        "1",
        0.0,
        float(_HIGHEST),
        float(order),
        meaning=f"waves of part {k} per wave of wavenumber k_c",
    )
    for k, order in enumerate((*_FIELD_ORDERS, 3, 5, 8, 12), 1)
)
_AMPLITUDES = tuple(
    Parameter(f"cogging_{shape}_{k}", f"C_{shape[0]}{k}", "N", -500.0, 500.0, 0.0, meaning=f"{shape} of order {k}")
    for k in range(1, len(_ORDERS) + 1)
    for shape in ("sine", "cosine")
)


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """The field's angle; without a phase motor every order of the first part that stroke or revolution tells apart."""
    if outlook.field_wavenumber is not None:
        return ({"cogging_wavenumber": outlook.field_wavenumber, **{p.name: p.default for p in _ORDERS[:4]}},)
    step = 0.5 * math.pi / max(outlook.stroke, 1e-9)
    if outlook.axis == "rotary":
        # Whole waves per revolution, but one: that is gravity. At least about one wave in the stroke.
        apart, first = max(int(step), 1), max(int(4.0 * step), 2)
        orders = range(first, _HIGHEST + 1, apart)[:_MOST]
        return tuple({"cogging_wavenumber": 1.0, "cogging_order_1": float(order)} for order in orders)
    return tuple({"cogging_wavenumber": step, "cogging_order_1": float(4 + k)} for k in range(_MOST))


EFFECT = Effect(
    name="cogging",
    slot="FORCE",
    physics="A force periodic in position acts without current: waves of the field's angle, else the strongest orders.",
    parameters=(
        Parameter(
            "cogging_wavenumber",
            "k_c",
            "1/m",
            1e-2,
            1e4,
            200.0,
            log=True,
            meaning="angle per travel of order 1: pi / pole pitch, or 1 per radian",
            reach=1.02,
        ),
        *_ORDERS,
        *_AMPLITUDES,
    ),
    amplitudes=tuple(p.name for p in _AMPLITUDES),
    preset=tuple(p.name for p in _ORDERS),
    single_only=tuple(p.name for p in (*_ORDERS, *_AMPLITUDES) if p.name[-1] in "5678"),
    orders=tuple(p.name for p in _ORDERS),
    grid=grid,
    force=force,
    depends_on=(("position",),),
    exposed_by="slow free wheels, or slow steady moves over several pole pitches",
    confused_with=("current_offset", "force_ripple", "encoder_periodic_error"),
)
