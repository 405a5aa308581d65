"""The objective `free_run`: displacement over the whole run, as in the paper."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from linid.arrays import Array, Integers
from linid.identification.objectives.objective import Directions, independent_along
from linid.identification.signals.motion import measure_motion
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings

_GROUP = 0.02  # s, residuals of free runs are grouped in bins of this length
# Of a recording's highest speed: an axis that starts slower is taken to have stood, its bristle in balance. The sign of
# such a speed, which is noise or one of the first samples under a current that jumps, would bend it to one side.
_RESTS = 0.02


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
        fastest = np.maximum.reduceat(np.abs(self.motion.v), first)
        self.moving = np.abs(self.start[:, 1]) > _RESTS * fastest
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
        self.signal = np.concatenate([r.y - np.mean(r.y) for r in self.recordings])
        self.floor = float(np.median(noise))

    def starts(self, offsets: Array) -> Array:
        """Start states (C, R, 3) for offsets (C, 2 R); the bristle follows from the model (nan)."""
        shape = (offsets.shape[0], len(self.recordings), 2)
        state = np.full((*shape[:2], 3), np.nan)
        state[:, :, :2] = self.start + offsets.reshape(shape) * self.scale
        state[:, ~self.moving, 1] = 0.0
        return state

    def simulate(self, params: Array, offsets: Array, *, velocity: bool = False) -> tuple[Array, Array, int]:
        """Free-run positions (C, N) m and velocities. params: (C, VECTOR_SIZE); offsets: (C, nuisances), position and
        speed.
        """
        return self.simulator.run(params, self.segments, self.starts(offsets), velocity=velocity)

    def residuals(self, params: Array, offsets: Array) -> Array:
        """(C, N) position errors in m. params: (C, VECTOR_SIZE); offsets: (C, nuisances), position and speed."""
        return self._projected(self.simulate(params, offsets)[0] - self.motion.measured)

    def independent(self, residuals: Array, slopes: Array | None = None) -> Array:
        """How many of residuals (N,) are independent of each other, by recording (R,); not known in the search, whose
        candidates are too far off.

        slopes: (N, p + 2) by p parameters, by start positions and by start speeds (None: not known). With them
        recordings share what all have together as they do once nothing is left that parameters or starts explain:
        else the one whose residuals are white counts more, is fitted better, becomes whiter still, and in the end no
        other counts. Together they count as their residuals are, by the harmonic mean.
        """
        if self.project:
            return np.zeros(len(self.recordings))
        edges = self.simulator.inputs.sample_offsets
        counts = _independent(residuals, edges)
        shared = counts if slopes is None else _independent(_unexplained(residuals, slopes, edges), edges)
        if not np.all((counts > 0.0) & (shared > 0.0)):
            return counts
        return shared * min(np.sum(1.0 / shared) / np.sum(1.0 / counts), 1.0)

    @property
    def carries_slopes(self) -> bool:
        """Whether `slopes` is to be used: not in the search, whose descents end elsewhere with it."""
        return not self.project and self.simulator.has_slopes(guided=False)

    def slopes(self, params: Array, offsets: Array, directions: Directions) -> tuple[Array, Array]:
        """Residuals (N,) in m at params (VECTOR_SIZE,) and offsets (nuisances,), and their derivatives (N, K) in K
        directions."""
        count = len(directions.offsets)
        moved = np.zeros((len(self.recordings), 3, count))
        moved[:, :2] = (directions.offsets.reshape(count, -1, 2) * self.scale).transpose(1, 2, 0)
        moved[~self.moving, 1] = 0.0
        start = self.starts(offsets[None])[0]
        y, slopes = self.simulator.slopes(params, directions.params, self.segments, start, moved, guided=False)
        return y - self.motion.measured, slopes

    def _projected(self, errors: Array) -> Array:
        """Errors (C, N), without start position and speed of free wheels where these are projected out."""
        if self.project:
            edges = self.simulator.inputs.sample_offsets
            for index, recording in enumerate(self.recordings):
                if recording.kind != "free_wheel":
                    continue
                a, b = edges[index], edges[index + 1]
                basis = np.linalg.qr(np.column_stack([np.ones(b - a), self.motion.v[a:b]]))[0]
                errors[:, a:b] -= (errors[:, a:b] @ basis) @ basis.T
        return errors


def _independent(residuals: Array, edges: Integers) -> Array:
    """How many of residuals (N,) are independent of each other, between edges (R + 1,), (R,)."""
    return np.array([independent_along(residuals[a:b]) for a, b in pairwise(edges)])


def _unexplained(residuals: Array, slopes: Array, edges: Integers) -> Array:
    """Residuals (N,) without what their slopes (N, p + 2) explain: p columns all recordings together, the others each
    recording alone; edges: (R + 1,) between recordings.

    Source: Frisch and Waugh 1933, Econometrica 1, 387: the recordings' own columns go first.
    """
    rows = np.column_stack([residuals, slopes])
    if not np.all(np.isfinite(rows)):  # a failed simulation
        return residuals
    rows = rows[:, :-2]
    for a, b in pairwise(edges):
        starts = slopes[a:b, -2:]
        own = np.linalg.qr(starts[:, np.any(starts, axis=0)])[0]  # where an axis stood, its speed is none
        rows[a:b] -= own @ (own.T @ rows[a:b])
    columns = rows[:, 1:][:, np.any(rows[:, 1:], axis=0)]
    columns = columns / np.linalg.norm(columns, axis=0)
    return np.asarray(rows[:, 0] - columns @ np.linalg.lstsq(columns, rows[:, 0], rcond=1e-9)[0])
