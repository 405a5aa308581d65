"""The jobs of a batch as tasks on the workers of a cluster, which share the batch's folder and its input files."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from linid.errors import LinidError
from linid.workflow.batch.file import JobSpec
from linid.workflow.batch.job import JobReport, run_interruptibly
from linid.workflow.cluster.connection import RETRIES, Cluster, failure, is_killed_worker
from linid.workflow.cluster.worker import StoppedError, Terms, process_for, stop
from linid.workflow.run.reporter import Reporter

_SAVED_WITHIN = 60.0  # s, for running jobs after Ctrl-C: a kernel that is compiled notices it only when it is ready


def run_job(terms: Terms, job: JobSpec, folder: str, resume: bool) -> JobReport:
    """A job of a batch as a task of a worker; its folder is on the shared file system.

    resume: take over what is in the folder already. Raises ProcessDiedError, ConfigError where this worker is unfit.
    """
    try:
        with process_for(terms, job.inputs, job.label) as process:
            report: JobReport = process.call(run_interruptibly, job, Path(folder), resume, 1)
            return report
    except StoppedError:
        return JobReport(job.label, "not_started", 130, 0.0, "interrupted before it began")


class ClusterPlaces:
    """Hands jobs to the cluster's workers as soon as their predecessors are done; resume: of the batch."""

    def __init__(
        self, cluster: Cluster, folder: Path, specs: Sequence[JobSpec], resume: bool, reporter: Reporter
    ) -> None:
        inputs = dict.fromkeys(str(Path(text).absolute()) for spec in specs for text in spec.inputs)
        self.cluster = cluster.sharing(folder, list(inputs))
        self.folder = folder.absolute()
        self.resume = resume
        self.reporter = reporter
        self.jobs: dict[str, JobSpec] = {}
        self.submitted = 0
        self.futures: dict[str, Any] = {}
        self.begun: dict[str, float] = {}
        # What is told by dask's own threads: a future that is done, or (label, worker) of a job that begins.
        self.told: SimpleQueue[Any] = SimpleQueue()
        self.token = self.cluster.terms.token
        self.client = self.cluster.client
        self.client.subscribe_topic(self.token, lambda event: self.told.put(event[1]))

    def free(self) -> bool:
        """The cluster holds any number of jobs."""
        return True

    def start(self, job: JobSpec) -> None:
        """Submit a job."""
        folder = self.folder / job.label
        # In a folder that holds nothing now, all that is found later comes from a worker that died over this job.
        resume = self.resume or not folder.exists() or not any(folder.iterdir())
        self.submitted += 1
        future = self.client.submit(
            run_job,
            self.cluster.terms,
            job,
            str(folder),
            resume,
            key=(f"job-{self.token}", self.submitted),
            retries=RETRIES,
        )
        self.jobs[job.label] = job
        self.futures[job.label] = future
        future.add_done_callback(lambda done: self.told.put((job.label, None)))

    def ended(self) -> list[JobReport]:
        """Reports of jobs that have ended since; waits for the first."""
        while True:
            label, worker = self.told.get()
            if label not in self.futures:
                continue
            if worker is not None:
                again = " again, its worker was lost" if label in self.begun else ""
                self.begun[label] = time.monotonic()
                self.reporter.say(f"{label}: started{again} (worker {worker})")
            elif label not in self.begun and is_killed_worker(self.futures[label]):
                # It only stood in line behind the work that killed its workers.
                self.start(self.jobs[label])
            else:
                return [self._report(label)]

    def interrupt(self) -> list[JobReport]:
        """Drop the jobs that have not begun, and let those that have save their state."""
        waiting = [label for label in self.futures if label not in self.begun]
        with suppress(Exception):  # the scheduler may be gone: the workers then end what they have begun
            self.client.cancel([self.futures.pop(label) for label in waiting])
        reports = []
        deadline = time.monotonic() + _SAVED_WITHIN
        while self.futures and time.monotonic() < deadline:
            with suppress(Exception):
                self.client.run(stop, self.token)  # again and again: a process that just begins does not listen yet
            with suppress(Empty):
                label, worker = self.told.get(timeout=2.0)
                if label in self.futures and worker is None:
                    reports.append(self._report(label))
        with suppress(Exception):
            self.client.cancel(list(self.futures.values()))
        words = "its worker did not answer; the last state that it wrote counts"
        return reports + [JobReport(label, "interrupted", 130, 0.0, words, True) for label in self.futures]

    def _report(self, label: str) -> JobReport:
        """How a job ended, also where its worker could not do it; the scheduler then forgets it."""
        future = self.futures.pop(label)
        self.jobs.pop(label)
        try:
            report: JobReport = future.result()
            return report
        except Exception as error:
            reason = failure(self.cluster.address, error)
            seconds = time.monotonic() - self.begun.get(label, time.monotonic())
            code, text = (
                (reason.exit_code, str(reason))
                if isinstance(reason, LinidError)
                else (1, f"{type(reason).__name__}: {reason}")
            )
            return JobReport(label, "failed", code, seconds, text, (self.folder / label).exists())
