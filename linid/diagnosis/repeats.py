"""Repeated recordings: which belong together, and their common stretch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from linid.recording.recording import Recording

_SHORTEST = 50  # samples that two repeats must have in common


def repeats_of(recording: Recording, among: Sequence[Recording]) -> tuple[Recording, ...]:
    """The other recordings that were declared repeats of the same command (`repeat_of:` in the campaign)."""
    first = recording.repeat_of or recording.name
    return tuple(r for r in among if r.name != recording.name and (r.repeat_of or r.name) == first)


def aligned(one: Recording, other: Recording) -> tuple[Recording, Recording] | None:
    """Both recordings cut to their common stretch, aligned by their speed; None if too little is common.

    A scope that was started by hand begins sooner or later than the command: the lag, in whole samples, is where
    the correlation of the speeds is largest.
    """
    from scipy.signal import correlate

    if abs(one.period - other.period) > 1e-6 * one.period or one.kind != other.kind:
        return None
    speeds = [np.diff(r.y) for r in (one, other)]
    lag = int(np.argmax(correlate(*speeds, mode="full"))) - (speeds[1].size - 1)
    first, second = max(lag, 0), max(-lag, 0)
    size = min(one.t.size - first, other.t.size - second)
    if size < _SHORTEST:
        return None
    return _part(one, first, size), _part(other, second, size)


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
