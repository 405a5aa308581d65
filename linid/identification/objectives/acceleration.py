"""The objective `acceleration`: force balance along the measured motion, in weak form."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array, Flags, Integers
from linid.identification.objectives.behind_play import along_measured, slopes_measured
from linid.identification.objectives.stencils import Stencils
from linid.identification.signals.motion import input_jumps, measure_motion
from linid.physics.model import Model
from linid.recording.noise import noise_profile, quantum
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator

BUMP_HALF_WIDTHS = (0.007, 0.014, 0.028, 0.056)  # s, half-widths of the weak form's kernel
_BUMP_NOISE = 0.2  # widen until noise is below this share of the acceleration
_GROUP = 0.05  # s, residuals are grouped in bins of this length
_RINGING = 8  # samples beside a jump of an input, over which its spline rings
_MOST_MASKED = 0.8  # of a recording; with more jumps than that its input is not made of jumps


def bump(half_width: int) -> Array:
    """Smooth kernel (n,), n = 2 half_width + 1, of the weak form, sum 1: (1 - x^2)^4 on (-1, 1)."""
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


def _clear_of_jumps(recording: Recording, half_width: int) -> NDArray[np.bool_]:
    """Samples (n,) whose bump touches no jump of an input: no spline knows when within its interval an input jumped."""
    reach = half_width + _RINGING
    touched = np.zeros(recording.y.size, dtype=np.bool_)
    for jump in np.flatnonzero(input_jumps(recording)):
        touched[max(0, jump - reach) : jump + reach + 2] = True
    return ~touched if np.mean(touched) < _MOST_MASKED else np.ones_like(touched)


@dataclass
class Acceleration:
    """Force balance along the measured motion divided by the mass, in m/s^2, in weak form.

    The model's acceleration and the second difference of raw position are smoothed by the same bump.
    The second difference is a triangle-weighted mean of acceleration; so is what the simulation gives. Rows beside
    jumps of an input are left out, for whoever fits, screens or judges alike.
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
        centres: list[Integers] = []
        groups: list[Integers] = []
        owner: list[int] = []
        owners: list[Integers] = []
        widths: list[int] = []
        self.measured_acceleration = np.zeros(self.motion.measured.size)
        self.kernels: list[Array] = []
        for index, recording in enumerate(self.recordings):
            a, b = inputs.sample_offsets[index], inputs.sample_offsets[index + 1]
            dt = inputs.dts[index]
            if self.half_widths:
                half = self.half_widths[index]
            else:
                noise = float(self.motion.position_noise[index])
                if quantum(recording.y) > noise:  # coarse steps, which are noisier where the axis moves
                    noise = float(np.sqrt(np.mean(noise_profile(recording.y) ** 2)))
                half = _bump_half_width(recording.y, dt, noise)
            widths.append(half)
            self.kernels.append(bump(half))
            self.measured_acceleration[a:b] = _smooth_acceleration(recording.y, dt, half)
            stride = self.stride or max(1, half // 2)
            rows = np.arange(half + 3, int(b - a) - half - 3, stride)
            rows = rows[_clear_of_jumps(recording, half)[rows]]
            bins = rows // max(1, round(_GROUP / dt))
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
        self.floor = 1e-9
        self.among: Flags | None = None
        self._see_rows()

    def _see_rows(self) -> None:
        """What is seen at the rows: the measured acceleration, and how smooth ones follow from all samples'."""
        self.target = self.signal = self.measured_acceleration[self.rows]
        self.stencils = Stencils(tuple(self.kernels), self.simulator.inputs.dts, self.rows, self.classes)

    def with_model(self, model: Model) -> Acceleration:
        """The same rows under another model of the same motor's inputs; all that hangs on the recordings is shared."""
        other = copy(self)
        other.model = model
        other.simulator = replace(self.simulator, model=model)
        return other

    def at_rows_of(self, other: Acceleration) -> Acceleration:
        """The same at the rows of an objective on recordings of the same lengths."""
        out = copy(self)
        out.rows, out.classes, out.groups = other.rows, other.classes, other.groups
        out.group_recording = other.group_recording
        out._see_rows()
        return out

    def of_rows(self, chosen: Flags) -> Acceleration:
        """The same at some of its rows alone, without their groups; recordings without any are not computed. chosen:
        (n,)."""
        out = copy(self)
        out.rows, out.classes = self.rows[chosen], self.classes[chosen]
        held = np.bincount(out.classes, minlength=len(self.recordings)) > 0
        out.among = None if bool(np.all(held)) else held
        out._see_rows()
        return out

    def model_acceleration(self, params: Array) -> Array:
        """Smoothed acceleration that the model would have one measure at the rows, (C, N) m/s^2.
        params: (C, VECTOR_SIZE).
        """
        along = along_measured(self.simulator, params, self.motion, without="states", among=self.among)
        a = self.stencils.smooth(along.acceleration)
        if along.reading_error is not None:
            a += self.stencils.second(along.reading_error)
        return a

    def slopes(self, params: Array, tangents: Array) -> Array:
        """How `model_acceleration` answers K directions, (K, N) in m/s^2 per unit of each, where
        `Simulator.has_slopes_along`.

        params: (VECTOR_SIZE,); tangents: (K, VECTOR_SIZE).
        """
        a, reading = slopes_measured(self.simulator, params, tangents, self.motion, self.among)
        a = self.stencils.smooth(a)
        if reading is not None:
            moved = np.any(reading != 0.0, axis=1)
            a[moved] += self.stencils.second(reading[moved])
        return a

    def reading_acceleration(self, params: Array) -> Array:
        """What the model's reading error alone adds to the measured acceleration at the rows, (C, N) m/s^2.
        params: (C, VECTOR_SIZE).
        """
        readings = self.simulator.readings(params, self.motion.y, self.motion.v)
        return self.stencils.second(readings)

    def residuals(self, params: Array, offsets: Array) -> Array:
        """(C, N) acceleration errors in m/s^2. params: (C, VECTOR_SIZE); offsets: (C, 0), there are none."""
        return np.asarray(self.model_acceleration(params) - self.target)
