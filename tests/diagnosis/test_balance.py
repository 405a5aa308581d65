"""The floor of the force balance: what the sensors' noise makes of it, resting or moving."""

from __future__ import annotations

import numpy as np
import pytest

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


MODELS = [
    Model("sine"),
    Model("sine", ("cogging", "cable_force", "encoder_periodic_error")),
    Model("sine", law="maxwell_slip"),
]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("places", [(0, 2, 3), (1,), (0, 1, 2, 3)])
def test_what_is_asked_of_some_recordings_is_what_all_would_say(model: Model, places: tuple[int, ...]) -> None:
    """To the last bit, on any number of threads; the rows of all others are empty."""
    campaign = stand("stand_axis_sine.yaml", only=("freewheel_1", "sine_current_1", "sine_position_1", "moves_1"))
    values = [{p.name: campaign.truth.get(p.name, 0.3 * p.upper) for p in model.parameters}]
    values.append({**values[0], "coulomb_force": 1.1 * values[0]["coulomb_force"]})
    vectors = np.array([model.vector(one) for one in values])
    tangents = vectors[1:] - vectors[:1]
    for jobs in (1, 3):
        balance = Balance(Model("sine"), numbered(campaign.recordings), jobs, 1)
        asked = balance.rows_of(places)
        whole, some = balance.residuals(model, vectors), balance.residuals(model, vectors, places)
        assert np.array_equal(some[:, asked], whole[:, asked]) and not np.any(some[:, ~asked])
        assert np.ptp(whole, axis=0)[asked].max() > 0.0
        if balance.has_slopes(model):
            slopes = balance.slopes(model, vectors[0], tangents, places)
            assert np.array_equal(slopes[:, asked], balance.slopes(model, vectors[0], tangents)[:, asked])
            assert not np.any(slopes[:, ~asked]) and np.any(slopes)


def test_the_noise_is_the_same_under_any_model_asked_before() -> None:
    """Other measurements of the motion are kept from one judge to the next."""
    campaign = stand(only=FREE_WHEELS)
    model, recordings = Model("friction"), numbered(campaign.recordings)
    own = {p.name: campaign.truth.get(p.name, p.default) for p in model.parameters}
    first, second = model.vector(own), model.vector({**own, "coulomb_force": 1.5 * own["coulomb_force"]})
    balance = Balance(model, recordings, 2, 1)
    fresh = Balance(model, recordings, 1, 1)
    with balance.measured_once():
        balance.noise(model, first)
        assert np.array_equal(balance.noise(model, second).encoder, fresh.noise(model, second).encoder)
