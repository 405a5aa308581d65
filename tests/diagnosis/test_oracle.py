"""What a diagnosis that knew the truth would reach, against closed forms."""

from __future__ import annotations

from dataclasses import replace

import pytest

from linid.diagnosis.oracle import ahead_along
from tests.export.axis import result_of
from tests.simulation.axis_with_effects import AXIS, simulate, start_of_run, synchronous_run


def test_a_constant_force_that_lacks_moves_the_axis_by_half_its_acceleration_times_the_time_squared() -> None:
    recording = synchronous_run()
    force = 2.0  # N
    values = {"constant_force": force}
    y = simulate(("constant_force",), recording, start_of_run(), values=values)
    measured = replace(recording, y=y)
    wanted = 0.5 * force / AXIS["mass"] * 0.1**2
    assert ahead_along(result_of(), [measured]) == pytest.approx(wanted, rel=0.05)
    assert ahead_along(result_of(("constant_force",), values=values), [measured]) < 0.05 * wanted
