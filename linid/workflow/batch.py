"""batch: jobs in processes of their own; a failing one stops only those that need its result."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from linid.report.tables import BatchRow, batch_table_console
from linid.stop_signals import exit_code_of
from linid.workflow.batch_file import JobSpec, read_batch
from linid.workflow.batch_job import JobReport, run_job
from linid.workflow.outcome import Outcome
from linid.workflow.reporter import Reporter
from linid.workflow.request import Request
from linid.workflow.run_folder import Interrupted, file_record, identity_of, open_run_folder, recorded, write_text

COMMAND = "batch"
# Of several failures, the one to report: the earlier in this list.
_PRIORITY = (130, 1, 3, 4, 2, 5)
_USABLE = ("done", "not_converged")


def run_batch(request: Request, reporter: Reporter, *, overrides: dict[str, Any]) -> Outcome:
    """Run all jobs of the batch files, `request.jobs` at a time; the results do not depend on that number.

    overrides: raw settings above those of the files. With resume, finished jobs are skipped and interrupted ones
    go on. Raises ConfigError for the files; failures of jobs stand in the outcome's table and exit code.
    """
    specs = read_specs(request.files, overrides)
    if request.dry_run:
        jobs = [
            {
                "job": s.label, "command": s.command, "files": list(s.files),
                "model": s.options.get("model") or s.models.get("model", ""), "after": list(s.after),
            }
            for s in specs
        ]  # fmt: skip
        return Outcome(COMMAND, None, summary={"command": COMMAND, "dry_run": True, "jobs": jobs})
    folder = open_run_folder(COMMAND, request.out, overwrite=request.overwrite, resume=request.resume)
    folder.previous = None if folder.previous is None else {**folder.previous, "status": "resumed", "identity": None}
    config = "".join(f"# {path}\n{path.read_text(encoding='utf-8')}\n" for path in request.files)
    folder.begin(
        identity=identity_of(COMMAND, config, overrides), config=config, inputs=[file_record(p) for p in request.files],
        seed=None, jobs=request.jobs,
    )  # fmt: skip
    with recorded(folder), reporter:
        scheduler = Scheduler(specs, folder.path, request.jobs, request.resume, reporter)
        reports = scheduler.run()
        outcome = _outcome(folder.path, reports)
        _write_summary(folder.path, reports)
        if scheduler.interrupted:
            folder.end("interrupted", scheduler.interrupted)
            raise Interrupted(folder.path, scheduler.interrupted)
        folder.end("done" if outcome.exit_code == 0 else "failed", outcome.exit_code)
    return outcome


def read_specs(paths: Sequence[Path], overrides: dict[str, Any]) -> tuple[JobSpec, ...]:
    """The jobs of all batch files; with several files each job's label begins with its file's name."""
    if len(paths) == 1:
        return read_batch(paths[0], overrides)
    stems: list[str] = []
    for path in paths:
        stem, number = path.stem, 1
        while stem in stems:
            number += 1
            stem = f"{path.stem}_{number}"
        stems.append(stem)
    return tuple(
        spec for path, stem in zip(paths, stems, strict=True) for spec in read_batch(path, overrides, prefix=f"{stem}.")
    )


@dataclass
class _Running:
    spec: JobSpec
    process: BaseProcess
    answer: Connection
    started: float


class Scheduler:
    """Starts jobs as their predecessors finish, at most `jobs` at a time, each in a process of its own."""

    def __init__(self, specs: Sequence[JobSpec], folder: Path, jobs: int, resume: bool, reporter: Reporter) -> None:
        self.waiting = list(specs)
        self.order = [spec.label for spec in specs]
        self.folder = folder
        self.jobs = jobs
        # A lone job may use all threads; that does not change its result.
        self.threads = jobs if len(specs) == 1 else 1
        self.resume = resume
        self.reporter = reporter
        self.reports: dict[str, JobReport] = {}
        self.running: list[_Running] = []
        self.interrupted = 0  # the exit code that the signal asks for

    def run(self) -> list[JobReport]:
        """All reports, in the order of the file."""
        try:
            while self.waiting or self.running:
                self._skip()
                self._start()
                self._collect()
        except KeyboardInterrupt as stop:
            self.interrupted = exit_code_of(stop)
            self._interrupt()
        for spec in self.waiting:
            self.reports[spec.label] = JobReport(spec.label, "not_started", 130, 0.0, "interrupted before it began")
        return [self.reports[label] for label in self.order]

    def _skip(self) -> None:
        """Jobs whose predecessor failed cannot run."""
        changed = True
        while changed:
            changed = False
            for spec in list(self.waiting):
                lost = [a for a in spec.after if a in self.reports and self.reports[a].status not in _USABLE]
                if lost:
                    reason = f"{lost[0]} {self.reports[lost[0]].status}"
                    self._note(JobReport(spec.label, "skipped", 0, 0.0, f"needs {lost[0]}: {reason}"))
                    self.waiting.remove(spec)
                    changed = True

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        for spec in list(self.waiting):
            if len(self.running) >= self.jobs:
                return
            if not all(a in self.reports for a in spec.after):
                continue
            here, there = context.Pipe(duplex=False)
            campaigns = {
                key: tuple(self._real(text, "campaign.yaml") for text in texts) for key, texts in spec.campaigns.items()
            }
            models = {key: self._real(text, "parameters.json") for key, text in spec.models.items()}
            job = replace(spec, campaigns=campaigns, models=models)
            target = self.folder / spec.label
            process = context.Process(target=run_job, args=(job, target, self.resume, self.threads, there))
            process.start()
            there.close()
            self.running.append(_Running(spec, process, here, time.monotonic()))
            self.waiting.remove(spec)
            self.reporter.say(f"{spec.label}: started ({spec.command})")

    def _real(self, text: str, name: str) -> str:
        """The path behind `job:LABEL`."""
        return str(self.folder / text[4:] / name) if text.startswith("job:") else text

    def _collect(self) -> None:
        if not self.running:
            return
        wait([item.answer for item in self.running])
        for item in [item for item in self.running if item.answer.poll()]:
            self._note(_answer(item))
            item.process.join()
            self.running.remove(item)

    def _note(self, report: JobReport) -> None:
        self.reports[report.label] = report
        what = report.key_figure or ""
        seconds = f" in {report.seconds:.1f} s" if report.seconds else ""
        self.reporter.say(f"{report.label}: {report.status.replace('_', ' ')}{seconds}{'; ' if what else ''}{what}")

    def _interrupt(self) -> None:
        """Let the running jobs save their state."""
        for item in self.running:
            if item.process.pid is not None and item.process.is_alive():
                os.kill(item.process.pid, signal.SIGINT)
        for item in self.running:
            self._note(_answer(item, interrupted=True))
            item.process.join()
        self.running.clear()


def _answer(item: _Running, interrupted: bool = False) -> JobReport:
    """What the job's process said; if it died without a word, that."""
    try:
        report: JobReport = item.answer.recv()
        return report
    except (EOFError, OSError):
        item.process.join()
        code = item.process.exitcode
        if interrupted:
            return JobReport(item.spec.label, "interrupted", 130, 0.0, "before it began")
        seconds = time.monotonic() - item.started
        return JobReport(
            item.spec.label, "failed", 1, seconds, f"its process ended without an answer (exit code {code})"
        )


def _outcome(folder: Path, reports: Sequence[JobReport]) -> Outcome:
    codes = {report.exit_code for report in reports} - {0}
    code = next((c for c in _PRIORITY if c in codes), 1 if codes else 0)
    rows = [
        BatchRow(r.label, r.status.replace("_", " "), r.seconds, r.key_figure, r.label if r.folder else "-")
        for r in reports
    ]
    summary = {
        "command": COMMAND, "folder": str(folder), "exit_code": code,
        "jobs": [{**vars(r), "folder": str(folder / r.label) if r.folder else None} for r in reports],
    }  # fmt: skip
    key = f"{sum(r.status in _USABLE for r in reports)} of {len(reports)} jobs done"
    return Outcome(COMMAND, folder, code, key, (batch_table_console(rows),), summary)


def _write_summary(folder: Path, reports: Sequence[JobReport]) -> None:
    import csv
    import io

    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["job", "status", "exit_code", "seconds", "key_figure"])
    writer.writerows([r.label, r.status, r.exit_code, f"{r.seconds:.2f}", r.key_figure] for r in reports)
    write_text(folder / "summary.csv", stream.getvalue())
