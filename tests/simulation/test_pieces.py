"""Pieces of tasks hold each task once, and no thread waits long for another."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from linid.simulation.pieces import Pieces, evenly, of_recordings, of_windows

LENGTHS = st.lists(st.integers(2, 100_000), min_size=1, max_size=12)


def tasks(pieces: Pieces) -> list[int]:
    return sorted(k for first, end in pieces for k in range(first, end))


def finish(cost: list[float], threads: int) -> float:
    """When the last of the threads is done, each taking the next piece as soon as it is free."""
    free = [0.0] * threads
    for one in cost:
        free[free.index(min(free))] += one
    return max(free)


@given(st.integers(0, 300), st.integers(1, 40), st.integers(1, 4))
def test_even_pieces_hold_each_task_once(count: int, least: int, threads: int) -> None:
    pieces = evenly(count, least, threads)
    assert tasks(pieces) == list(range(count))
    assert len(pieces) == 1 or min(end - first for first, end in pieces) >= least


@given(LENGTHS, st.integers(1, 20), st.integers(1, 4), st.data())
def test_recordings_hold_each_task_once(lengths: list[int], each: int, threads: int, data: st.DataObject) -> None:
    counts = np.array(lengths)
    among = np.array(data.draw(st.lists(st.booleans(), min_size=counts.size, max_size=counts.size)), dtype=np.bool_)
    wanted = [each * r + k for r in range(counts.size) if among[r] for k in range(each)]
    assert tasks(of_recordings(counts, among, each, threads)) == wanted
    assert tasks(of_recordings(counts, None, each, threads)) == list(range(each * counts.size))


@given(st.lists(st.integers(2, 100_000), min_size=1, max_size=9))
def test_two_threads_are_done_within_a_sixth_of_the_best(lengths: list[int]) -> None:
    """As the longest first promises (Graham 1969, SIAM J. Appl. Math. 17, 416); the best by trying all."""
    counts = np.array(lengths)
    cost = [float(counts[first]) for first, _ in of_recordings(counts, None, 1, 2)]
    ones = [sum(part) for k in range(counts.size + 1) for part in combinations(lengths, k)]
    best = min(max(one, sum(lengths) - one) for one in ones)
    assert finish(cost, 2) <= 7.0 / 6.0 * best + 1e-6


def test_one_long_recording_is_shared_out_by_candidates() -> None:
    pieces = of_recordings(np.array([90_000, 5_000, 5_000]), None, 16, 2)
    cost = [(end - first) * [90_000.0, 5_000.0, 5_000.0][first // 16] for first, end in pieces]
    assert finish(cost, 2) < 0.55 * sum(cost)


@given(st.lists(st.integers(1, 60), min_size=1, max_size=12), st.sampled_from([1, 8]), st.integers(1, 4))
def test_windows_hold_each_once(windows: list[int], least: int, threads: int) -> None:
    recording = np.repeat(np.arange(len(windows)), windows)
    pieces = of_windows(recording, least, threads)
    assert tasks(pieces) == list(range(recording.size))


@pytest.mark.parametrize("threads", [2, 3])
def test_windows_of_many_recordings_stay_together(threads: int) -> None:
    recording = np.repeat(np.arange(8), [20, 30, 10, 40, 15, 25, 35, 45])
    pieces = of_windows(recording, 8, threads)
    assert [np.unique(recording[first:end]).size for first, end in pieces] == [1] * 8
    assert [end - first for first, end in pieces] == sorted([20, 30, 10, 40, 15, 25, 35, 45], reverse=True)
