"""Short formulas: those that are true are found with their numbers, and where none is, none is said."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from linid.diagnosis.proposed.arguments import arguments_of
from linid.diagnosis.proposed.dictionary import formulas
from linid.diagnosis.proposed.family import Family
from linid.diagnosis.proposed.history import memory_of
from linid.diagnosis.proposed.leftover import Leftover
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.quantities import number, over, quantity
from linid.diagnosis.proposed.short_formula import likely_formula, ranked_formulas
from linid.diagnosis.proposed.waves import wave_families
from linid.diagnosis.report_data import ShortFormula
from tests.diagnosis.proposed.axis import Force, axis, formula_of, proposal_of


def found(problem: Problem, form: str) -> ShortFormula:
    short = formula_of(problem, proposal_of(problem, form))
    assert short is not None
    return short.said


def numbers(text: str) -> list[float]:
    """All numbers in a text that are no exponents."""
    return [float(part.replace("−", "-")) for part in re.findall(r"(?<![\w√])−?\d+(?:\.\d+)?", text)]


def bell(problem: Problem) -> np.ndarray:
    return np.exp(-0.5 * ((problem.rows.y - 0.35) / 0.02) ** 2)


CASES: list[tuple[str, Force, str, list[float], float]] = [
    ("velocity", lambda p: -2.0 * p.rows.v**3, "N/(m/s)³ · v³", [-2.0], 0.05),
    ("velocity", lambda p: -0.8 * p.rows.v * np.abs(p.rows.v), "N/(m/s)² · v · |v|", [-0.8], 0.05),
    ("speed x motor force", lambda p: -0.1 * np.abs(p.rows.v) * p.push, "per (m/s) · |v| · F", [-0.1], 0.03),
    ("motor_force", lambda p: -3e-4 * p.push**3, "per N² · F³", [-3e-4], 0.05),
    ("force_size x direction", lambda p: 0.2 * np.abs(p.push) * p.friction, "|F| · sign(v)", [-0.2], 0.05),
    ("position x velocity", lambda p: -2.0 * bell(p) * p.rows.v, "exp(−½ ((y − ", [-2.0, 350.0, 20.0], 0.05),
    ("pole_phase", lambda p: 0.6 * np.sin(200.0 * p.rows.y + 0.4), "sin(2π · y/", [0.6, 31.416, 0.4], 0.1),
    ("one direction", lambda p: 0.5 * (p.rows.v > 0.0), "N · [v > 0]", [0.5], 0.05),
]


@pytest.mark.parametrize(("form", "force", "part", "values", "within"), CASES)
def test_a_true_formula_is_found_with_its_numbers(
    form: str, force: Force, part: str, values: list[float], within: float
) -> None:
    short = found(axis(force), form)
    assert part in short.text
    plain = numbers(short.text.replace("2π", ""))
    assert plain[: len(values)] == pytest.approx(values, rel=within)
    assert short.numbers == len(values)
    assert short.closed > 0.9


def test_friction_that_wears_in_after_a_reversal() -> None:
    def force(p: Problem) -> np.ndarray:
        travel = memory_of(p.rows).travel
        return 1.5 * np.where(np.isfinite(travel), np.exp(-travel / 0.02), 0.0) * p.friction

    short = found(axis(force), "travel x direction")
    match = re.fullmatch(r"−([\d.]+) N · exp\(−travel/([\d.]+) mm\) · sign\(v\)", short.text)
    assert match is not None, short.text
    assert float(match[1]) == pytest.approx(1.5, rel=0.1)
    assert float(match[2]) == pytest.approx(20.0, rel=0.1)


def test_a_vibration_above_a_speed() -> None:
    def force(p: Problem) -> np.ndarray:
        return np.sin(2.0 * math.pi * 11.0 * p.rows.t + 0.5) / (1.0 + np.exp(-(np.abs(p.rows.v) - 0.4) / 0.02))

    problem = axis(force)
    waves = wave_families(problem, arguments_of(problem), Leftover(problem).of_rows)
    family = next(one for one in waves if one.arguments == ("time", "velocity") and "phase" in one.form)
    short = formula_of(problem, proposal_of(problem, family))
    assert short is not None
    pattern = r"([\d.]+) N · sin\(2π · ([\d.]+) Hz · t \+ ([\d.]+)\) · \[\|v\| > ([\d.]+) m/s\]"
    match = re.fullmatch(pattern, short.said.text)
    assert match is not None, short.said.text
    assert [float(one) for one in match.groups()] == pytest.approx([1.0, 11.0, 0.5, 0.4], rel=0.05)


def test_a_wave_that_grows_and_turns_with_the_speed() -> None:
    def force(p: Problem) -> np.ndarray:
        speed = np.abs(p.rows.v)
        return 1.2 * (1.0 - np.exp(-speed / 0.15)) * np.sin(400.0 * p.rows.y + 0.4 + 2.0 * math.pi * speed / 0.6)

    problem = axis(force)
    ranked = ranked_formulas(problem, proposal_of(problem, "position x velocity"))
    likely = likely_formula(proposal_of(problem, "position x velocity", 0.1), ranked)
    assert likely is not None
    wave = r"([\d.]+) N · sin\(2π · y/([\d.]+) mm \+ ([\d.]+) \+ 2π · \|v\|/([\d.]+) m/s\)"
    match = re.fullmatch(wave + r" · \(1 − exp\(−\|v\|/([\d.]+) m/s\)\)", likely.said.text)
    assert match is not None, likely.said.text
    numbers_of = [float(one) for one in match.groups()]
    assert numbers_of == pytest.approx([1.2, 2000.0 * math.pi / 400.0, 0.4, 0.6, 0.15], rel=0.1)


def test_no_formula_where_none_is_as_good_as_the_curve() -> None:
    """Heights at a dozen places that no formula of few numbers has."""
    heights = np.random.default_rng(3).uniform(-1.0, 1.0, 12)

    def force(p: Problem) -> np.ndarray:
        return np.interp(p.rows.y, np.linspace(0.0, 0.6, 12), heights)

    problem = axis(force)
    assert formula_of(problem, proposal_of(problem, "position")) is None


def test_no_formula_of_coefficients_of_each_recording() -> None:
    problem = axis(lambda p: p.rows.recording * 0.1 * p.rows.v)
    assert formula_of(problem, proposal_of(problem, "damping per recording")) is None


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.01234, "m", "12.3 mm"),
        (-0.5, "m", "−500 mm"),
        (1.5, "m", "1.5 m"),
        (0.05, "m/s", "50 mm/s"),
        (0.0005, "N", "0.0005 N"),
        (12345.0, "N", "12300 N"),
        (0.0, "m", "0 m"),
        (0.03, "rad", "0.03 rad"),
    ],
)
def test_quantities(value: float, unit: str, text: str) -> None:
    assert quantity(value, unit) == text


def test_numbers_without_needless_zeros() -> None:
    assert [number(x) for x in (2.0, -0.25, 1e-9, 3.5e12)] == ["2", "−0.25", "1e−9", "3.5e12"]


@pytest.mark.parametrize(
    ("unit", "divisor", "power", "text"),
    [
        ("N", "m/s", 3.0, "N/(m/s)³"),
        ("N", "m", 1.0, "N/m"),
        ("N", "N", 1.0, ""),
        ("N", "N", 3.0, "/N²"),
        ("", "m/s", 1.0, "/(m/s)"),
        ("N", "s", 0.5, "N/√s"),
    ],
)
def test_units_of_quotients(unit: str, divisor: str, power: float, text: str) -> None:
    assert over(unit, divisor, power) == text


@pytest.mark.parametrize(
    "names",
    [("time", "velocity"), ("position", "direction"), ("position", "velocity"), ("position", "motor_force"), ("time",)],
)
def test_every_formula_of_a_term_without_waves_has_columns(names: tuple[str, ...]) -> None:
    problem = axis(lambda problem: np.zeros(problem.rows.t.size))
    rows = problem.rows.t.size
    family = Family(names, "smooth", np.empty((rows, 0)), np.empty((0, 0)))
    found = list(formulas(problem, family))
    assert found
    for formula in found:
        theta = formula.starts[0] if len(formula.starts) else np.zeros(0)
        assert formula.columns(theta).shape[0] == rows, formula.name
