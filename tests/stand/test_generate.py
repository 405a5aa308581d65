"""The campaign: inside the stroke, reproducible bit for bit, re-measurable, and of the described content."""

from __future__ import annotations

import numpy as np
import pytest

from linid.errors import ConfigError, UsageError
from linid.recording.recording import Recording
from linid.stand.description import AxisDescription
from linid.stand.generate import GeneratedCampaign, generate, resample_noise, true_parameters


def bits(recording: Recording) -> tuple[bytes, ...]:
    assert recording.phase_currents is not None
    return recording.t.tobytes(), recording.y.tobytes(), recording.phase_currents.tobytes()


def test_every_motion_stays_within_the_stroke(stand: AxisDescription, campaign: GeneratedCampaign) -> None:
    centre = (stand.stroke.lower_m + stand.stroke.upper_m) / 2
    half = (stand.stroke.upper_m - stand.stroke.lower_m) / 2
    for name, motion in campaign.exact.items():
        assert np.max(np.abs(motion.y - centre)) < half, name
        if "current" in name:  # open loop: no runaway, half of the stroke is left
            assert np.max(np.abs(motion.y - centre)) < half / 2, name


def test_free_wheels_travel_20_to_250_mm_and_come_to_rest(campaign: GeneratedCampaign) -> None:
    directions = set()
    for recording in campaign.recordings:
        if recording.kind == "free_wheel":
            motion = campaign.exact[recording.name]
            assert 0.019 < np.ptp(motion.y) < 0.25
            assert abs(motion.v[-1]) < 1e-4
            directions.add(np.sign(motion.v[0]))
    assert directions == {-1.0, 1.0}


def test_slow_ramps_creep_before_they_slide(stand: AxisDescription, campaign: GeneratedCampaign) -> None:
    breakaway = stand.friction.static_force_n / stand.friction.bristle_stiffness_n_per_m
    for name in ("slow_ramp_1", "slow_ramp_2"):
        motion = campaign.exact[name]
        travel = np.abs(motion.y - motion.y[0])
        assert np.max(travel[motion.t < 1]) < 1.5 * breakaway
        assert np.max(travel[motion.t < 1]) > 100 * stand.measurement.position_resolution_m
        assert np.max(travel) > 0.01


def test_campaign_has_the_described_recordings(stand: AxisDescription, campaign: GeneratedCampaign) -> None:
    assert [r.name for r in campaign.recordings] == [m.name for m in stand.campaign]
    for mode, recording in zip(stand.campaign, campaign.recordings, strict=True):
        assert (recording.split, recording.added_mass) == (mode.split, mode.added_mass_kg)
        assert recording.kind == ("free_wheel" if mode.mode == "free_wheel" else "motor")
        assert len(recording.t) == round(mode.duration_s / stand.measurement.sample_period_s)
        assert recording.period == pytest.approx(stand.measurement.sample_period_s)
        assert recording.phase_currents is not None
        assert recording.phase_currents.shape == (3, len(recording.t))
        assert recording.y.shape == recording.t.shape
    kinds = [mode.mode for mode in stand.campaign]
    assert {kind: kinds.count(kind) for kind in kinds} == {
        "free_wheel": 6,
        "slow_ramp": 2,
        "sine_current": 3,
        "square_current": 2,
        "sine_position": 3,
        "moves": 3,
    }
    assert {m.mode for m in stand.campaign if m.split == "held_out"} == set(kinds)


def test_recordings_are_the_exact_motion_plus_small_errors(campaign: GeneratedCampaign) -> None:
    for recording in campaign.recordings:
        motion = campaign.exact[recording.name]
        assert np.max(np.abs(recording.y - motion.y)) < 6 * 2e-7
        assert np.std(recording.y - motion.y) == pytest.approx(2.02e-7, rel=0.1)
        assert recording.phase_currents is not None
        assert np.max(np.abs(recording.phase_currents - motion.currents)) < 6 * 3e-3


def test_same_seed_same_bits_whatever_else_is_generated(stand: AxisDescription, campaign: GeneratedCampaign) -> None:
    names = ["freewheel_3", "square_current_1"]
    part = generate(stand, seed=1, only=names)
    assert [r.name for r in part.recordings] == names
    whole = {r.name: r for r in campaign.recordings}
    for recording in part.recordings:
        assert bits(recording) == bits(whole[recording.name])


def test_resampled_noise_is_what_another_seed_would_have_given(stand: AxisDescription) -> None:
    names = ["freewheel_1", "moves_1"]
    first = generate(stand, seed=1, only=names)
    again = resample_noise(first, 7)
    fresh = generate(stand, seed=7, only=names)
    assert again.seed == 7
    assert again.exact is first.exact
    for a, b, old in zip(again.recordings, fresh.recordings, first.recordings, strict=True):
        assert bits(a) == bits(b)
        assert bits(a) != bits(old)


def test_truth_names_the_described_values(
    stand: AxisDescription, sine_stand: AxisDescription, campaign: GeneratedCampaign
) -> None:
    assert campaign.truth == {
        "coulomb_force": 1.72,
        "static_force": 3.198,
        "stribeck_velocity": 2.993e-3,
        "stribeck_exponent": 2.0,
        "bristle_stiffness": 1.169e4,
        "bristle_damping": 92.14,
        "viscous_friction": 2.517,
        "mass": 0.588,
        "force_constant": 7.7531248,
        "electrical_wavenumber": 111.0,
        "winding_displacement": np.pi / 3,
        "commutation_offset": 0.768,
        "winding_length": 0.688,
        "nome": 0.493,
    }
    sine = true_parameters(sine_stand)
    assert sine["winding_displacement"] == 0.5368
    assert not {"nome", "winding_length", "constant_force"} & set(sine)
    tilted = AxisDescription.model_validate(stand.model_dump() | {"constant_force_n": -1.5})
    assert true_parameters(tilted)["constant_force"] == -1.5


def test_the_paper_like_sine_stand_generates_within_its_stroke(sine_stand: AxisDescription) -> None:
    generated = generate(sine_stand, seed=0)
    for motion in generated.exact.values():
        assert sine_stand.stroke.lower_m < motion.y.min() < motion.y.max() < sine_stand.stroke.upper_m


def test_a_motion_that_leaves_the_stroke_is_refused(stand: AxisDescription) -> None:
    content = stand.model_dump()
    content["campaign"] = [content["campaign"][8] | {"amplitude_a": 2.0}]
    with pytest.raises(ConfigError, match=r"recording sine_current_1.*outside the stroke.*Lower its amplitude"):
        generate(AxisDescription.model_validate(content), seed=1)


def test_a_motion_that_diverges_is_refused(stand: AxisDescription) -> None:
    # A millisecond step is far too long for the bristles at this speed.
    content = stand.model_dump() | {"integration_step_s": 1e-3}
    content["drive"] |= {"loop_period_s": 1e-3}
    content["campaign"] = content["campaign"][1:2]
    with pytest.raises(ConfigError, match="does not stay finite"):
        generate(AxisDescription.model_validate(content), seed=1)


def test_unknown_recording_and_negative_seed_are_usage_errors(stand: AxisDescription) -> None:
    with pytest.raises(UsageError, match="no recording named moves_9"):
        generate(stand, seed=1, only=["moves_9"])
    with pytest.raises(UsageError, match="seed"):
        generate(stand, seed=-1)
