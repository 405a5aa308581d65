"""What fit-friction and fit-motor share: gaps of all recordings, files, figures, and the outcome."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from linid.errors import UsageError
from linid.report.figures import drawing_process
from linid.report.result_files import MODEL_FILE
from linid.workflow.run import results
from linid.workflow.run.outcome import DONE, NOT_CONVERGED, Outcome, gap_figure_text
from linid.workflow.run.run_folder import RunFolder, open_run_folder
from linid.workflow.run.settings import settings_yaml
from linid.workflow.run.stage import describe_stage

if TYPE_CHECKING:
    from linid.diagnosis.gap import RecordingGap
    from linid.identification.result import FitResult
    from linid.interface.campaign import Campaign
    from linid.interface.results import Fit
    from linid.interface.stages import Stage
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request


def announce(campaign: Campaign, reporter: Reporter) -> None:
    """Say what the reader understood, and later, before the simulation is compiled, that it is."""
    from linid.kernel_cache import before_compilation

    before_compilation(lambda: reporter.say("compiling the simulation (once per machine)"))
    count, held_out = len(campaign), len(campaign.held_out)
    reporter.say(f"read {count} recording{'s' if count > 1 else ''}, {held_out} of them held out")
    warnings = campaign.warnings
    for note in campaign.notes[len(warnings) :]:  # the first are the warnings
        reporter.detail(note)
    for warning in warnings:
        reporter.warn(warning)
    for found in campaign.coast_downs:
        reporter.say(f"{found.recording.name}: {found.coast_down.evidence}")


def begin_ahead(command: str, request: Request) -> Callable[[Reporter], None]:
    """Begin to load what figures need, and to compile what this machine lacks for a command, while its files are read,
    where several jobs may run; returns what waits for the compilation."""
    if request.dry_run or request.jobs < 2:
        return lambda reporter: None
    if request.settings.figures != "none":
        drawing_process.begin()
    from linid.simulation.compile_ahead import PLANS, Compilation

    compilation = Compilation(PLANS[command])
    return lambda reporter: compilation.finish(partial(reporter.step, "compile the simulation (once per machine)"))


def begin(request: Request, command: str, campaign: Campaign, identity: str, more: Sequence[Any] = ()) -> RunFolder:
    """Open the run folder and write what is known before the work starts."""
    folder = open_run_folder(command, request.out, overwrite=request.overwrite, resume=request.resume)
    config = settings_yaml(request.settings, f"Settings of this run, as `--config` reads them.\n{request.line}")
    folder.begin(
        identity=identity, config=config, inputs=[*campaign.files, *more], seed=request.settings.seed, jobs=request.jobs
    )
    return folder


def start_of(start: Fit, campaign: Campaign, place: str) -> FitResult:
    """The result that a fit starts from; raises UsageError where it is of another kind of axis, naming the place."""
    if start.result.axis != campaign.axis:
        raise UsageError(
            place,
            f"is of a {start.result.axis} axis, the recordings of a {campaign.axis} one",
            "Use the axis's own friction result.",
        )
    return start.result


def complete(folder: RunFolder, found: Fit, campaign: Campaign, request: Request, reporter: Reporter) -> Outcome:
    """Measure the gaps of all recordings, write tables, show them, write figures, close the run folder.

    A recording that cannot be measured is warned about and left out.
    """
    from linid import api
    from linid.interface.measuring import residual_recordings

    result = found.result
    measured = api.validate(
        found,
        sorted(residual_recordings(campaign.recordings, result), key=lambda r: r.split),
        jobs=request.jobs,
        seed=request.settings.seed,
        progress=reporter.step,
        unmeasured=lambda error: reporter.warn(str(error)),
    )
    results.write_gaps(measured.gaps, folder.path, result.axis)
    outcome = reporter.show(fit_outcome(folder, result, measured.gaps))
    results.draw(partial(results.fit_pictures, found, measured, campaign), folder.path, request, reporter)
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
        "search_check": result.search_check,
        "not_separable": [list(pair) for pair in result.pairs],
        "evaluations": result.evaluations,
    }
    tables = (parameter_table_console(result), gap_table_console(gaps, result.axis))
    return Outcome(folder.command, folder.path, code, gap_figure_text(gaps, result.axis), tables, summary)


def finished_before(folder: RunFolder) -> Outcome:
    """The outcome of a run that was complete when it was resumed."""
    from linid.identification.model_file import load_model

    return fit_outcome(folder, load_model(folder.path / MODEL_FILE), results.read_gaps(folder.path))


def plan_outcome(command: str, stages: Sequence[Stage], campaign: Campaign) -> Outcome:
    """What --dry-run prints: stages that search, parameters and budget; nothing is written."""
    summary = {
        "command": command,
        "dry_run": True,
        "files": list(campaign.files),
        "held_out": [r.name for r in campaign.held_out],
        "stages": [describe_stage(stage) for stage in stages if not stage.winding],
    }
    return Outcome(command, None, DONE, "", (), summary)
