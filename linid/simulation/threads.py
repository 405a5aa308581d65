"""Pieces of one computation in threads that stay: to start new ones for each would take longer than most of them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import lru_cache
from typing import TypeVar

Piece = TypeVar("Piece")


def summed(work: Callable[[Piece], int], pieces: Sequence[Piece], threads: int) -> int:
    """The sum of work(piece) over all pieces, done by this thread and `threads` - 1 others.

    work: should release the interpreter's lock; it must not call this with as many threads itself. What it raises is
    raised here once nobody works any more.
    """
    left = iter(pieces)
    if threads < 2 or len(pieces) < 2:
        return _done(work, left)
    # A fork takes no threads along: it gets its own.
    helpers = [_helpers(os.getpid(), threads - 1).submit(_done, work, left) for _ in range(threads - 1)]
    try:
        total = _done(work, left)
    finally:
        begun = [helper for helper in helpers if not helper.cancel()]  # one that comes too late is not waited for
        wait(begun)
    return total + sum(helper.result() for helper in begun)


def _done(work: Callable[[Piece], int], left: Iterator[Piece]) -> int:
    """Take pieces as long as there are some."""
    try:
        return sum(work(piece) for piece in left)
    except BaseException:
        for _ in left:  # nobody is to go on
            pass
        raise


@lru_cache(maxsize=8)
def _helpers(process: int, threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, "simulation")
