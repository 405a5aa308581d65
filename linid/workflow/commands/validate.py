"""validate: the gap between a fitted model and recordings that it may never have seen."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from linid.errors import DataError, UsageError
from linid.interface.measuring import residual_recordings
from linid.interface.reading import file_record
from linid.workflow.run import results
from linid.workflow.run.fit_run import announce, begin
from linid.workflow.run.inputs import decisive, fingerprint
from linid.workflow.run.outcome import DONE, Outcome, gap_figure_text
from linid.workflow.run.run_folder import identity_of, recorded

if TYPE_CHECKING:
    from collections.abc import Sequence

    from linid.diagnosis.gap import RecordingGap
    from linid.interface.campaign import Campaign
    from linid.interface.results import Fit
    from linid.recording import Recording
    from linid.report.figures.write import Drawing
    from linid.simulation.controller import Controller
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request

COMMAND = "validate"
Choice = Literal["auto", "held_out", "fit", "all"]


def validate(
    request: Request, reporter: Reporter, *, model: Path, split: Choice = "auto", controller: Path | None = None
) -> Outcome:
    """Measure and show the gap of a MODEL on recordings.

    split: which recordings; auto takes the held-out ones of the files where there are any, else all. controller: of
    the drive, in whose loops the model follows the references that were logged.
    Raises ConfigError for the model, DataError or UsageError for the recordings.
    """
    from linid import api
    from linid.identification.model_file import model_to_text

    fit = api.load(model)
    result = fit.result
    campaign = api.read(*request.files, axis_of=fit, **request.settings.given())
    announce(campaign, reporter)
    chosen = residual_recordings(choose(campaign, split), result)
    if not chosen:
        raise DataError(
            ", ".join(str(f) for f in request.files),
            f"holds no recording that a {result.model} model can be asked for",
            "Give free wheels, or recordings with the channels that the model needs.",
        )
    if request.dry_run:
        names = [r.name for r in chosen]
        return Outcome(COMMAND, None, summary={"command": COMMAND, "dry_run": True, "recordings": names})
    loops, read = None, [file_record(model)]
    if controller is not None:
        from linid.simulation.controller import load_controller

        loops = load_controller(controller)
        read.append(file_record(controller))
    told = [] if loops is None else [loops.model_dump_json()]
    identity = identity_of(COMMAND, fingerprint(chosen), decisive(request.settings), model_to_text(result), *told)
    folder = begin(request, COMMAND, campaign, identity, read)
    if folder.finished_before:
        reporter.say(f"{folder.path}: already finished, nothing to resume")
        return _outcome(folder.path, results.read_gaps(folder.path), result.axis)
    with recorded(folder), reporter:
        seed = request.settings.seed
        found = api.validate(fit, chosen, among=campaign, jobs=request.jobs, seed=seed, progress=reporter.step)
        results.write_gaps(found.gaps, folder.path, result.axis)
        outcome = _outcome(folder.path, found.gaps, result.axis)
        more: list[Drawing] = []
        if loops is not None:
            outcome, more = _with_closed_loops(outcome, fit, chosen, loops)
        elif any(one.reference is not None for one in chosen):
            reporter.say("commanded positions are logged: --controller compares how model and machine follow them")
        outcome = reporter.show(outcome)
        results.draw(lambda: results.validation_pictures(found, campaign) + more, folder.path, request, reporter)
        folder.end(outcome.status, outcome.exit_code, key_figure=outcome.key_figure)
    return outcome


def _with_closed_loops(
    outcome: Outcome, fit: Fit, chosen: Sequence[Recording], loops: Controller
) -> tuple[Outcome, list[Drawing]]:
    """The outcome with how the model follows the logged references beside how the machine did, and what shows it."""
    from linid.workflow.commands.closed_loop import closed_loop_table, run_closed_loops

    logged = [r for r in chosen if r.reference is not None]
    if not logged:
        raise DataError(
            ", ".join(r.name for r in chosen),
            "logs no reference that a controller could follow",
            "Map the commanded position, `reference: {column: ..., unit: mm}`, or leave --controller out.",
        )
    assert outcome.folder is not None
    rows, drawings = run_closed_loops(fit, logged, loops, (None, None), outcome.folder)
    tables = (*outcome.tables, closed_loop_table(rows, fit.result.axis))
    return replace(outcome, tables=tables, summary=outcome.summary | {"closed_loop": rows}), drawings


def choose(campaign: Campaign, split: Choice) -> Sequence[Recording]:
    """The recordings of the asked split; raises UsageError where there are none."""
    if split == "all" or (split == "auto" and not campaign.held_out):
        return campaign.recordings
    chosen = campaign.fitted if split == "fit" else campaign.held_out
    if not chosen:
        raise UsageError("--split", f"no recording is marked `split: {split}`", "Choose --split all.")
    return chosen


def _outcome(folder: Path, gaps: Sequence[RecordingGap], axis: str) -> Outcome:
    from linid.report.tables import gap_table_console

    summary = {
        "command": COMMAND,
        "folder": str(folder),
        "axis": axis,
        "gaps": results.gap_rows(gaps),
        "exit_code": DONE,
    }
    return Outcome(COMMAND, folder, DONE, gap_figure_text(gaps, axis), (gap_table_console(gaps, axis),), summary)
