"""validate: the gap between a fitted model and recordings that it may never have seen."""

from __future__ import annotations

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
    from linid.recording import Recording
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request

COMMAND = "validate"
Choice = Literal["auto", "held_out", "fit", "all"]


def validate(request: Request, reporter: Reporter, *, model: Path, split: Choice = "auto") -> Outcome:
    """Measure and show the gap of a MODEL on recordings.

    split: which recordings; auto takes the held-out ones of the files where there are any, else all.
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
    identity = identity_of(COMMAND, fingerprint(chosen), decisive(request.settings), model_to_text(result))
    folder = begin(request, COMMAND, campaign, identity, [file_record(model)])
    if folder.finished_before:
        reporter.say(f"{folder.path}: already finished, nothing to resume")
        return _outcome(folder.path, results.read_gaps(folder.path), result.axis)
    with recorded(folder), reporter:
        seed = request.settings.seed
        found = api.validate(fit, chosen, among=campaign, jobs=request.jobs, seed=seed, progress=reporter.step)
        results.write_gaps(found.gaps, folder.path, result.axis)
        if request.settings.figures:
            from linid.report.figures.write import validation_drawings, write_drawings

            results.write_coast_downs(campaign.coast_downs, folder.path, request.settings)
            write_drawings(
                validation_drawings(found.gaps, found.traces),
                folder.path / "figures",
                formats=request.settings.figure_formats,
                processes=request.jobs,
                progress=lambda done, total, stem: reporter.step("figures", done, total),
            )
        outcome = _outcome(folder.path, found.gaps, result.axis)
        folder.end(outcome.status, outcome.exit_code, key_figure=outcome.key_figure)
    return outcome


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
