"""The force balance along the measured motion: residual acceleration of many recordings, with its noise floor."""

from __future__ import annotations

from collections.abc import MutableMapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linid.identification.acceleration import Acceleration
from linid.identification.motion import input_jumps, noise_level, with_input_noise
from linid.physics.model import Model
from linid.recording.recording import Recording

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Memory = MutableMapping[str, Any]

BLOCK = 0.1  # s, rows of one block are resampled together
_DRAWS = 3
_MOST_MASKED = 0.8  # of a recording; with more jumps than that its input is not made of jumps
_LEAST_FLOOR = 0.3  # of the median floor: no recording counts more than that however quiet it is


@dataclass(frozen=True)
class Rows:
    """Rows of the weak-form force balance of R recordings; no row touches a jump of an input.

    index: (n,) places in the objective's residuals; recording: (n,) 0 to R - 1; block: (n,) number of the stretch of
    `BLOCK` seconds; t, y, v, a: (n,) measured motion in SI; current: (n,) signed thrust-producing current or input
    (A or V), 0 without; standstill: (n,) true where the axis rests; half_widths: of the bump, in samples.
    """

    index: Integers
    recording: Integers
    block: Integers
    t: Array
    y: Array
    v: Array
    a: Array
    current: Array
    standstill: NDArray[np.bool_]
    half_widths: tuple[int, ...]


class Balance:
    """Residual accelerations of some recordings under any model, always at the same rows and bumps.

    memory: fits of an earlier run by key, and where new ones are kept.
    """

    def __init__(
        self, base: Model, recordings: Sequence[Recording], jobs: int, seed: int, memory: Memory | None = None
    ) -> None:
        self.recordings = tuple(recordings)
        self.memory: Memory = {} if memory is None else memory
        self.jobs = jobs
        self.seed = seed
        part = Acceleration(base, self.recordings, jobs)
        self._base = base
        self._parts = {base.effects: part}
        self.rows = _rows(part, self.recordings)

    def __getstate__(self) -> dict[str, Any]:
        # On its way to a worker: compiled simulations stay here, and the worker has one thread and a memory of its own.
        return {**self.__dict__, "_parts": {}, "memory": dict(self.memory), "jobs": 1}

    def residual(self, model: Model, vector: Array) -> Array:
        """Measured minus modelled acceleration (n,) in m/s^2; vector: (VECTOR_SIZE,) SI."""
        if model.effects not in self._parts:
            self._parts[model.effects] = Acceleration(
                model, self.recordings, self.jobs, half_widths=self.rows.half_widths
            )
        part = self._parts[model.effects]
        residual = -part.residuals(vector[None, :], np.zeros((1, 0)))[0][self.rows.index]
        return np.asarray(np.nan_to_num(residual, nan=1e3, posinf=1e3, neginf=-1e3))

    def noise(self, model: Model, vector: Array) -> Array:
        """Standard deviation (R,) in m/s^2 that encoder and input noise alone give the residual.

        The recordings hold their noise once; what the residual changes when as much is added is the noise's share.
        """
        generator = np.random.default_rng(self.seed)
        plain = self.residual(model, vector)
        power = np.zeros(len(self.recordings))
        counts = np.maximum(np.bincount(self.rows.recording, minlength=power.size), 1)
        for _ in range(_DRAWS):
            noisy = tuple(_noisier(r, generator) for r in self.recordings)
            part = Acceleration(model, noisy, self.jobs, half_widths=self.rows.half_widths)
            change = -part.residuals(vector[None, :], np.zeros((1, 0)))[0][self.rows.index] - plain
            # A stop that moves by a sample leaves a burst, which is not the noise's usual size.
            change = np.clip(change, -6.0 * _spread(change), 6.0 * _spread(change))
            power += np.bincount(self.rows.recording, change**2, minlength=power.size) / counts / _DRAWS
        return np.sqrt(power)

    @cached_property
    def split(self) -> NDArray[np.bool_]:
        """(n,) true where a row belongs to a held-out recording."""
        held = np.array([r.split == "held_out" for r in self.recordings])
        return np.asarray(held[self.rows.recording])


def scale_of(noise: Array) -> Array:
    """Per recording: the acceleration (m/s^2) in which its residuals are counted, its noise or little less."""
    return np.asarray(np.maximum(noise, max(_LEAST_FLOOR * float(np.median(noise)), 1e-12)))


def _spread(x: Array) -> float:
    return float(np.median(np.abs(x))) / 0.6745 + 1e-300


def _noisier(recording: Recording, generator: np.random.Generator) -> Recording:
    moved = recording.y + noise_level(recording.y) * generator.standard_normal(recording.y.size)
    return with_input_noise(replace(recording, y=moved), generator)


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
    keep = np.ones(part.rows.size, dtype=bool)
    t, current = np.empty(part.rows.size), np.empty(part.rows.size)
    block = np.empty(part.rows.size, dtype=np.int64)
    first = 0
    for index, recording in enumerate(recordings):
        mine = owner == index
        t[mine] = recording.t[sample[mine]]
        current[mine] = thrust_current(recording)[sample[mine]]
        reach = part.half_widths[index] + 8  # the spline rings for some samples beside a jump
        jumps = np.flatnonzero(input_jumps(recording))
        bad = np.zeros(recording.y.size, dtype=bool)
        for jump in jumps:
            bad[max(0, jump - reach) : jump + reach + 2] = True
        if np.mean(bad) < _MOST_MASKED:
            keep[mine] = ~bad[sample[mine]]
        bins = ((t[mine] - recording.t[0]) // BLOCK).astype(np.int64)
        block[mine] = bins + first
        first += int(bins.max(initial=0)) + 1
    motion = part.motion
    chosen = np.flatnonzero(keep)
    flat = part.rows[chosen]
    return Rows(
        chosen, owner[chosen], block[chosen], t[chosen], motion.y[flat], motion.v[flat], part.target[chosen],
        current[chosen], motion.standstill[flat], part.half_widths,
    )  # fmt: skip
