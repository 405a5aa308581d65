"""One job of a batch, in a process of its own or on a worker; light to import, since every process begins here."""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import redirect_stderr, suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.errors import LinidError
from linid.report.files import ANY, FileList

if TYPE_CHECKING:
    from linid.interface.settings import Settings
    from linid.workflow.batch.file import JobSpec
    from linid.workflow.run.outcome import Outcome
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request

LOG_FILE = "log.txt"


@dataclass(frozen=True)
class JobReport:
    """How a job ended. status: done, not_converged, failed, interrupted, skipped, not_started; key_figure: its result
    in one line, or what went wrong; folder: whether it has one; drawing: what others need is there, the job goes on."""

    label: str
    status: str
    exit_code: int
    seconds: float
    key_figure: str
    folder: bool = False
    drawing: bool = False


def run_job(spec: JobSpec, folder: Path, resume: bool, threads: int, answer: Connection) -> None:
    """Run a job in a process of its own and send its JobReport, one before it draws figures and one at its end."""
    _end_with_parent()
    answer.send(run_interruptibly(spec, folder, resume, threads, answer.send))
    answer.close()


def run_interruptibly(
    spec: JobSpec, folder: Path, resume: bool, threads: int, tell: Callable[[JobReport], None] | None = None
) -> JobReport:
    """Run a job in the main thread of a process that does nothing else meanwhile.

    Progress goes to log.txt in its folder; Ctrl-C and SIGTERM save the state, and are ignored afterwards.
    resume: what an earlier run or worker left in the folder is taken over; a failed job starts anew; tell: hears that
    only figures are left to be drawn.
    """
    _interrupt_once()
    began = time.monotonic()
    status, code, text = "interrupted", 130, "state saved"

    def show(outcome: Outcome) -> Outcome:
        if tell is not None:
            seconds = time.monotonic() - began
            report = JobReport(spec.label, outcome.status, outcome.exit_code, seconds, outcome.key_figure, True, True)
            tell(report)
        return outcome

    try:
        folder.mkdir(parents=True, exist_ok=True)
        with (folder.parent / f".{folder.name}.log").open("a", encoding="utf-8") as log, redirect_stderr(log):
            outcome = _run(spec, folder, resume, threads, log, show)
        status, code, text = outcome.status, outcome.exit_code, outcome.key_figure
    except KeyboardInterrupt:
        pass
    except LinidError as error:
        status, code, text = "failed", error.exit_code, str(error)
    except Exception as error:
        status, code, text = "failed", 1, f"{type(error).__name__}: {error}"
        folder.mkdir(parents=True, exist_ok=True)
        with suppress(LinidError):
            FileList(folder).note(folder / "traceback.txt", ANY)
        (folder / "traceback.txt").write_text(traceback.format_exc(), encoding="utf-8")
    finally:
        for each in (signal.SIGINT, signal.SIGTERM):
            signal.signal(each, signal.SIG_IGN)
        _keep_log(folder)
    return JobReport(spec.label, status, code, time.monotonic() - began, text, folder.exists())


def _run(
    spec: JobSpec, folder: Path, resume: bool, threads: int, log: Any, show: Callable[[Outcome], Outcome]
) -> Outcome:
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request
    from linid.workflow.run.run_folder import clear_run, read_run

    reporter = Reporter(1, log, show)
    # A job that never began, or was killed before it could say so, has no run to resume; one that failed starts anew,
    # perhaps with mended settings.
    before = read_run(folder) if resume else None
    again = before is not None and before.get("status") != "failed"
    if resume and not again:
        clear_run(folder)
    files = tuple(Path(text) for text in spec.files)
    request = Request(
        files, verified_settings(spec), folder, resume=again, jobs=threads, line=f"batch job {spec.label}"
    )
    models = {key: Path(text) for key, text in spec.models.items()}
    return _COMMANDS[spec.command](_Call(spec, request, models, reporter, resume))


@dataclass(frozen=True)
class _Call:
    """What a command of a batch gets. resume: whether the batch is resumed, even if this job starts anew."""

    spec: JobSpec
    request: Request
    models: dict[str, Path]
    reporter: Reporter
    resume: bool

    @property
    def options(self) -> dict[str, Any]:
        return self.spec.options


