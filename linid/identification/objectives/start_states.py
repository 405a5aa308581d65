"""Start states of predictions by models with states that no channel shows: estimated from the samples before."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array, Integers
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
    out = np.empty((params.shape[0], int(windows.count.sum())))
    for c, one in enumerate(params):
        own, start = one[None, :], starts[c : c + 1]
        places = _moving(simulator, start[0])
        prior = _prior(along, c, motion, simulator.inputs.sample_offsets)[part.recording][:, _of_prior(places)]
        plain = simulator.run(own, part, start, guided=guided)[0][0]
        nudged = np.repeat(start, len(places), axis=0)
        for row, place in enumerate(places):
            nudged[row, :, place] += _NUDGE * prior[:, row]
        swung = simulator.run(np.repeat(own, len(places), axis=0), part, nudged, guided=guided)[0]
        slopes = (swung - plain) / _NUDGE  # per prior deviation
        better = start.copy()
        better[0][:, places] += _steps(slopes, before.measured - plain, noise, part) * prior
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
    the states along the motion and the step of Gauss and Newton are differenced; which stretches it makes worse is
    held.
    """
    before = _stretches_of(simulator, motion, windows)
    part, whole = before.part, before.whole
    along, starts = _along(simulator, np.vstack([params, params + START_STEP * tangents]), motion, before)
    start, places, offsets = starts[0], _moving(simulator, starts[0]), simulator.inputs.sample_offsets
    noise = _noise_of(before, motion)
    priors = np.array([_prior(along, c, motion, offsets)[:, _of_prior(places)] for c in range(len(starts))])
    prior, prior_by = priors[0][part.recording], ((priors[1:] - priors[0]) / START_STEP)[:, part.recording]
    start_by = ((starts[1:] - start) / START_STEP).transpose(1, 2, 0)

    def ahead(segments: Segments, begins: Array, begins_by: Array) -> tuple[Array, Array]:
        return simulator.slopes(params, tangents, segments, begins, begins_by, guided=guided)

    plain, plain_by = ahead(part, start, start_by)
    slopes, slopes_by = np.empty((len(places), plain.size)), np.empty((len(places), len(tangents), plain.size))
    for row, place in enumerate(places):
        nudged, nudged_by = start.copy(), start_by.copy()
        nudged[:, place] += _NUDGE * prior[:, row]
        nudged_by[:, place] += _NUDGE * prior_by[:, :, row].T
        swung, swung_by = ahead(part, nudged, nudged_by)
        slopes[row], slopes_by[row] = (swung - plain) / _NUDGE, (swung_by - plain_by).T / _NUDGE
    misses = before.measured - plain
    steps = _steps(slopes, misses, noise, part)
    better, better_by = start.copy(), start_by.copy()
    better[:, places] += steps * prior
    for k in range(len(tangents)):
        after = _steps(slopes + START_STEP * slopes_by[:, k], misses - START_STEP * plain_by[:, k], noise, part)
        better_by[:, places, k] += (after - steps) / START_STEP * prior + steps * prior_by[k]
    met = simulator.run(params[None], part, better[None], guided=guided)[0][0]
    worse = _worse(met, plain, before)
    better[worse], better_by[worse] = start[worse], start_by[worse]
    moved, moved_by = ahead(whole, better, better_by)
    return moved[before.seen], moved_by[before.seen]


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
    """Their columns in `_prior`, which has none of the bristle."""
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
    inputs = simulator.inputs
    start_w = np.full((params.shape[0], inputs.counts.size), np.nan)
    along = simulator.along(
        params, motion.y, motion.v, motion.standstill, start_w, without="acceleration", wanted=wanted
    )
    return along, along.starts(before.flat, motion.y, motion.v, inputs.dts[before.part.recording])


def _rows(first: Integers, count: Integers) -> Integers:
    """The numbers first, first + 1 ... of every stretch, one after the other."""
    ends = np.cumsum(count)
    return np.repeat(first - ends + count, count) + np.arange(int(ends[-1]))


def _prior(along: AlongMotion, candidate: int, motion: Motion, offsets: Integers) -> Array:
    """Prior deviations (R, 2 + states) of position (m), speed (m/s) and hidden states in each recording."""
    rows = []
    for r, (a, b) in enumerate(pairwise(offsets)):
        own = max(float(np.std(motion.y[a:b])), 1e-12)
        sizes = np.sqrt(np.mean(np.nan_to_num(along.states[candidate, a:b]) ** 2, axis=0))
        noise = np.maximum([motion.position_noise[r], motion.speed_noise[r]], 1e-12)
        rows.append(np.concatenate([noise, np.maximum(sizes, _LEAST_SHARE * own)]))
    return np.array(rows)


def _steps(slopes: Array, misses: Array, noise: Array, part: Segments) -> Array:
    """Changes of the states in prior deviations (S, n), least squares with the prior; none where a run diverged.

    slopes: (n, samples of all stretches) m; misses: (samples,) m, measured minus simulated; noise: (S,) m.
    """
    size = slopes.shape[0]
    out = np.zeros((part.count.size, size))
    for length in np.unique(part.count):
        chosen = np.flatnonzero(part.count == length)
        rows = _rows(part.out_offsets[:-1][chosen], part.count[chosen])
        matrix = slopes[:, rows].reshape(size, chosen.size, length).transpose(1, 2, 0)
        target = misses[rows].reshape(chosen.size, length)
        sound = np.all(np.isfinite(matrix), axis=(1, 2)) & np.all(np.isfinite(target), axis=1)
        chosen, matrix, target = chosen[sound], matrix[sound], target[sound]
        level = noise[chosen]
        for _ in range(_ROUNDS):
            square = np.einsum("swi,swj->sij", matrix, matrix) / level[:, None, None] ** 2 + np.eye(size)
            pull = np.einsum("swi,sw->si", matrix, target) / level[:, None] ** 2
            step = np.linalg.solve(square, pull[:, :, None])[:, :, 0]
            left = target - np.einsum("swi,si->sw", matrix, step)
            level = np.maximum(noise[chosen], np.sqrt(np.mean(left**2, axis=1)))
        out[chosen] = step
    return out
