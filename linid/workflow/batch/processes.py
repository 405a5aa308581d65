"""The jobs of a batch in processes of their own on this machine."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path

from linid.workflow.batch.file import JobSpec
from linid.workflow.batch.job import JobReport, run_job
from linid.workflow.run.reporter import Reporter


@dataclass
class _Running:
    label: str
    process: BaseProcess
    answer: Connection
    started: float


class Processes:
    """At most `jobs` jobs at a time, each in a process with `threads` threads; resume: of the batch."""

    def __init__(self, folder: Path, jobs: int, threads: int, resume: bool, reporter: Reporter) -> None:
        self.folder = folder
        self.jobs = jobs
        self.threads = threads
        self.resume = resume
        self.reporter = reporter
        self.running: list[_Running] = []

    def free(self) -> bool:
        """Whether one more job may be started now."""
        return len(self.running) < self.jobs

    def start(self, job: JobSpec) -> None:
        """Begin a job in a process of its own."""
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe(duplex=False)
        arguments = (job, self.folder / job.label, self.resume, self.threads, there)
        process = context.Process(target=run_job, args=arguments)
        process.start()
        there.close()
        self.running.append(_Running(job.label, process, here, time.monotonic()))
        self.reporter.say(f"{job.label}: started ({job.command})")

    def ended(self) -> list[JobReport]:
        """Reports of jobs that have ended or begun to draw since; waits for the first."""
        wait([item.answer for item in self.running])
        reports = []
        for item in [item for item in self.running if item.answer.poll()]:
            reports.append(_answer(item))
            if not reports[-1].drawing:
                item.process.join()
                self.running.remove(item)
        return reports

    def interrupt(self) -> list[JobReport]:
        """Let the running jobs save their state."""
        for item in self.running:
            if item.process.pid is not None and item.process.is_alive():
                os.kill(item.process.pid, signal.SIGINT)
        reports = []
        for item in self.running:
            reports.append(_answer(item, interrupted=True))
            item.process.join()
        self.running.clear()
        return reports


def _answer(item: _Running, interrupted: bool = False) -> JobReport:
    """What the job's process said; if it died without a word, that."""
    try:
        report: JobReport = item.answer.recv()
        while interrupted and report.drawing:
            report = item.answer.recv()
        return report
    except (EOFError, OSError):
        item.process.join()
        code = item.process.exitcode
        if interrupted:
            return JobReport(item.label, "interrupted", 130, 0.0, "before it began")
        seconds = time.monotonic() - item.started
        return JobReport(item.label, "failed", 1, seconds, f"its process ended without an answer (exit code {code})")
