"""The measure of strength, recomputed by other means, and amplitudes scaled to it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from linid.challenge.catalogue import ENTRIES, AxisSizes
from linid.challenge.plant import simulate
from linid.challenge.strength import HALF_WIDTH, VISIBLE, bump, calibrate, run_all, scope_of, strength
from linid.stand.description import AxisDescription
from tests.challenge.conftest import effect


def test_bump_smooths_without_bias_and_its_curve_differentiates_twice() -> None:
    smooth, curve = bump(HALF_WIDTH, 1e-3)
    t = 1e-3 * np.arange(-100, 101)
    assert smooth.sum() == pytest.approx(1)
    assert np.convolve(3.0 + 2.0 * t, curve, "valid") == pytest.approx(0, abs=1e-7)
    assert np.convolve(4.9 * t**2, curve, "valid") == pytest.approx(9.8)
    # At 20 Hz a wave passes nearly unchanged, and its curve is that of the smoothed wave.
    wave = np.sin(2 * np.pi * 20 * t)
    passed = np.convolve(wave, smooth, "valid")
    curved = np.convolve(wave, curve, "valid")
    assert curved == pytest.approx(-((2 * np.pi * 20) ** 2) * passed, rel=0.05, abs=50)


@pytest.mark.parametrize("name", ["constant_force", "payload_change", "cogging", "current_offset"])
def test_strength_is_the_share_of_missing_force(calm: AxisDescription, name: str) -> None:
    # Recomputed from what the effect is, without the kernel's base acceleration and without smoothing.
    hidden = effect(name, calm)
    only = scope_of(hidden, calm)
    modes = [calm.campaign[i] for i in only]
    found = strength(run_all(calm, [hidden], only=only), modes)
    missing, total = [], []
    for index, mode in zip(only, modes, strict=True):
        run = simulate(calm, mode, [hidden], index=index)
        if name == "constant_force":
            force = np.full(run.y.size, hidden.amplitude)
        elif name == "payload_change":
            force = -hidden.amplitude * run.acceleration
        elif name == "cogging":
            motor, shape = calm.motor, hidden.shape
            double = 2 if motor.kind == "theta" else 1
            angle = 2 * double * motor.electrical_wavenumber_per_m * run.y
            force = hidden.amplitude * (1 + shape["swell"] * np.sin(2 * np.pi * run.y / shape["swell_length"]))
            force *= np.sin(angle + shape["phase"]) + shape["second"] * np.sin(2 * angle + shape["second_phase"])
        else:
            # Force of the offsets in the fundamental of the field; odd harmonics are below a per mille of it.
            motor = calm.motor
            double = 2 if motor.kind == "theta" else 1
            one = motor.force_constant_n_per_a
            if motor.kind == "theta":
                one *= 8 * motor.nome * math.sin(2 * motor.winding_length_rad)
            force = np.zeros(run.y.size)
            for j, phase in zip((-1, 0, 1), "uvw", strict=True):
                angle = double * (motor.electrical_wavenumber_per_m * run.y + j * motor.winding_displacement_rad)
                field = one * np.sin(angle + double * motor.commutation_offset_rad)
                force -= field * hidden.amplitude * hidden.shape[phase]
        missing.append(force)
        total.append(run.mass * run.acceleration if mode.mode == "free_wheel" else run.thrust)
    expected = np.sqrt(np.mean(np.concatenate(missing) ** 2) / np.mean(np.concatenate(total) ** 2)) / VISIBLE
    # Smoothing costs cogging at speed a little.
    assert found == pytest.approx(expected, rel=0.06 if name == "cogging" else 0.03)


@pytest.mark.parametrize("name", ENTRIES)
def test_amplitudes_are_scaled_to_the_wanted_strength(calm: AxisDescription, sizes: AxisSizes, name: str) -> None:
    reached = calibrate(calm, effect(name, calm), 0.12, sizes)
    assert reached is not None
    hidden, found = reached
    assert found == pytest.approx(0.12, rel=0.035)
    assert abs(hidden.amplitude) <= ENTRIES[name].limit(sizes)


def test_the_coarse_step_of_the_search_measures_what_the_fine_one_does(calm: AxisDescription, sizes: AxisSizes) -> None:
    for name in ("asymmetric_friction", "flexible_load"):
        reached = calibrate(calm, effect(name, calm), 0.3, sizes)
        assert reached is not None
        only = scope_of(reached[0], calm)
        fine = strength(run_all(calm, [reached[0]], only=only), [calm.campaign[i] for i in only])
        assert fine == pytest.approx(reached[1], rel=0.02)


def test_no_effect_has_no_strength(calm: AxisDescription) -> None:
    assert strength(run_all(calm, []), calm.campaign) < 1e-8
    assert strength(run_all(calm, [replace(effect("cogging", calm), amplitude=0.0)]), calm.campaign) < 1e-8


def test_what_cannot_become_that_strong_is_refused(calm: AxisDescription, sizes: AxisSizes) -> None:
    assert calibrate(calm, effect("end_effect", calm), 50.0, sizes) is None
