"""A model along a measured motion, behind play too: where the reading waits, the motor crosses the play unseen."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from linid.arrays import Array, Flags, Integers
from linid.identification.signals.motion import Motion
from linid.physics.effects.registry import find_effect
from linid.physics.model import STATE_PLACES, Model
from linid.recording.splines import cubic_spline_coefficients
from linid.recording.waits import ahead_of_reading
from linid.simulation.along_told import AlongMotion
from linid.simulation.run import Simulator

Without = Literal["", "acceleration", "states"]

_VISIBLE = 6.0  # deviations of the noise: within less play a resting reading is a resting motor
_STEP = 1e-3  # of the play, and of what can be seen of it, for its slope


def play_of(model: Model) -> str:
    """The effect of a model that is play between motor and reading; empty without such."""
    return next((name for name in model.effects if find_effect(name).play), "")


def along_measured(
    simulator: Simulator,
    params: Array,
    motion: Motion,
    *,
    without: Without = "",
    wanted: Flags | None = None,
    among: Flags | None = None,
) -> AlongMotion:
    """The model along a measured motion as `Simulator.along` tells it, behind play with the motor's own motion.

    params: (C, VECTOR_SIZE) SI; motion: of all recordings of the simulator; without, wanted (samples,), among (R,): as
    there.
    """
    if play_of(simulator.model):
        return _BehindPlay(simulator, motion).along(params, without=without, wanted=wanted, among=among)
    start_w = np.full((params.shape[0], simulator.inputs.counts.size), np.nan)
    measured = motion.y, motion.v, motion.standstill
    return simulator.along(params, *measured, start_w, without=without, wanted=wanted, among=among)


def slopes_measured(
    simulator: Simulator, params: Array, tangents: Array, motion: Motion, among: Flags | None
) -> tuple[Array, Array | None]:
    """How acceleration (K, samples) and reading error (K, samples; None without) of `along_measured` answer K
    directions, where `Simulator.has_slopes_along`.

    params: (VECTOR_SIZE,) SI; tangents: (K, VECTOR_SIZE) of them; motion, among (R,): as there.
    """
    if play_of(simulator.model):
        return _BehindPlay(simulator, motion).slopes(params, tangents, among)
    return simulator.slopes_along(params, tangents, motion.y, motion.v, motion.standstill, among)


def guides_of(simulator: Simulator, motion: Motion, params: Array) -> list[tuple[Integers | slice, Simulator]]:
    """Who simulates which candidates where the motor's field is read at measured positions: behind play those of the
    motor, which hang on the play.

    motion: of all recordings of the simulator; params: (C, VECTOR_SIZE) SI. Returns pairs: numbers (c,) of candidates,
    or all of them, and their simulator.
    """
    if not play_of(simulator.model):
        return [(slice(None), simulator)]
    behind = _BehindPlay(simulator, motion)
    plays = params[:, _slot_of_play(simulator.model)]
    return [(np.flatnonzero(plays == play), behind.guided(float(play))) for play in np.unique(plays)]


def moves_guides(model: Model, tangents: Array) -> Flags:
    """Which directions (K,) move the positions of `guides_of`. tangents: (K, VECTOR_SIZE) of a candidate."""
    if not play_of(model):
        return np.zeros(len(tangents), dtype=np.bool_)
    return np.asarray(tangents[:, _slot_of_play(model)] != 0.0)


def _slot_of_play(model: Model) -> int:
    """Place of the play among the parameters of a candidate that has it."""
    return model.slot(find_effect(play_of(model)).play)


@dataclass(frozen=True)
class _BehindPlay:
    """A model with play between motor and reading along a measured motion.

    The waits of the readings tell how the motor moves behind the play (`recording.waits`), so that no force is asked
    where it is, and the balance of forces judges how it got there.
    """

    simulator: Simulator
    motion: Motion

    @cached_property
    def _motor(self) -> Simulator:
        """The model of the motor alone."""
        model = self.simulator.model
        others = tuple(name for name in model.effects if name != play_of(model))
        return replace(self.simulator, model=model.with_effects(others))

    @property
    def _slot(self) -> int:
        return _slot_of_play(self.simulator.model)

    def along(
        self, params: Array, *, without: Without = "", wanted: Flags | None = None, among: Flags | None = None
    ) -> AlongMotion:
        """What `along_measured` tells; its acceleration is the part of the motor's that the reading shows."""
        model, motor = self.simulator.model, self._motor
        plays = params[:, self._slot]
        shape = params.shape[0], self.motion.y.size
        a, w, reading = np.empty(shape if without != "acceleration" else (1, 0)), np.empty(shape), np.empty(shape)
        kept = [] if without == "states" else list(model.states)
        states = np.full((*shape, len(kept)) if kept else (1, 0, 0), np.nan)
        for play in np.unique(plays):
            these = np.flatnonzero(plays == play)
            behind = _behind(self.motion, float(play))
            start_w = np.full((these.size, self.simulator.inputs.counts.size), np.nan)
            found = motor.along(params[these], *behind.motion, start_w, without=without, wanted=wanted, among=among)
            w[these] = found.bristle
            reading[these] = -behind.ahead if found.reading_error is None else found.reading_error - behind.ahead
            if without != "acceleration":
                a[these] = behind.shown(found.acceleration)
            for place, state in enumerate(kept):
                if state == STATE_PLACES[play_of(model)]:
                    states[these, :, place] = 2.0 * behind.ahead / play if play > 0.0 else 0.0
                else:
                    states[these, :, place] = found.states[:, :, motor.model.states.index(state)]
        return AlongMotion(a, w, states, reading)

    def slopes(self, params: Array, tangents: Array, among: Flags | None) -> tuple[Array, Array]:
        """How acceleration and reading error of `along` answer K directions, (K, samples) each. params: (VECTOR_SIZE,);
        tangents: (K, VECTOR_SIZE)."""
        play = float(params[self._slot])
        behind = _behind(self.motion, play)
        a, reading = self._motor.slopes_along(params, tangents, *behind.motion, among)
        a = behind.shown(a)
        reading = np.zeros_like(a) if reading is None else reading
        by_play = tangents[:, self._slot]
        if np.any(by_play != 0.0):
            step = _STEP * max(play, _VISIBLE * float(np.max(self.motion.position_noise)))
            moved = np.vstack([params, params])
            moved[1, self._slot] += step
            ends = self.along(moved, without="states", among=among)
            assert ends.reading_error is not None
            a += by_play[:, None] * np.diff(ends.acceleration, axis=0) / step
            reading += by_play[:, None] * np.diff(ends.reading_error, axis=0) / step
        return a, reading

    def guided(self, play: float) -> Simulator:
        """The simulator with the motor's positions in the place of those that are read."""
        inputs = self.simulator.inputs
        positions = self.motion.measured + _behind(self.motion, play).ahead
        coefficients = inputs.coefficients.copy()
        for r, dt in enumerate(inputs.dts):
            mine = positions[inputs.sample_offsets[r] : inputs.sample_offsets[r + 1]]
            place = slice(int(inputs.offsets[r]), int(inputs.offsets[r + 1]))
            coefficients[place, 3] = cubic_spline_coefficients(float(dt), mine)[0]
        return replace(self.simulator, inputs=inputs._replace(coefficients=coefficients))


