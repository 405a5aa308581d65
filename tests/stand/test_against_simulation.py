"""The stand's exact motion is what the project's own model makes of the exact currents and the truth file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.simulation.reference import simulate_reference
from linid.stand.description import AxisDescription
from linid.stand.generate import GeneratedCampaign, generate
from linid.stand.plant import plant_parameters, stribeck

SAMPLES = 400


def deviation(description: AxisDescription, generated: GeneratedCampaign, name: str) -> float:
    """Largest position difference in m between stand and reference over the first samples."""
    motion = generated.exact[name]
    recording = next(r for r in generated.recordings if r.name == name)
    part = replace(
        recording, t=motion.t[:SAMPLES].copy(), y=motion.y[:SAMPLES].copy(),
        phase_currents=motion.currents[:, :SAMPLES].copy(),
    )  # fmt: skip
    v0 = float(motion.v[0])
    w0 = np.sign(v0) * stribeck(v0, plant_parameters(description)) / description.friction.bristle_stiffness_n_per_m
    y, _ = simulate_reference(
        description.motor.kind, generated.truth, part, (float(motion.y[0]), v0, float(w0)), max_step=1e-3
    )
    assert np.ptp(part.y) > 1e-4
    return float(np.max(np.abs(y - part.y)))


# Driven runs carry the error of a spline through currents sampled at 1 kHz.
@pytest.mark.parametrize(
    ("name", "tolerance"),
    [("freewheel_2", 1e-8), ("freewheel_5", 1e-8), ("slow_ramp_1", 2e-8), ("sine_current_1", 2e-6), ("moves_1", 1e-5)],
)
def test_theta_stand_agrees_with_the_reference(
    stand: AxisDescription, campaign: GeneratedCampaign, name: str, tolerance: float
) -> None:
    assert deviation(stand, campaign, name) < tolerance


def test_sine_stand_agrees_with_the_reference(sine_stand: AxisDescription) -> None:
    generated = generate(sine_stand, seed=1, only=["sine_current_1", "sine_position_1"])
    for name in ("sine_current_1", "sine_position_1"):
        assert deviation(sine_stand, generated, name) < 1e-5
