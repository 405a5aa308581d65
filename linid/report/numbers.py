"""Rounding for human readers: a number never shows more digits than its uncertainty supports.

The rule is the Particle Data Group's (Review of Particle Physics, Introduction, "Rounding"): of the three
leading digits of the standard deviation, 100 to 354 keeps two significant digits, 355 to 949 keeps one,
950 to 999 is rounded up to 1000 and keeps two. The value is given to the same decimal place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Context, Decimal
from typing import Literal

from linid.statistics import NORMAL_97_5

Kind = Literal["uncertain", "exact", "magnitude", "bound", "unknown"]

FLOAT_DIGITS = 15  # decimal digits that a double carries faithfully
EXACT_DIGITS = 6  # shown of a number that comes without any uncertainty
_ONE_DIGIT_FROM = 355  # of three leading digits, by the rule above
_SKEW = 1.25  # ratio of the interval's sides above which +- would mislead
_CONTEXT = Context(prec=60, rounding=ROUND_HALF_EVEN)


@dataclass(frozen=True)
class Rounded:
    """A rounded estimate; None where there is nothing to show.

    kind: `uncertain` (value and std), `exact` (fixed, or without uncertainty), `magnitude` (value is only a power
    of ten), `bound` (held at a search bound, no std), `unknown` (not even an order of magnitude).
    skewed: the 95 % interval is clearly not symmetric about the value.
    """

    kind: Kind
    value: Decimal | None = None
    std: Decimal | None = None
    low: Decimal | None = None
    high: Decimal | None = None
    status: str = "fitted"
    skewed: bool = False


def supported_place(std: float) -> int:
    """Power of ten of the last digit that a standard deviation `std` > 0 supports (PDG rule)."""
    exact = Decimal(repr(float(std)))
    exponent = exact.adjusted()
    leading = exact.scaleb(2 - exponent, _CONTEXT)
    return exponent - 1 if leading < _ONE_DIGIT_FROM else exponent


def round_estimate(value: float, std: float, low: float, high: float, status: str = "fitted") -> Rounded:
    """Round an estimate and its 95 % interval to the digits that its uncertainty supports.

    value, std, low, high: in one unit; std nan, infinite or negative means that no uncertainty is known.
    status: `fitted`, `fixed`, `not_identifiable` or `at_bound`. Ends of the interval are no finer than the value,
    but a non-zero value or end keeps at least one digit, as far as its side of the interval excludes zero.
    """
    if not math.isfinite(value):
        return Rounded("unknown", status=status)
    if status == "fixed":
        return Rounded("exact", _digits(value, 12), status=status)
    known = math.isfinite(std) and std >= 0.0
    if status == "not_identifiable" or (not known and status != "at_bound"):
        return _magnitude(value, status)
    if not known:
        return Rounded("bound", _digits(value, 3), status=status)
    if std == 0.0:
        return Rounded("exact", _digits(value, EXACT_DIGITS), status=status)
    place = supported_place(std)
    sides = (value - low, high - value)
    skewed = all(math.isfinite(s) and s > 0 for s in sides) and max(sides) > _SKEW * min(sides)
    sure_sign = low > 0 or high < 0
    return Rounded(
        "uncertain",
        _at_place(value, place, keep_one=sure_sign),
        _at_place(std, place),
        _end(low, value, place),
        _end(high, value, place),
        status,
        skewed,
    )


def estimate_text(rounded: Rounded) -> str:
    """`value ± std` of a rounded estimate, or what stands in its place."""
    if rounded.value is None or rounded.kind == "unknown":
        return "not identifiable"
    if rounded.kind == "magnitude":
        return f"not identifiable, ~{plain(rounded.value)}"
    if rounded.std is None:
        return plain(rounded.value) + _suffix(rounded)
    mantissa, std, exponent = common_exponent(rounded.value, rounded.std)
    text = f"{mantissa} ± {std}"
    return (text if exponent is None else f"({text})e{exponent}") + _suffix(rounded)


def interval_text(rounded: Rounded) -> str:
    """`[low, high]`, empty if there is no interval."""
    if rounded.low is None or rounded.high is None:
        return ""
    return f"[{plain(rounded.low)}, {plain(rounded.high)}]"


def with_interval(value: float, low: float, high: float) -> str:
    """A value with its 95 % interval, both with as many digits as it supports."""
    rounded = round_estimate(value, (high - low) / (2.0 * NORMAL_97_5), low, high)
    return f"{plain(rounded.value)} {interval_text(rounded)}"


def common_exponent(value: Decimal, std: Decimal) -> tuple[str, str, int | None]:
    """Texts of value and std over one power of ten; the exponent is None when plain decimals show them honestly."""
    if _last_place(value) != _last_place(std):
        return plain(value), plain(std), None
    exponent = max((d.adjusted() for d in (value, std) if d), default=0)
    if _fits_fixed(value, exponent) and _fits_fixed(std, exponent):
        return f"{value:f}", f"{std:f}", None
    return f"{value.scaleb(-exponent, _CONTEXT):f}", f"{std.scaleb(-exponent, _CONTEXT):f}", exponent


def plain(number: Decimal | None) -> str:
    """A rounded number as text that `float` reads back; powers of ten instead of padding zeros."""
    if number is None:
        return ""
    if not number.is_finite():
        return "inf" if number > 0 else "-inf"
    exponent = number.adjusted() if number else _last_place(number)
    if _fits_fixed(number, exponent):
        return f"{number:f}"
    return f"{number.scaleb(-exponent, _CONTEXT):f}e{exponent}"


def format_number(value: float, digits: int = 3) -> str:
    """`value` to at most `digits` significant digits, for measures without a stated uncertainty; `nan` for nan."""
    if not math.isfinite(value):
        return "nan" if math.isnan(value) else ("inf" if value > 0 else "-inf")
    number = _digits(value, digits)
    # A measure claims no accuracy, so padding zeros do no harm and 1230 reads better than 1.23e3.
    return f"{number:f}" if number == 0 or -4 < number.adjusted() < 5 else plain(number)


def _suffix(rounded: Rounded) -> str:
    return {"fixed": " (fixed)", "at_bound": " (at bound)"}.get(rounded.status, "")


def _magnitude(value: float, status: str) -> Rounded:
    if value == 0.0:
        return Rounded("unknown", status=status)
    exponent = round(math.log10(abs(value)))
    return Rounded("magnitude", Decimal((int(value < 0), (1,), exponent)), status=status)


def _end(end: float, value: float, place: int) -> Decimal | None:
    if math.isnan(end):
        return None
    if math.isinf(end):
        return Decimal("inf") if end > 0 else Decimal("-inf")
    side = abs(value - end) / NORMAL_97_5  # a wide side supports fewer digits than the value
    if 0 < side < math.inf:
        place = max(place, supported_place(side))
    return _at_place(end, place, keep_one=True)


def _at_place(value: float, place: int, keep_one: bool = False) -> Decimal:
    exact = Decimal(repr(float(value)))
    if value != 0.0:
        place = max(place, exact.adjusted() - FLOAT_DIGITS + 1)
    rounded = exact.quantize(Decimal((0, (1,), place)), context=_CONTEXT)
    if rounded == 0 and value != 0.0 and keep_one:
        rounded = exact.quantize(Decimal((0, (1,), exact.adjusted())), context=_CONTEXT)
    return abs(rounded) if rounded == 0 else rounded  # no minus zero


def _digits(value: float, digits: int) -> Decimal:
    if value == 0.0:
        return Decimal(0)
    number = Decimal(repr(float(value)))
    if len(number.as_tuple().digits) > digits:
        number = number.quantize(Decimal((0, (1,), number.adjusted() - digits + 1)), context=_CONTEXT)
    # A float carries no count of trailing zeros: 2.0 was given as 2.
    number = number.normalize(_CONTEXT)
    return number.quantize(Decimal(1)) if _last_place(number) > 0 and number.adjusted() < min(digits, 6) else number


def _last_place(number: Decimal) -> int:
    exponent = number.as_tuple().exponent
    assert isinstance(exponent, int)
    return exponent


def _fits_fixed(number: Decimal, exponent: int) -> bool:
    return _last_place(number) <= 0 and -5 < exponent < 6
