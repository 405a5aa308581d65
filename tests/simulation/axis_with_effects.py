"""A small synchronous axis and one strong, plausible set of parameters for every effect."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from linid.physics.effects.registry import EFFECTS
from linid.physics.model import Model
from linid.recording.recording import Recording, in_order
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings

AXIS = {
    "coulomb_force": 1.72,
    "static_force": 3.198,
    "stribeck_velocity": 2.993e-3,
    "stribeck_exponent": 2.0,
    "bristle_stiffness": 1.169e4,
    "bristle_damping": 92.14,
    "viscous_friction": 2.517,
    "mass": 0.588,
    "force_constant": 30.0,
    "electrical_wavenumber": 200.0,
    "winding_displacement": 2.0 * math.pi / 3.0,
    "commutation_offset": 0.3,
}

SAMPLES: dict[str, dict[str, float]] = {
    "cogging": {
        "cogging_wavenumber": 200.0,
        "cogging_sine_1": 0.6,
        "cogging_cosine_1": -0.4,
        "cogging_sine_2": 1.5,
        "cogging_cosine_2": 0.5,
        "cogging_sine_3": 0.3,
        "cogging_cosine_3": 0.2,
        "cogging_sine_4": 0.2,
        "cogging_cosine_4": -0.3,
        "cogging_order_1": 1.0,
        "cogging_order_2": 2.0,
        "cogging_order_3": 4.0,
        "cogging_order_4": 6.0,
    },
    "force_ripple": {
        "ripple_wavenumber": 200.0,
        "ripple_sine_6": 0.06,
        "ripple_cosine_6": 0.04,
        "ripple_sine_12": 0.02,
        "ripple_cosine_12": -0.01,
    },
    "phase_gain_imbalance": {"phase_gain_1": 0.08, "phase_gain_3": -0.05},
    "current_offset": {"current_offset_1": 0.04, "current_offset_3": -0.06},
    "asymmetric_friction": {"friction_asymmetry": 0.2, "viscous_asymmetry": 0.3},
    "constant_force": {"constant_force": 1.2},
    "cable_force": {
        "cable_preload": 0.5,
        "cable_stiffness": 12.0,
        "cable_hysteresis": 0.8,
        "cable_hysteresis_length": 0.01,
        "cable_middle": 0.02,
    },
    "position_dependent_friction": {
        "friction_at_1": -0.3,
        "friction_at_2": -0.1,
        "friction_at_3": 0.25,
        "friction_at_4": 0.5,
        "friction_at_5": 0.15,
        "friction_at_7": -0.2,
        "friction_at_8": -0.25,
        "friction_at_9": 0.1,
        "friction_at_10": 0.3,
        "friction_at_11": 0.2,
        **{f"friction_place_{k}": -0.06 + 0.015 * (k - 1) for k in range(1, 12)},
    },
    "quadratic_drag": {"drag_coefficient": 6.0, "drag_power": 2.2, "drag_speed": 0.2},
    "input_delay": {"input_delay": 2.3e-3},
    "force_saturation": {"saturation": 0.8, "saturation_knee": 0.6},
    "thermal_derating": {"derating": 0.4, "thermal_time": 0.4},
    "end_effect": {
        "end_loss_low": 0.3,
        "end_loss_high": 0.2,
        "end_reach_low": 0.01,
        "end_reach_high": 0.02,
        "end_length": 0.02,
        "end_low": -0.06,
        "end_high": 0.09,
    },
    "flexible_load": {"load_mass": 0.2, "load_frequency": 25.0, "load_damping": 0.04},
    "encoder_periodic_error": {
        "encoder_period": 2e-3,
        "encoder_sine_1": 4e-6,
        "encoder_cosine_1": 2e-6,
        "encoder_sine_2": 1e-6,
        "encoder_cosine_2": -1e-6,
    },
    "external_disturbance": {
        "disturbance_force_1": 4.0,
        "disturbance_start_1": 0.31,
        "disturbance_duration_1": 0.14,
        "disturbance_recording_1": 5.0,
        **{
            f"disturbance_{name}_{k}": value
            for k in range(2, 7)
            for name, value in (("force", 0.0), ("start", 0.0), ("duration", 0.2), ("recording", 0.0))
        },
    },
    "friction_drift": {
        "drift_warm_up": -0.3,
        "drift_per_campaign": -0.1,
        "drift_viscous": 0.5,
        "drift_time": 0.4,
        "drift_campaign_time": 10.0,
    },
    "payload_change": {"payload_mass": 0.3, "payload_recordings": 16.0},
    "backlash": {"backlash_gap": 2e-4},
    "eddy_current_drag": {"eddy_damping": 5.0, "eddy_speed": 0.2},
    "dwell_stiction": {"dwell_growth": 0.15, "dwell_length": 2e-4, "dwell_time": 0.05},
    "gravity": {"gravity_sine": 4.0, "gravity_cosine": 1.5},
    "friction_level_change": {"friction_change": 0.6, "friction_change_recordings": 16.0},
    "drive_train_backlash": {
        "backlash_load_mass": 0.2,
        "backlash_load_gap": 2e-4,
        "backlash_load_frequency": 40.0,
        "backlash_load_damping": 0.3,
    },
    "load_dependent_friction": {"load_friction": 0.15},
    "force_constant_change": {"constant_change": 0.15},
    "breakaway_change": {"static_change": 12.0},
    "commutation_change": {"field_displacement": 1.5e-3},
    "viscous_friction_change": {"viscous_change": 2.0},
    "pole_pitch_error": {"pitch_error_2": 4e-4, "pitch_error_3": -3e-4, "pitch_low": -0.06, "pitch_high": 0.09},
}
NAMES = tuple(effect.name for effect in EFFECTS)


def synchronous_run(duration: float = 0.8, number: int = 5) -> Recording:
    """Currents that turn the field to and fro; the axis follows, with reversals and a rest at the end."""
    t = np.arange(0.0, duration, 1e-3)
    path = 0.05 * np.sin(2.0 * np.pi * 1.7 * t) * np.minimum(1.0, np.maximum(0.0, (duration - 0.1 - t) / 0.2))
    angle = AXIS["electrical_wavenumber"] * path
    turns = np.array([[-1.0], [0.0], [1.0]]) * AXIS["winding_displacement"]
    currents = (0.55 + 0.15 * np.sin(9.0 * t)) * np.sin(angle + turns)
    return Recording("synchronous", t, np.zeros_like(t), phase_currents=currents, number=number, elapsed=4.0)


def start_of_run() -> tuple[float, float, float]:
    """Where the field holds the axis at the start of `synchronous_run`."""
    return ((0.5 * math.pi - AXIS["commutation_offset"]) / AXIS["electrical_wavenumber"], 0.0, 0.0)


def simulate(
    effects: tuple[str, ...],
    recording: Recording,
    start: tuple[float, float, float],
    substeps: int = 2,
    *,
    values: dict[str, float] | None = None,
    kind: str = "sine",
    specialised: bool = False,
) -> np.ndarray:
    """Positions (n,) in m of the axis with the effects' sample parameters, or with `values` over them."""
    model = Model(kind, effects)
    known = dict(AXIS)
    for name in effects:
        known |= SAMPLES.get(name, {})
    simulator = Simulator(model, pack_inputs([recording]), substeps, specialised=specialised)
    vector = model.vector(known | (values or {}))[None, :]
    return simulator.run(vector, whole_recordings(simulator.inputs), np.array([[start]]))[0][0]


