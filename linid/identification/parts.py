"""The three objectives as residual rows: `free_run`, `ahead` and `acceleration` (in weak form).

Each part holds some recordings and gives, for every candidate, residuals with a class each. Residuals of a
class share one unknown noise level; groups keep the order in time for the uncertainty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from linid.identification.motion import Motion, input_jumps, measure_motion
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Segments, Simulator, whole_recordings

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

HORIZON = 0.1  # s, how far `ahead` looks
BUMP_HALF_WIDTHS = (0.007, 0.014, 0.028, 0.056)  # s, half-widths of the weak form's kernel
_BUMP_NOISE = 0.2  # widen until noise is below this share of the acceleration
_TRAVEL_CLASSES = (1e-4, 1e-2)  # of the recording's range: resting, creeping, moving
_GROUP = 0.02  # s, residuals of free runs are grouped in bins of this length


class Part(Protocol):
    """Residuals of some recordings under one objective."""

    name: str
    recordings: tuple[Recording, ...]
    classes: Integers  # (N,)
    groups: Integers  # (N,), consecutive along time
    group_recording: Integers  # (groups,)
    nuisances: int  # start-state offsets per candidate
    floor: float
    robust: bool  # whether single groups may be outliers (bursts, unstable breakaways)

    def residuals(self, params: Array, offsets: Array) -> Array:
        """(C, N) residuals in the part's unit; offsets: (C, nuisances)."""
        ...


def _travel_class(span: Array, full: float) -> Integers:
    limits = np.array(_TRAVEL_CLASSES) * full
    return np.asarray(np.searchsorted(limits, span), dtype=np.int64)


@dataclass
class FreeRun:
    """Displacement over the whole run (the paper's objective), in m; start position and speed are nuisances.

    project: take them out linearly instead of fitting them (for the search). A change of start speed moves a
    coast-down along its own trajectory, so that its shape is the measured speed.
    """

    model: Model
    recordings: tuple[Recording, ...]
    substeps: int
    jobs: int
    project: bool = False
    name: str = "free_run"
    robust: bool = False

    def __post_init__(self) -> None:
        self.simulator = Simulator(self.model, pack_inputs(self.recordings), self.substeps, self.jobs)
        self.segments = whole_recordings(self.simulator.inputs)
        self.motion = measure_motion(self.recordings)
        first = self.simulator.inputs.sample_offsets[:-1]
        self.start = np.column_stack([self.motion.y[first], self.motion.v[first]])
        self.moving = self.start[:, 1] != 0.0
        noise = np.maximum(self.motion.position_noise, 1e-12)
        # Offsets are searched in units of their own uncertainty, so that all Jacobian columns have like size.
        self.scale = np.column_stack([noise, np.maximum(self.motion.speed_noise, 1e-9)])
        self.nuisances = 2 * len(self.recordings)
        counts = self.simulator.inputs.counts
        self.classes = np.repeat(np.arange(counts.size, dtype=np.int64), counts)
        groups, owner, base = [], [], 0
        for index, recording in enumerate(self.recordings):
            bins = np.arange(recording.t.size) // max(1, round(_GROUP / recording.period))
            groups.append(bins + base)
            base += int(bins[-1]) + 1
            owner += [index] * (int(bins[-1]) + 1)
        self.groups = np.concatenate(groups).astype(np.int64)
        self.group_recording = np.array(owner, dtype=np.int64)
        self.floor = float(np.median(noise))

    def starts(self, offsets: Array) -> Array:
        """Start states (C, R, 3) for offsets (C, 2 R); the bristle follows from the model (nan)."""
        shape = (offsets.shape[0], len(self.recordings), 2)
        state = np.full((*shape[:2], 3), np.nan)
        state[:, :, :2] = self.start + offsets.reshape(shape) * self.scale
        state[:, ~self.moving, 1] = 0.0
        return state

    def simulate(self, params: Array, offsets: Array, *, velocity: bool = False) -> tuple[Array, Array, int]:
        """Free-run positions (C, N) m and velocities."""
        return self.simulator.run(params, self.segments, self.starts(offsets), velocity=velocity)

    def residuals(self, params: Array, offsets: Array) -> Array:
        """(C, N) position errors in m."""
        errors = self.simulate(params, offsets)[0] - self.motion.measured
        if self.project:
            edges = self.simulator.inputs.sample_offsets
            for index, recording in enumerate(self.recordings):
                if recording.kind != "free_wheel":
                    continue
                a, b = edges[index], edges[index + 1]
                basis = np.linalg.qr(np.column_stack([np.ones(b - a), self.motion.v[a:b]]))[0]
                errors[:, a:b] -= (errors[:, a:b] @ basis) @ basis.T
        return errors


