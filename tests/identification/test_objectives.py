"""Which objective with which internal step each recording follows."""

from __future__ import annotations

import pytest

from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.choose import FULL, Look, make_parts
from linid.identification.objectives.free_run import FreeRun
from linid.identification.settings import FitSettings
from linid.physics.model import Model
from tests.identification.stand import stand


@pytest.mark.parametrize(
    ("asked", "look", "expected"),
    [
        (None, FULL, (2, 5)),
        (8, FULL, (8, 8)),  # asked for: also above what predictions of a tenth of a second need
        (1, FULL, (1, 4)),
        (8, Look(coarse=True), (2, 8)),
    ],
)
def test_internal_steps_are_those_asked_for(asked: int | None, look: Look, expected: tuple[int, int]) -> None:
    recordings = stand(only=("freewheel_1", "moves_1")).recordings
    parts = make_parts(Model("sine"), recordings, FitSettings(substeps=asked), asked or 5, look=look)
    (ahead,) = (part for part in parts if isinstance(part, Ahead))
    (free,) = (part for part in parts if isinstance(part, FreeRun))
    assert (ahead.substeps, free.substeps) == expected
