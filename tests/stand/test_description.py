"""Axis descriptions: units in keys, unknown keys refused with their place, periods that nest."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from linid.errors import ConfigError
from linid.stand.description import AxisDescription, load_axis_description


@pytest.fixture
def content(stand: AxisDescription) -> dict[str, Any]:
    return stand.model_dump(mode="json")


def test_a_description_survives_yaml(stand: AxisDescription, content: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "axis.yaml"
    path.write_text(yaml.safe_dump(content))
    assert load_axis_description(path) == stand


@pytest.mark.parametrize(
    ("where", "key", "value", "named"),
    [
        ((), "mas_kg", 1.0, "mas_kg"),
        ((), "mass_kg", 0.0, "mass_kg"),
        (("friction",), "static_force_n", 1.0, "friction"),
        (("friction",), "stribeck_exponent", 3.0, "friction.stribeck_exponent"),
        (("motor",), "nome", 1.0, "motor.nome"),
        (("motor",), "kind", "round", "motor"),
        (("stroke",), "upper_m", -1.0, "stroke"),
        (("drive",), "loop_period_s", 1.5e-5, "loop_period_s"),
        (("measurement",), "sample_period_s", 2.2e-4, "sample_period_s"),
        (("campaign", 0), "speed_mm_per_s", 300, "campaign[1].speed_mm_per_s"),
        (("campaign", 1), "name", "freewheel_1", "freewheel_1"),
        (("campaign", 1), "name", "../escape", "campaign[2].name"),
        (("campaign", 0), "duration_s", float("nan"), "duration_s"),
    ],
)
def test_a_wrong_value_is_refused_and_named(
    content: dict[str, Any], tmp_path: Path, where: tuple[str | int, ...], key: str, value: object, named: str
) -> None:
    part: Any = content
    for step in where:
        part = part[step]
    part[key] = value
    path = tmp_path / "axis.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    with pytest.raises(ConfigError) as caught:
        load_axis_description(path)
    assert caught.value.place.startswith(str(path))
    assert named in str(caught.value)


def test_files_that_cannot_be_read_are_configuration_errors(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"absent\.yaml"):
        load_axis_description(tmp_path / "absent.yaml")
    broken = tmp_path / "broken.yaml"
    for text in ("name: [stand", "- 1\n", ""):
        broken.write_text(text)
        with pytest.raises(ConfigError, match=r"broken\.yaml"):
            load_axis_description(broken)
