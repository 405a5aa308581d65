"""Fits that do not depend on each other, run in threads: half of a fit is no simulation and keeps one core busy."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def side_by_side(
    function: Callable[[Item, int], Result], items: Sequence[Item], jobs: int
) -> Iterator[tuple[Item, Result]]:
    """Items with their results in order, as soon as each is there.

    function: of an item and the threads that it may use itself; jobs: threads in all. What has not begun is dropped
    when the caller stops, be it by an error or Ctrl-C.
    """
    at_once = max(1, min(jobs, len(items)))
    if at_once == 1:
        yield from ((item, function(item, jobs)) for item in items)
        return
    each = max(1, jobs // at_once)
    pool = ThreadPoolExecutor(at_once)
    try:
        futures = [pool.submit(function, item, each) for item in items]
        for item, future in zip(items, futures, strict=True):
            yield item, future.result()
    finally:
        pool.shutdown(cancel_futures=True)
