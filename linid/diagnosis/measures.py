"""The three gap measures of a model on recordings, each beside the floor that measurement noise and repeats set."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np

from linid.arrays import Array
from linid.diagnosis.gap import AheadPieces, RecordingGap, Trace, traced
from linid.diagnosis.repeats import aligned, repeats_of
from linid.errors import UsageError
from linid.identification.objectives.acceleration import Acceleration
from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.choose import WINDOW_STEPS, check_recordings
from linid.identification.objectives.free_run import FreeRun
from linid.identification.optimise.start_offsets import fit_start_offsets
from linid.identification.result import FitResult
from linid.identification.signals.motion import input_levels, measure_motion, retaken, with_input_noise
from linid.identification.unit_mass import comparable
from linid.physics.model import Model
from linid.recording.recording import Recording

_DRAWS = 8
# Internal steps per sample of the draws, at most: more of them change floors by a quarter of what other draws do, and
# those ahead by less than 0.1 % (`python -m tests.benchmarks.floors`).
_DRAWN_STEPS = WINDOW_STEPS
_AT_ONCE = 200_000  # samples of draws that are simulated together: of long recordings, each takes some ten MB
_KEPT = 10_000  # samples of a recording whose draws are kept for the next model: with their splines 17 MB
_drawn: WeakKeyDictionary[Recording, tuple[int, list[Recording]]] = WeakKeyDictionary()
# Times the median of its square, from where a draw is odd (of squares of Gaussians one in a hundred and fifty): now
# and then noise looks like a bend, the speed there is smoothed hardly at all, and a prediction from there is far off.
_ODD = 16.0
_ABOUT_MEDIAN = 0.918  # mean square of eight Gaussian draws about their own median, whose variance is 0.168


def model_of(result: FitResult) -> tuple[Model, Array]:
    """The model and flat parameter vector (1, VECTOR_SIZE) of a fit result."""
    model = Model(result.model, result.effects, law=result.law)
    return model, model.vector({e.name: e.value for e in result.estimates})[None, :]


def measure_gaps(
    result: FitResult,
    recordings: Sequence[Recording],
    *,
    jobs: int = 1,
    seed: int = 1,
    among: Sequence[Recording] = (),
    floors: bool = True,
) -> tuple[tuple[RecordingGap, ...], tuple[Trace, ...]]:
    """Gap measures and traces of every recording under a fitted model.

    Free runs start from the measured state (free wheels: the start speed is refined on the recording, it is
    a nuisance and no property of the axis). Floors: the smoothed motion is measured anew in `_DRAWS` seeded draws, with
    the encoder's steps and the noise of encoder and currents as the recording has them; the errors' scatter is the
    floor. Where
    `among` (default: recordings) holds declared repeats, the floor is at least what of the error does not repeat.
    Without `floors`, which take most of the time, they come back as nan.
    Raises UsageError or DataError where a recording lacks what the model needs.
    """
    model, vector = model_of(result)
    pitch = next((abs(e.value) for e in result.derived if e.name == "pole_pitch"), None)
    gaps, traces = [], []
    for recording in recordings:
        if recording.axis != result.axis:
            raise UsageError(
                recording.name, f"is a {recording.axis} axis, the model a {result.axis} one", "Use the axis's own model"
            )
        recording = comparable(result, recording)
        check_recordings([recording], Model("friction") if recording.kind == "free_wheel" else model)
        task = _Task(model, vector, result.substeps, jobs)
        repeats = [comparable(result, other) for other in repeats_of(recording, among or recordings)]
        gap, trace = _measure(task, recording, repeats, seed if floors else None)
        gaps.append(replace(gap, per_mass=result.per_mass))
        traces.append(replace(trace, pole_pitch=pitch))
    return tuple(gaps), tuple(traces)


@dataclass(frozen=True)
class _Task:
    """A model with its parameters (1, VECTOR_SIZE), and how to run it."""

    model: Model
    vector: Array
    substeps: int
    jobs: int

    def mass(self, recording: Recording) -> float:
        """Moving mass with what was added, kg (rotary: kg m^2)."""
        return float(self.vector[0, self.model.slot("mass")]) + recording.added_mass

    def free_run(self, *recordings: Recording) -> tuple[Array, Array]:
        """Position and velocity of the free runs, one after the other, (n,) each."""
        free = FreeRun(self.model, recordings, self.substeps, self.jobs)
        wheel = recordings[0].kind == "free_wheel"
        offsets = fit_start_offsets(free, self.vector) if wheel else np.zeros((1, free.nuisances))
        y, v, _ = free.simulate(self.vector, offsets, velocity=True)
        return y[0], v[0]

    def ahead(self, *recordings: Recording) -> Ahead:
        return Ahead(self.model, recordings, self.substeps, self.jobs, project=False, skip_jumps=False, guided=False)

    def ahead_error(self, *recordings: Recording) -> Array:
        """Errors of all windows at their horizon, (k,) m."""
        part = self.ahead(*recordings)
        return np.asarray((part.simulate(self.vector)[0] - part.measured)[part.segments.out_offsets[1:] - 1])

    def balance(self, recording: Recording, half_widths: tuple[int, ...] = ()) -> Acceleration:
        return Acceleration(self.model, (recording,), self.jobs, half_widths=half_widths)

    def force(self, recording: Recording, balance: Acceleration) -> Array:
        """Force that is missing in the balance, N."""
        return np.asarray(self.mass(recording) * balance.residuals(self.vector, np.zeros((1, 0)))[0])


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))


def ahead_pieces(part: Ahead, recording: Recording, predicted: Array) -> AheadPieces:
    """The windows of one recording for drawing: every second one, since they overlap by half.

    part: the objective on this recording alone; predicted: (1, N) m, its windows one after the other.
    """
    length = int(part.segments.count[0])
    shape = (-1, length)
    error = (predicted[0] - part.measured).reshape(shape)
    y = predicted[0].reshape(shape)
    period = recording.duration / (recording.t.size - 1)
    t = recording.t[part.flat].reshape(shape)

    def stitched(block: Array) -> Array:
        return np.pad(block[::2], ((0, 0), (0, 1)), constant_values=np.nan).ravel()[:-1]

    v = np.gradient(y, period, axis=1, edge_order=2)
    lines = [stitched(block) for block in (t, y, v, error)]
    return AheadPieces((length - 1) * period, lines[0], lines[1], lines[2], lines[3], t[:, -1], error[:, -1])


def _measure(
    task: _Task, recording: Recording, repeats: Sequence[Recording], seed: int | None
) -> tuple[RecordingGap, Trace]:
    """Measures and trace of one recording; seed: of the noise draws, None: no floors."""
    y_simulated, v_simulated = task.free_run(recording)
    spread = float(np.std(recording.y))
    ahead = task.ahead(recording)
    pieces = ahead_pieces(ahead, recording, ahead.simulate(task.vector))
    balance = task.balance(recording)
    force = task.force(recording, balance)
    floors = np.full(3, np.nan)
    if seed is not None:
        floors = _noise_floors(task, recording, balance, seed)
    scatters = [_scatter(task, *pair) for pair in (aligned(recording, other) for other in repeats) if pair is not None]
    if scatters and seed is not None:
        floors = np.maximum(floors, np.sqrt(np.mean(np.square(scatters), axis=0)))
    gap = RecordingGap(
        recording=recording.name,
        kind=recording.kind,
        split=recording.split,
        free_run=_rms(y_simulated - recording.y) / spread,
        free_run_floor=float(floors[0]) / spread,
        ahead=_rms(pieces.end_error),
        ahead_floor=float(floors[1]),
        force=_rms(force),
        force_share=_rms(force) / max(_total_force(task, recording, balance), 1e-300),
        force_floor=float(floors[2]),
        repeats=len(scatters),
    )
    trace = replace(
        traced(recording, y_simulated, v_simulated),
        force_t=recording.t[balance.rows],
        force_residual=force,
        ahead=pieces if recording.kind != "free_wheel" else None,
    )
    return gap, trace


def _total_force(task: _Task, recording: Recording, balance: Acceleration) -> float:
    """RMS of the total force: the motor's on driven runs, the inertial force on free wheels."""
    mass = task.mass(recording)
    if recording.kind == "free_wheel":
        return mass * _rms(balance.target)
    frictionless = task.vector.copy()
    frictionless[0, :7] = (1e-12, 1e-12, 1.0, 2.0, 1.0, 0.0, 0.0)
    return mass * _rms(balance.model_acceleration(frictionless)[0])