@dataclass(frozen=True)
class _Behind:
    """A motor behind some play. motion: its position in m, its speed in m/s and where it rests, (samples,) each; ahead:
    (samples,) how far it is ahead of the reading, m; seen: (samples,) what of its acceleration the reading shows."""

    motion: tuple[Array, Array, Flags]
    ahead: Array
    seen: Array

    def shown(self, a: Array) -> Array:
        """What the reading shows of accelerations (C, samples), m/s^2: nothing where unseen, though they diverge."""
        return np.where(self.seen > 0.0, a, 0.0) * self.seen


@lru_cache(maxsize=8)  # most candidates of a fit have one play
def _behind(motion: Motion, play: float) -> _Behind:
    """The motor of a measured motion behind some play in m."""
    size = motion.y.size
    ahead, faster, seen, begin = np.zeros(size), np.zeros(size), np.ones(size), 0
    for measured in motion.of_recordings:
        mine = slice(begin, begin + measured.measured.size)
        begin = mine.stop
        found = ahead_of_reading(measured.waits, measured.measured, measured.dt, play)
        ahead[mine], faster[mine] = found.y, found.v
        if play > _VISIBLE * measured.position_noise:
            seen[mine] = found.seen
    return _Behind((motion.y + ahead, motion.v + faster, motion.standstill), ahead, seen)
