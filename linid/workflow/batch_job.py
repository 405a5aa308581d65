"""One job of a batch, in a process of its own; light to import, since every process begins here."""

from __future__ import annotations

import signal
import sys
import time
import traceback
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.errors import LinidError

if TYPE_CHECKING:
    from linid.workflow.batch_file import JobSpec
    from linid.workflow.outcome import Outcome
    from linid.workflow.reporter import Reporter

LOG_FILE = "log.txt"


@dataclass(frozen=True)
class JobReport:
    """How a job ended. status: done, not_converged, failed, interrupted, skipped, not_started; key_figure: its result
    in one line, or what went wrong; folder: whether it has one."""

    label: str
    status: str
    exit_code: int
    seconds: float
    key_figure: str
    folder: bool = False


def run_job(spec: JobSpec, folder: Path, resume: bool, threads: int, answer: Connection) -> None:
    """Run a job and send its JobReport; progress goes to log.txt in its folder."""
    _interrupt_once()
    began = time.monotonic()
    status, code, text = "interrupted", 130, "state saved"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with (folder.parent / f".{folder.name}.log").open("a", encoding="utf-8") as log:
            sys.stderr = log
            outcome = _run(spec, folder, resume, threads, log)
        status, code, text = outcome.status, outcome.exit_code, outcome.key_figure
    except KeyboardInterrupt:
        pass
    except LinidError as error:
        status, code, text = "failed", error.exit_code, str(error)
    except Exception as error:
        status, code, text = "failed", 1, f"{type(error).__name__}: {error}"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "traceback.txt").write_text(traceback.format_exc(), encoding="utf-8")
    finally:
        for each in (signal.SIGINT, signal.SIGTERM):
            signal.signal(each, signal.SIG_IGN)
        sys.stderr = sys.__stderr__
        _keep_log(folder)
    answer.send(JobReport(spec.label, status, code, time.monotonic() - began, text, folder.exists()))
    answer.close()


def _run(spec: JobSpec, folder: Path, resume: bool, threads: int, log: Any) -> Outcome:
    from linid.workflow.reporter import Reporter
    from linid.workflow.request import Request
    from linid.workflow.run_folder import clear_run, read_run

    reporter = Reporter(1, log)
    # A job that never began has no run to resume; one that failed starts anew, perhaps with mended settings.
    before = read_run(folder) if resume else None
    again = before is not None and before.get("status") != "failed"
    if before is not None and not again:
        clear_run(folder)
    files = tuple(Path(text) for text in spec.files)
    request = Request(files, spec.settings, folder, resume=again, jobs=threads, line=f"batch job {spec.label}")
    if spec.command == "generate":
        return _generate(spec, folder, resume, reporter)
    if spec.command == "fit-friction":
        from linid.workflow.fit_friction import fit_friction

        return fit_friction(request, reporter)
    if spec.command == "fit-motor":
        from linid.workflow.fit_motor import fit_motor

        friction = None if spec.friction is None else Path(spec.friction)
        return fit_motor(request, reporter, model=spec.model, friction=friction)  # type: ignore[arg-type]
    from linid.workflow.validate import validate

    return validate(request, reporter, model=Path(spec.model), split=spec.split)  # type: ignore[arg-type]


def _generate(spec: JobSpec, folder: Path, resume: bool, reporter: Reporter) -> Outcome:
    from linid.workflow.generate import generate_campaign
    from linid.workflow.outcome import Outcome

    if resume and (folder / "truth.yaml").exists():  # written last
        return Outcome("generate", folder, key_figure="made before")
    return generate_campaign(Path(spec.files[0]), folder, reporter, overwrite=resume, **spec.generate)


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
        log.replace(folder / LOG_FILE)
