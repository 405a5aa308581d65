"""Recordings packed for the kernel: input splines, clocks and masses in flat arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array, Integers, joined
from linid.recording.input_course import input_coefficients
from linid.recording.recording import Recording
from linid.recording.splines import cubic_spline_coefficients

CONTINUOUS = 1e-6  # of an input: what rounding leaves of the difference between both sides of a sample
LONGEST_KEPT = 100_000  # samples of a recording whose coefficients are kept: 13 MB


class Inputs(NamedTuple):
    """Inputs of R recordings on uniform grids.

    coefficients: (intervals, 4, 4) cubics in powers of t - t_k of the three inputs (A or V) and of the measured
    position (m); sampled: (3, samples) inputs at the samples, midway between before and after where they step; offsets:
    (R + 1,) first interval of each recording; sample_offsets: (R + 1,); t_starts, dts: (R,) s; added_mass: (R,) kg;
    powered: (R,) whether any input is not zero; steps: (R,) whether any differs before and after a sample; records:
    (R,) numbers in the campaign; elapsed: (R,) running time of the campaign at t = 0, s.
    """

    coefficients: Array
    sampled: Array
    offsets: Integers
    sample_offsets: Integers
    t_starts: Array
    dts: Array
    added_mass: Array
    powered: NDArray[np.bool_]
    steps: NDArray[np.bool_]
    records: Array
    elapsed: Array

    @property
    def counts(self) -> Integers:
        """Samples per recording (R,)."""
        return np.diff(self.sample_offsets)


def pack_inputs(recordings: Sequence[Recording], *, voltages: bool = False) -> Inputs:
    """Inputs of recordings on uniform grids between their samples (the paper's section 5.2, but for jumps), packed.

    voltages: the phase voltages are the inputs; the windings of a free wheel are open.
    """
    sizes = np.array([recording.t.size for recording in recordings], dtype=np.int64)
    offsets = np.concatenate([[0], np.cumsum(sizes - 1)]).astype(np.int64)
    blocks = [_block(recording, voltages) for recording in recordings]
    return Inputs(
        coefficients=joined([block.coefficients for block in blocks], 0) if blocks else np.empty((0, 4, 4)),
        sampled=joined([block.sampled for block in blocks], 1) if blocks else np.empty((3, 0)),
        offsets=offsets,
        sample_offsets=np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        t_starts=np.array([r.t[0] for r in recordings]),
        dts=np.array([(r.t[-1] - r.t[0]) / (r.t.size - 1) for r in recordings]),
        added_mass=np.array([r.added_mass for r in recordings]),
        powered=np.array([block.powered for block in blocks], dtype=np.bool_),
        steps=np.array([block.steps for block in blocks], dtype=np.bool_),
        records=np.array([float(r.number) for r in recordings]),
        elapsed=np.array([r.elapsed for r in recordings]),
    )


class _Block(NamedTuple):
    """One recording's part of coefficients and sampled inputs, and whether any input acts, and steps."""

    coefficients: Array
    sampled: Array
    powered: bool
    steps: bool


# Several objectives pack the same recordings one after the other; with a recording its blocks go.
_blocks: WeakKeyDictionary[Recording, dict[bool, _Block]] = WeakKeyDictionary()


def _block(recording: Recording, voltages: bool) -> _Block:
    """One recording's part, computed once unless it is so long that keeping it would fill the memory."""
    kept = _blocks.get(recording, {})
    if voltages not in kept:
        block = _spline_block(recording, voltages)
        if recording.t.size > LONGEST_KEPT:
            return block
        kept = {**kept, voltages: block}
        _blocks[recording] = kept
    return kept[voltages]


def _spline_block(recording: Recording, voltages: bool) -> _Block:
    """One recording's part, computed."""
    channels, before = _driving(recording, voltages), recording.stepping
    if before is not recording and before.y is recording.y:
        return _with_noise(recording, channels, before, voltages)
    powered = channels is not None and bool(np.any(channels))
    dt = (recording.t[-1] - recording.t[0]) / (recording.t.size - 1)
    out = np.zeros((recording.t.size - 1, 4, 4))
    sampled, steps = np.zeros((3, recording.t.size)), False
    if channels is not None and powered:
        pieces = input_coefficients(recording, channels)
        out[:, : len(channels)] = pieces.transpose(1, 0, 2)
        sampled[: len(channels)], steps = _at_samples(pieces, dt)
    if recording.measured:
        out[:, 3] = cubic_spline_coefficients(dt, recording.y)[0]
    return _Block(out, sampled, powered, steps)


def _with_noise(recording: Recording, channels: Array | None, before: Recording, voltages: bool) -> _Block:
    """The part of a recording to whose inputs noise was added: that of the recording before, and the noise's own course
    between the samples, which does not step by itself. channels: (c, n) its inputs in A or V."""
    known = _blocks.get(before, {}).get(voltages) or _spline_block(before, voltages)
    own = _driving(before, voltages)
    if channels is None or own is None:
        return known
    pieces = input_coefficients(recording, channels - own, stepping=False)
    at_samples, steps = _at_samples(pieces, (recording.t[-1] - recording.t[0]) / (recording.t.size - 1))
    out, sampled = known.coefficients.copy(), known.sampled.copy()
    out[:, : len(pieces)] += pieces.transpose(1, 0, 2)
    sampled[: len(pieces)] += at_samples
    return _Block(out, sampled, bool(np.any(channels)), known.steps or steps)


def _driving(recording: Recording, voltages: bool) -> Array | None:
    """What drives a recording, (c, n) in A or V; None where nothing does."""
    if voltages:
        return recording.phase_voltages if recording.kind != "free_wheel" else None
    return None if recording.inputs is None else np.atleast_2d(recording.inputs)


def _at_samples(pieces: Array, dt: float) -> tuple[Array, bool]:
    """Inputs at the samples (c, n), midway where they step, and whether any does. pieces: (c, n - 1, 4) as of
    `input_coefficients`."""
    ends = pieces @ dt ** np.arange(4.0)
    before, after = ends[:, :-1], pieces[:, 1:, 0]
    apart = np.abs(after - before)
    steps = bool(np.any(apart > CONTINUOUS * np.abs(pieces[:, :, 0]).max(initial=0.0)))
    continuous = apart <= CONTINUOUS * (np.abs(after) + dt * np.abs(pieces[:, 1:, 1]))
    between = np.where(continuous, after, 0.5 * (before + after))
    return np.concatenate([pieces[:, :1, 0], between, ends[:, -1:]], axis=1), steps


def measured_points(inputs: Inputs, pieces: int) -> Array:
    """Measured positions (m) and the three inputs, (4, points), at `pieces` equal parts of each sampling interval.

    Those of recording r begin at pieces * offsets[r] + r and end with its last sample. At a sample, inputs that step
    there are between both levels.
    """
    order = [3, 0, 1, 2]
    out = np.empty((4, pieces * int(inputs.offsets[-1]) + inputs.dts.size))
    for r, dt in enumerate(inputs.dts):
        c = inputs.coefficients[inputs.offsets[r] : inputs.offsets[r + 1]]
        begin, end = pieces * inputs.offsets[r] + r, pieces * inputs.offsets[r + 1] + r
        for piece in range(pieces):
            x = np.vander([piece * (dt / pieces)], 4, increasing=True)[0]
            out[:, begin + piece : end : pieces] = np.einsum("kjn,n->jk", c, x)[order]
        ends = (c @ dt ** np.arange(4.0)).T[order]
        if inputs.steps[r]:
            out[:, begin + pieces : end : pieces] = 0.5 * (out[:, begin + pieces : end : pieces] + ends[:, :-1])
        out[:, end] = ends[:, -1]
    return out
