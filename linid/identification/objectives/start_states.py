"""Start states of predictions by models with states that no channel shows: estimated from the samples before."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array, Integers
from linid.identification.objectives.behind_play import along_measured
from linid.identification.signals.motion import Motion
from linid.recording.motion import SMOOTHING_REACH
from linid.simulation.along_told import AlongMotion
from linid.simulation.run import Segments, Simulator

# s; longer stretches average more noise, but a model that is somewhat off (frequency, damping, friction) strays from
# the axis within them: a measured axis with a load that swings at 53 Hz was predicted worse from 50 ms and more.
_STRETCH = 0.025
_NUDGE = 0.1  # of a state's prior deviation: far above rounding, small against where friction and play bend
START_STEP = 1e-5  # of search coordinates, over which what is along the motion is differentiated
_LEAST_SHARE = 1e-9  # of the axis' own motion: prior deviation of a hidden state that has not moved at all
_ROUNDS = 2  # of the weighting: the second one knows what the first leaves
# Of what the step to better start states does, RMS: where they answer it otherwise than in a straight line by more, as
# over play or where friction holds, its derivative is by nudged states.
_STRAIGHT = 0.01


class _Stretches(NamedTuple):
    """The samples before S windows. part: these stretches, each up to its window's first sample; whole: with the
    windows behind them; flat: (S,) first sample among those of all recordings; measured: raw positions at the samples
    of `part`, m; seen: where those of the windows stand in `whole`."""

    part: Segments
    whole: Segments
    flat: Integers
    measured: Array
    seen: Integers


def _stretches_of(simulator: Simulator, motion: Motion, windows: Segments) -> _Stretches:
    inputs = simulator.inputs
    stretch = np.maximum(np.round(_STRETCH / inputs.dts).astype(np.int64), SMOOTHING_REACH)[windows.recording]
    before = np.minimum(windows.first, stretch)
    part = Segments(windows.recording, windows.first - before, before + 1)
    whole = Segments(windows.recording, part.first, before + windows.count)
    flat = inputs.sample_offsets[part.recording] + part.first
    seen = _rows(whole.out_offsets[:-1] + before, windows.count)
    return _Stretches(part, whole, flat, motion.measured[_rows(flat, part.count)], seen)


def predicted_from_before(
    simulator: Simulator, params: Array, motion: Motion, windows: Segments, *, guided: bool
) -> Array:
    """Positions (C, N) m at the samples of all windows, predicted from states that the samples up to each window's
    first tell.

    Position, speed and what the motion does not tell of hidden states are moved, a stretch earlier, from those along
    the smoothed motion, by one Gauss-Newton step, to where the simulation with the logged inputs meets the raw
    positions up to the window's first sample best; the simulation then goes on through the window. Each state is held
    by a prior: position and speed by their noise, a hidden state by its RMS over the recording, so that what the
    stretch does not tell (play not taken up, a load that swings slowly) stays as it was. Positions are weighed by what
    misses them beyond noise, too. The stretch is at least as long as the smoothing reaches: samples behind a window's
    first decide only what noise and which RMS the whole recording is said to have. A window near the recording's start
    has a shorter stretch.
    params: (C, VECTOR_SIZE); windows: S of all recordings; guided: see `Simulator.run`. Source: moving horizon
    estimation (Rao, Rawlings and Mayne 2003, IEEE Trans. Autom. Control 48), with one step of Gauss-Newton.
    """
    before = _stretches_of(simulator, motion, windows)
    part, whole = before.part, before.whole
    along, starts = _along(simulator, params, motion, before)
    noise, at_part = _noise_of(before, motion), _rows(whole.out_offsets[:-1], part.count)
    priors = _priors(along, motion, simulator.inputs.sample_offsets)[:, part.recording]
    out = np.empty((params.shape[0], int(windows.count.sum())))
    for c, one in enumerate(params):
        own, start = one[None, :], starts[c : c + 1]
        places = _moving(simulator, start[0])
        prior = priors[c][:, _of_prior(places)]
        plain, slopes = _swung(simulator, own, part, start, (places, prior), guided)
        better = start.copy()
        better[0][:, places] += _steps(_told(slopes, part), before.measured - plain, noise)[-1].change * prior
        moved = simulator.run(own, whole, better, guided=guided)[0][0]
        worse = _worse(moved[at_part], plain, before)
        if np.any(worse):
            chosen = Segments(whole.recording[worse], whole.first[worse], whole.count[worse])
            anew = simulator.run(own, chosen, start[:, worse], guided=guided)[0][0]
            moved[np.repeat(worse, whole.count)] = anew
        out[c] = moved[before.seen]
    return out


def slopes_from_before(
    simulator: Simulator, params: Array, tangents: Array, motion: Motion, windows: Segments, *, guided: bool
) -> tuple[Array, Array]:
    """The positions (N,) of `predicted_from_before` for one candidate, and their derivatives (N, K) in K directions.

    params: (VECTOR_SIZE,); tangents: (K, VECTOR_SIZE). The runs' derivatives are those that a simulation carries along,
    those of the states along the motion differences. Where the positions answer the step of Gauss and Newton in a
    straight line, it answers the directions by what they change of what it misses, all but the noise in that; else it
    is differentiated whole (`_bent_by`). Which stretches it makes worse is held.
    """
    before = _stretches_of(simulator, motion, windows)
    part, whole, own, count = before.part, before.whole, params[None, :], len(tangents)
    along, starts = _along(simulator, np.vstack([own, params + START_STEP * tangents]), motion, before)
    start, places = starts[0], _moving(simulator, starts[0])
    noise = _noise_of(before, motion)
    priors = _priors(along, motion, simulator.inputs.sample_offsets)[:, :, _of_prior(places)]
    prior, prior_by = priors[0][part.recording], ((priors[1:] - priors[0]) / START_STEP)[:, part.recording]
    begins = _Begins(start, ((starts[1:] - start) / START_STEP).transpose(1, 2, 0), places, prior, prior_by)
    plain, slopes = _swung(simulator, own, part, start[None], (places, prior), guided)
    told = _told(slopes, part)
    steps = _steps(told, before.measured - plain, noise)
    change = steps[-1].change
    better = start.copy()
    better[:, places] += change * prior
    met = simulator.run(own, part, better[None], guided=guided)[0][0]
    worse = _worse(met, plain, before)
    bent = _bent(told, change, met - plain) & ~worse
    better[worse] = start[worse]
    better_by = np.concatenate([begins.start_by, np.zeros((*start.shape, len(places)))], axis=2)
    better_by[:, places, :count] += (change * prior_by).transpose(1, 2, 0)
    if np.any(bent):
        answers = _bent_by(simulator, params, tangents, (before, begins, noise), bent, guided)
        better_by[np.ix_(bent, places, np.arange(count))] += answers * prior[bent][:, :, None]
    better_by[worse, :, :count] = begins.start_by[worse]
    better_by[:, places, count + np.arange(len(places))] = prior
    directions = np.vstack([tangents, np.zeros((len(places), params.size))])
    moved, moved_by = simulator.slopes(params, directions, whole, better, better_by, guided=guided)
    steps_by = _steps_by(told, steps, -moved_by[_rows(whole.out_offsets[:-1], part.count), :count])
    steps_by[worse | bent] = 0.0
    owner = np.repeat(np.arange(windows.count.size), windows.count)
    by = moved_by[before.seen]
    return moved[before.seen], by[:, :count] + np.einsum("nj,njk->nk", by[:, count:], steps_by[owner])


class _Begins(NamedTuple):
    """Start states along the motion (S, 3 + states) with their derivatives (S, 3 + states, K), the places (n,) of those
    that a stretch may move, and their prior deviations (S, n) with derivatives (K, S, n)."""

    start: Array
    start_by: Array
    places: Integers
    prior: Array
    prior_by: Array


def _bent_by(
    simulator: Simulator,
    params: Array,
    tangents: Array,
    known: tuple[_Stretches, _Begins, Array],
    chosen: NDArray[np.bool_],
    guided: bool,
) -> Array:
    """How the step of some stretches (S,) answers the directions, in prior deviations (B, n, K), by runs with nudged
    states. known: the stretches, their start states, noise (S,) in m."""
    before, (start, start_by, places, prior, prior_by), noise = known
    part = Segments(*(column[chosen] for column in before.part))
    measured = before.measured[np.repeat(chosen, before.part.count)]

    def ahead(begins: Array, begins_by: Array) -> tuple[Array, Array]:
        return simulator.slopes(params, tangents, part, begins, begins_by, guided=guided)

    plain, plain_by = ahead(start[chosen], start_by[chosen])
    slopes, slopes_by = np.empty((len(places), plain.size)), np.empty((len(places), len(tangents), plain.size))
    for row, place in enumerate(places):
        nudged, nudged_by = start[chosen], start_by[chosen]
        nudged[:, place] += _NUDGE * prior[chosen, row]
        nudged_by[:, place] += _NUDGE * prior_by[:, chosen, row].T
        swung, swung_by = ahead(nudged, nudged_by)
        slopes[row], slopes_by[row] = (swung - plain) / _NUDGE, (swung_by - plain_by).T / _NUDGE
    misses = measured - plain
    plainly = _steps(_told(slopes, part), misses, noise[chosen])[-1].change
    out = np.empty((part.count.size, len(places), len(tangents)))
    for k in range(len(tangents)):
        beside = _told(slopes + START_STEP * slopes_by[:, k], part)
        after = _steps(beside, misses - START_STEP * plain_by[:, k], noise[chosen])[-1].change
        out[:, :, k] = (after - plainly) / START_STEP
    return out


def _swung(
    simulator: Simulator, own: Array, part: Segments, start: Array, moving: tuple[Integers, Array], guided: bool
) -> tuple[Array, Array]:
    """Positions (samples,) in m along all stretches, and how they answer the states at these places by their prior
    deviations, (n, samples) m. own: (1, VECTOR_SIZE); start: (1, S, 3 + states); moving: places (n,), priors (S, n)."""
    places, prior = moving
    plain = simulator.run(own, part, start, guided=guided)[0][0]
    nudged = np.repeat(start, len(places), axis=0)
    for row, place in enumerate(places):
        nudged[row, :, place] += _NUDGE * prior[:, row]
    moved = simulator.run(np.repeat(own, len(places), axis=0), part, nudged, guided=guided)[0]
    return plain, (moved - plain) / _NUDGE


def _noise_of(before: _Stretches, motion: Motion) -> Array:
    """Noise (S,) of the measured positions, m."""
    return np.asarray(np.maximum(motion.position_noise, 1e-15)[before.part.recording])


def _moving(simulator: Simulator, start: Array) -> Integers:
    """Which of the start states (S, 3 + states) a stretch may move: not what the motion tells, as it does the bristle,
    nor a hidden state that nothing ever moves."""
    moves = np.any(start, axis=0)
    moves[:3] = True, True, False
    moves[3:] &= np.isin(simulator.model.states, simulator.model.untold_states)
    return np.flatnonzero(moves)


def _of_prior(places: Integers) -> Integers:
    """Their columns in `_priors`, which has none of the bristle."""
    return np.asarray(places - (places > 2))


def _worse(met: Array, plain: Array, before: _Stretches) -> NDArray[np.bool_]:
    """Which stretches (S,) the step makes worse: where play or friction bend too much for one step, what is along the
    motion is the better guess. met, plain: positions after the step and before it, m."""
    misses = [np.add.reduceat((y - before.measured) ** 2, before.part.out_offsets[:-1]) for y in (met, plain)]
    return np.asarray(~(misses[0] <= misses[1]))


def _along(simulator: Simulator, params: Array, motion: Motion, before: _Stretches) -> tuple[AlongMotion, Array]:
    """The model along the measured motion, and start states (C, S, 3 + states) of the stretches as it has them."""
    wanted = np.zeros(motion.y.size, dtype=np.bool_)
    wanted[before.flat] = True
    along = along_measured(simulator, params, motion, without="acceleration", wanted=wanted)
    return along, along.starts(before.flat, motion.y, motion.v, simulator.inputs)


def _rows(first: Integers, count: Integers) -> Integers:
    """The numbers first, first + 1 ... of every stretch, one after the other."""
    ends = np.cumsum(count)
    return np.repeat(first - ends + count, count) + np.arange(int(ends[-1]))


def _priors(along: AlongMotion, motion: Motion, offsets: Integers) -> Array:
    """Prior deviations (C, R, 2 + states) of position (m), speed (m/s) and hidden states in each recording."""
    own = np.maximum([np.std(motion.y[a:b]) for a, b in pairwise(offsets)], 1e-12)
    noise = np.maximum([motion.position_noise, motion.speed_noise], 1e-12).T
    out = np.empty((len(along.states), own.size, 2 + along.states.shape[2]))
    out[:, :, :2] = noise
    for candidate, states in zip(out, along.states, strict=True):  # one at a time, for the memory
        squares = np.add.reduceat(np.nan_to_num(states) ** 2, offsets[:-1], axis=0)
        candidate[:, 2:] = np.maximum(np.sqrt(squares / np.diff(offsets)[:, None]), _LEAST_SHARE * own[:, None])
    return out


class _Told(NamedTuple):
    """What S stretches tell of n states: how positions (n, samples) m answer their prior deviations, products of that
    (S, n, n) in m^2, and the stretches."""

    slopes: Array
    square: Array
    part: Segments

    def pull(self, misses: Array) -> Array:
        """Products of the answers with misses (samples, K) in m, (S, n, K) in m^2."""
        begins = self.part.out_offsets[:-1]
        return np.stack([np.add.reduceat(row[:, None] * misses, begins, axis=0) for row in self.slopes], axis=1)

    def done(self, changes: Array) -> Array:
        """What changes (S, n, K) in prior deviations do to the positions in a straight line, (samples, K) m."""
        return np.asarray(np.einsum("jn,njk->nk", self.slopes, np.repeat(changes, self.part.count, axis=0)))

    def mean(self, squares: Array) -> Array:
        """Means (S, K) of squares (samples, K)."""
        return np.asarray(np.add.reduceat(squares, self.part.out_offsets[:-1], axis=0) / self.part.count[:, None])


class _Step(NamedTuple):
    """A step of least squares with the prior: change in prior deviations (S, n), what it leaves (samples,) m, and how
    much that is taken to be, the noise at least, (S,) m."""

    change: Array
    left: Array
    level: Array


def _told(slopes: Array, part: Segments) -> _Told:
    square = [[np.add.reduceat(a * b, part.out_offsets[:-1]) for b in slopes] for a in slopes]
    return _Told(slopes, np.array(square).transpose(2, 0, 1), part)


def _bent(told: _Told, change: Array, done: Array) -> NDArray[np.bool_]:
    """Which stretches (S,) answer changes of the states (S, n) otherwise than in a straight line. done: what these
    really do, (samples,) m."""
    straight = told.done(change[:, :, None])
    off = told.mean((done[:, None] - straight) ** 2) <= _STRAIGHT**2 * told.mean(straight**2)
    return np.asarray(~off[:, 0])  # where a run diverged, too


def _solved(told: _Told, level: Array, pull: Array) -> Array:
    """Changes of the states in prior deviations (S, n, K) under a level (S,) in m of what they leave; none where a run
    diverged."""
    square, pull = (x / level[:, None, None] ** 2 for x in (told.square, pull))
    sound = np.all(np.isfinite(square), axis=(1, 2)) & np.all(np.isfinite(pull), axis=(1, 2))
    square[~sound], pull[~sound] = 0.0, 0.0
    return np.asarray(np.linalg.solve(square + np.eye(square.shape[1]), pull))


def _steps(told: _Told, misses: Array, noise: Array) -> list[_Step]:
    """Rounds of changes of the states, the last one to be taken; misses: (samples,) m, measured minus simulated; noise:
    (S,) m."""
    out: list[_Step] = []
    level, pull = noise, told.pull(misses[:, None])
    for _ in range(_ROUNDS):
        change = _solved(told, level, pull)
        left = misses[:, None] - told.done(change)
        out.append(_Step(change[:, :, 0], left[:, 0], level))
        level = np.maximum(noise, np.nan_to_num(np.sqrt(told.mean(left**2)[:, 0])))
    return out


def _steps_by(told: _Told, steps: Sequence[_Step], misses_by: Array) -> Array:
    """How the last of these steps answers directions that change what is missed at its end by misses_by (samples, K)
    m, (S, n, K)."""
    pull = told.pull(misses_by)
    by = level_by = np.zeros((pull.shape[0], pull.shape[2]))
    for number, step in enumerate(steps):
        if number:
            before = steps[number - 1]
            grown = told.mean(before.left[:, None] * (misses_by - told.done(by))) / step.level[:, None]
            level_by = np.where((step.level > steps[0].level)[:, None], grown, 0.0)
        # A higher level lets the prior have more of a say.
        weaker = step.change[:, :, None] * (2.0 * step.level[:, None] * level_by)[:, None]
        by = _solved(told, step.level, pull - weaker)
    return by
