"""The objective `ahead`: prediction over a short horizon, restarted from the measured state."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from linid.arrays import Array, Integers
from linid.identification.objectives.behind_play import along_measured, guides_of, moves_guides
from linid.identification.objectives.objective import TRAVEL_CLASSES, Directions, travel_class
from linid.identification.objectives.start_states import START_STEP, predicted_from_before, slopes_from_before
from linid.identification.settings import HORIZON
from linid.identification.signals.motion import input_jumps, measure_motion
from linid.physics.model import EFFECT_START, MASS, Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.pieces import Pieces
from linid.simulation.run import Segments, Simulator
from linid.simulation.threads import summed

_AT_ONCE = 131072  # numbers that a piece of work holds: few enough to stay near the processor, and worth a thread


@dataclass
class Ahead:
    """Prediction over a short horizon from the measured state, restarted every half horizon, in m.

    The start state's error adds a straight line to a window; that line is projected out.
    Hidden states at the start are those along the measured motion, or, where it does not tell them, estimated from the
    samples before, see `predicted_from_before`.
    thin: use only every thin-th window (for the search's first look). skip_jumps: leave out windows in which
    an input jumps between two samples, since the motion alone shows when it did. guided: the motor's field is read
    at the measured position; at the simulated one a wrong field phase that acts as a spring would fit better than the
    true one, because it holds back what the noise of the currents does. trust: weight (windows,) of each window beside
    others of its class; None: all count alike. stands_for: how many windows of all data each one counts as.
    """

    model: Model
    recordings: tuple[Recording, ...]
    substeps: int
    jobs: int
    horizon: float = HORIZON
    thin: int = 1
    project: bool = True
    skip_jumps: bool = True
    guided: bool = True
    name: str = "ahead"
    nuisances: int = 0
    robust: bool = True
    trust: Array | None = None
    stands_for: int = 1

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
        self.begins = np.zeros(self.motion.y.size, dtype=np.bool_)
        self.begins[self.flat_first] = True
        flat = [np.arange(a, a + n) for a, n in zip(self.flat_first, self.segments.count, strict=True)]
        self.flat = np.concatenate(flat)
        self.measured = self.motion.measured[self.flat]
        self.bases = {int(n): _line_basis(int(n)) for n in np.unique(self.segments.count)}
        spans = np.array([np.ptp(self.motion.y[rows]) for rows in flat])
        full = np.array([np.ptp(r.y) for r in self.recordings])[self.segments.recording]
        sizes = self.segments.count
        kinds = len(TRAVEL_CLASSES) + 1
        travelled = travel_class(spans / np.maximum(full, 1e-300), 1.0)
        self.classes = np.repeat(self.segments.recording * kinds + travelled, sizes)
        self.groups = np.repeat(np.arange(sizes.size, dtype=np.int64), sizes)
        self.group_recording = self.segments.recording
        means = np.bincount(self.groups, self.measured) / np.bincount(self.groups)
        self.signal = self.measured - means[self.groups]
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
        if not self.model.untold_states:
            return self.simulate_along(params)
        guides = self._guides(params)
        return _in_order(
            [
                (these, predicted_from_before(one, params[these], self.motion, self.segments, guided=self.guided))
                for these, one in guides
            ]
        )

    def simulate_along(self, params: Array) -> Array:
        """Predicted positions of all windows from the states along the motion, also of models whose hidden states a
        prediction would have to tell from the samples before, (C, N) m."""
        starts, guides = self._starts(params), self._guides(params)
        return _in_order(
            [
                (these, one.run(params[these], self.segments, starts[these], guided=self.guided)[0])
                for these, one in guides
            ]
        )

    def _guides(self, params: Array) -> list[tuple[Integers | slice, Simulator]]:
        """Who simulates which candidates (C, VECTOR_SIZE)."""
        return guides_of(self.simulator, self.motion, params) if self.guided else [(slice(None), self.simulator)]

    def _starts(self, params: Array) -> Array:
        """Start states (C, S, 3 or more) of all windows: bristle and hidden states as they are along the motion."""
        motion = self.motion
        along = along_measured(self.simulator, params, motion, without="acceleration", wanted=self.begins)
        return along.starts(self.flat_first, motion.y, motion.v, self.simulator.inputs)

    @property
    def carries_slopes(self) -> bool:
        """Whether `slopes` knows this model's derivatives over these recordings."""
        return self.guided and self.simulator.has_slopes(guided=True)

    def slopes(self, params: Array, offsets: Array, directions: Directions) -> tuple[Array, Array]:
        """Residuals (N,) in m at params (VECTOR_SIZE,), and their derivatives (N, K) in K directions; offsets: (0,),
        there are none.
        """
        y, slopes = self._predicted(params, directions.params)
        if self.project:
            summed(lambda piece: self._without_lines(slopes, *piece), self._alike(slopes.shape[1]), self.jobs)
        return self._errors(y[None])[0], slopes

    def _alike(self, each: int) -> Pieces:
        """Pieces of windows of one length, one after another; each: numbers of every sample."""
        lengths = self.segments.count
        edges = [0, *np.flatnonzero(np.diff(lengths)) + 1, lengths.size]
        sizes = [max(1, _AT_ONCE // (max(each, 1) * int(lengths[a]))) for a in edges[:-1]]
        starts = [k for (a, b), size in zip(pairwise(edges), sizes, strict=True) for k in range(a, b, size)]
        return list(pairwise([*map(int, starts), lengths.size]))

    def _without_lines(self, slopes: Array, begin: int, end: int) -> int:
        """Take the straight lines out of derivatives (N, K) of windows of one length, from and to which it is."""
        basis, rows = self.bases[int(self.segments.count[begin])], self.segments.out_offsets[[begin, end]]
        block = slopes[rows[0] : rows[1]].reshape(end - begin, len(basis), -1)
        block -= basis @ (basis.T @ block)
        return 0

    def _predicted(self, params: Array, tangents: Array) -> tuple[Array, Array]:
        """Predicted positions (N,) in m of one candidate, and their derivatives (N, K)."""
        ((_, simulator),) = self._guides(params[None])
        y, slopes = self._predicted_by(simulator, params, tangents)
        for k in np.flatnonzero(moves_guides(self.model, tangents)):
            moved = self.simulate((params + START_STEP * tangents[k])[None])[0]
            slopes[:, k] = (moved - y) / START_STEP
        return y, slopes

    def _predicted_by(self, simulator: Simulator, params: Array, tangents: Array) -> tuple[Array, Array]:
        """What `_predicted` tells where no direction moves positions at which the field is read."""
        if self.model.untold_states:
            return slopes_from_before(simulator, params, tangents, self.motion, self.segments, guided=True)
        # Where the axis rests, the bristle is drawn to the balance of forces; elsewhere only friction acts on it.
        acting = np.any(tangents[:, : MASS + 1] != 0.0, axis=1) | np.any(self.motion.standstill)
        acting |= np.any(tangents[:, EFFECT_START:] != 0.0, axis=1)
        acting &= np.any(tangents != 0.0, axis=1)
        starts = self._starts(np.vstack([params, params + START_STEP * tangents[acting]]))
        moved = np.zeros((*starts.shape[1:], len(tangents)))
        moved[:, :, acting] = (starts[1:] - starts[0]).transpose(1, 2, 0) / START_STEP
        return simulator.slopes(params, tangents, self.segments, starts[0], moved)

    def residuals(self, params: Array, offsets: Array) -> Array:
        """(C, N) prediction errors in m, each window without its straight line. params: (C, VECTOR_SIZE);
        offsets: (C, 0), there are none.
        """
        return self._errors(self.simulate(params))

    def _errors(self, predicted: Array) -> Array:
        """Errors (C, N) of predicted positions, which they replace, each window without its straight line."""
        summed(lambda piece: self._put_errors(predicted, *piece), self._alike(len(predicted)), self.jobs)
        return predicted

    def _put_errors(self, predicted: Array, begin: int, end: int) -> int:
        """`_errors` of windows of one length, from and to which it is."""
        first, last = self.segments.out_offsets[[begin, end]]
        errors = predicted[:, first:last]
        errors -= self.measured[first:last]
        if self.project:
            basis = self.bases[int(self.segments.count[begin])]
            block = errors.reshape(len(errors), end - begin, len(basis))
            block -= (block @ basis) @ basis.T
        return 0


def _line_basis(length: int) -> Array:
    line = np.column_stack([np.ones(length), np.arange(length, dtype=np.float64)])
    return np.asarray(np.linalg.qr(line)[0])


def _in_order(parts: list[tuple[Integers | slice, Array]]) -> Array:
    """What was found of candidates in parts, numbers or all, and (c, N) of these, as one (C, N)."""
    if len(parts) == 1:
        return parts[0][1]
    out = np.empty((sum(len(found) for _, found in parts), parts[0][1].shape[1]))
    for these, found in parts:
        out[these] = found
    return out
