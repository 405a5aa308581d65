"""Recordings of small generated stands for the tests of identification."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from linid.stand.description import load_axis_description
from linid.stand.generate import GeneratedCampaign, generate

CONFIGS = Path(__file__).parents[2] / "configs"


@cache
def stand(config: str = "stand_axis.yaml", only: tuple[str, ...] | None = None) -> GeneratedCampaign:
    """The generated campaign of a stand, made once per test run."""
    return generate(load_axis_description(CONFIGS / config), seed=1, only=only)


FREE_WHEELS = ("freewheel_1", "freewheel_2", "freewheel_4", "freewheel_5")
