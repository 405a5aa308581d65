"""Counts the processor's instructions exactly, by single steps of a traced child process (Linux on x86-64)."""

from __future__ import annotations

import ctypes
import os
import platform
import signal
import sys
from collections.abc import Callable

_TRACEME, _PEEKUSER, _CONT, _KILL, _SINGLESTEP = 0, 3, 7, 8, 9
_PROGRAM_COUNTER = 16 * 8  # its place in the kernel's struct user


def available() -> bool:
    """Whether this system is one on which `addresses` works."""
    return sys.platform == "linux" and platform.machine() == "x86_64"


def addresses(function: Callable[[], object]) -> list[int] | None:
    """The addresses of all instructions that a call of `function` executes, in their order; None if not permitted.

    Includes the few thousand of the interpreter around it: take the difference of two calls.
    """
    library = ctypes.CDLL(None, use_errno=True)
    library.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
    library.ptrace.restype = ctypes.c_long
    processors = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(processors)})  # both on one: they take turns anyway
    child = os.fork()
    if child == 0:
        if library.ptrace(_TRACEME, 0, None, None) != 0:
            os._exit(1)
        os.kill(os.getpid(), signal.SIGSTOP)
        function()
        os.kill(os.getpid(), signal.SIGSTOP)
        os._exit(0)
    try:
        return _steps(library.ptrace, child)
    finally:
        os.sched_setaffinity(0, processors)


def _steps(step: Callable[..., int], child: int) -> list[int] | None:
    found: list[int] = []
    _, status = os.waitpid(child, 0)
    if not os.WIFSTOPPED(status):
        return None
    wait = os.waitpid
    while True:
        step(_SINGLESTEP, child, None, None)
        _, status = wait(child, 0)
        if os.WIFEXITED(status) or os.WIFSIGNALED(status):
            return None
        if os.WSTOPSIG(status) == signal.SIGSTOP and found:
            break
        found.append(step(_PEEKUSER, child, _PROGRAM_COUNTER, None))
    step(_KILL, child, None, None)
    wait(child, 0)
    return found