def _campaign_paths() -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Level of the current in A, times in s and path of the field in m for each driven run."""
    t = np.arange(0.0, 1.6, 1e-3)
    fade = np.clip((t - 0.1) / 0.2, 0.0, 1.0)  # from rest
    slow = 0.07 * np.sin(2.0 * np.pi * 0.6 * t) + 0.004 * np.sin(2.0 * np.pi * 4.1 * t)
    quick = 0.03 * np.sin(2.0 * np.pi * 2.3 * t) + 0.03 * np.sin(2.0 * np.pi * 0.5 * t)
    rests = 0.06 * np.clip(1.6 * np.sin(2.0 * np.pi * 0.9 * t), -1.0, 1.0)
    sweep = 0.05 * np.sin(2.0 * np.pi * (0.5 * t + 1.1 * t * t))
    return [(0.45, t, slow * fade), (0.9, t, quick * fade), (0.5, t, rests * fade), (1.1, t, sweep * fade)]


def campaign_with(effects: tuple[str, ...], seed: int = 0, noise: float = 1e-7) -> list[Recording]:
    """Four free wheels and four driven runs of the axis with its effects, encoder noise in m added."""
    generator = np.random.default_rng(seed)
    recordings: list[Recording] = []
    t = np.arange(0.0, 0.6, 1e-3)
    for k, (speed, added) in enumerate(((0.6, 0.0), (-0.5, 0.5), (-0.6, 0.0), (0.5, 0.5))):
        recordings.append(Recording(f"wheel_{k}", t, np.full_like(t, speed), kind="free_wheel", added_mass=added))
    for k, (level, times, path) in enumerate(_campaign_paths()):
        turns = np.array([[-1.0], [0.0], [1.0]]) * AXIS["winding_displacement"]
        wave = level * (1.0 + 0.3 * np.sin(7.0 * times + k))
        currents = wave * np.sin(AXIS["electrical_wavenumber"] * path + turns)
        recordings.append(Recording(f"run_{k}", times, np.zeros_like(times), phase_currents=currents))
    out = []
    for recording in in_order(recordings):
        start = (*start_of_run()[:2], math.nan)
        if recording.kind == "free_wheel":
            start = (-0.05 if recording.y[0] > 0.0 else 0.1, float(recording.y[0]), math.nan)
        y = simulate(effects, recording, start, 8)
        out.append(replace(recording, y=y + noise * generator.standard_normal(y.size)))
    return out
