"""Fits that do not depend on each other: in threads here, or on workers elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Protocol, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


class Workers(Protocol):
    """Processes elsewhere that take items of work; function, items and results travel there and back pickled."""

    def map(self, function: Callable[[Item, int], Result], items: Sequence[Item]) -> Iterator[Result]:
        """function(item, threads) of every item, in order, as soon as each is there."""
        ...


def in_parallel(
    function: Callable[[Item, int], Result], items: Sequence[Item], jobs: int, workers: Workers | None = None
) -> Iterator[tuple[Item, Result]]:
    """Items with their results in order, as soon as each is there.

    function: of an item and the threads that it may use itself; jobs: threads in all; workers: who does several items
    instead of threads here. What has not begun is dropped when the caller stops, be it by an error or Ctrl-C.
    """
    if workers is not None and len(items) > 1:
        yield from zip(items, workers.map(function, items), strict=True)
        return
    # Threads suffice: half of a fit is simulation, which lets the others run.
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
