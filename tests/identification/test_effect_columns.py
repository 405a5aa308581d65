"""Columns of effects are those of one candidate alone, however many are asked for at once."""

from __future__ import annotations

import numpy as np
import pytest

from linid.identification.guess.effect_values import _CHUNK, EffectColumns
from linid.identification.objectives.acceleration import Acceleration
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from tests.identification.stand import stand

RECORDINGS = ("sine_position_1", "freewheel_1")


@pytest.mark.parametrize(("name", "shape"), [("cogging", "cogging_wavenumber"), ("encoder_periodic_error", None)])
def test_columns_of_more_than_a_batch(name: str, shape: str | None) -> None:
    campaign = stand()
    recordings = [r for r in campaign.recordings if r.name in RECORDINGS]
    values = {p.name: campaign.truth.get(p.name, p.default) for p in Model("theta").parameters}
    effect = find_effect(name)
    free = shape or next(p.name for p in effect.parameters if p.name not in effect.amplitudes)
    usual = next(p.default for p in effect.parameters if p.name == free)
    entries = [{free: (1.0 + 0.02 * k) * (usual or 1.0)} for k in range(_CHUNK // 2 + 7)]
    sizes = {amplitude: 1.0 + k for k, amplitude in enumerate(effect.amplitudes[:2])}
    found = EffectColumns("theta", values, recordings, 2).of(effect, entries, sizes)
    part = Acceleration(Model("theta", (name,)), recordings, 1, stride=5)
    assert found.shape == (part.rows.size, len(entries) * len(sizes)) and found.shape[1] > _CHUNK
    plain = part.model_acceleration(part.model.vector(values)[None])[0]
    for k in (0, _CHUNK - 1, _CHUNK, found.shape[1] - 1):
        entry, amplitude = entries[k // len(sizes)], list(sizes)[k % len(sizes)]
        step = 0.02 * sizes[amplitude]
        alone = part.model.vector(values | entry | {amplitude: step})[None]
        if set(effect.terms) == {"sensor"}:
            expected = part.reading_acceleration(alone)[0]
        else:
            expected = part.model_acceleration(alone)[0] - plain
        np.testing.assert_array_equal(found[:, k], (expected / step).astype(np.float32))
        assert np.any(expected)
