"""What an axis has gone through up to each row: reversals, travel, rests."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array, Flags, Integers
from linid.diagnosis.balance import Rows


def direction_of(rows: Rows) -> Array:
    """Direction of motion (n,), 1 or -1, dimensionless; at rest the one before, 0 before the first move."""
    sign = np.where(rows.standstill, 0.0, np.sign(rows.v))
    last = last_where(sign != 0.0, rows.recording)
    return np.where(last >= 0, sign[np.maximum(last, 0)], 0.0)


def since_reversal(rows: Rows, direction: Array) -> tuple[Array, Array]:
    """Travel (n,) in m and time (n,) in s since the last reversal, infinite before the first one.

    direction: (n,) 1, -1 or 0, dimensionless.
    """
    turned = np.zeros(direction.size, dtype=np.bool_)
    turned[1:] = (direction[1:] != direction[:-1]) & (rows.recording[1:] == rows.recording[:-1])
    last = last_where(turned, rows.recording)
    known, place = last >= 0, np.maximum(last, 0)
    path = travelled(rows)
    return np.where(known, path - path[place], np.inf), np.where(known, rows.t - rows.t[place], np.inf)


def last_rest(rows: Rows) -> Array:
    """Duration (n,) in s of the last rest before each row, 0 before the first one; while it rests, so far."""
    still = rows.standstill
    begun = still.copy()
    begun[1:] &= ~(still[:-1] & (rows.recording[1:] == rows.recording[:-1]))
    first, latest = last_where(begun, rows.recording), last_where(still, rows.recording)
    known = (first >= 0) & (latest >= 0)
    duration = rows.t[np.maximum(latest, 0)] - rows.t[np.maximum(first, 0)]
    return np.where(known, np.maximum(duration, 0.0), 0.0)


def travelled(rows: Rows) -> Array:
    """Distance gone (n,) in m since the first row of all, over all recordings."""
    step = np.zeros(rows.y.size)
    step[1:] = np.where(rows.recording[1:] == rows.recording[:-1], np.abs(np.diff(rows.y)), 0.0)
    return np.cumsum(step)


def last_where(mask: Flags, recording: Integers) -> Integers:
    """The last row (n,) up to each, in the same recording, in which mask (n,) holds; -1: there is none."""
    place = np.where(mask, np.arange(mask.size), -1)
    last = np.maximum.accumulate(place)
    first = np.searchsorted(recording, recording)
    return np.where(last >= first, last, -1).astype(np.int64)
