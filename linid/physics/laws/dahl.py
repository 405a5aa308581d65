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
_NEAR = 1e-7  # of an exponent to 1, 1.5 or 2, where a power becomes a logarithm
_SHORT = 0.05  # of the way in which what is missing goes by 1/e, below which Simpson's rule is exact enough


def _tie(vectors: Array) -> None:
    vectors[:, _STATIC] = vectors[:, _COULOMB]
    # No Stribeck effect: its speed is any, and a low one lets the simulation see soon that it is over.
    vectors[:, _VELOCITY], vectors[:, _EXPONENT], vectors[:, _DAMPING] = 1e-3, 2.0, 0.0


@term
def passed(w: float, travel: float, rest: float, breakaway: float, own: Own) -> tuple[float, float, float]:
    """The deflection in m after a travel in m, its mean, and its mean with a weight that grows from 0 to 1.

    dz/dx = -|z|^i sgn z / rest in closed form, z = 1 - w/(rest sgn x), and its integrals. w, rest: deflection and that
    of steady sliding, in m; breakaway: F_C/sigma_0 in m, which this law does not ask for.
    """
    side = math.copysign(rest, travel)
    z = 1.0 - w / side
    size, way = abs(z), abs(travel) / rest
    if size == 0.0 or way == 0.0:
        return w, w, 0.5 * w
    power = 1.0 - own[0]
    if abs(power) < _NEAR:
        end, middle = size * math.exp(-way), size * math.exp(-0.5 * way)
        first, short = size - end, way < _SHORT
        second = first - way * end
    else:
        for pole in (-0.5, -1.0):
            if abs(power - pole) < _NEAR:
                power = pole + _NEAR
        begun = size**power  # falls by power * way
        left, half = max(begun - power * way, 0.0), begun - 0.5 * power * way
        end = left ** (1.0 / power) if left > 0.0 else 0.0
        short = way * max(1.0, abs(power)) < _SHORT * begun
        middle = half ** (1.0 / power) if short else 0.0
        first = (size * begun - end * left) / (1.0 + power)
        second = (begun * first - (size * begun**2 - end * left**2) / (1.0 + 2.0 * power)) / power
    # Integrals over the way: the first of what is missing, the second of it times the way behind it.
    mean, late = first / way, second / way**2
    if short:
        mean, late = (size + 4.0 * middle + end) / 6.0, (2.0 * middle + end) / 6.0
    missing = side * math.copysign(1.0, z)
    return side - missing * end, side - missing * mean, 0.5 * side - missing * late


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
    passed=passed,
    rate=rate,
)
