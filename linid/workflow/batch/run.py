"""batch: jobs in processes here or on a cluster; a failing one stops only those that need its result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from heapq import heappop, heappush
from pathlib import Path
from typing import Any, Protocol

from linid.interface.reading import file_record
from linid.report.files import csv_text
from linid.report.result_files import MODEL_AFTER, MODEL_FILE
from linid.report.tables import BatchRow, batch_table_console
from linid.stop_signals import exit_code_of
from linid.workflow.batch.file import JobSpec, read_batch
from linid.workflow.batch.job import JobReport
from linid.workflow.batch.on_cluster import ClusterPlaces
from linid.workflow.batch.processes import Processes
from linid.workflow.cluster.connection import Cluster, connected
from linid.workflow.run.outcome import Outcome
from linid.workflow.run.reporter import Reporter
from linid.workflow.run.request import Request
from linid.workflow.run.run_folder import Interrupted, identity_of, open_run_folder, recorded, write_text

COMMAND = "batch"
# Of several failures, the one to report: the earlier in this list.
_PRIORITY = (130, 1, 3, 4, 2, 5)
_USABLE = ("done", "not_converged")


def run_batch(request: Request, reporter: Reporter, *, overrides: dict[str, Any]) -> Outcome:
    """Run all jobs of the batch files, `request.jobs` at a time; the results do not depend on that number.

    overrides: raw settings above those of the files. With resume, finished jobs are skipped and interrupted ones
    go on. Raises ConfigError for the files, Interrupted after Ctrl-C or SIGTERM (the state is saved); failures of jobs
    stand in the outcome's table and exit code.
    """
    specs = read_specs(request.files, overrides)
    if request.dry_run:
        jobs = [
            {
                "job": s.label,
                "command": s.command,
                "files": list(s.files),
                "model": s.options.get("model") or s.models.get("model", ""),
                "after": list(s.after),
            }
            for s in specs
        ]
        return Outcome(COMMAND, None, summary={"command": COMMAND, "dry_run": True, "jobs": jobs})
    with connected(request, reporter) as cluster:
        return run_jobs(specs, request, reporter, overrides, cluster)


def run_jobs(
    specs: Sequence[JobSpec], request: Request, reporter: Reporter, overrides: dict[str, Any], cluster: Cluster | None
) -> Outcome:
    """Run jobs in a run folder of their own, here or on a cluster; raises Interrupted, with the state saved."""
    folder = open_run_folder(COMMAND, request.out, overwrite=request.overwrite, resume=request.resume)
    folder.previous = None if folder.previous is None else {**folder.previous, "status": "resumed", "identity": None}
    config = "".join(f"# {path}\n{path.read_text(encoding='utf-8')}\n" for path in request.files)
    folder.begin(
        identity=identity_of(COMMAND, config, overrides),
        config=config,
        inputs=[file_record(p) for p in request.files],
        seed=None,
        jobs=request.jobs,
    )
    with recorded(folder), reporter:
        places: Places
        if cluster is None:
            # A lone job may use all threads; that does not change its result.
            threads = request.jobs if len(specs) == 1 else 1
            places = Processes(folder.path, request.jobs, threads, request.resume, reporter)
        else:
            places = ClusterPlaces(cluster, folder.path, specs, request.resume, reporter)
        queue = JobQueue(specs, folder.path, places, reporter)
        reports = queue.run()
        outcome = _outcome(folder.path, reports)
        _write_summary(folder.path, reports)
        if queue.interrupted:
            folder.end("interrupted", queue.interrupted)
            raise Interrupted(folder.path, queue.interrupted)
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


class Places(Protocol):
    """Where the jobs of a batch run: processes here, or workers of a cluster."""

    def free(self) -> bool:
        """Whether one more job may be started now."""
        ...

    def start(self, job: JobSpec) -> None:
        """Begin a job whose predecessors are done."""
        ...

    def ended(self) -> list[JobReport]:
        """Reports of jobs that have ended, or have only figures left to draw, since; waits for the first."""
        ...

    def interrupt(self) -> list[JobReport]:
        """Let what runs save its state; reports of all jobs that were started."""
        ...


class JobQueue:
    """Starts the jobs of a batch in the order of the file as their predecessors end."""

    def __init__(self, specs: Sequence[JobSpec], folder: Path, places: Places, reporter: Reporter) -> None:
        self.specs = {spec.label: spec for spec in specs}
        self.folder = folder
        self.places = places
        self.reporter = reporter
        self.reports: dict[str, JobReport] = {}
        self.interrupted = 0  # the exit code that the signal asks for
        self.order = {label: number for number, label in enumerate(self.specs)}
        self.missing = {spec.label: len(spec.after) for spec in specs}
        self.followers: dict[str, list[str]] = {label: [] for label in self.specs}
        for spec in specs:
            for before in spec.after:
                self.followers[before].append(spec.label)
        self.released: set[str] = set()  # their followers need not wait for them any more
        self.ready = [self.order[label] for label, count in self.missing.items() if not count]
        self.labels = list(self.specs)

    def run(self) -> list[JobReport]:
        """All reports, in the order of the file."""
        running = 0
        try:
            while self.ready or running:
                while self.ready and self.places.free():
                    self.places.start(self._with_paths(self.specs[self.labels[heappop(self.ready)]]))
                    running += 1
                for report in self.places.ended():
                    if report.drawing:
                        self._release(report.label)
                    else:
                        running -= 1
                        self._note(report)
        except KeyboardInterrupt as stop:
            self.interrupted = exit_code_of(stop)
            for report in self.places.interrupt():
                self._say(report)
        for label in self.specs:
            self.reports.setdefault(label, JobReport(label, "not_started", 130, 0.0, "interrupted before it began"))
        return [self.reports[label] for label in self.specs]

    def _note(self, report: JobReport) -> None:
        """Keep a report; jobs that waited for it become ready, or are skipped with all that need them."""
        open_reports = [report]
        while open_reports:
            report = open_reports.pop()
            self._say(report)
            if report.status in _USABLE:
                self._release(report.label)
            elif report.label not in self.released:
                reason = f"needs {report.label}: {report.label} {report.status}"
                open_reports += [
                    JobReport(label, "skipped", 0, 0.0, reason)
                    for label in self.followers[report.label]
                    if label not in self.reports
                ]

    def _release(self, label: str) -> None:
        """What a job makes is there: its followers wait for one job less, once."""
        if label in self.released:
            return
        self.released.add(label)
        for follower in self.followers[label]:
            self.missing[follower] -= 1
            if not self.missing[follower] and follower not in self.reports:
                heappush(self.ready, self.order[follower])

    def _say(self, report: JobReport) -> None:
        self.reports[report.label] = report
        what = report.key_figure or ""
        seconds = f" in {report.seconds:.1f} s" if report.seconds else ""
        self.reporter.say(f"{report.label}: {report.status.replace('_', ' ')}{seconds}{'; ' if what else ''}{what}")

    def _with_paths(self, spec: JobSpec) -> JobSpec:
        """The job with absolute paths, also behind `job:LABEL`."""
        campaigns = {
            key: tuple(self._path(text, "campaign.yaml") for text in texts) for key, texts in spec.campaigns.items()
        }
        models = {key: self._path(text, self._model_of(text)) for key, text in spec.models.items()}
        others = {key: str(Path(spec.options[key]).absolute()) for key in spec.paths}
        return replace(spec, campaigns=campaigns, models=models, options={**spec.options, **others})

    def _model_of(self, text: str) -> str:
        """The name of the MODEL file that the job of a `job:LABEL` leaves behind."""
        made = self.specs.get(text.removeprefix("job:"))
        return MODEL_AFTER if made is not None and made.command == "diagnose" else MODEL_FILE

    def _path(self, text: str, name: str) -> str:
        made = self.folder / text[4:] / name
        return str((made if text.startswith("job:") else Path(text)).absolute())


def _outcome(folder: Path, reports: Sequence[JobReport]) -> Outcome:
    codes = {report.exit_code for report in reports} - {0}
    code = next((c for c in _PRIORITY if c in codes), 1 if codes else 0)
    rows = [
        BatchRow(r.label, r.status.replace("_", " "), r.seconds, r.key_figure, r.label if r.folder else "-")
        for r in reports
    ]
    summary = {
        "command": COMMAND,
        "folder": str(folder),
        "exit_code": code,
        "jobs": [{**vars(r), "folder": str(folder / r.label) if r.folder else None} for r in reports],
    }
    key = f"{sum(r.status in _USABLE for r in reports)} of {len(reports)} jobs done"
    return Outcome(COMMAND, folder, code, key, (batch_table_console(rows),), summary)


def _write_summary(folder: Path, reports: Sequence[JobReport]) -> None:
    rows = ([r.label, r.status, r.exit_code, f"{r.seconds:.2f}", r.key_figure] for r in reports)
    header = ("job", "status", "exit_code", "seconds", "key_figure")
    write_text(folder / "summary.csv", csv_text(header, rows))
