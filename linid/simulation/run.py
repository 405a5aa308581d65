"""Run one model or a whole population over segments of recordings, in parallel threads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array, Flags, Integers
from linid.physics.effects.registry import active_mask, find_effect
from linid.physics.electrical import WINDING_CODES
from linid.physics.laws.registry import LUGRE, find_law
from linid.physics.model import MOTOR_START, STATE_PLACES, Model
from linid.simulation.along import AlongTraces
from linid.simulation.along_beside import AlongSlopes, Directions
from linid.simulation.along_motion import MeasuredMotion
from linid.simulation.along_told import AlongMotion
from linid.simulation.compiled import (
    Kernel,
    load_along_slopes,
    load_kernel,
    load_lockstep,
    load_lockstep_slopes,
    load_slopes,
)
from linid.simulation.course import Candidates, Scheme, Starts, Traces
from linid.simulation.directions import silent_places, touched_by
from linid.simulation.inputs import Inputs, measured_points
from linid.simulation.lanes import LANES, padded
from linid.simulation.pieces import Pieces, evenly, of_recordings, of_windows
from linid.simulation.slope_effects import FORCE_STEP
from linid.simulation.slopes import Tangents
from linid.simulation.steering import UNSTEERED, Steering
from linid.simulation.threads import summed
from linid.simulation.told import effects_told, forces_told

# Share of the friction force by which a step may misjudge the bristle rate, at one step per sample; it falls with
# the square of the step, so that refined steps near reversals keep the order.
REVERSAL_TOLERANCE = 0.002
_NO_STATES = ("drive", "field", "friction")  # terms whose hidden states no derivative is carried for
_ROUNDS = 4  # of lanes, which a thread takes at a time: fewer would leave lanes free too often
# Of motors that currents drive, and of forces that are not known beforehand.
_NO_CURRENTS, _NO_TRACES, _NO_GUIDE = np.empty((1, 0, 3)), np.empty((1, 3, 0)), np.empty((4, 0))
_NO_FORCES, _NO_SLOPES = np.empty(0), np.empty((0, 0))


class Segments(NamedTuple):
    """S stretches of recordings to be simulated.

    recording: (S,) indices; first: (S,) first samples; count: (S,) numbers of samples.
    """

    recording: Integers
    first: Integers
    count: Integers  # type: ignore[assignment]  # a tuple's method of that name is not missed

    @property
    def out_offsets(self) -> Integers:
        """Where each segment's samples start in the output (S + 1,)."""
        return np.concatenate([[0], np.cumsum(self.count)]).astype(np.int64)


def whole_recordings(inputs: Inputs) -> Segments:
    """One segment per recording, from its first to its last sample."""
    n = inputs.counts
    return Segments(np.arange(n.size, dtype=np.int64), np.zeros(n.size, dtype=np.int64), n)


