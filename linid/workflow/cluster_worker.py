"""What runs on the workers of a cluster, each of which does one thing at a time in its only thread."""

from __future__ import annotations

import ctypes
import hashlib
import os
import pickle
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.errors import ConfigError
from linid.workflow.run_folder import RUN_FILE, versions

if TYPE_CHECKING:
    from linid.workflow.batch_file import JobSpec
    from linid.workflow.batch_job import JobReport

DECISIVE = ("linid", "numpy", "scipy", "numba", "deap")
ONE_THREAD = "OPENBLAS_NUM_THREADS"
_lock = threading.Lock()
_stopped: set[str] = set()
_at_work: dict[int, str] = {}  # thread -> token of the run that it works for


@dataclass(frozen=True)
class Terms:
    """What the workers of a run must agree to. token: of the run; versions: of the program that asks; folder, record:
    of a batch, and the content of its run.json (empty: no folder is shared)."""

    token: str
    versions: dict[str, str]
    folder: str = ""
    record: str = ""


@cache
def own_versions() -> dict[str, str]:
    """Versions of all that decides a result, and a digest of linid's own source, which may have been edited."""
    import linid

    package = Path(str(linid.__file__)).parent
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        digest.update(str(path.relative_to(package)).encode() + path.read_bytes())
    out = {"Python": f"{sys.version_info.major}.{sys.version_info.minor}"}
    out |= {name: versions()[name] for name in DECISIVE}
    return out | {"linid source": digest.hexdigest()[:12]}


def processor() -> str:
    """The processor for which kernels are compiled here."""
    from llvmlite.binding import get_host_cpu_name

    return str(get_host_cpu_name())


def objection(terms: Terms, threads: int, inputs: Sequence[str] = ()) -> tuple[str, str] | None:
    """Why this process cannot take part in a run, as fact and remedy; None if it can.

    threads: that this worker has; inputs: files that it must see.
    """
    for name, version in terms.versions.items():
        mine = own_versions().get(name, "unknown")
        if mine != version:
            return f"has {name} {mine}, this program {version}", "Install the same there as here and start it again."
    if threads != 1:
        return f"has {threads} threads", "Start it with --nthreads 1, and --nworkers N for more workers."
    if os.environ.get(ONE_THREAD) != "1":
        return (
            f"has {ONE_THREAD} not set to 1, which could change the last bits of results",
            "Set it before the worker is started, or start the worker with its nanny, which does.",
        )
    if terms.folder:
        try:
            seen = (Path(terms.folder) / RUN_FILE).read_text(encoding="utf-8") == terms.record
        except OSError:
            seen = False
        if not seen:
            return (
                f"does not see the folder {terms.folder}",
                "Choose an --out on a file system that all workers share, under the same path.",
            )
        if not os.access(terms.folder, os.W_OK):
            return f"may not write into {terms.folder}", "Start it as a user who may."
    missing = [path for path in inputs if not Path(path).exists()]
    if missing:
        return (
            f"does not see the file {missing[0]}",
            "Put the recordings on a file system that all workers share, under the same path.",
        )
    return None


def look_at_worker(terms: Terms, inputs: Sequence[str], dask_worker: Any = None) -> tuple[Any, str, str]:
    """Objection of this worker, its host and processor. dask fills in `dask_worker`."""
    host = str(dask_worker.address).rpartition("://")[2].rpartition(":")[0]
    return objection(terms, dask_worker.state.nthreads, inputs), host, processor()


def look_at_scheduler(dask_scheduler: Any = None) -> dict[str, str]:
    """Versions in the scheduler's process, which unpacks what is sent to workers."""
    return own_versions()


def run_on_worker(terms: Terms, job: JobSpec, folder: str, resume: bool) -> JobReport:
    """A job of a batch as a task; its folder is on the shared file system.

    resume: take over what is in the folder already. Raises ConfigError where this worker cannot do it.
    """
    from distributed import get_worker

    from linid.workflow.batch_job import JobReport, perform

    worker = get_worker()
    reason = objection(terms, worker.state.nthreads, job.inputs)
    if reason is not None:
        raise ConfigError(f"worker {worker.address}", *reason)
    not_begun = JobReport(job.label, "not_started", 130, 0.0, "interrupted before it began")
    if not _begin(terms.token):
        return not_begun
    try:
        worker.log_event(terms.token, (job.label, str(worker.address)))
        return perform(job, Path(folder), resume, 1)
    except KeyboardInterrupt:  # before or after the work itself
        return not_begun
    finally:
        _end()


def _begin(token: str) -> bool:
    with _lock:
        if token in _stopped:
            return False
        _at_work[threading.get_ident()] = token
        return True


def _end() -> None:
    with _lock:
        _at_work.pop(threading.get_ident(), None)
    # An interrupt that was sent a moment ago must not reach the worker's own code.
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(threading.get_ident()), None)


def stop(token: str) -> None:
    """Interrupt this worker's work for a run, as Ctrl-C would in a process of its own; it begins no more of it."""
    with _lock:
        _stopped.add(token)
        for thread in [thread for thread, run in _at_work.items() if run == token]:
            del _at_work[thread]
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(KeyboardInterrupt))


def same(pickled: bytes) -> bytes:
    """What several items need, kept on the workers once."""
    return pickled


@lru_cache(maxsize=1)
def _unpickled(pickled: bytes) -> Any:
    return pickle.loads(pickled)


def do_item(terms: Terms, pickled: bytes, item: Any) -> Any:
    """One item of a step that runs side by side. Raises ConfigError where this worker cannot do it."""
    from distributed import get_worker

    worker = get_worker()
    reason = objection(terms, worker.state.nthreads)
    if reason is not None:
        raise ConfigError(f"worker {worker.address}", *reason)
    function: Callable[[Any, int], Any] = _unpickled(pickled)
    return function(item, 1)


def dask_setup(worker: Any) -> None:
    """Workers on this machine: Ctrl-C and `kill` go to the whole group, but the program that asks must save first."""
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, signal.SIG_IGN)
