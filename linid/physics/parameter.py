"""Parameters: name, symbol, unit, search bounds and scale of every quantity that can be identified."""

from __future__ import annotations

from dataclasses import dataclass

# Unit of the same quantity on a rotary axis (m -> rad, N -> N m, kg -> kg m^2).
_ROTARY = {
    "m": "rad",
    "m/s": "rad/s",
    "N": "N m",
    "kg": "kg m^2",
    "N/m": "N m/rad",
    "N s/m": "N m s/rad",
    "N/A": "N m/A",
    "N/V": "N m/V",
    "1/m": "1/rad",
    "N s^2/m^2": "N m s^2/rad^2",
}


@dataclass(frozen=True)
class Parameter:
    """One physical quantity to be identified.

    lower, upper: search bounds in SI units; log: search on a logarithmic scale (positive scale parameters); default:
    value in SI units when it is neither fitted nor given; reach: search only within this factor (without log: this
    distance) of the first value, for what has many local optima, such as a period; 0: the whole range.
    """

    name: str
    symbol: str
    unit: str
    lower: float
    upper: float
    default: float
    log: bool = False
    meaning: str = ""
    reach: float = 0.0

    def unit_on(self, axis: str) -> str:
        """The unit on a `linear` or `rotary` axis."""
        return _ROTARY.get(self.unit, self.unit) if axis == "rotary" else self.unit


def is_force(unit: str) -> bool:
    """Whether a quantity of some unit is a force or a mass per something, and so in proportion to the moving mass."""
    return bool({"N", "kg"} & set(unit.split("/")[0].split()))
