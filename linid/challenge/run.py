"""Running a diagnosis over all campaigns of a challenge. It sees the campaign folders, never the keys."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

from linid.challenge.files import DIAGNOSIS_FILE, RESULTS_FOLDER, campaign_files
from linid.errors import LinidError, UsageError

ERROR_FILE = "error.txt"
Result = TypeVar("Result")


class Diagnose(Protocol):
    """Diagnoses the campaign file `path` with `jobs` threads and writes `out`/diagnosis.json (and what else it has)."""

    def __call__(self, path: Path, out: Path, jobs: int) -> Any: ...


@dataclass(frozen=True)
class Diagnosed:
    """How the diagnosis of one campaign ended. status: done, failed, kept (done by an earlier run)."""

    campaign: str
    status: str
    seconds: float
    error: str = ""


def run_challenge(
    folder: Path,
    diagnose: Diagnose,
    *,
    jobs: int = 1,
    resume: bool = False,
    progress: Callable[[int, int, Diagnosed], None] | None = None,
) -> tuple[Diagnosed, ...]:
    """Diagnose every campaign of a challenge into folder/results/NAME; a failing one does not stop the others.

    jobs: campaigns at a time, each in a process of its own and with one thread (diagnose must then be picklable);
    resume: keep the results that are there. progress: called with (done, total, last).
    Raises DataError without campaigns, UsageError when results exist and resume is False.
    """
    files = campaign_files(folder)
    results = folder / RESULTS_FOLDER
    if results.exists() and any(results.iterdir()) and not resume:
        raise UsageError(str(results), "already holds results", "Go on with --resume, or remove the folder.")
    done: dict[str, Diagnosed] = {}

    def note(one: Diagnosed) -> None:
        done[one.campaign] = one
        if progress is not None:
            progress(len(done), len(files), one)

    waiting = []
    for path in files:
        if (results / path.parent.name / DIAGNOSIS_FILE).exists():
            note(Diagnosed(path.parent.name, "kept", 0.0))
        else:
            waiting.append(path)
    for one in in_processes(diagnose_one, [(diagnose, path, results) for path in waiting], jobs):
        note(one)
    return tuple(done[path.parent.name] for path in files)


def diagnose_one(diagnose: Diagnose, path: Path, results: Path) -> Diagnosed:
    """Diagnose one campaign; what goes wrong is written beside its results."""
    name = path.parent.name
    out = results / name
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    began = time.monotonic()
    error = ""
    try:
        diagnose(path, out, 1)
        if not (out / DIAGNOSIS_FILE).exists():
            error = f"wrote no {DIAGNOSIS_FILE}"
    except LinidError as reason:
        error = str(reason)
    except Exception as reason:
        error = f"{type(reason).__name__}: {reason}"
    if error:
        (out / ERROR_FILE).write_text(error + "\n", encoding="utf-8")
    return Diagnosed(name, "failed" if error else "done", time.monotonic() - began, error)


def _end_with_parent() -> None:
    """Let this worker end when the process that started it does, however that ends."""
    import os
    from multiprocessing import parent_process
    from threading import Thread

    def watch() -> None:
        parent = parent_process()
        if parent is not None:
            parent.join()
            os._exit(1)

    Thread(target=watch, daemon=True).start()


def in_processes(work: Callable[..., Result], tasks: Sequence[tuple[Any, ...]], jobs: int) -> Iterator[Result]:
    """Results of work(*task) as they come, `jobs` at a time, each in a process of its own (one job: in this one)."""
    from multiprocessing import active_children, get_context

    if jobs == 1:
        yield from (work(*task) for task in tasks)
        return
    pool = ProcessPoolExecutor(jobs, mp_context=get_context("spawn"), initializer=_end_with_parent)
    try:
        open_jobs: set[Future[Result]] = {pool.submit(work, *task) for task in tasks}
        while open_jobs:
            finished, open_jobs = wait(open_jobs, return_when=FIRST_COMPLETED)
            for future in finished:
                yield future.result()
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for worker in active_children():  # a stop that reaches this process alone must not wait for their work
            worker.terminate()
        raise
    pool.shutdown()
