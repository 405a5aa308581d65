"""The force balance along the measured motion: residual acceleration of many recordings, with its noise floor."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, MutableMapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array, Integers
from linid.identification.objectives.acceleration import Acceleration
from linid.identification.signals.motion import retaken, with_input_noise
from linid.parallel_tasks import in_parallel
from linid.physics.model import Model
from linid.physics.motors.registry import MOTORS
from linid.recording.recording import Recording
from linid.statistics import MEDIAN_ABSOLUTE

Memory = MutableMapping[str, Any]
Places = tuple[int, ...]  # of some recordings among all, in order

BIN = 0.05  # s; rows of one bin have one weight in a fit: a reversal that no model follows spoils its own bin only
BLOCK = 0.25  # s; rows of one block have one word in a judgement and are resampled together
_DRAWS = 4
_KEPT_DRAWS = 100_000  # samples, up to which these measurements are kept for the second judge: 250 MB
_BURST = 1e9  # deviations
_STILL = 1e-3  # of the largest change of a residual by noise: what changes less rests within an encoder's step
_LEAST_FLOOR = 0.3  # of the median floor: no recording counts more than that however quiet it is


@dataclass(frozen=True)
class Rows:
    """Rows of the weak-form force balance of R recordings; no row touches a jump of an input.

    recording: (n,) 0 to R - 1; block, bin: (n,) number of the stretch of `BLOCK` and of `BIN` seconds; t, y, v, a: (n,)
    measured motion in SI; current: (n,) signed thrust-producing current or input (A or V), 0 without; standstill: (n,)
    true where the axis rests.
    """

    recording: Integers
    block: Integers
    bin: Integers
    t: Array
    y: Array
    v: Array
    a: Array
    current: Array
    standstill: NDArray[np.bool_]


@dataclass(frozen=True)
class Noise:
    """Mean squares (B,) in (m/s^2)^2 that the noise of encoder and of inputs give the residual per bin.

    gain: acceleration per input at which that of the inputs was found; it grows with the square of it. A fit that did
    not count that would do best with inputs that push nowhere (errors in variables: Fuller 1987, Measurement Error
    Models).
    """

    encoder: Array
    inputs: Array
    gain: float

    def power(self, gain: float) -> Array:
        """Mean squares (B,) under a model with another acceleration per input."""
        return self.encoder + self.inputs * (gain / self.gain if self.gain else 0.0) ** 2

    def deviation(self, rows: Rows) -> Array:
        """Standard deviations (R,) in m/s^2 per recording under the model at which they were found."""
        power = (self.encoder + self.inputs)[rows.bin]
        counts = np.maximum(np.bincount(rows.recording), 1)
        return np.asarray(np.sqrt(np.bincount(rows.recording, power) / counts))


class Balance:
    """Residual accelerations of some recordings under any model, always at the same rows and bumps.

    memory: fits of an earlier run by key, and where new ones are kept.
    """

    def __init__(
        self, base: Model, recordings: Sequence[Recording], jobs: int, seed: int, memory: Memory | None = None
    ) -> None:
        self.recordings = tuple(recordings)
        self.memory: Memory = {} if memory is None else memory
        self.base = base
        self.jobs = jobs
        self.seed = seed
        self._part = Acceleration(base, self.recordings, jobs)
        self._draws: list[Acceleration] | None = None  # while `measured_once`
        self._parts: dict[Places, Acceleration] = {}  # of some recordings alone
        self.rows = _rows(self._part, self.recordings)

    def __getstate__(self) -> dict[str, Any]:
        # On its way to a worker: it has one thread and a memory of its own.
        return {**self.__dict__, "memory": dict(self.memory), "jobs": 1, "_draws": None}

    def part(self, model: Model) -> Acceleration:
        """The rows under a model."""
        return self._part.with_model(model)

    def residuals(self, model: Model, vectors: Array, places: Places | None = None) -> Array:
        """Measured minus modelled acceleration (C, n) in m/s^2; vectors: (C, VECTOR_SIZE) SI; places: of the recordings
        that are asked for (None: all), 0 in the rows of others."""
        residuals = -self._some(places).with_model(model).residuals(vectors, np.zeros((vectors.shape[0], 0)))
        return self._in_all_rows(np.nan_to_num(residuals, nan=1e3, posinf=1e3, neginf=-1e3), places)

    def _some(self, places: Places | None) -> Acceleration:
        """The rows of some recordings alone."""
        if places is None:
            return self._part
        if places not in self._parts:
            self._parts[places] = self._part.of_rows(self.rows_of(places))
        return self._parts[places]

    def _in_all_rows(self, found: Array, places: Places | None) -> Array:
        """What was found in the rows of some recordings (C, k) among all rows (C, n)."""
        if places is None:
            return found
        out = np.zeros((found.shape[0], self.rows.t.size))
        out[:, self.rows_of(places)] = found
        return out

    def rows_of(self, places: Iterable[int]) -> NDArray[np.bool_]:
        """Rows (n,) that belong to recordings given by their places."""
        chosen = np.zeros(len(self.recordings), dtype=np.bool_)
        chosen[list(places)] = True
        return np.asarray(chosen[self.rows.recording])

    def has_slopes(self, model: Model) -> bool:
        """Whether `slopes` knows a model. Of one without effects differences are nearly as fast."""
        return model.mask != 0 and self.part(model).simulator.has_slopes_along

    def slopes(self, model: Model, vector: Array, tangents: Array, places: Places | None = None) -> Array:
        """How the residuals answer K directions, (K, n) in m/s^2 per unit of each. vector: (VECTOR_SIZE,) SI; tangents:
        (K, VECTOR_SIZE); places: as in `residuals`."""
        slopes = -self._some(places).with_model(model).slopes(vector, tangents)
        return self._in_all_rows(np.nan_to_num(slopes, nan=0.0, posinf=0.0, neginf=0.0), places)

    def residual(self, model: Model, vector: Array) -> Array:
        """`residuals` of a single vector, (n,) m/s^2."""
        return np.asarray(self.residuals(model, vector[None, :])[0])

    @contextmanager
    def measured_once(self) -> Iterator[None]:
        """Let `noise` use the same measurements again and again within this block."""
        self._draws = []
        try:
            yield
        finally:
            self._draws = None

    def noise(self, model: Model, vector: Array) -> Noise:
        """What encoder and input noise alone give the residual under a model. vector: (VECTOR_SIZE,), SI.

        The smoothed motion measured anew, several times: how the residuals scatter about their mean. (Not about those
        of the smoothed motion itself: without noise nobody can tell where it rests.)
        """
        asked = in_parallel(partial(self._residual_again, model, vector), self._measured_again(), self.jobs)
        by_encoder, by_inputs = np.split(np.array([residual for _, residual in asked]), [_DRAWS])
        rows = self.rows
        encoder = (by_encoder - by_encoder.mean(axis=0)) * math.sqrt(_DRAWS / (_DRAWS - 1.0))
        inputs = by_inputs - by_encoder[0]
        found = []
        for changes in (encoder, inputs):
            # A stop that moves by a sample leaves a burst, which is not the noise's usual size.
            limits = np.array([_BURST * _spread_of(change, rows.recording)[rows.recording] for change in changes])
            found.append(_per_bin(np.clip(changes, -limits, limits) ** 2, rows))
        return Noise(found[0], found[1], gain_of(model, vector))

    def _measured_again(self) -> Sequence[Acceleration | Sequence[Recording]]:
        """Other measurements of the same motions, by other noise of the encoder and of the inputs, `_DRAWS` each."""
        if self._draws:
            return self._draws
        generator = np.random.default_rng(self.seed)
        offsets = self._part.simulator.inputs.sample_offsets
        smooth = [self._part.motion.y[offsets[k] : offsets[k + 1]] for k in range(len(self.recordings))]
        anew = [[retaken(r, y, generator) for r, y in zip(self.recordings, smooth, strict=True)] for _ in range(_DRAWS)]
        fed = [[with_input_noise(r, generator) for r in anew[0]] for _ in range(_DRAWS)]
        if self._draws is None or offsets[-1] > _KEPT_DRAWS:
            return [*anew, *fed]
        self._draws = [part for _, part in in_parallel(self._rows_again, [*anew, *fed], self.jobs)]
        return self._draws

    def _rows_again(self, recordings: Sequence[Recording], jobs: int) -> Acceleration:
        """The same rows of other measurements."""
        part = Acceleration(self.base, tuple(recordings), jobs, half_widths=self._part.half_widths)
        return part.at_rows_of(self._part)

    def _residual_again(
        self, model: Model, vector: Array, measured: Acceleration | Sequence[Recording], jobs: int
    ) -> Array:
        """The residual (n,) in m/s^2 at the same rows of other measurements. vector: (VECTOR_SIZE,), SI."""
        part = measured if isinstance(measured, Acceleration) else self._rows_again(measured, jobs)
        found = part.with_model(model).residuals(vector[None, :], np.zeros((1, 0)))[0]
        return np.asarray(np.nan_to_num(-found))

    def smoothed(self, accelerations: Sequence[Array]) -> Array:
        """Accelerations of each recording's samples, in m/s^2, as the rows' bumps see them, (n,)."""
        kernels = zip(accelerations, self._part.kernels, strict=True)
        smooth = np.concatenate([np.convolve(one, kernel, "same") for one, kernel in kernels])
        return np.asarray(smooth[self._part.rows])

    @cached_property
    def blur(self) -> Array:
        """Per recording (R,): the deviation in s of the moments that a row's bump is the mean of."""
        out = []
        for kernel, dt in zip(self._part.kernels, self._part.simulator.inputs.dts, strict=True):
            place = np.arange(kernel.size) - (kernel.size - 1) / 2.0
            out.append(float(dt) * math.sqrt(float(kernel @ place**2) / float(kernel.sum())))
        return np.array(out)

    @cached_property
    def split(self) -> NDArray[np.bool_]:
        """(n,) true where a row belongs to a held-out recording."""
        held = np.array([r.split == "held_out" for r in self.recordings])
        return np.asarray(held[self.rows.recording])


