"""What a finished fit warns of."""

from __future__ import annotations

from dataclasses import replace

import pytest

from linid.identification.assemble import little_travel
from tests.simulation.axis_with_effects import AXIS, start_of_run, synchronous_run
from tests.simulation.axis_with_effects import simulate as simulated


@pytest.mark.parametrize(("share", "warned"), [(1.0, False), (0.1, True)])
def test_a_motion_shorter_than_a_pole_pitch_does_not_tell_the_field(share: float, warned: bool) -> None:
    run = synchronous_run()
    path = simulated((), run, start_of_run())
    moved = replace(run, y=path[0] + share * (path - path[0]))
    (*said,) = little_travel([moved], {"electrical_wavenumber": AXIS["electrical_wavenumber"]})
    assert bool(said) == warned
    if warned:
        assert "pole pitches of the fitted field" in said[0]
    free = replace(moved, phase_currents=None)
    assert little_travel([free, moved], {"coulomb_force": 1.0}) == ()  # no field is fitted
    assert little_travel([free], {"electrical_wavenumber": 1.0}) == ()  # and none is driven