@dataclass
class Ahead:
    """Prediction over a short horizon from the measured state, restarted every half horizon, in m.

    The start state's error adds a straight line to a window; that line is projected out.
    thin: use only every thin-th window (for the search's first look). skip_jumps: leave out windows in which
    an input jumps between two samples, since nobody knows when it did.
    """

    model: Model
    recordings: tuple[Recording, ...]
    substeps: int
    jobs: int
    horizon: float = HORIZON
    thin: int = 1
    project: bool = True
    skip_jumps: bool = True
    name: str = "ahead"
    nuisances: int = 0
    robust: bool = True

    def __post_init__(self) -> None:
        self.simulator = Simulator(self.model, pack_inputs(self.recordings), self.substeps, self.jobs)
        self.motion = measure_motion(self.recordings)
        inputs = self.simulator.inputs
        recording, first, count = [], [], []
        for index, samples in enumerate(inputs.counts):
            length = min(max(8, round(self.horizon / inputs.dts[index])), int(samples) - 1)
            begins = np.arange(0, int(samples) - length, max(1, length // 2) * self.thin)
            for k in self._smooth_windows(index, begins, length):
                recording.append(index)
                first.append(int(k))
                count.append(length + 1)
        self.segments = Segments(*(np.array(x, dtype=np.int64) for x in (recording, first, count)))
        self.flat_first = inputs.sample_offsets[self.segments.recording] + self.segments.first
        flat = [np.arange(a, a + n) for a, n in zip(self.flat_first, self.segments.count, strict=True)]
        self.flat = np.concatenate(flat)
        self.measured = self.motion.measured[self.flat]
        self.bases = {int(n): _line_basis(int(n)) for n in np.unique(self.segments.count)}
        spans = np.array([np.ptp(self.motion.y[rows]) for rows in flat])
        full = np.array([np.ptp(r.y) for r in self.recordings])[self.segments.recording]
        sizes = self.segments.count
        kinds = len(_TRAVEL_CLASSES) + 1
        travelled = _travel_class(spans / np.maximum(full, 1e-300), 1.0)
        self.classes = np.repeat(self.segments.recording * kinds + travelled, sizes)
        self.groups = np.repeat(np.arange(sizes.size, dtype=np.int64), sizes)
        self.group_recording = self.segments.recording
        self.floor = float(np.median(np.maximum(self.motion.position_noise, 1e-12)))

    def _smooth_windows(self, index: int, begins: Integers, length: int) -> Integers:
        """The windows without a jump of the input (all, where hardly any is without)."""
        if not self.skip_jumps:
            return begins
        before = np.concatenate([[0], np.cumsum(input_jumps(self.recordings[index]))])
        smooth = begins[before[begins + length] == before[begins]]
        return smooth if smooth.size >= max(4, begins.size // 10) else begins

    def simulate(self, params: Array) -> Array:
        """Predicted positions of all windows, (C, N) m."""
        motion = self.motion
        start_w = np.full((params.shape[0], len(self.recordings)), np.nan)
        _, w = self.simulator.along(params, motion.y, motion.v, motion.standstill, start_w)
        starts = np.empty((params.shape[0], self.flat_first.size, 3))
        starts[:, :, 0] = motion.y[self.flat_first]
        starts[:, :, 1] = motion.v[self.flat_first]
        starts[:, :, 2] = w[:, self.flat_first]
        return self.simulator.run(params, self.segments, starts)[0]

    def residuals(self, params: Array, offsets: Array) -> Array:
        """(C, N) prediction errors in m, each window without its straight line."""
        errors = self.simulate(params) - self.measured
        if not self.project:
            return errors
        offsets_out = self.segments.out_offsets
        for length, basis in self.bases.items():
            windows = np.flatnonzero(self.segments.count == length)
            rows = (offsets_out[windows][:, None] + np.arange(length)).ravel()
            block = errors[:, rows].reshape(errors.shape[0], windows.size, length)
            errors[:, rows] = (block - (block @ basis) @ basis.T).reshape(errors.shape[0], -1)
        return errors


def _line_basis(length: int) -> Array:
    line = np.column_stack([np.ones(length), np.arange(length, dtype=np.float64)])
    return np.asarray(np.linalg.qr(line)[0])


def bump(half_width: int) -> Array:
    """Smooth kernel (2 half_width + 1,) of the weak form, sum 1: (1 - x^2)^4 on (-1, 1)."""
    x = np.arange(-half_width, half_width + 1) / (half_width + 1)
    kernel = (1.0 - x * x) ** 4
    return np.asarray(kernel / kernel.sum())


def _smooth_acceleration(y: Array, dt: float, half_width: int) -> Array:
    """Second difference of y over dt^2, smoothed by the bump, (n,) in m/s^2."""
    second = np.zeros(y.size)
    second[1:-1] = np.diff(y, 2) / dt**2
    return np.convolve(second, bump(half_width), mode="same")


def _bump_half_width(y: Array, dt: float, noise: float) -> int:
    """Narrowest kernel (samples) that leaves little noise in the acceleration; wide ones blur ripple."""
    half = 2
    for width in BUMP_HALF_WIDTHS:
        half = max(2, min(round(width / dt), y.size // 8))
        gain = float(np.sqrt(np.sum(np.diff(bump(half), 2, prepend=[0, 0], append=[0, 0]) ** 2))) / dt**2
        signal = float(np.sqrt(np.mean(_smooth_acceleration(y, dt, half) ** 2)))
        if gain * noise < _BUMP_NOISE * signal:
            break
    return half


@dataclass
class Acceleration:
    """Force balance along the measured motion divided by the mass, in m/s^2, in weak form.

    The model's acceleration and the second difference of raw position are smoothed by the same bump.
    The second difference is a triangle-weighted mean of acceleration: (1, 10, 1)/12 of its samples (Numerov).
    half_widths: of the bump in samples per recording (empty: chosen by the noise).
    """

    model: Model
    recordings: tuple[Recording, ...]
    jobs: int
    stride: int = 0
    half_widths: tuple[int, ...] = ()
    name: str = "acceleration"
    nuisances: int = 0
    robust: bool = True

    def __post_init__(self) -> None:
        self.simulator = Simulator(self.model, pack_inputs(self.recordings), 1, self.jobs)
        self.motion = measure_motion(self.recordings)
        inputs = self.simulator.inputs
        centres, groups, owner, owners = [], [], [], []
        widths: list[int] = []
        self.measured_acceleration = np.zeros(self.motion.measured.size)
        self.kernels: list[Array] = []
        for index, recording in enumerate(self.recordings):
            a, b = inputs.sample_offsets[index], inputs.sample_offsets[index + 1]
            dt = inputs.dts[index]
            if self.half_widths:
                half = self.half_widths[index]
            else:
                half = _bump_half_width(recording.y, dt, float(self.motion.position_noise[index]))
            widths.append(half)
            kernel = np.convolve(bump(half), [1.0, 10.0, 1.0]) / 12.0
            self.kernels.append(kernel)
            self.measured_acceleration[a:b] = _smooth_acceleration(recording.y, dt, half)
            stride = self.stride or max(1, half // 2)
            rows = np.arange(half + 3, int(b - a) - half - 3, stride)
            bins = rows // max(1, round(0.05 / dt))
            base = (groups[-1][-1] + 1) if groups else 0
            groups.append(np.unique(bins, return_inverse=True)[1] + base)
            owner += [index] * (int(groups[-1][-1]) + 1 - base)
            centres.append(rows + a)
            owners.append(np.full(rows.size, index, dtype=np.int64))
        self.half_widths = tuple(widths)
        self.rows = np.concatenate(centres)
        self.groups = np.concatenate(groups).astype(np.int64)
        self.group_recording = np.array(owner, dtype=np.int64)
        self.classes = np.concatenate(owners)
        self.target = self.measured_acceleration[self.rows]
        self.floor = 1e-9

    def model_acceleration(self, params: Array) -> Array:
        """Smoothed model acceleration at the rows, (C, N) m/s^2."""
        from scipy.ndimage import convolve1d

        motion = self.motion
        start_w = np.full((params.shape[0], len(self.recordings)), np.nan)
        a, _ = self.simulator.along(params, motion.y, motion.v, motion.standstill, start_w)
        offsets = self.simulator.inputs.sample_offsets
        for index, kernel in enumerate(self.kernels):
            part = slice(offsets[index], offsets[index + 1])
            a[:, part] = convolve1d(a[:, part], kernel, axis=1)
        return np.asarray(a[:, self.rows])

    def residuals(self, params: Array, offsets: Array) -> Array:
        """(C, N) acceleration errors in m/s^2."""
        return self.model_acceleration(params) - self.target


def motion_of(part: Part) -> Motion:
    """The measured motion a part works on."""
    return part.motion  # type: ignore[attr-defined, no-any-return]


def split_by(recordings: Sequence[Recording], kind: str) -> tuple[Recording, ...]:
    """The recordings of one kind."""
    return tuple(r for r in recordings if r.kind == kind)
