"""The force balance at true parameters of an independent plant leaves its noise and nothing else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from linid.api import read
from linid.challenge.files import CAMPAIGN_FILE, key_of, write_hidden_campaign
from linid.challenge.hidden_axis import AXES, AxisKind
from linid.challenge.make import Plan, make_campaign
from linid.diagnosis.balance import Balance
from linid.diagnosis.base import numbered
from linid.physics.model import Model


@pytest.mark.parametrize("kind", AXES)
def test_true_parameters_reach_the_noise_floor_in_every_recording(kind: AxisKind, tmp_path: Path) -> None:
    """Stops, breakaways, reversals and current steps included: what is left there would look like an effect."""
    hidden = make_campaign(Plan(21, kinds=("none",), axes=(kind,)), 0)
    write_hidden_campaign(hidden, tmp_path)
    recordings = numbered(read(tmp_path / hidden.name / CAMPAIGN_FILE).recordings)
    key = key_of(hidden)
    model = Model(key.motor)
    vector = model.vector(key.base)
    balance = Balance(model, recordings, 2, 1)
    residual, noise = balance.residual(model, vector), balance.noise(model, vector).deviation(balance.rows)
    owner = balance.rows.recording
    ratios = np.bincount(owner, residual**2) / np.bincount(owner) / noise**2
    named = {r.name: round(float(ratio), 2) for r, ratio in zip(recordings, ratios, strict=True)}
    assert 0.8 < float(np.median(ratios)) < 1.2, named
    assert float(np.max(ratios)) < 1.8, named