def _fit_friction(call: _Call) -> Outcome:
    from linid.workflow.commands.fit_friction import fit_friction

    return fit_friction(call.request, call.reporter, friction=call.models.get("friction"))


def verified_settings(spec: JobSpec) -> Settings:
    """The settings of a job; fits are verified by a search from scratch unless told otherwise, where that is quick.

    Not where the shape of a field is searched too, which takes as long as the fit, nor with effects or other laws.
    """
    from linid.physics.motors.registry import MOTORS

    settings = spec.settings
    kinds = {"fit-friction": "friction", "fit-motor": spec.options.get("model", "")}
    if "verify_search" in settings.model_fields_set or spec.command not in kinds or settings.effects or settings.law:
        return settings
    if MOTORS[kinds[spec.command]].shape:
        return settings
    return settings.model_copy(update={"verify_search": True})


def _fit_motor(call: _Call) -> Outcome:
    from linid.workflow.commands.fit_motor import fit_motor

    options = call.options
    winding = options["connection"] if options["input"] == "voltage" else ""
    friction = call.models.get("friction")
    return fit_motor(call.request, call.reporter, model=options["model"], friction=friction, winding=winding)


def _validate(call: _Call) -> Outcome:
    from linid.workflow.commands.validate import validate

    return validate(call.request, call.reporter, model=call.models["model"], split=call.options["split"])


def _diagnose(call: _Call) -> Outcome:
    from linid.workflow.commands.diagnose import diagnose

    since = call.models.get("since")
    simulator = None if since is None else str(since)
    return diagnose(call.request, call.reporter, model=call.options["model"], simulator=simulator)


def _generate(call: _Call) -> Outcome:
    from linid.workflow.commands.generate import generate_campaign
    from linid.workflow.run.outcome import Outcome

    folder = call.request.out
    assert folder is not None
    if call.resume and (folder / "truth.yaml").exists():  # written last
        return Outcome("generate", folder, key_figure="made before")
    options = {**call.options, "axis": Path(call.options["axis"])}
    return generate_campaign(out=folder, reporter=call.reporter, overwrite=call.resume, **options)


def _field(call: _Call) -> Outcome:
    from linid.workflow.commands.field import field
    from linid.workflow.commands.geometry_file import read_geometry

    path = call.options["geometry"]
    geometry = None if path is None else read_geometry(Path(path), {})
    request = replace(call.request, files=() if path is None else (Path(path),), resume=False, overwrite=True)
    return field(request, call.reporter, geometry=geometry, k=call.options["k"], **call.models)


def _reproduce(call: _Call) -> Outcome:
    from linid.workflow.commands.reproduce import reproduce

    others = {key: tuple(map(Path, call.spec.campaigns[f"{key}_files"])) for key in ("narrow", "voltage")}
    geometry = Path(call.options["geometry"])
    return reproduce(call.request, call.reporter, models=call.models, geometry=geometry, **others)


_COMMANDS: dict[str, Callable[[_Call], Outcome]] = {
    "fit-friction": _fit_friction,
    "fit-motor": _fit_motor,
    "validate": _validate,
    "diagnose": _diagnose,
    "generate": _generate,
    "field": _field,
    "reproduce": _reproduce,
}


def _end_with_parent() -> None:
    """End at once when the batch is killed: --resume must find the folder free, and every file is written whole."""
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            multiprocessing.connection.wait([parent.sentinel])
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _interrupt_once() -> None:
    """The first Ctrl-C or SIGTERM interrupts; group and parent may both send one, the second must not disturb."""

    def stop(number: int, frame: Any) -> None:
        for each in (signal.SIGINT, signal.SIGTERM):
            signal.signal(each, signal.SIG_IGN)
        raise KeyboardInterrupt

    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, stop)


def _keep_log(folder: Path) -> None:
    """Move the log into the job's folder (it must be empty when the job begins)."""
    log = folder.parent / f".{folder.name}.log"
    if log.exists():
        folder.mkdir(parents=True, exist_ok=True)
        with suppress(LinidError):
            FileList(folder).note(folder / LOG_FILE, ANY)
        log.replace(folder / LOG_FILE)
