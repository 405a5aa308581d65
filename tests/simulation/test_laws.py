"""Friction laws in the kernels against slow twins: motion, convergence, energy, and the way along a motion."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.law_reference import LawRun, simulate_law
from linid.simulation.run import Simulator, whole_recordings

VALUES = {
    "coulomb_force": 2.0,
    "static_force": 3.0,
    "stribeck_velocity": 5e-3,
    "stribeck_exponent": 2.0,
    "bristle_stiffness": 1.2e4,
    "bristle_damping": 40.0,
    "viscous_friction": 2.5,
    "mass": 0.6,
    "force_constant": 1.0,
}
OWN = {
    "dahl": {"dahl_exponent": 1.3, "static_force": 2.0, "bristle_damping": 0.0},
    "elasto_plastic": {"breakaway_share": 0.7},
    "maxwell_slip": {"slip_stiffness_ratio": 0.5, "slip_force_tilt": 0.2, "slip_force_bend": 0.1},
}
T = np.arange(0.0, 0.4, 1e-3)
DRIVE = 3.6 * np.sin(2 * np.pi * 6 * T) * (0.5 + 2.0 * T)  # from presliding to sliding


@cache
def reference(law: str) -> LawRun:
    return simulate_law(law, VALUES | OWN[law], T, DRIVE, (0.0, 0.0), max_step=2.5e-6 if "slip" in law else 1e-4)


def simulated(law: str, substeps: int) -> tuple[Simulator, np.ndarray, np.ndarray]:
    recording = Recording(name="a", t=T, y=reference(law).y, drive_input=DRIVE, kind="motor", split="fit", number=1)
    model = Model("force", law=law)
    simulator = Simulator(model, pack_inputs([recording]), substeps)
    vector = model.vector(VALUES | OWN[law])[None, :]
    y, *_ = simulator.run(vector, whole_recordings(simulator.inputs), np.zeros((1, 1, 3)))
    return simulator, vector, y[0]


@pytest.mark.parametrize("law", list(OWN))
def test_the_twin_keeps_its_energy(law: str) -> None:
    """Work of the force = loss + energy of springs and mass; the tolerance is the twin's own, of a work of 0.05 J."""
    run = reference(law)
    balance = run.work - run.lost - run.stored - 0.5 * VALUES["mass"] * run.v**2
    assert np.max(np.abs(balance)) < 1e-7 and run.work[-1] > 5e-3
    assert np.all(np.diff(run.lost + 1e-9 * np.arange(T.size)) > 0.0)  # friction never gives


@pytest.mark.parametrize("law", list(OWN))
def test_motion_of_the_twin(law: str) -> None:
    errors = [float(np.max(np.abs(simulated(law, n)[2] - reference(law).y))) for n in (2, 16)]
    travel = float(np.ptp(reference(law).y))
    assert travel > 1e-3 and errors[0] < 2e-3 * travel
    assert errors[1] < 0.25 * errors[0] or errors[1] < 1e-4 * travel


@pytest.mark.parametrize("law", list(OWN))
def test_acceleration_along_the_motion_of_the_twin(law: str) -> None:
    simulator, vector, _ = simulated(law, 2)
    run = reference(law)
    still = np.zeros(T.size, dtype=np.bool_)
    a = simulator.along(vector, run.y, run.v, still, np.zeros((1, 1))).acceleration[0, 1:-1]
    measured = np.diff(run.y, 2) / (T[1] - T[0]) ** 2
    assert np.sqrt(np.mean((a - measured) ** 2)) < 0.02 * np.sqrt(np.mean(measured**2))


def test_a_small_loop_inside_a_larger_one_closes() -> None:
    """Maxwell's elements remember the reversal that a small loop began at; LuGre's bristle drifts over it."""
    path = np.concatenate(
        [
            np.linspace(0, 1e-4, 60),
            np.linspace(1e-4, 6e-5, 30),
            np.linspace(6e-5, 1e-4, 30),
            np.linspace(1e-4, 4e-4, 90),
        ]
    )
    gaps = {}
    for law in ("maxwell_slip", "lugre"):
        model = Model("friction", law=law)
        recording = Recording(name="a", t=1e-3 * np.arange(path.size), y=path, kind="free_wheel", split="fit", number=1)
        simulator = Simulator(model, pack_inputs([recording]), 1)
        vector = model.vector(VALUES | OWN["maxwell_slip"])[None, :]
        still = np.zeros(path.size, dtype=np.bool_)
        speed = np.gradient(path, 1e-3)
        w = simulator.along(vector, path, speed, still, np.zeros((1, 1))).bristle[0]
        gaps[law] = abs(w[119] - w[59]) / w[59]
    assert gaps["maxwell_slip"] < 1e-3 < 0.05 < gaps["lugre"]


def test_predictions_start_with_bent_elements() -> None:
    """A run that starts in the middle with the elements as they are along the motion goes on as the whole one does."""
    simulator, vector, _ = simulated("maxwell_slip", 8)
    run = reference("maxwell_slip")
    still = np.zeros(T.size, dtype=np.bool_)
    along = simulator.along(vector, run.y, run.v, still, np.zeros((1, 1)))
    first = np.array([200])
    starts = along.starts(first, run.y, run.v, simulator.inputs)
    assert starts.shape == (1, 1, 7)
    segments = whole_recordings(simulator.inputs)._replace(first=first, count=np.array([60]))
    ahead, *_ = simulator.run(vector, segments, starts)
    forgetful = starts.copy()
    forgetful[0, 0, 3:] = np.nan
    other, *_ = simulator.run(vector, segments, forgetful)
    errors = [float(np.max(np.abs(x[0] - run.y[200:260]))) for x in (ahead, other)]
    assert errors[0] < 2e-6 and errors[0] < 0.5 * errors[1]
