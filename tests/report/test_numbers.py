"""No number may show more digits than its uncertainty supports."""

from __future__ import annotations

import math
from decimal import Decimal

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from linid.report.numbers import estimate_text, format_number, interval_text, plain, round_estimate, supported_place

NAN, INF = float("nan"), float("inf")
VALUES = st.floats(-1e300, 1e300, allow_nan=False)
STDS = st.floats(1e-300, 1e300, allow_nan=False)


def format_estimate(value: float, std: float, low: float, high: float, status: str = "fitted") -> str:
    """One line: the estimate, or its interval where that is skewed."""
    rounded = round_estimate(value, std, low, high, status)
    if rounded.kind == "uncertain" and rounded.skewed:
        return f"{plain(rounded.value)} {interval_text(rounded)}" + (f" ({status})" if status != "fitted" else "")
    return estimate_text(rounded)


def interval(value: float, std: float) -> tuple[float, float, float, float]:
    return value, std, value - 1.96 * std, value + 1.96 * std


@pytest.mark.parametrize(
    ("value", "std", "text"),
    [
        (0.58834, 0.00212, "0.5883 ± 0.0021"),
        (0.827, 0.119, "0.83 ± 0.12"),  # the PDG's own examples
        (0.827, 0.367, "0.8 ± 0.4"),
        (1.5, 0.0999, "1.50 ± 0.10"),
        (1.5, 0.0949, "1.50 ± 0.09"),
        (12345.0, 210.0, "(1.234 ± 0.021)e4"),
        (1e-7, 3.3e-9, "(1.000 ± 0.033)e-7"),
        (-0.001, 0.1, "0.00 ± 0.10"),
        (-2.0944, 0.00071, "-2.0944 ± 0.0007"),
        (1234567.0, 2.0, "(1.2345670 ± 0.0000020)e6"),
    ],
)
def test_known_roundings(value: float, std: float, text: str) -> None:
    assert format_estimate(*interval(value, std)) == text


@pytest.mark.parametrize(
    ("estimate", "text"),
    [
        ((31234.0, NAN, NAN, NAN, "not_identifiable"), "not identifiable, ~1e4"),
        ((31234.0, 5.0, 31000.0, 32000.0, "not_identifiable"), "not identifiable, ~1e4"),
        ((5.0, INF, -INF, INF, "fitted"), "not identifiable, ~1e1"),
        ((5.0, -1.0, 4.0, 6.0, "fitted"), "not identifiable, ~1e1"),
        ((0.0, NAN, NAN, NAN, "not_identifiable"), "not identifiable"),
        ((NAN, 0.1, 0.0, 1.0, "fitted"), "not identifiable"),
        ((INF, 0.1, 0.0, 1.0, "fixed"), "not identifiable"),
        ((0.1, NAN, NAN, NAN, "fixed"), "0.1 (fixed)"),
        ((2.0, NAN, NAN, NAN, "fixed"), "2 (fixed)"),
        ((250.0, NAN, NAN, NAN, "at_bound"), "250 (at bound)"),
        ((2.0, 0.02, 1.96, 2.04, "at_bound"), "2.000 ± 0.020 (at bound)"),
        ((1 / 3, 0.0, 1 / 3, 1 / 3, "fitted"), "0.333333"),
        ((3e4, 4e4, 3.1e3, 4e5, "fitted"), "3e4 [3e3, 4.0e5]"),
    ],
)
def test_special_cases(estimate: tuple[float, float, float, float, str], text: str) -> None:
    assert format_estimate(*estimate) == text


@given(VALUES, STDS)
def test_value_and_std_end_at_the_supported_digit(value: float, std: float) -> None:
    rounded = round_estimate(*interval(value, std))
    assert rounded.value is not None and rounded.std is not None
    place = supported_place(std)
    for number in (rounded.value, rounded.std):
        exponent = number.as_tuple().exponent
        assert isinstance(exponent, int)
        sure_sign = abs(value) > 1.96 * std
        assert exponent >= place or (sure_sign and len(number.as_tuple().digits) == 1)
    assert len(rounded.std.as_tuple().digits) <= 2
    assert len(rounded.value.as_tuple().digits) <= 16


@given(VALUES, STDS)
def test_rounding_moves_by_at_most_half_a_unit_of_the_last_place(value: float, std: float) -> None:
    rounded = round_estimate(*interval(value, std))
    for number, exact in ((rounded.value, value), (rounded.std, std)):
        assert number is not None
        exponent = number.as_tuple().exponent
        assert isinstance(exponent, int)
        assert abs(number - Decimal(repr(exact))) <= Decimal((0, (5,), exponent - 1))


@given(VALUES, STDS)
def test_plain_text_reads_back_as_the_same_number(value: float, std: float) -> None:
    rounded = round_estimate(*interval(value, std))
    for number in (rounded.value, rounded.std, rounded.low, rounded.high):
        if number is not None:
            assert float(plain(number)) == float(number)
            if number.is_finite() and number != 0:
                # no padding zeros: the text has exactly the significant digits of the rounded number
                digits = plain(number).partition("e")[0].lstrip("-").replace(".", "").lstrip("0")
                assert len(digits) == len(number.as_tuple().digits)


@given(STDS)
def test_std_keeps_its_size(std: float) -> None:
    rounded = round_estimate(*interval(0.0, std)).std
    assert rounded is not None
    assert float(rounded) == pytest.approx(std, rel=0.15)


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6))
def test_interval_ends_are_no_finer_than_the_value(value: float, std: float) -> None:
    assume(abs(value) > 1e-6)
    rounded = round_estimate(*interval(value, std))
    place = supported_place(std)
    for end in (rounded.low, rounded.high):
        assert end is not None
        exponent = end.as_tuple().exponent
        assert isinstance(exponent, int)
        assert exponent >= place or len(end.as_tuple().digits) == 1
    assert rounded.low is not None and rounded.high is not None
    assert rounded.low <= rounded.high


@given(st.floats(), st.floats(), st.floats(), st.floats(), st.sampled_from(["fitted", "fixed", "at_bound"]))
def test_any_floats_give_a_short_text(value: float, std: float, low: float, high: float, status: str) -> None:
    text = format_estimate(value, std, low, high, status)
    assert 0 < len(text) < 100 and "nan" not in text


def test_interval_with_open_ends() -> None:
    assert interval_text(round_estimate(2.0, 0.1, -INF, INF)) == "[-inf, inf]"
    assert interval_text(round_estimate(2.0, 0.1, NAN, 2.2)) == ""
    # an end clipped at a bound just beside the value does not earn extra digits
    assert interval_text(round_estimate(0.5000001, 0.1, 0.5, 0.7)) == "[0.50, 0.70]"


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.52345, "0.523"), (1234.5, "1230"), (12.0, "12"), (0.0, "0"), (1e-9, "1e-9"), (5e6, "5e6"), (100.0, "100")],
)
def test_measures(value: float, text: str) -> None:
    assert format_number(value) == text


def test_measures_that_are_no_numbers() -> None:
    assert [format_number(x) for x in (NAN, INF, -INF)] == ["nan", "inf", "-inf"]


@given(VALUES)
def test_measures_keep_three_digits(value: float) -> None:
    text = format_number(value)
    # subnormal numbers have fewer digits than three
    assert float(text) == pytest.approx(value, rel=5.01e-3, abs=1e-320)
    assert not math.isnan(float(text))
