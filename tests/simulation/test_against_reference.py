"""The compiled simulation against the slow scipy twin, on the stand's modes, and its order."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from linid.identification.optimise.time_step import choose_substeps
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.recording.splines import trim
from linid.simulation.inputs import pack_inputs
from linid.simulation.reference import simulate_reference
from linid.simulation.run import Simulator, whole_recordings
from tests.identification.stand import stand

FRICTION = {
    "coulomb_force": 1.72,
    "static_force": 3.198,
    "stribeck_velocity": 2.993e-3,
    "stribeck_exponent": 2.0,
    "bristle_stiffness": 1.169e4,
    "bristle_damping": 92.14,
    "viscous_friction": 2.517,
    "mass": 0.588,
}


def simulate(kind: str, values: dict[str, float], recording: Recording, start: tuple[float, ...], substeps: int):
    model = Model(kind)
    simulator = Simulator(model, pack_inputs([recording]), substeps)
    y, v, steps = simulator.run(
        model.vector(values)[None, :], whole_recordings(simulator.inputs), np.array([[start]]), velocity=True
    )
    return y[0], v[0], steps


@pytest.mark.parametrize(
    "name", ["freewheel_1", "slow_ramp_1", "sine_current_1", "square_current_1", "sine_position_1", "moves_1"]
)
def test_one_micrometre_at_the_default_step(name: str) -> None:
    """1.2 s runs of every mode of the stand, with the exact currents of its plant.

    Of the square wave the first 0.18 s: held up by steps, it multiplies whatever is off by ten in every 0.1 s.
    """
    campaign = stand()
    recording = next(r for r in campaign.recordings if r.name == name)
    exact = campaign.exact[name]
    currents = exact.currents.copy() if recording.kind != "free_wheel" else None
    recording = trim(replace(recording, phase_currents=currents), 0.0, 0.18 if name == "square_current_1" else 1.2)
    kind = "friction" if recording.kind == "free_wheel" else "theta"
    values = campaign.truth
    start = (float(exact.y[0]), float(exact.v[0]), 0.0)
    substeps = choose_substeps(Model(kind), [recording], values)
    reference, _ = simulate_reference(kind, values, recording, start, rtol=1e-10, max_step=5e-3)
    y, _, _ = simulate(kind, values, recording, start, substeps)
    assert np.max(np.abs(y - reference)) < 1e-6


@pytest.mark.parametrize(("stiffness", "damping"), [(1.169e4, 92.14), (1e6, 300.0), (1e8, 2000.0)])
@pytest.mark.parametrize("speed", [0.5, 5.0])
def test_order_of_a_coast_down_that_stops(stiffness: float, damping: float, speed: float) -> None:
    """Error of the whole run against 128 times finer steps; least-squares slope over 1 to 16 steps a sample."""
    values = {**FRICTION, "bristle_stiffness": stiffness, "bristle_damping": damping, "viscous_friction": 12.0}
    t = np.arange(0.0, 1.0, 1e-3)
    recording = Recording("coast", t, np.zeros_like(t), kind="free_wheel")
    start = (0.0, speed, math.nan)
    fine, _, _ = simulate("friction", values, recording, start, 128)
    counts = np.array([1, 2, 4, 8, 16])
    errors = [np.sqrt(np.mean((simulate("friction", values, recording, start, int(n))[0] - fine) ** 2)) for n in counts]
    slope = -np.polyfit(np.log(counts), np.log(np.maximum(errors, 1e-13)), 1)[0]
    assert slope >= 1.9, (slope, errors)
    assert errors[1] < 1e-7


@pytest.mark.parametrize(("stiffness", "damping"), [(1.169e4, 92.14), (1e6, 300.0), (1e8, 2000.0)])
def test_order_of_a_driven_run_with_reversals(stiffness: float, damping: float) -> None:
    values = {**FRICTION, "bristle_stiffness": stiffness, "bristle_damping": damping, "force_constant": 45.0}
    t = np.arange(0.0, 1.5, 1e-3)
    drive = Recording("drive", t, np.zeros_like(t), drive_input=0.25 * np.sin(2 * np.pi * 1.5 * t))
    start = (0.3, 0.0, 0.0)
    fine, speed, _ = simulate("force", values, drive, start, 128)
    assert np.sum(np.diff(np.sign(speed[50:])) != 0) >= 3  # it does reverse
    counts = np.array([1, 2, 4, 8, 16])
    errors = [np.sqrt(np.mean((simulate("force", values, drive, start, int(n))[0] - fine) ** 2)) for n in counts]
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert slope >= 1.9, (slope, errors)


def test_coulomb_and_viscous_coast_down_in_closed_form() -> None:
    """F_S = F_C and a stiff bristle: v(t) = (v_0 + F_C/s) exp(-s t/m) - F_C/s until it stops."""
    values = {**FRICTION, "static_force": 1.72, "bristle_stiffness": 1e8, "bristle_damping": 2000.0}
    t = np.arange(0.0, 0.6, 1e-3)
    recording = Recording("coast", t, np.zeros_like(t), kind="free_wheel")
    m, viscous, coulomb, v_0 = 0.588, 2.517, 1.72, 1.0
    y, v, _ = simulate("friction", values, recording, (0.0, v_0, math.nan), 4)
    level = coulomb / viscous
    stop = m / viscous * math.log((v_0 + level) / level)
    expected = (v_0 + level) * m / viscous * (1.0 - np.exp(-viscous * t / m)) - level * t
    sliding = t < stop - 2e-3
    assert np.max(np.abs(y[sliding] - expected[sliding])) < 5e-8
    assert np.max(np.abs(v[t > stop + 0.05])) < 1e-6


def test_work_balances_energy_and_loss() -> None:
    """Input work = kinetic energy + bristle energy + friction loss, and the rest falls with the step."""
    values = {**FRICTION, "force_constant": 45.0}
    t = np.arange(0.0, 1.0, 1e-3)
    current = 0.25 * np.sin(2 * np.pi * 1.5 * t)
    drive = Recording("drive", t, np.zeros_like(t), drive_input=current)
    y, v, _ = simulate("force", values, drive, (0.3, 0.0, 0.0), 8)
    force = 45.0 * current
    work = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(y))
    kinetic = 0.5 * 0.588 * v[-1] ** 2
    assert work > kinetic > 0.0
    reference, speed = simulate_reference("force", values, drive, (0.3, 0.0, 0.0), rtol=1e-10, max_step=2e-3)
    work_reference = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(reference))
    loss = work - kinetic
    loss_reference = work_reference - 0.5 * 0.588 * speed[-1] ** 2
    assert loss == pytest.approx(loss_reference, rel=1e-6)
