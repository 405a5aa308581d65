"""The three gap measures of a model on recordings, each beside the floor that measurement noise alone sets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from linid.diagnosis.gap import RecordingGap, Trace
from linid.errors import UsageError
from linid.identification.acceleration import Acceleration
from linid.identification.ahead import Ahead
from linid.identification.free_run import FreeRun
from linid.identification.motion import noise_level, with_input_noise
from linid.identification.objectives import check_recordings
from linid.identification.polish import polish_starts
from linid.identification.result import FitResult
from linid.physics.model import Model
from linid.recording.recording import Recording

Array = NDArray[np.float64]
_DRAWS = 8


def model_of(result: FitResult) -> tuple[Model, Array]:
    """The model and flat parameter vector (1, VECTOR_SIZE) of a fit result."""
    model = Model(result.model, result.effects)
    return model, model.vector({e.name: e.value for e in result.estimates})[None, :]


def measure_gaps(
    result: FitResult, recordings: Sequence[Recording], *, jobs: int = 1, seed: int = 1
) -> tuple[tuple[RecordingGap, ...], tuple[Trace, ...]]:
    """Gap measures and traces of every recording under a fitted model.

    Free runs start from the measured state (free wheels: the start speed is refined on the recording, it is
    a nuisance and no property of the axis). Floors: the noise of encoder and currents, estimated from the
    recording, is added once more to the model's own prediction in `_DRAWS` seeded draws.
    Raises UsageError or DataError where a recording lacks what the model needs.
    """
    model, vector = model_of(result)
    gaps, traces = [], []
    for recording in recordings:
        if recording.axis != result.axis:
            raise UsageError(
                recording.name, f"is a {recording.axis} axis, the model a {result.axis} one", "Use the axis's own model"
            )
        check_recordings([recording], Model("friction") if recording.kind == "free_wheel" else model)
        gap, trace = _measure(model, vector, recording, result.substeps, jobs, seed)
        gaps.append(gap)
        traces.append(trace)
    return tuple(gaps), tuple(traces)


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))


def _ahead_error(part: Ahead, predicted: Array) -> float:
    """RMS error at the end of the horizon."""
    last = part.segments.out_offsets[1:] - 1
    return _rms((predicted[0] - part.measured)[last])


def _measure(
    model: Model, vector: Array, recording: Recording, substeps: int, jobs: int, seed: int
) -> tuple[RecordingGap, Trace]:
    free = FreeRun(model, (recording,), substeps, jobs)
    offsets = polish_starts(free, vector) if recording.kind == "free_wheel" else np.zeros((1, free.nuisances))
    y_row, v_row, _ = free.simulate(vector, offsets, velocity=True)
    y_simulated, v_simulated = y_row[0], v_row[0]
    spread = float(np.std(recording.y))
    ahead = Ahead(model, (recording,), substeps, jobs, project=False, skip_jumps=False)
    predicted = ahead.simulate(vector)
    balance = Acceleration(model, (recording,), jobs)
    mass = float(vector[0, model.slot("mass")]) + recording.added_mass
    force = mass * balance.residuals(vector, np.zeros((1, 0)))[0]
    driving = _total_force(model, vector, recording, balance, mass)
    floors = _floors(model, vector, recording, substeps, jobs, seed, balance.half_widths, y_simulated)
    gap = RecordingGap(
        recording=recording.name,
        kind=recording.kind,
        split=recording.split,
        free_run=_rms(y_simulated - recording.y) / spread,
        free_run_floor=floors[0] / spread,
        ahead=_ahead_error(ahead, predicted),
        ahead_floor=floors[1],
        force=_rms(force),
        force_share=_rms(force) / max(driving, 1e-300),
        force_floor=floors[2],
    )
    dt = recording.duration / (recording.t.size - 1)
    trace = Trace(
        recording=recording.name,
        kind=recording.kind,
        split=recording.split,
        axis=recording.axis,
        added_mass=recording.added_mass,
        t=recording.t,
        y_measured=recording.y,
        y_simulated=y_simulated,
        velocity_measured=np.gradient(recording.y, dt),
        velocity_simulated=v_simulated,
        force_t=recording.t[balance.rows],
        force_residual=force,
        phase_currents=recording.phase_currents,
        drive_input=recording.drive_input,
        input_unit=recording.input_unit,
    )
    return gap, trace


def _total_force(model: Model, vector: Array, recording: Recording, balance: Acceleration, mass: float) -> float:
    """RMS of the total force: the motor's on driven runs, the inertial force on free wheels."""
    if recording.kind == "free_wheel":
        return mass * _rms(balance.target)
    frictionless = vector.copy()
    frictionless[0, :7] = (1e-12, 1e-12, 1.0, 2.0, 1.0, 0.0, 0.0)
    return mass * _rms(balance.model_acceleration(frictionless)[0])


def _noisy(recording: Recording, y: Array, generator: np.random.Generator) -> Recording:
    """The recording with positions y plus encoder noise, and its inputs with their noise once more."""
    y = y + noise_level(recording.y) * generator.standard_normal(y.size)
    return replace(with_input_noise(recording, generator), y=y)


def _floors(
    model: Model,
    vector: Array,
    recording: Recording,
    substeps: int,
    jobs: int,
    seed: int,
    half_widths: tuple[int, ...],
    y_simulated: Array,
) -> tuple[float, float, float]:
    """RMS free-run error (m), ahead error (m) and force error (N) that measurement noise alone would cause.

    The model's own motion stands for the machine; where it diverged the measured motion does.
    """
    generator = np.random.default_rng(seed)
    mass = float(vector[0, model.slot("mass")]) + recording.added_mass
    clean = y_simulated if np.all(np.isfinite(y_simulated)) else recording.y
    powered = recording.kind != "free_wheel"
    own = replace(recording, y=clean)
    base_force = Acceleration(model, (own,), jobs, half_widths=half_widths).residuals(vector, np.zeros((1, 0)))[0]
    base_ahead = Ahead(model, (own,), substeps, jobs, project=False, skip_jumps=False)
    base_error = (base_ahead.simulate(vector) - base_ahead.measured)[0]
    last = base_ahead.segments.out_offsets[1:] - 1
    squares = np.zeros(3)
    for _ in range(_DRAWS):
        noisy = _noisy(recording, clean, generator)
        encoder = noisy.y - clean
        if powered:
            moved = FreeRun(model, (replace(noisy, y=recording.y),), substeps, jobs)
            y_moved = moved.simulate(vector, np.zeros((1, moved.nuisances)))[0][0]
            squares[0] += np.nanmean((y_moved - clean + encoder) ** 2)
        else:
            squares[0] += np.mean(encoder**2)
        drawn = Ahead(model, (noisy,), substeps, jobs, project=False, skip_jumps=False)
        error = (drawn.simulate(vector) - drawn.measured)[0]
        squares[1] += np.mean((error - base_error)[last] ** 2)
        force = Acceleration(model, (noisy,), jobs, half_widths=half_widths).residuals(vector, np.zeros((1, 0)))[0]
        squares[2] += mass**2 * np.mean((force - base_force) ** 2)
    floors = np.sqrt(squares / _DRAWS)
    return float(floors[0]), float(floors[1]), float(floors[2])
