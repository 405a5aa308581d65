"""Units and channel names."""

from __future__ import annotations

import math

import pytest

from linid.errors import DataError
from linid.recording.names import candidates, is_time, normalised, split_header
from linid.recording.units import find_unit, unit_of


@pytest.mark.parametrize(
    ("text", "factor", "si"),
    [
        ("ms", 1e-3, "s"),
        ("µs", 1e-6, "s"),
        ("min", 60.0, "s"),
        ("μm", 1e-6, "m"),
        ("um", 1e-6, "m"),
        ("in", 0.0254, "m"),
        ("mm/s", 1e-3, "m/s"),
        ("rpm", math.pi / 30, "rad/s"),
        ("°", math.pi / 180, "rad"),
        ("rev", 2 * math.pi, "rad"),
        ("deg/s", math.pi / 180, "rad/s"),
        ("mA", 1e-3, "A"),
        ("kA", 1e3, "A"),
        ("mV", 1e-3, "V"),
        ("kV", 1e3, "V"),
        ("nm", 1e-9, "m"),
        ("Nm", 1.0, "N m"),
        ("Degrees", math.pi / 180, "rad"),
    ],
)
def test_factors(text: str, factor: float, si: str) -> None:
    unit = find_unit(text)
    assert unit is not None and unit.factor == pytest.approx(factor, rel=1e-15) and unit.si == si


@pytest.mark.parametrize("text", ["MA", "MM", "S", "a", "furlong", "", "KA"])
def test_unknown_or_wrongly_written(text: str) -> None:
    assert find_unit(text) is None


def test_errors_suggest() -> None:
    with pytest.raises(DataError, match="Did you mean mm"):
        unit_of("MM", "file, column 'x'", ("length",))
    with pytest.raises(DataError, match="is a current, expected a length"):
        unit_of("A", "file, column 'x'", ("length",))


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("Actual Position (mm)", "Actual Position", "mm"),
        ("Iq [A]", "Iq", "A"),
        ("Weg / mm", "Weg", "mm"),
        ("Speed (mm/s)", "Speed", "mm/s"),
        ("Pos, um", "Pos", "um"),
        ("Pos in mm", "Pos", "mm"),
        ("pos_mm", "pos", "mm"),
        ("time_s", "time", "s"),
        ("I_A", "I_A", None),
        ("q_m", "q_m", None),
        ("Position (actual) [mm]", "Position (actual)", "mm"),
        ("Position (furlong)", "Position", "furlong"),
        ("Axis (1)", "Axis (1)", None),
        ("# t [s]", "t", "s"),
        ("Current/A", "Current", "A"),
        ("Winkel (°)", "Winkel", "°"),
    ],
)
def test_header_cells(header: str, name: str, unit: str | None) -> None:
    assert split_header(header) == (name, unit)


@pytest.mark.parametrize(
    ("name", "words"),
    [("ActPos", "act pos"), ("I_q", "i q"), ("Q-Current", "q current"), ("Axis 1.ActPos", "axis 1 act pos")],
)
def test_normalised(name: str, words: str) -> None:
    assert normalised(name) == words


def test_time_names() -> None:
    assert all(map(is_time, ["Time", "t", "Zeit", "TIMESTAMP", "X-Axis", "Time 2", "time_ms"]))
    assert not any(map(is_time, ["Settling time limit", "Torque", "T", "Tension", "timeout"]))


def test_demands_are_no_measurements() -> None:
    names = [
        "Position Command",
        "Position Error",
        "Actual Position",
        "SetPos",
        "TargetPosition",
        "Speed",
        "Command Speed",
    ]
    found = candidates(names)
    assert found["position"] == [2] and found["velocity"] == [5]


def test_phase_currents() -> None:
    found = candidates(["Current U", "Current V", "Current W", "Current Q", "Current Command"])
    assert [found["current_u"], found["current_v"], found["current_w"], found["current_q"]] == [[0], [1], [2], [3]]
    assert found["command"] == [4]
    two_sets = candidates(["Iu", "Iv", "Ia", "Ib"])
    assert two_sets["current_u"] == [0, 2]
    assert candidates(["Motor Current 1"])["current_u"] == []
