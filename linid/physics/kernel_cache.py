"""Where compiled kernels are kept, and one process at a time that compiles into there.

numba numbers the files of its cache by what it finds there: two processes that compile a function for different types
or processors at the same moment can take the same number, and load each other's machine code from then on. With the
lock, the second one also finds compiled what the first one needed half a minute for.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba.core import event

try:
    import fcntl
except ImportError:  # not a Unix: numba's own care must do
    fcntl = None  # type: ignore[assignment]

LOCK_FILE = "compiling.lock"
_EVENT = "numba:compiler_lock"  # from before numba looks into its cache until it has written to it
_LONGEST = 300.0  # s to wait for another process: a file system without working locks must not stop a fit
_LOOK = 0.05  # s


class CompileLock(event.Listener):  # type: ignore[misc]
    """Holds a lock file while numba compiles in this process; path: of the file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._inside = 0  # of nested compilations and of other threads
        self._guard = threading.Lock()
        self._handle: int | None = None

    def on_start(self, event: Any) -> None:
        """numba is about to compile, or to load from its cache."""
        with self._guard:
            self._inside += 1
            if self._inside == 1:
                self._handle = self._locked()

    def on_end(self, event: Any) -> None:
        """It is done."""
        with self._guard:
            self._inside -= 1
            if self._inside == 0 and self._handle is not None:
                os.close(self._handle)  # and with it the lock
                self._handle = None

    def _locked(self) -> int | None:
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            handle = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError:
            return None
        deadline = time.monotonic() + _LONGEST
        while time.monotonic() < deadline:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return handle
            except BlockingIOError:
                time.sleep(_LOOK)
            except OSError:
                break
        os.close(handle)
        return None


def cache_folder() -> Path:
    """Where emitted kernels and their machine code are kept (LINID_CACHE_DIR, else the user's cache)."""
    chosen = os.environ.get("LINID_CACHE_DIR")
    if chosen:
        return Path(chosen)
    from platformdirs import user_cache_path

    return user_cache_path("linid", appauthor=False)


_waiting: list[Callable[[], None]] = []


def before_compilation(tell: Callable[[], None] | None) -> None:
    """Have somebody told once, before the next kernel that is not in the cache is compiled; None: nobody any more."""
    _waiting[:] = [] if tell is None else [tell]


def announce_compilation() -> None:
    """A kernel is about to be compiled: tell who waits for that."""
    while _waiting:
        _waiting.pop()()


_installed: list[CompileLock] = []
_installing = threading.Lock()


def lock_compilation() -> None:
    """From now on numba compiles in this process only while no other one does with the same cache folder."""
    with _installing:
        if fcntl is not None and not _installed:
            _installed.append(CompileLock(cache_folder() / LOCK_FILE))
            event.register(_EVENT, _installed[0])  # type: ignore[no-untyped-call]
