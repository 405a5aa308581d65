"""Quantities in texts for people: a few digits, with units of a handy size."""

from __future__ import annotations

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


def per(unit: str, power: float) -> str:
    """What divides by a power of a unit, as the end of another unit; empty for a number."""
    if not unit or power == 0.0:
        return ""
    inner = f"({unit})" if "/" in unit or " " in unit or power not in _RAISED or power != 1.0 else unit
    if power not in _RAISED:
        return f"/{inner}^{power:g}"
    plain = inner if "/" in unit or " " in unit else unit
    return f"/{plain}{_RAISED[power]}"
