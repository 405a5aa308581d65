"""Where compiled functions are kept, and what several processes that compile into there owe each other.

numba numbers the files of its cache by what it finds there: two processes that keep a function for different types or
processors at the same moment can take the same number, and load each other's machine code from then on. So only one at
a time writes, and a kernel that another process is compiling is waited for: it needs seconds to be compiled again.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import njit
from numba.core.caching import FunctionCache
from numba.core.runtime.nrt import rtsys

LOCK_FILE = "writing.lock"
Function = TypeVar("Function", bound=Callable[..., Any])
_LONGEST = 300.0  # s to wait for another process: a file system without working locks must not stop a fit


def locked(path: Path) -> Any:
    """The lock of this file between processes, taken, to be released; None on a file system without locks."""
    from filelock import FileLock, Timeout

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = FileLock(path)
        lock.acquire(timeout=_LONGEST)
    except (OSError, NotImplementedError, Timeout):
        return None
    return lock


def cache_folder() -> Path:
    """Where emitted kernels and their machine code are kept (LINID_CACHE_DIR, else the user's cache)."""
    chosen = os.environ.get("LINID_CACHE_DIR")
    if chosen:
        return Path(chosen)
    from platformdirs import user_cache_path

    return user_cache_path("linid", appauthor=False)


class SharedCache(FunctionCache):  # type: ignore[misc]
    """numba's disk cache, which one process at a time writes to."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What is kept for these types, or None; without loading all that numba needs to compile.

        Machine code needs no more than the names it calls by: those of numba's runtime and those for hashes.
        """
        rtsys.initialize(target_context)
        import numba.cpython.hashing  # noqa: F401

        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled for these types."""
        lock = locked(cache_folder() / LOCK_FILE)
        try:
            super().save_overload(sig, data)
        finally:
            if lock is not None:
                lock.release()


def kept(**options: Any) -> Callable[[Function], Function]:
    """numba's njit with these options, what it compiles kept on disk."""

    def decorate(function: Function) -> Function:
        compiled: Any = njit(**options)(function)
        compiled._cache = SharedCache(function)
        return cast(Function, compiled)

    return decorate


_waiting: list[Callable[[], None]] = []


def before_compilation(tell: Callable[[], None] | None) -> None:
    """Have somebody told once, before the next kernel that is not in the cache is compiled; None: nobody any more."""
    _waiting[:] = [] if tell is None else [tell]


def announce_compilation() -> None:
    """A kernel is about to be compiled: tell who waits for that."""
    while _waiting:
        _waiting.pop()()
