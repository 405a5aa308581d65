"""What fit-friction and fit-motor share: gaps of all recordings, files, figures, and the outcome."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from linid.errors import LinidError
from linid.report.result_files import MODEL_FILE
from linid.workflow.run import results
from linid.workflow.run.outcome import DONE, NOT_CONVERGED, Outcome, gap_figure_text
from linid.workflow.run.run_folder import RunFolder, open_run_folder
from linid.workflow.run.settings import settings_yaml
from linid.workflow.run.stage import describe_task

if TYPE_CHECKING:
    from linid.diagnosis.gap import RecordingGap, Trace
    from linid.identification.result import FitResult
    from linid.recording import Recording
    from linid.workflow.run.inputs import Inputs
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request
    from linid.workflow.run.stage import FitTask


def announce(inputs: Inputs, reporter: Reporter) -> None:
    """Say what the reader understood."""
    count, held_out = len(inputs.recordings), len(inputs.of(split="held_out"))
    reporter.say(f"read {count} recording{'s' if count > 1 else ''}, {held_out} of them held out")
    for note in inputs.notes():
        reporter.detail(note)
    for warning in inputs.warnings():
        reporter.warn(warning)
    for found in inputs.coast_downs:
        reporter.say(f"{found.recording.name}: {found.coast_down.evidence}")


def begin(request: Request, command: str, inputs: Inputs, identity: str, more: Sequence[Any] = ()) -> RunFolder:
    """Open the run folder and write what is known before the work starts."""
    folder = open_run_folder(command, request.out, overwrite=request.overwrite, resume=request.resume)
    config = settings_yaml(request.settings, f"Settings of this run, as `--config` reads them.\n{request.line}")
    folder.begin(
        identity=identity, config=config, inputs=[*inputs.files, *more], seed=request.settings.seed, jobs=request.jobs
    )
    return folder


def measure(
    result: FitResult,
    recordings: Sequence[Recording],
    reporter: Reporter,
    *,
    jobs: int,
    seed: int,
    strict: bool = False,
    among: Sequence[Recording] = (),
) -> tuple[tuple[RecordingGap, ...], tuple[Trace, ...]]:
    """Gaps and traces; a recording that cannot be measured is warned about and left out (strict: raised).

    among: where repeats of a recording are looked for (default: recordings).
    """
    from linid.diagnosis.measures import measure_gaps
    from linid.diagnosis.parallel_tasks import in_parallel

    def measured(recording: Recording, jobs: int) -> tuple[tuple[RecordingGap, ...], tuple[Trace, ...]] | LinidError:
        try:
            return measure_gaps(result, [recording], jobs=jobs, seed=seed, among=among or recordings)
        except LinidError as error:
            return error

    gaps: list[RecordingGap] = []
    traces: list[Trace] = []
    for done, (_, found) in enumerate(in_parallel(measured, recordings, jobs), 1):
        if isinstance(found, LinidError):
            if strict:
                raise found
            reporter.warn(str(found))
            continue
        gap, trace = found
        gaps += gap
        traces += trace
        reporter.step("gaps", done, len(recordings))
    return tuple(gaps), tuple(traces)


def complete(folder: RunFolder, result: FitResult, inputs: Inputs, request: Request, reporter: Reporter) -> Outcome:
    """Measure the gaps of all recordings, write tables and figures, close the run folder."""
    recordings = results.residual_recordings(inputs.recordings, result)
    recordings = tuple(sorted(recordings, key=lambda r: r.split))
    gaps, traces = measure(result, recordings, reporter, jobs=request.jobs, seed=request.settings.seed)
    results.write_gaps(gaps, folder.path, result.axis)
    if request.settings.figures:
        results.write_coast_downs(inputs.coast_downs, folder.path, request.settings)
        results.write_fit_pictures(result, gaps, traces, folder.path, request.settings, reporter, request.jobs)
    outcome = fit_outcome(folder, result, gaps)
    folder.end(outcome.status, outcome.exit_code, key_figure=outcome.key_figure)
    reporter.close()
    return outcome


def fit_outcome(folder: RunFolder, result: FitResult, gaps: Sequence[RecordingGap]) -> Outcome:
    """The outcome of a fit, from its results or from what an earlier run wrote."""
    from linid.report.tables import gap_table_console, parameter_table_console

    code = DONE if result.converged else NOT_CONVERGED
    summary = {
        "command": folder.command,
        "folder": str(folder.path),
        "model": result.model,
        "axis": result.axis,
        "converged": result.converged,
        "stop_reasons": list(result.stop_reasons),
        "exit_code": code,
        "parameters": results.parameter_rows(result),
        "gaps": results.gap_rows(gaps),
        "warnings": list(result.warnings),
        "not_separable": [list(pair) for pair in result.pairs],
        "evaluations": result.evaluations,
    }
    tables = (parameter_table_console(result), gap_table_console(gaps, result.axis))
    return Outcome(folder.command, folder.path, code, gap_figure_text(gaps, result.axis), tables, summary)


def finished_before(folder: RunFolder) -> Outcome:
    """The outcome of a run that was complete when it was resumed."""
    from linid.identification.model_file import load_model

    return fit_outcome(folder, load_model(folder.path / MODEL_FILE), results.read_gaps(folder.path))


def plan_outcome(command: str, tasks: Sequence[tuple[str, FitTask]], inputs: Inputs) -> Outcome:
    """What --dry-run prints: stages, parameters and budget; nothing is written."""
    summary = {
        "command": command,
        "dry_run": True,
        "files": list(inputs.files),
        "held_out": [r.name for r in inputs.of(split="held_out")],
        "stages": [describe_task(task, label) for label, task in tasks],
    }
    return Outcome(command, None, DONE, "", (), summary)
