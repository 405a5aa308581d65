"""diagnose: where the simulation differs from the machine, which effect is missing, how far the gap shrinks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.errors import UsageError
from linid.interface.reading import file_record
from linid.interface.stages import base_kind
from linid.report.result_files import MODEL_AFTER
from linid.workflow.cluster.connection import Cluster, connected
from linid.workflow.run.checkpoint import Memory
from linid.workflow.run.fit_run import announce, begin, begin_ahead
from linid.workflow.run.inputs import decisive, fingerprint
from linid.workflow.run.outcome import DONE, Outcome
from linid.workflow.run.request import Request
from linid.workflow.run.run_folder import CHECKPOINT_FILE, RunFolder, identity_of, recorded, write_text

if TYPE_CHECKING:
    from linid.diagnosis.diagnose import Found
    from linid.diagnosis.report_data import Diagnosis
    from linid.identification.result import ModelKind
    from linid.interface.campaign import Campaign
    from linid.interface.results import Diagnosed, Fit
    from linid.recording import Recording
    from linid.simulation.functional_unit import FunctionalUnit
    from linid.workflow.run.reporter import Reporter

COMMAND = "diagnose"
RECORDED = "recorded"  # the simulation beside the recordings
UNITS = (".fmu", ".yaml", ".yml")  # files of functional units, or of the names of their variables
BEFORE_FILE = "model_before.json"


def diagnose(
    request: Request,
    reporter: Reporter,
    *,
    model: ModelKind | None = None,
    simulator: str | None = None,
    controller: Path | None = None,
) -> Outcome:
    """Diagnose the gap of a campaign; see the command's help. model: of the base (None: what the recordings allow);
    simulator: file of an earlier model that is the base, or `recorded`, the simulation beside the recordings;
    controller: file of the drive's loops (None: linid's own, suited to the axis).

    Raises UsageError for options that do not go together, LinidError for what the user can mend.
    """
    from linid import api
    from linid.identification.model_file import model_to_text
    from linid.simulation.controller import load_controller

    _refuse_with(simulator, request, model)
    foreign, loops = _is_foreign(simulator), None if controller is None else load_controller(controller)
    given = None if simulator is None or foreign else api.load(simulator)
    compiled = begin_ahead(COMMAND, request)
    campaign = api.read(*request.files, axis_of=given, **request.settings.given())
    announce(campaign, reporter)
    kind = given.model if given is not None else model or base_kind(campaign.recordings)
    if request.dry_run:
        plan = {"command": COMMAND, "dry_run": True, "model": kind, "recordings": [r.name for r in campaign]}
        return Outcome(COMMAND, None, DONE, "", (), plan)
    known = request.settings.known_values(campaign.known)
    told = [str(simulator) if given is None else model_to_text(given.result)] if simulator else []
    told += [] if loops is None else [loops.model_dump_json()]
    identity = identity_of(COMMAND, kind, fingerprint(campaign.recordings), decisive(request.settings), known, *told)
    with connected(request, reporter) as workers:
        read = (None if simulator == RECORDED else simulator, controller)
        more = [file_record(Path(file)) for file in read if file is not None]
        folder = begin(request, COMMAND, campaign, identity, more)
        if folder.finished_before:
            reporter.say(f"{folder.path}: already finished, nothing to resume")
            return Outcome(COMMAND, folder.path, DONE, str((folder.previous or {}).get("key_figure", "")), (), {})
        memory = Memory(folder.path / CHECKPOINT_FILE, identity)
        if request.resume:
            memory.load()
        with recorded(folder), memory, reporter:
            compiled(reporter)
            if foreign and simulator != RECORDED:
                unit = _refitted(campaign, Path(str(simulator)), folder.path, reporter)
                campaign = _simulated(campaign, unit, folder.path, reporter)
            found = _diagnosed(request, reporter, campaign, (kind, given, foreign), memory, workers)
            reporter.step("feed-forward", 0, 1)
            found = api.compensate(found, campaign, loops, jobs=request.jobs)
            reporter.step("exports", 0, 1)
            found = api.survey_exports(found, campaign, jobs=request.jobs)
            return _complete(found.found, folder, request, reporter)


def _refitted(campaign: Campaign, file: Path, folder: Path, reporter: Reporter) -> FunctionalUnit:
    """A functional unit, its free parameters identified on the campaign; their values are written and said."""
    from linid import api
    from linid.report.files import csv_text
    from linid.simulation.functional_unit import load_unit

    unit = load_unit(file)
    if not unit.free:
        return unit
    done = api.refit_unit(campaign, unit, partial(reporter.step, "identify parameters of the unit"))
    rows = [(e.name, e.start, e.value, e.low, e.high, e.at_end) for e in done.estimates]
    header = ["parameter", "start", "value", "low", "high", "at end of range"]
    write_text(folder / "unit_parameters.csv", csv_text(header, rows, 9))
    reporter.say(f"Parameters of {file.name}: {'; '.join(e.sentence for e in done.estimates)}")
    return done.unit


def _simulated(campaign: Campaign, unit: FunctionalUnit, folder: Path, reporter: Reporter) -> Campaign:
    """The campaign beside what a functional unit makes of it, each motion written as soon as it is there."""
    from linid import api
    from linid.report.files import columns_csv_text, file_stems

    stems = dict(zip((r.name for r in campaign), file_stems(r.name for r in campaign), strict=True))
    names: list[str] = []

    def done(recording: Recording, y: Any) -> None:
        text = columns_csv_text(["t", "measured", "simulated"], [recording.t, recording.y, y], 9)
        write_text(folder / "simulated" / f"{stems[recording.name]}.csv", text)
        names.append(recording.name)
        reporter.step("simulate by unit", len(names), len(campaign.recordings))

    return api.simulated_by(campaign, unit, done)


def _is_foreign(simulator: str | None) -> bool:
    """Whether the base is a simulation of the user's own, into which nobody can see."""
    return simulator is not None and (simulator == RECORDED or Path(simulator).suffix.lower() in UNITS)


