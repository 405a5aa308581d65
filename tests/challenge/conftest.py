"""An axis with its campaign, and effects hidden in it, calibrated once per session."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.challenge.axes import draw_axis, scales, tamed
from linid.challenge.catalogue import AxisSizes, HiddenEffect, draw_effect
from linid.stand.description import AxisDescription
from linid.stand.mode_descriptions import Mode


@pytest.fixture(scope="session")
def axis() -> AxisDescription:
    return draw_axis("axis", np.random.default_rng(3))


@pytest.fixture(scope="session")
def calm(axis: AxisDescription) -> AxisDescription:
    """The axis with few recordings, gentle enough to stay in the stroke whatever is hidden."""
    kept = {"freewheel_1", "freewheel_4", "sine_current_1", "sine_position_2", "moves_1", "moves_3"}
    modes = []
    for mode in axis.campaign:
        if mode.name in kept:
            for _ in range(4 if mode.mode == "sine_current" else 0):
                mode = tamed(mode)
            modes.append(mode)
    return axis.model_copy(update={"campaign": tuple(modes)})


@pytest.fixture(scope="session")
def sizes(axis: AxisDescription) -> AxisSizes:
    return scales(axis)


def listed(axis: AxisDescription) -> tuple[tuple[str, str, str], ...]:
    return tuple((m.name, "free_wheel" if m.mode == "free_wheel" else "motor", m.split) for m in axis.campaign)


def effect(name: str, axis: AxisDescription, factor: float = 1.0) -> HiddenEffect:
    """A drawn effect of `factor` times its first, small amplitude."""
    drawn = draw_effect(name, np.random.default_rng(8), scales(axis), listed(axis))
    return HiddenEffect(name, factor * drawn.amplitude, drawn.shape, drawn.recordings)


def mode_of(axis: AxisDescription, name: str) -> Mode:
    return next(mode for mode in axis.campaign if mode.name == name)


def everywhere(hidden: HiddenEffect, axis: AxisDescription) -> HiddenEffect:
    """A per-recording effect put into all recordings."""
    return replace(hidden, recordings=tuple(m.name for m in axis.campaign)) if hidden.recordings else hidden
