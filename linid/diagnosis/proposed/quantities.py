"""Quantities in texts for people: a few digits, with units of a handy size."""

from __future__ import annotations

STRIBECK = "g(v)/F_C"  # the Stribeck curve over Coulomb's force, in formulas for people
_SMALLER = {"m": ("mm", 1e3, 1.0), "m/s": ("mm/s", 1e3, 0.1), "s": ("ms", 1e3, 0.1), "rad": ("rad", 1.0, 0.0)}
_RAISED = {1.0: "", 2.0: "²", 3.0: "³"}


def number(value: float, digits: int = 3) -> str:
    """A number with some significant digits and a minus sign, without needless zeros."""
    text = f"{value:.{digits}g}"
    if "e" in text:
        mantissa, exponent = text.split("e")
        if -5 <= int(exponent) < 6:
            text = f"{float(text):.0f}" if int(exponent) > 0 else f"{value:.{digits - 1 - int(exponent)}f}"
        else:
            text = f"{mantissa}e{int(exponent)}"
    return text.replace("-", "−") if not text.startswith("−") else text


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """An SI value with its unit, in a smaller one where it is small."""
    smaller, factor, below = _SMALLER.get(unit, (unit, 1.0, 0.0))
    if 0.0 < abs(value) < below:
        value, unit = value * factor, smaller
    return f"{number(value, digits)} {unit}".strip()


def over(unit: str, divisor: str, power: float = 1.0) -> str:
    """A unit divided by a power of another one; one that starts with a stroke is one over what follows."""
    if unit and unit == divisor:
        unit, power = "", power - 1.0
    if not divisor or power == 0.0:
        return unit
    compound = "/" in divisor or " " in divisor
    inner = f"({divisor})" if compound else divisor
    if power == 0.5:
        return f"{unit}/√{inner}"
    return f"{unit}/{inner}{_RAISED.get(power, f'^{power:g}')}"
