"""The default stand, and its campaign generated once per session."""

from __future__ import annotations

from pathlib import Path

import pytest

from linid.stand.description import AxisDescription, load_axis_description
from linid.stand.generate import GeneratedCampaign, generate

REPOSITORY = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def stand() -> AxisDescription:
    return load_axis_description(REPOSITORY / "configs" / "stand_axis.yaml")


@pytest.fixture(scope="session")
def sine_stand() -> AxisDescription:
    return load_axis_description(REPOSITORY / "configs" / "stand_axis_sine.yaml")


@pytest.fixture(scope="session")
def voltage_stand() -> AxisDescription:
    return load_axis_description(REPOSITORY / "configs" / "stand_voltage.yaml")


@pytest.fixture(scope="session")
def campaign(stand: AxisDescription) -> GeneratedCampaign:
    return generate(stand, seed=1)