def _refuse_with(simulator: str | None, request: Request, model: ModelKind | None) -> None:
    """Raise UsageError for options that do not go with a given base."""
    given = None if _is_foreign(simulator) else model  # of the model that stands in for a foreign simulation
    for option, value in (("--model", given), ("--effect", request.settings.effects)):
        if simulator is not None and value:
            raise UsageError(option, "does not go with a base that is given as it stands", "Leave it out.")


def _diagnosed(
    request: Request,
    reporter: Reporter,
    campaign: Campaign,
    base: tuple[ModelKind, Fit | None, bool],
    memory: Memory,
    workers: Cluster | None,
) -> Diagnosed:
    from linid import api
    from linid.diagnosis.means import Means

    means = Means(
        jobs=request.jobs,
        workers=workers,
        seed=request.settings.seed,
        memory=memory,
        progress=reporter.step,
        told=reporter.say,
    )
    return api.diagnose(campaign, base[0], since=base[1], simulated=base[2], means=means, **request.settings.given())


def _complete(found: Found, folder: RunFolder, request: Request, reporter: Reporter) -> Outcome:
    """Write what was found and close the run folder."""
    outcome = _outcome(found.diagnosis, folder.path)
    _write_models(found, folder.path)
    _write_predictions(found, folder.path)

    def show() -> None:
        nonlocal outcome
        outcome = reporter.show(outcome)

    _write(found.diagnosis, folder.path, request, reporter, show)
    folder.end(outcome.status, outcome.exit_code, key_figure=outcome.key_figure)
    return outcome


def diagnose_campaign(
    path: Path, out: Path, jobs: int, without: Sequence[str] = (), since: Path | None = None
) -> Diagnosis:
    """Diagnose a campaign file into a folder, without figures or a word: for many campaigns at once. without: effects
    of the library that are left out of consideration; since: campaign file of the commissioning, whose fitted model is
    the base."""
    import json

    from linid import api

    begun = None if since is None else api.read(since)
    given = None if begun is None else api.fit(begun, base_kind(begun.recordings), jobs=jobs)
    campaign = replace(api.read(path), name=path.parent.name)
    found = api.diagnose(campaign, since=given, without=without, jobs=jobs)
    out.mkdir(parents=True, exist_ok=True)
    write_text(out / "diagnosis.json", json.dumps(found.to_dict(), indent=1, allow_nan=False) + "\n")
    _write_models(found.found, out)
    return found.found.diagnosis


def _write(
    diagnosis: Diagnosis, folder: Path, request: Request, reporter: Reporter, written: Callable[[], None]
) -> None:
    from linid.report.diagnosis.files import write_diagnosis

    settings = request.settings
    write_diagnosis(
        diagnosis,
        folder,
        formats=settings.figure_formats,
        figures=settings.figures,
        written=written,
        processes=request.jobs,
        progress=lambda done, total, stem: reporter.step("figures", done, total),
    )


def _write_models(found: Found, folder: Path) -> None:
    from linid.identification.model_file import model_to_text

    write_text(folder / BEFORE_FILE, model_to_text(found.before))
    write_text(folder / MODEL_AFTER, model_to_text(found.after))


def _write_predictions(found: Found, folder: Path) -> None:
    """predictions/RECORDING.csv: time, measured position, and what both models say, so that anyone can check."""
    from linid.report.files import columns_csv_text, file_stems

    stems = file_stems(t.recording for t in found.traces_before)
    for before, after, stem in zip(found.traces_before, found.traces_after, stems, strict=True):
        columns = [before.t, before.y_measured, before.y_simulated, after.y_simulated]
        names = ["t", "measured", "free_run_before", "free_run_after"]
        for trace, name in ((before, "ahead_before"), (after, "ahead_after")):
            if trace.ahead is not None:
                columns.append(_on_grid(trace.ahead.t, trace.ahead.y, before.t))
                names.append(name)
        write_text(folder / "predictions" / f"{stem}.csv", columns_csv_text(names, columns, 9))


def _on_grid(t: Any, y: Any, grid: Any) -> Any:
    """Stitched predictions on the recording's own samples: the piece that began first has the say at a seam."""
    import numpy as np

    out = np.full(grid.size, np.nan)
    known = np.isfinite(t) & np.isfinite(y)
    period = (grid[-1] - grid[0]) / (grid.size - 1)
    place = np.rint((t[known] - grid[0]) / period).astype(int)
    out[place[::-1]] = y[known][::-1]
    return out


def _outcome(diagnosis: Diagnosis, folder: Path) -> Outcome:
    from linid.report.diagnosis.console import diagnosis_console

    verdict = diagnosis.verdict
    summary = {
        "command": COMMAND,
        "folder": str(folder),
        "model": diagnosis.model,
        "status": verdict.status,
        "effects": list(verdict.effects),
        "equivalent": list(verdict.equivalent),
        "proposal": None if diagnosis.proposal is None else list(diagnosis.proposal.arguments),
        "sentence": verdict.sentence,
        "next_experiment": verdict.next_experiment,
        "exit_code": DONE,
    }
    figure = f"{verdict.status}: {', '.join(verdict.effects) or '-'}"
    return Outcome(COMMAND, folder, DONE, figure, (diagnosis_console(diagnosis),), summary)