def _noise_floors(task: _Task, recording: Recording, balance: Acceleration, seed: int) -> Array:
    """RMS free-run error (m), ahead error (m) and force error (N) that measurement noise alone would cause, (3,).

    The smoothed motion of the recording is measured anew: the noise of each stretch and the steps of the encoder fall
    as they might have fallen, which noise on top of readings that have steps already does not. How the errors scatter
    about their median is the noise's share. The measured motion is the base, because a model's own motion may rest or
    slip elsewhere than the machine did.
    """
    task = replace(task, substeps=min(task.substeps, _DRAWN_STEPS))
    # The start speed of a free wheel is fitted over the whole run, that of a driven one is as noisy as its samples.
    held = task.free_run(recording)[0] if recording.kind == "free_wheel" else None
    errors: list[list[Array]] = [[], [], []]
    for anew in _measured_again(recording, seed):
        runs = task.free_run(*anew)[0] if held is None else np.tile(held, len(anew))
        run = runs - np.concatenate([one.y for one in anew])
        forces = [task.force(one, task.balance(one, balance.half_widths).at_rows_of(balance)) for one in anew]
        for kept, error in zip(errors, (run, task.ahead_error(*anew), np.concatenate(forces)), strict=True):
            kept.append(np.nan_to_num(error, nan=np.inf).reshape(len(anew), -1))
    return np.array([_scatter_of_draws(np.concatenate(rows)) for rows in errors])