def gain_of(model: Model, vector: Array) -> float:
    """Acceleration per input in m/s^2 per A (or V), but for the shape of the field; 0 without a motor.
    vector: (VECTOR_SIZE,), SI.
    """
    motor = MOTORS[model.kind]
    if not motor.inputs:
        return 0.0
    shape = {name: float(vector[model.slot(name)]) for name, _ in motor.shape}
    constant = float(motor.fundamental(float(vector[model.slot("force_constant")]), shape))
    return constant / float(vector[model.slot("mass")])


def scale_of(noise: Array) -> Array:
    """Per recording (R,): the acceleration in m/s^2 in which its residuals are counted, its noise or little less."""
    return np.asarray(np.maximum(noise, max(_LEAST_FLOOR * float(np.median(noise)), 1e-12)))


def _spread_of(x: Array, owner: Integers) -> Array:
    """Robust standard deviation (R,) of x (n,) per recording, of where it is not still: a coarse encoder rests."""
    out = []
    for k in range(int(owner.max(initial=-1)) + 1):
        mine = np.abs(x[owner == k])
        moved = mine[mine > _STILL * np.max(mine, initial=0.0)]
        out.append(float(np.median(moved)) / MEDIAN_ABSOLUTE if moved.size else 0.0)
    return np.array(out)


