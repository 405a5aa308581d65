"""A scheduler and workers as processes of their own, as on a cluster, all on this machine."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from linid.errors import ConfigError
from tests.workflow.small import ROOT, interruptible

MINUTES = 5.0


class DaskProcesses:
    """Ends all of them on leaving. allowed_failures: deaths of workers that a task may cause before it is given up."""

    def __init__(self, folder: Path, allowed_failures: int = 3) -> None:
        self.folder = folder
        self.file = folder / "scheduler.json"
        self.file.unlink(missing_ok=True)
        self.processes: list[subprocess.Popen[bytes]] = []
        more = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": str(allowed_failures)}
        self._start("dask_scheduler", "--port", "0", "--scheduler-file", str(self.file), "--no-dashboard", more=more)
        self.address = ""
        try:
            self._wait_for_address()
        except BaseException:
            self.__exit__()
            raise

    def __enter__(self) -> DaskProcesses:
        return self

    def __exit__(self, *reason: object) -> None:
        for process in self.processes:
            process.kill()
        for process in self.processes:
            process.wait()

    def worker(
        self, *, package: Path = ROOT, threads: int = 1, more: Mapping[str, str] | None = None
    ) -> subprocess.Popen[bytes]:
        """One more worker; package: the folder whose linid it imports; more: of its environment."""
        return self._start(
            "dask_worker",
            self.address,
            "--nthreads",
            str(threads),
            "--no-nanny",
            "--no-dashboard",
            "--memory-limit",
            "0",
            more={"PYTHONPATH": str(package), "OPENBLAS_NUM_THREADS": "1", **(more or {})},
        )

    def client(self, stack: ExitStack, workers: int) -> Any:
        """A client of the test's own, once so many workers are there."""
        from distributed import Client

        client = stack.enter_context(Client(self.address, set_as_default=False))
        client.wait_for_workers(workers, timeout=60 * MINUTES)
        return client

    def _start(self, module: str, *arguments: str, more: dict[str, str]) -> subprocess.Popen[bytes]:
        host = ("--host", "127.0.0.1")
        self.processes.append(
            subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.{module}", *arguments, *host],
                cwd=self.folder,
                env={**os.environ, "PYTHONPATH": str(ROOT), **more},
                preexec_fn=interruptible,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        )
        return self.processes[-1]

    def _wait_for_address(self) -> None:
        deadline = time.monotonic() + 60 * MINUTES
        while not self.address:
            assert time.monotonic() < deadline
            assert all(process.poll() is None for process in self.processes)
            with suppress(OSError, ValueError):  # not there yet, or not yet written to the end
                self.address = str(json.loads(self.file.read_text(encoding="utf-8"))["address"])
            time.sleep(0.05)


def square(item: int, threads: int) -> int:
    """Work for workers, which import this module by its name."""
    if item == 7:
        raise ConfigError("seven", "cannot be squared", "Take another.")
    return threads * item**2


def die(item: int, threads: int) -> int:
    """Ends the process that computes."""
    os._exit(9)


def kill_worker(item: int, threads: int) -> int:
    """Ends its worker, which then ends this process."""
    os.kill(os.getppid(), signal.SIGKILL)
    time.sleep(60.0)
    return item
