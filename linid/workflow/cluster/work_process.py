"""A process in which a worker of a cluster computes, apart from dask's threads.

They draw from the same global random numbers as a search does, run linear algebra on any number of threads, and cannot
be interrupted. The process serves one call after the other, so that Python, numba and kernels are loaded once.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any, BinaryIO

from linid.errors import LinidError
from linid.own_process import own_python
from linid.threads import ONE_THREAD


class ProcessDiedError(Exception):
    """The process ended in the midst of a call, killed by the system for its memory perhaps."""


class WorkProcess:
    """The process as seen by the worker that started it, with which it ends."""

    def __init__(self) -> None:
        # A session of its own: Ctrl-C is for the program that asks, which passes it on.
        self._process = subprocess.Popen(
            own_python("from linid.workflow.cluster.work_process import serve; serve()"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **ONE_THREAD},
            start_new_session=True,
        )

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """function(*arguments) there. Raises what it raises, and ProcessDiedError."""
        assert self._process.stdin is not None and self._process.stdout is not None
        try:
            pickle.dump((function, arguments), self._process.stdin)
            self._process.stdin.flush()
            error, value = pickle.load(self._process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):
            self._process.kill()
            raise ProcessDiedError(f"its process ended without an answer (exit code {self._process.wait()})") from None
        if error is not None:
            raise error
        return value

    def interrupt(self) -> None:
        """Ctrl-C for what is being done there."""
        self._process.send_signal(signal.SIGINT)


def _read(requests: BinaryIO, calls: SimpleQueue[Any]) -> None:
    """Take calls from the worker; where it is gone, however it ended, this process is to end at once."""
    try:
        while True:
            calls.put(pickle.load(requests))
    except EOFError:
        os._exit(1)


def serve() -> None:
    """Answer calls for ever."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # while nothing is being done; jobs listen
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what is printed must not come between the answers
    calls: SimpleQueue[Any] = SimpleQueue()
    threading.Thread(target=_read, args=(sys.stdin.buffer, calls), daemon=True).start()
    while True:
        function, arguments = calls.get()
        try:
            answer = pickle.dumps((None, function(*arguments)))
        except LinidError as error:
            answer = pickle.dumps((error, None))
        except Exception as error:
            answer = pickle.dumps((RuntimeError(f"{type(error).__name__}: {error}"), None))
        answers.write(answer)
        answers.flush()