def _per_bin(squares: Array, rows: Rows) -> Array:
    """Mean squares (B,) per bin of draws (D, n), drawn to the mean of their recording by as much as they scatter by
    chance (empirical Bayes: Efron and Morris 1973, J. Am. Stat. Assoc. 68, 117)."""
    counts = np.maximum(np.bincount(rows.bin), 1)
    draws = np.array([np.bincount(rows.bin, one) / counts for one in squares])
    means = draws.mean(axis=0)
    chance = draws.var(axis=0, ddof=1) / draws.shape[0]
    owner = np.zeros(counts.size, dtype=np.int64)
    owner[rows.bin] = rows.recording
    out = np.empty(counts.size)
    for index in np.unique(owner):
        mine = owner == index
        middle = float(np.average(means[mine], weights=counts[mine]))
        by_chance = float(np.mean(chance[mine]))
        between = max(float(np.var(means[mine])) - by_chance, 0.0)
        kept = between / max(between + by_chance, 1e-300)
        out[mine] = middle + kept * (means[mine] - middle)
    return out


def thrust_current(recording: Recording) -> Array:
    """Signed size of the input (n,): amplitude of the currents' space vector with the sign of its strongest side."""
    if recording.drive_input is not None and recording.phase_currents is None:
        return np.asarray(recording.drive_input)
    if recording.phase_currents is None:
        return np.zeros(recording.y.size)
    i_1, i_2, i_3 = recording.phase_currents
    return np.asarray(np.sqrt(2.0 / 3.0 * (i_1**2 + i_2**2 + i_3**2)))


def _rows(part: Acceleration, recordings: tuple[Recording, ...]) -> Rows:
    offsets = part.simulator.inputs.sample_offsets
    owner = part.classes
    sample = part.rows - offsets[owner]
    t, current = np.empty(part.rows.size), np.empty(part.rows.size)
    parts = np.empty((2, part.rows.size), dtype=np.int64)
    first = np.zeros(2, dtype=np.int64)
    for index, recording in enumerate(recordings):
        mine = owner == index
        t[mine] = recording.t[sample[mine]]
        current[mine] = thrust_current(recording)[sample[mine]]
        for place, length in enumerate((BLOCK, BIN)):
            number = ((t[mine] - recording.t[0]) // length).astype(np.int64)
            # Without the empty ones, which jumps of an input leave.
            number = np.unique(number, return_inverse=True)[1]
            parts[place, mine] = number + first[place]
            first[place] += int(number.max(initial=-1)) + 1
    motion = part.motion
    flat = part.rows
    return Rows(
        owner, parts[0], parts[1], t, motion.y[flat], motion.v[flat], part.target, current, motion.standstill[flat]
    )
