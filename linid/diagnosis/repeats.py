"""Repeated recordings: which belong together, and their common stretch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.recording.recording import Recording

_SHORTEST = 50  # samples that two repeats must have in common


def repeats_of(recording: Recording, among: Sequence[Recording]) -> tuple[Recording, ...]:
    """The other recordings that were declared repeats of the same command (`repeat_of:` in the campaign)."""
    first = recording.repeat_of or recording.name
    return tuple(r for r in among if r.name != recording.name and (r.repeat_of or r.name) == first)


def aligned(one: Recording, other: Recording) -> tuple[Recording, Recording] | None:
    """Both recordings cut to their common stretch, aligned by their speed; None if too little is common.

    A scope that was started by hand begins sooner or later than the command: the lag, in whole samples, is where
    the speeds differ least in the mean square, with at least half of the shorter recording in common.
    """
    if abs(one.period - other.period) > 1e-6 * one.period or one.kind != other.kind:
        return None
    lag = _lag(np.diff(one.y), np.diff(other.y))
    first, second = max(lag, 0), max(-lag, 0)
    size = min(one.t.size - first, other.t.size - second)
    if size < _SHORTEST:
        return None
    return _part(one, first, size), _part(other, second, size)


def _lag(a: Array, b: Array) -> int:
    """k such that a[n + k] is most like b[n]."""
    from scipy.signal import correlate

    lags = np.arange(-(b.size - 1), a.size)
    common = np.minimum(a.size, b.size + lags) - np.maximum(lags, 0)
    sums = [np.concatenate([[0.0], np.cumsum(x**2)]) for x in (a, b)]
    first, second = np.maximum(lags, 0), np.maximum(-lags, 0)
    energy = sums[0][first + common] - sums[0][first] + sums[1][second + common] - sums[1][second]
    difference = (energy - 2.0 * correlate(a, b, mode="full")) / common
    difference[common < 0.5 * min(a.size, b.size)] = np.inf
    return int(lags[np.argmin(difference)])


def _part(recording: Recording, first: int, size: int) -> Recording:
    rows = slice(first, first + size)
    currents, command, v = recording.phase_currents, recording.drive_input, recording.v
    return replace(
        recording,
        t=recording.t[rows],
        y=recording.y[rows],
        v=None if v is None else v[rows],
        phase_currents=None if currents is None else currents[:, rows],
        drive_input=None if command is None else command[rows],
    )
