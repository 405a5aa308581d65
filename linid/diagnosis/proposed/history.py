"""What an axis has gone through up to each row: reversals, travel, rests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from linid.arrays import Array, Flags, Integers
from linid.diagnosis.balance import Rows
from linid.physics.own_terms.memory import memory_along


def direction_of(rows: Rows) -> Array:
    """Direction of motion (n,), 1 or -1, dimensionless; at rest the one before, 0 before the first move."""
    sign = np.where(rows.standstill, 0.0, np.sign(rows.v))
    last = last_where(sign != 0.0, rows.recording)
    return np.where(last >= 0, sign[np.maximum(last, 0)], 0.0)


@dataclass(frozen=True)
class Memory:
    """travel: (n,) m and lasting: (n,) s since the last reversal, before the first one since the start; rest: (n,) s
    that the last rest took; slid: (n,) m gone since it, before the first one since the start."""

    travel: Array
    lasting: Array
    rest: Array
    slid: Array


def memory_of(rows: Rows) -> Memory:
    """What the axis remembers at each row, as simulations keep it for own terms."""
    parts = []
    for number in np.unique(rows.recording):
        mine = rows.recording == number
        parts.append(memory_along(rows.t[mine], rows.y[mine]))
    return Memory(
        *(np.concatenate([part[name] for part in parts]) for name in ("travel", "since_reversal", "rest", "slid"))
    )


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
