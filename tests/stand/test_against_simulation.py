"""The stand's exact motion is what the project's own model makes of the exact currents and the truth file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.simulation.reference import simulate_reference
from linid.stand.description import AxisDescription
from linid.stand.generate import GeneratedCampaign, generate
from linid.stand.plant import plant_parameters, stribeck

SECONDS = 0.4


def deviation(description: AxisDescription, generated: GeneratedCampaign, name: str) -> float:
    """Largest position difference in m between stand and reference over the first samples."""
    motion = generated.exact[name]
    recording = next(r for r in generated.recordings if r.name == name)
    samples = round(SECONDS / description.measurement.sample_period_s)
    part = replace(
        recording,
        t=motion.t[:samples].copy(),
        y=motion.y[:samples].copy(),
        phase_currents=motion.currents[:, :samples].copy(),
    )
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


def looped(description: AxisDescription, loop_period: float, sample_period: float) -> AxisDescription:
    content = description.model_dump()
    content["drive"] |= {"loop_period_s": loop_period}
    content["measurement"] |= {"sample_period_s": sample_period}
    return AxisDescription.model_validate(content)


def test_sine_stand_differs_only_by_the_ripple_of_its_drive_loop(sine_stand: AxisDescription) -> None:
    # Samples in step with the loop lead the mean course of a rising current by loop^2 / (12 lag): the only difference.
    name = "sine_position_1"
    error = {}
    for loop, sample in ((1e-4, 1e-3), (5e-5, 1e-3), (1e-5, 1e-4)):
        axis = looped(sine_stand, loop, sample)
        error[loop] = deviation(axis, generate(axis, seed=1, only=[name]), name)
    assert error[1e-4] / error[5e-5] == pytest.approx(4, rel=0.1)
    assert error[1e-5] < 5e-7
