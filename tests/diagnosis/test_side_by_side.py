"""Independent fits in threads: order, threads to each, and what happens when one fails or the caller stops."""

from __future__ import annotations

import threading
import time

import pytest

from linid.diagnosis.side_by_side import side_by_side


@pytest.mark.parametrize(("jobs", "each"), [(1, 1), (2, 1), (3, 1), (8, 2)])
def test_results_come_in_order_and_the_threads_are_shared_out(jobs: int, each: int) -> None:
    def function(item: int, threads: int) -> tuple[int, int]:
        time.sleep(0.02 * (4 - item))  # the last one ends first
        return item**2, threads

    assert list(side_by_side(function, [1, 2, 3, 4], jobs)) == [(k, (k**2, each)) for k in (1, 2, 3, 4)]
    assert list(side_by_side(function, [], jobs)) == []


def test_a_single_item_gets_all_threads_and_no_pool() -> None:
    def function(item: int, threads: int) -> tuple[int, str]:
        return threads, threading.current_thread().name

    assert list(side_by_side(function, [7], 4)) == [(7, (4, threading.main_thread().name))]


def test_an_error_drops_what_has_not_begun() -> None:
    begun = []

    def function(item: int, threads: int) -> int:
        begun.append(item)
        time.sleep(0.05)
        if item == 0:
            raise ValueError("no such fit")
        return item

    with pytest.raises(ValueError, match="no such fit"):
        list(side_by_side(function, range(20), 2))
    assert len(begun) < 10