@dataclass(frozen=True)
class Simulator:
    """A model over packed recordings. jobs: threads (never changes a result); specialised: compile for this
    model alone; substeps: internal steps per sample; steering: by a drive that closes its loops over one recording."""

    model: Model
    inputs: Inputs
    substeps: int = 2
    jobs: int = 1
    specialised: bool = False
    steering: Steering = UNSTEERED

    def _by_recording(self, segments: Segments) -> Pieces:
        least = LANES if self.model.mask == 0 else 1  # side by side, fewer would leave lanes free
        return of_windows(segments.recording, least, self.jobs)

    @cached_property
    def _guide(self) -> Array:
        """Measured positions and inputs (4, points) at the ends and middles of all base steps."""
        return measured_points(self.inputs, 2 * self.substeps)

    @cached_property
    def _kept(self) -> Integers:
        return np.array(self.model.states, dtype=np.int64)

    @cached_property
    def _hidden(self) -> tuple[Integers, Integers, Integers]:
        """Hidden states for `Tangents`: their places, the bits of their effects and of those that motion drives."""
        effects = [find_effect(name) for name in STATE_PLACES if name in self.model.effects]
        owners = [active_mask((effect.name,)) for effect in effects for _ in range(effect.states)]
        owners += [0] * (self._kept.size - len(owners))  # of own terms' memory, which is told by itself
        driven = [
            active_mask(tuple(effect.name for effect in effects if effect.states_are_driven_by(name)))
            for name in ("y", "v", "a")
        ]
        return self._kept, np.array(owners, dtype=np.int64), np.array(driven, dtype=np.int64)

    @cached_property
    def _fast(self) -> int:
        """The bits of the effects and own terms whose forces hang on speed."""
        return active_mask(tuple(name for name in self.model.effects if find_effect(name).pushes_by_speed))

    @property
    def _reads(self) -> bool:
        """Whether an effect has a reading error."""
        return any(find_effect(name).sensor is not None for name in self.model.effects)

    def _candidates(self, params: Array) -> Candidates:
        winding = WINDING_CODES[self.model.winding]
        return Candidates(np.ascontiguousarray(params), self.model.motor, self.model.mask, winding)

    def _kernel(self) -> Kernel:
        law = find_law(self.model.law).steps
        if self.specialised:
            return load_kernel(self.model, bool(self.model.winding), law=law)
        return load_kernel(None, bool(self.model.winding), self.model.mask == 0, law)

    def run(
        self, params: Array, segments: Segments, starts: Array, *, velocity: bool = False, guided: bool = False
    ) -> tuple[Array, Array, int]:
        """Simulate every candidate over every segment.

        params: (C, VECTOR_SIZE) SI; starts: (C, S, 3) y in m, v in m/s, w in m, or with the hidden states of the
        model's effects after them (nan or absent: the effect's own start); guided: the outer forces act at the
        measured position instead of the simulated one.
        Returns positions (C, samples) in m, velocities (C, samples) in m/s (empty unless asked for) and the
        number of internal steps. A diverged simulation is nan from there on.
        """
        offsets = segments.out_offsets
        y_out = np.empty((params.shape[0], int(offsets[-1])))
        v_out = np.empty_like(y_out) if velocity else np.empty((1, 0))
        given = np.full((*starts.shape[:2], 3), np.nan) if self.model.winding else _NO_CURRENTS
        traces = Traces(offsets, y_out, v_out, _NO_TRACES)
        states = Starts(np.ascontiguousarray(starts), self._kept, given)
        steps = self._simulate(params, segments, states, guided, traces)
        return y_out, v_out, steps

    def has_slopes(self, guided: bool) -> bool:
        """Whether `slopes` knows this model: LuGre, its motor's force by measured position alone, no factor on the
        bristle by hidden states."""
        model = self.model
        plain = not model.winding and find_law(model.law).steps == LUGRE
        for effect in map(find_effect, model.effects):
            plain = plain and not any(effect.states_of(term) for term in _NO_STATES if term in effect.terms)
        return plain and (guided or not np.any(self.inputs.powered)) and self.steering.y.size == 0

    def slopes(
        self,
        params: Array,
        tangents: Array,
        segments: Segments,
        starts: Array,
        start_slopes: Array,
        *,
        guided: bool = True,
    ) -> tuple[Array, Array]:
        """Positions (samples,) in m over all segments and their derivatives (samples, K) in K directions.

        params: (VECTOR_SIZE,) SI; tangents: (K, VECTOR_SIZE) of them; starts, guided: as in `run`, (S, 3 + states);
        start_slopes: (S, 3 + states, K), of w and hidden states only where these are given. The steps are
        differentiated as they are taken, their lengths held, and when an own term's memory jumps: what the simulation
        does in closed form, exactly; forces of the motor, what effects do and how their hidden states go on by
        differences, to some 1e-7.
        Source: internal differentiation (Bock 1981, Springer Ser. Chem. Phys. 18, 102).
        """
        powered = bool(np.any(self.inputs.powered))
        in_lanes = self.model.mask == 0 or self._goes_in_lanes(guided)
        told = np.any(np.delete(tangents, [] if powered else silent_places(self.model), axis=1) != 0.0, axis=1)
        told |= np.any(start_slopes != 0.0, axis=(0, 1))
        tangents = tangents[told]
        count, samples = len(tangents), int(segments.out_offsets[-1])
        width = count if in_lanes else padded(count)
        out = segments.out_offsets, np.empty(samples), np.empty((samples, width))
        table, moved = np.zeros((8, width)), np.zeros((*starts.shape, width))
        table[:, :count], moved[:, :, :count] = tangents[:, :8].T, start_slopes[:, :, told]
        touched, begins = touched_by(self.model, tangents), np.ascontiguousarray(starts)
        scheme, by_points = self._scheme(guided, self._guide if powered else np.empty((4, 1))), _NO_SLOPES
        beside, told_effects = params + FORCE_STEP * tangents, self._told if guided else 0
        pieces = self._by_recording(segments)
        if in_lanes and told_effects:
            moving = np.any(beside[:, MOTOR_START:] != params[MOTOR_START:], axis=1)
            those = self._candidates(np.vstack([params, beside[moving]]))
            scheme, by_points = forces_told(those, self.inputs, segments, scheme, self._told, (pieces, self.jobs))
        along = Tangents(count, table, touched, self._fast, told_effects, by_points, begins, moved, *self._hidden)
        candidates = self._candidates(np.vstack([params, beside]))
        kernel = load_lockstep_slopes() if in_lanes else load_slopes()

        def work(piece: tuple[int, int]) -> int:
            kernel(candidates, self.inputs, segments, scheme, along, *piece, out)
            return 0

        summed(work, pieces, self.jobs)
        slopes = out[2][:, :count]
        if not np.all(told):
            slopes = np.zeros((samples, told.size))
            slopes[:, told] = out[2][:, :count]
        return out[1], slopes

    def run_by_voltage(
        self, params: Array, segments: Segments, starts: Array, start_currents: Array, *, guided: bool = False
    ) -> tuple[Array, Array, Array, int]:
        """Simulate a motor that phase voltages drive; its currents are states.

        start_currents: (C, S, 3) A, nan for those that the first voltages would hold; the rest as in `run`. Returns
        positions and velocities (C, samples), currents (C, 3, samples) in A and the number of internal steps.
        """
        offsets = segments.out_offsets
        shape = (params.shape[0], int(offsets[-1]))
        traces = Traces(offsets, np.empty(shape), np.empty(shape), np.empty((shape[0], 3, shape[1])))
        given = Starts(np.ascontiguousarray(starts), self._kept, np.ascontiguousarray(start_currents))
        steps = self._simulate(params, segments, given, guided, traces)
        return traces.y, traces.v, traces.currents, steps

    def _simulate(self, params: Array, segments: Segments, starts: Starts, guided: bool, traces: Traces) -> int:
        """Run the kernel over all candidates and segments."""
        # It never hangs on how many there are: the two kernels differ by rounding.
        if not self._goes_in_lanes(guided):
            kernel, least = self._kernel().simulate_tasks, 1
        elif self.model.mask == 0:
            kernel, least = load_lockstep(), _ROUNDS * LANES
        else:
            return self._simulate_told(params, segments, starts, traces)
        inputs, candidates = self.inputs, self._candidates(params)
        by_motion_alone = guided and self.model.mask == 0 and not self.model.winding
        scheme = self._scheme(guided, self._guide if by_motion_alone else _NO_GUIDE)

        def work(piece: tuple[int, int]) -> int:
            return int(kernel(candidates, inputs, segments, starts, scheme, *piece, traces))

        return self._spread(work, params.shape[0] * segments.count.size, least)

    def _simulate_told(self, params: Array, segments: Segments, starts: Starts, traces: Traces) -> int:
        """Run all candidates over all segments, guided: the forces are told beforehand, for one candidate at a time."""
        kernel, guided = load_lockstep(), self._scheme(True, self._guide)

        def simulate(k: int, pieces: Pieces, jobs: int) -> int:
            one = slice(k, k + 1)
            candidate, begins = self._candidates(params[one]), starts._replace(values=starts.values[one])
            scheme, _ = forces_told(candidate, self.inputs, segments, guided, self._told, (pieces, jobs))
            rows = traces._replace(y=traces.y[one], v=traces.v[one] if traces.v.size else traces.v)

            def work(piece: tuple[int, int]) -> int:
                return int(kernel(candidate, self.inputs, segments, begins, scheme, *piece, rows))

            return summed(work, pieces, jobs)

        if params.shape[0] == 1:
            return simulate(0, self._by_recording(segments), self.jobs)
        whole = [(0, segments.count.size)]
        return summed(lambda k: simulate(k, whole, 1), range(params.shape[0]), self.jobs)

    def _scheme(self, guided: bool, guide: Array) -> Scheme:
        tolerance = REVERSAL_TOLERANCE / self.substeps**2
        return Scheme(guided, guide, _NO_FORCES, self.substeps, tolerance, self.steering)

    @cached_property
    def _told(self) -> int:
        """The bits of effects whose forces are told beforehand where places are read as measured."""
        return effects_told(self.model) if bool(np.all(self.inputs.powered)) else 0

    def _goes_in_lanes(self, guided: bool) -> bool:
        """Whether simulations go side by side: without effects, or where all that these do is told beforehand."""
        model = self.model
        if model.winding or find_law(model.law).steps != LUGRE or self.steering.y.size or self.specialised:
            return False
        return model.mask == 0 or (guided and self._told == model.mask)

    def along(
        self,
        params: Array,
        y: Array,
        v: Array,
        standstill: NDArray[np.bool_],
        start_w: Array,
        *,
        without: Literal["", "acceleration", "states"] = "",
        wanted: NDArray[np.bool_] | None = None,
        among: Flags | None = None,
    ) -> AlongMotion:
        """Model acceleration, bristle, hidden states and reading error of every candidate along a measured motion.

        params: (C, VECTOR_SIZE) SI; y, v: (samples,) measured motion of all recordings in m and m/s; standstill:
        (samples,) where the axis rests; start_w: (C, R) deflection at each recording's start, m; without: what
        nobody asks for, acceleration or hidden states (empty then); wanted: (samples,) where the rest is, which without
        acceleration saves the way between (default: everywhere); among: (R,) recordings that are wanted at all
        (default: all; what is found of others is 0).
        """
        kernel, inputs, candidates = self._kernel(), self.inputs, self._candidates(params)
        kept = self._kept[:0] if without == "states" else self._kept
        shape = (params.shape[0], y.size)
        reads = self._reads
        room = np.empty if among is None else np.zeros  # callers reckon with all
        found = AlongTraces(
            np.empty((1, 0)) if without == "acceleration" else room(shape),
            room(shape) if wanted is None else np.full(shape, np.nan),
            np.full((*shape, kept.size) if kept.size else (1, 0, 0), np.nan),
            room(shape) if reads else np.empty((1, 0)),
        )
        motion = MeasuredMotion(
            y, v, self.inputs.sampled, standstill, np.empty(0, dtype=np.bool_) if wanted is None else wanted
        )

        def work(piece: tuple[int, int]) -> int:
            kernel.along_tasks(candidates, inputs, motion, start_w, kept, *piece, found)
            return 0

        summed(work, of_recordings(inputs.counts, among, shape[0], self.jobs), self.jobs)
        return AlongMotion(found.a, found.w, found.states, found.reading if reads else None)

    @property
    def has_slopes_along(self) -> bool:
        """Whether `slopes_along` knows this model: LuGre, currents or no inputs at all."""
        return not self.model.winding and find_law(self.model.law).steps == LUGRE

    def slopes_along(
        self,
        params: Array,
        tangents: Array,
        y: Array,
        v: Array,
        standstill: NDArray[np.bool_],
        among: Flags | None = None,
    ) -> tuple[Array, Array | None]:
        """How the acceleration (K, samples) of `along` and the reading error (K, samples; None where no effect has one)
        answer K directions.

        params: (VECTOR_SIZE,) SI; tangents: (K, VECTOR_SIZE) of them; y, v, standstill: as in `along`; among: (R,)
        as there. The bristle in closed form, all else by differences, to some 1e-7.
        """
        count, width = tangents.shape[0], padded(tangents.shape[0])
        table, reads = np.zeros((8, width)), self._reads
        table[:, :count] = tangents[:, :8].T
        room = np.empty if among is None else np.zeros
        found = AlongSlopes(room((count, y.size)), np.zeros((count, y.size)) if reads else np.empty((1, 0)))
        motion = MeasuredMotion(y, v, self.inputs.sampled, standstill, np.empty(0, dtype=np.bool_))
        candidates = self._candidates(np.vstack([params, params + FORCE_STEP * tangents]))
        kernel, directions = load_along_slopes(), Directions(touched_by(self.model, tangents), table)

        def work(piece: tuple[int, int]) -> int:
            kernel(candidates, self.inputs, motion, directions, *piece, found)
            return 0

        summed(work, of_recordings(self.inputs.counts, among, 1, self.jobs), self.jobs)
        return found.a, found.reading if reads else None

    def readings(self, params: Array, y: Array, v: Array) -> Array:
        """Reading errors (C, samples) in m that hang on nothing but position and speed: much faster than `along`.

        params: (C, VECTOR_SIZE) SI; y: (samples,) positions in m; v: (samples,) speeds in m/s.
        """
        kernel = self._kernel()
        out = np.empty((params.shape[0], y.size))
        params = np.ascontiguousarray(params)

        def work(piece: tuple[int, int]) -> int:
            kernel.reading_tasks(params, self.model.mask, y, v, piece[0], piece[1], out)
            return 0

        self._spread(work, params.shape[0])
        return out

    def _spread(self, work: Callable[[tuple[int, int]], int], tasks: int, least: int = 1) -> int:
        return summed(work, evenly(tasks, least, self.jobs), self.jobs)
