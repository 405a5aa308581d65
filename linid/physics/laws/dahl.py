"""Dahl's law: one spring-like contact whose force nears the Coulomb force along the travel, whatever the speed.

Source: Dahl 1968.
"""

from __future__ import annotations

import math

from linid.arrays import Array
from linid.physics import friction
from linid.physics.laws.law import Law, Own
from linid.physics.parameter import Parameter
from linid.physics.term import term

_COULOMB, _STATIC, _VELOCITY, _EXPONENT, _, _DAMPING, _, _ = range(len(friction.PARAMETERS))
_OWN = Parameter("dahl_exponent", "i", "1", 0.3, 3.0, 1.0, meaning="how the presliding curve bends: 1 as LuGre's")
_NEAR = 1e-6  # of an exponent to 1, where the closed form is the exponential


def _tie(vectors: Array) -> None:
    vectors[:, _STATIC] = vectors[:, _COULOMB]
    # No Stribeck effect: its speed is any, and a low one lets the simulation see soon that it is over.
    vectors[:, _VELOCITY], vectors[:, _EXPONENT], vectors[:, _DAMPING] = 1e-3, 2.0, 0.0


@term
def moved(w: float, travel: float, rest: float, breakaway: float, own: Own) -> float:
    """The deflection in m after a travel in m: dz/dx = -|z|^i sgn z / rest in closed form, z = 1 - w/(rest sgn x).

    breakaway: F_C/sigma_0 in m, which this law does not ask for.
    """
    if travel == 0.0:
        return w
    exponent = own[0]
    side = math.copysign(rest, travel)
    z = 1.0 - w / side
    size, way = abs(z), abs(travel) / rest
    if abs(exponent - 1.0) < _NEAR:
        size *= math.exp(-way)
    elif size > 0.0:
        power = 1.0 - exponent
        left = size**power - power * way
        size = left ** (1.0 / power) if left > 0.0 else 0.0
    return side * (1.0 - math.copysign(size, z))


@term
def rate(w: float, way: float, rest: float, breakaway: float, own: Own) -> tuple[float, float, float]:
    """dw/dy, its slope by w in 1/m, and by log(rest).

    way: factor -1 or 1, the direction of motion; rest, breakaway: steady deflection and F_C/sigma_0 in m.
    """
    u = way * w / rest
    z = 1.0 - u
    size = max(abs(z), 1e-9)
    value = math.copysign(size ** own[0], z)
    steepness = own[0] * abs(value) / size  # d value / dz
    return value, -steepness * way / rest, steepness * u


LAW = Law(
    name="dahl",
    title="Dahl",
    meaning="a force that nears the Coulomb force along the travel, without Stribeck effect and damping",
    source="Dahl 1968, A solid friction model, Aerospace Corporation TOR-0158(3107-18)-1",
    own=(_OWN,),
    absent=("static_force", "stribeck_velocity", "stribeck_exponent", "bristle_damping"),
    tie=_tie,
    moved=moved,
    rate=rate,
)
