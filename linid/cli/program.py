"""The process of a command, which ends without taking apart what it has loaded."""

from __future__ import annotations

import atexit
import os
import sys
from collections.abc import Callable

from linid.stop_signals import raise_on_sigterm

# s, after which a thread that runs Python lets another one that waits have its turn. Simulations and linear algebra run
# beside Python, a millisecond or two each: at Python's own 5 ms, whoever comes back from them waits as long again.
_TURN = 5e-4
# Pools of memory that all threads share. glibc gives each thread its own, up to eight a processor, and what one keeps
# no other can use: of a diagnosis a tenth to a sixth of its memory.
_POOLS, _MOST_POOLS = 2, -8  # mallopt's M_ARENA_MAX


def run_program(command: Callable[..., object]) -> None:
    """Run a click command as this process, which ends with its exit code."""
    raise_on_sigterm()
    sys.setswitchinterval(_TURN)
    _share_memory()
    try:
        command(prog_name="linid")
    except SystemExit as ending:
        _leave(ending.code)
        raise


def _share_memory() -> None:
    """Have threads share pools of memory, where the system's library can be told so and the user has not."""
    if sys.platform.startswith("linux") and "MALLOC_ARENA_MAX" not in os.environ:
        import ctypes

        tell = getattr(ctypes.CDLL(None), "mallopt", None)
        if tell is not None:
            tell(_MOST_POOLS, _POOLS)


def _leave(code: str | int | None) -> None:
    """End the process at once, after what was registered for its end. Returns where Python has more to do than that:
    other processes to wait for, somebody who traces this one, or output that nobody takes.

    Python would free every object and all machine code one by one, a third of a second for compiled kernels.
    """
    if isinstance(code, str) or _is_traced() or _has_children():
        return
    atexit._run_exitfuncs()
    try:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
    except (AttributeError, OSError, ValueError):  # none, full or closed
        return
    os._exit(code or 0)


def _is_traced() -> bool:
    """Whether a debugger or profiler is at work, which may have something to write at the end."""
    monitoring = getattr(sys, "monitoring", None)  # from Python 3.12 on
    monitored = monitoring is not None and any(map(monitoring.get_tool, range(6)))
    return monitored or sys.gettrace() is not None or sys.getprofile() is not None


def _has_children() -> bool:
    """Whether processes of Python's own pools are still there."""
    if "multiprocessing" not in sys.modules:
        return False
    from multiprocessing import active_children

    return bool(active_children())
