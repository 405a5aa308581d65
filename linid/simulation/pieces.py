"""How tasks are shared out among threads, which never changes a result: in pieces, from the first task to the last."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from linid.arrays import Flags, Integers

Pieces = list[tuple[int, int]]


def evenly(tasks: int, least: int, threads: int) -> Pieces:
    """Pieces of as many tasks each, `least` or more, four for each thread."""
    pieces = min(tasks // least, 4 * threads)
    if threads < 2 or pieces < 2:
        return [(0, tasks)]
    return list(pairwise([tasks * k // pieces for k in range(pieces + 1)]))


def of_recordings(counts: Integers, among: Flags | None, each: int, threads: int) -> Pieces:
    """Pieces of `each` tasks for every recording of counts (R,) samples, or for those among them (R,) alone.

    The longest first, so that no thread waits long for another, and in parts where one is more than a piece's share:
    the first task of a piece takes longer than the next of the same recording.
    """
    if among is None:
        among = np.ones(counts.size, dtype=np.bool_)
    if threads < 2:
        edges = np.flatnonzero(np.diff(np.concatenate([[0], among.astype(int), [0]])))
        return [(each * int(first), each * int(end)) for first, end in edges.reshape(-1, 2)]
    share = np.sum(counts[among]) / (2 * threads)
    pieces: Pieces = []
    for r in np.flatnonzero(among)[np.argsort(-counts[among], kind="stable")]:
        parts, first = min(each, math.ceil(counts[r] / share)), each * int(r)
        pieces += pairwise([first + each * k // parts for k in range(parts + 1)])
    return pieces


def of_windows(recording: Integers, least: int, threads: int) -> Pieces:
    """Pieces of whole recordings, of whose windows (S,) `recording` tells the owners, `least` windows or more.

    The longest first; where recordings are few, `evenly`: each piece computes the motor's forces, and their slopes, at
    all points of its windows.
    """
    edges = [0]
    for edge in np.flatnonzero(np.diff(recording)) + 1:
        if edge - edges[-1] >= least and recording.size - edge >= least:
            edges.append(int(edge))
    if len(edges) < 2 * threads:
        return evenly(recording.size, least, threads)
    return sorted(pairwise([*edges, recording.size]), key=lambda piece: piece[0] - piece[1])
