"""What runs on the workers of a cluster: checks, and tasks that they pass on to processes of their own."""

from __future__ import annotations

import hashlib
import os
import pickle
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from linid.entry_points import of_group
from linid.errors import ConfigError
from linid.workflow.cluster.work_process import ProcessDiedError, WorkProcess
from linid.workflow.run.run_folder import RUN_FILE, versions

DECISIVE = ("linid", "numpy", "scipy", "numba", "deap")
_lock = threading.Lock()
_stopped: set[str] = set()
_idle: list[WorkProcess] = []
_busy: list[tuple[str, WorkProcess]] = []  # with the token of the run that each works for


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
    package = Path(__file__).parents[2]
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        digest.update(str(path.relative_to(package)).encode() + path.read_bytes())
    out = {"Python": f"{sys.version_info.major}.{sys.version_info.minor}"}
    out |= {name: versions()[name] for name in DECISIVE}
    added = [f"{one.name} ({one.value})" for one in of_group("linid.effects")]
    return out | {"added effects": ", ".join(sorted(added)) or "none", "linid source": digest.hexdigest()[:12]}


def processor() -> str:
    """The processor for which kernels are compiled here."""
    from llvmlite.binding import get_host_cpu_name

    return str(get_host_cpu_name())


def objection(terms: Terms, inputs: Sequence[str] = ()) -> tuple[str, str] | None:
    """Why this process cannot take part in a run, as fact and remedy; None if it can. inputs: files to be seen."""
    for name, version in terms.versions.items():
        mine = own_versions().get(name, "unknown")
        if mine != version:
            return f"has {name} {mine}, this program {version}", "Install the same there as here and start it again."
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
    return objection(terms, inputs), host, processor()


def look_at_scheduler(dask_scheduler: Any = None) -> dict[str, str]:
    """Versions in the scheduler's process, which unpacks what is sent to workers."""
    return own_versions()


def do_item(terms: Terms, pickled: bytes, item: Any) -> Any:
    """One item of a step that runs side by side; pickled: the function.

    Raises ConfigError where this worker cannot do it, ProcessDiedError, and what the function raises.
    """
    with process_for(terms) as process:
        return process.call(_apply, pickled, item)


def same(pickled: bytes) -> bytes:
    """What several items need, kept on the workers once."""
    return pickled


def _apply(pickled: bytes, item: Any) -> Any:
    function: Callable[[Any, int], Any] = _unpickled(pickled)
    return function(item, 1)


@lru_cache(maxsize=1)
def _unpickled(pickled: bytes) -> Any:
    return pickle.loads(pickled)


class StoppedError(Exception):
    """The run was interrupted before this task began."""


@contextmanager
def process_for(terms: Terms, inputs: Sequence[str] = (), label: str = "") -> Iterator[WorkProcess]:
    """A process for one task of a run; label: told to the program that asks.

    Raises ConfigError where this worker cannot take part, StoppedError where the run was interrupted before.
    """
    from distributed import get_worker

    worker = get_worker()
    reason = objection(terms, inputs)
    if reason is not None:
        raise ConfigError(f"worker {worker.address}", *reason)
    with _lock:
        if terms.token in _stopped:
            raise StoppedError
        process = _idle.pop() if _idle else WorkProcess()
        mine = (terms.token, process)
        _busy.append(mine)
    if label:
        worker.log_event(terms.token, (label, str(worker.address)))
    died = False
    try:
        yield process
    except ProcessDiedError:
        died = True
        raise
    finally:
        with _lock:
            _busy.remove(mine)
            if not died:
                _idle.append(process)


def stop(token: str) -> None:
    """Interrupt this worker's work for a run, as Ctrl-C would here, and begin no more of it."""
    with _lock:
        _stopped.add(token)
        for run, process in _busy:
            if run == token:
                process.interrupt()


def dask_setup(worker: Any) -> None:
    """Workers on this machine: Ctrl-C and `kill` go to the whole group, but the program that asks must save first."""
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, signal.SIG_IGN)