def _measured_again(recording: Recording, seed: int) -> Iterator[list[Recording]]:
    """`_DRAWS` other measurements of a recording's motion and inputs, as many at a time as the memory has room for."""
    kept = _drawn.get(recording)
    if kept is not None and kept[0] == seed:
        yield kept[1]
        return
    generator, levels, smooth = np.random.default_rng(seed), input_levels(recording), measure_motion([recording]).y
    together = max(1, min(_DRAWS, _AT_ONCE // recording.t.size))
    for begin in range(0, _DRAWS, together):
        count = min(together, _DRAWS - begin)
        anew = [with_input_noise(retaken(recording, smooth, generator), generator, levels) for _ in range(count)]
        if count == _DRAWS and recording.t.size <= _KEPT:
            _drawn[recording] = seed, anew
        yield anew


def _scatter_of_draws(errors: Array) -> float:
    """RMS scatter of errors (draws, n) about their median over the draws; infinite where runs diverge."""
    if not np.all(np.isfinite(errors)):
        return float("inf")
    squares = np.mean((errors - np.median(errors, axis=0)) ** 2, axis=1)
    return float(np.sqrt(np.mean(np.minimum(squares, _ODD * np.median(squares))) / _ABOUT_MEDIAN))


def _scatter(task: _Task, one: Recording, other: Recording) -> Array:
    """What of free-run error (m), ahead error (m) and force error (N) does not repeat, RMS, (3,).

    one, other: aligned repeats. Their errors share what the model lacks, which is no floor; each has its own scatter,
    hence the square root of two. Each repeat is run with its own start and inputs, so these may differ.
    """
    first = task.balance(one)
    pairs = (
        [task.free_run(r)[0] - r.y for r in (one, other)],
        [task.ahead_error(r) for r in (one, other)],
        [task.force(one, first), task.force(other, task.balance(other, first.half_widths))],
    )
    return np.asarray([_rms(a - b) / np.sqrt(2.0) for a, b in pairs])
