"""Linear algebra on one thread: on several, sums are taken in another order, and the last bits of a result change."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

# What the libraries of linear algebra read when they are loaded.
ONE_THREAD = {name: "1" for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")}
_lock = Lock()
_inside = 0
_limits: list[Any] = []


def load_with_one_thread() -> None:
    """Keep this process, and those that it starts, to one thread of linear algebra, where the user names no number.

    Works for libraries that are not loaded yet.
    """
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)


@contextmanager
def one_thread() -> Iterator[None]:
    """One thread of linear algebra meanwhile, whatever the caller's program has loaded; several threads may be inside.

    The limit is the process's: it is lifted when the last one leaves.
    """
    global _inside
    # Loaded first: what is loaded later would not be held.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    with _lock:
        _inside += 1
        _let_any_thread_set()
        _limits.append(threadpool_limits(1))
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            _let_any_thread_set()
            while not _inside and _limits:
                _limits.pop().restore_original_limits()
            _let_any_thread_set()


def _let_any_thread_set() -> None:
    """Take the number of threads out of the hand of the thread that has set it last.

    From threadpoolctl 3.8 on, others set nothing otherwise, and are not told: OpenBLAS has one number for the process.
    """
    from threadpoolctl import OpenBLASController

    if hasattr(OpenBLASController, "clear_controlling_thread"):
        OpenBLASController.clear_controlling_thread(force=True)
