"""The floor of the force balance: what the sensors' noise makes of it, resting or moving."""

from __future__ import annotations

import numpy as np

from linid.diagnosis.balance import Balance
from linid.diagnosis.base import numbered
from linid.physics.model import Model
from tests.identification.stand import FREE_WHEELS, stand


def test_an_axis_at_rest_is_as_quiet_as_one_that_slides() -> None:
    """Under a force that no friction model holds, a motion without noise would not be seen to rest."""
    campaign = stand(only=FREE_WHEELS)
    recordings = numbered(campaign.recordings)
    balance = Balance(Model("friction"), recordings, 1, 1)
    values = {**campaign.truth, "coulomb_force": 2.0 * campaign.truth["coulomb_force"], "bristle_stiffness": 2e4}
    model = Model("friction")
    own = {p.name: values.get(p.name, p.default) for p in model.parameters}
    noise = balance.noise(model, model.vector(own)).encoder
    rows = balance.rows
    rest = np.bincount(rows.bin, rows.standstill) / np.bincount(rows.bin)
    still, moving = (np.sqrt(np.median(noise[chosen])) for chosen in (rest == 1.0, rest == 0.0))
    assert np.count_nonzero(rest == 1.0) > 20
    assert 0.3 < still / moving < 3.0
