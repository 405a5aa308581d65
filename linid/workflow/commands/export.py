"""export: the identified model in another program's form, with what that form costs on held-out recordings."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.errors import DataError, UsageError
from linid.interface.measuring import residual_recordings
from linid.interface.reading import file_record
from linid.report.files import write_atomic
from linid.workflow.run.inputs import decisive, fingerprint
from linid.workflow.run.outcome import DONE, Outcome
from linid.workflow.run.run_folder import identity_of, open_run_folder, recorded, write_text

if TYPE_CHECKING:
    from linid.export.loss import Loss, Measured
    from linid.export.target import Exported, Target
    from linid.identification.result import FitResult
    from linid.interface.campaign import Campaign
    from linid.interface.results import Fit
    from linid.recording import Recording
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request

COMMAND = "export"


@dataclass(frozen=True)
class ExportOptions:
    """to: targets by name; name: of the exported axis (None: of the model's file or folder); base: MODEL from which the
    closed gap counts (None: the model without its effects)."""

    to: tuple[str, ...]
    name: str | None = None
    base: Path | None = None


def export(request: Request, reporter: Reporter, *, model: Path, options: ExportOptions) -> Outcome:
    """Write a MODEL in the forms of targets: a folder each, with README.txt and, where recordings judge, loss.json.

    Raises UsageError for an unknown target or a model that one cannot be made of, ConfigError for the model or an
    effect that cannot be translated, DataError for the recordings.
    """
    from linid import api
    from linid.export.registry import find_target
    from linid.identification.model_file import load_model, model_to_text

    targets = [find_target(name) for name in dict.fromkeys(options.to)]
    fit = api.load(model)
    base = None if options.base is None else load_model(options.base)
    campaign = api.read(*request.files, axis_of=fit, **request.settings.given()) if request.files else None
    judges = () if campaign is None else _judges(request, campaign, fit)
    exported = _exported(fit, model, options, () if campaign is None else campaign.recordings)
    if request.dry_run:
        named = {"targets": [target.name for target in targets], "recordings": [r.name for r in judges]}
        return Outcome(COMMAND, None, summary={"command": COMMAND, "dry_run": True, **named})
    folder = open_run_folder(COMMAND, request.out, overwrite=request.overwrite)
    texts = (model_to_text(fit.result), None if base is None else model_to_text(base), options.name, list(options.to))
    folder.begin(
        identity=identity_of(COMMAND, fingerprint(judges), decisive(request.settings), *texts),
        config="# linid export\n",
        inputs=[
            *(file_record(path) for path in (model, options.base) if path is not None),
            *(() if campaign is None else campaign.files),
        ],
        seed=None,
        jobs=request.jobs,
    )
    with recorded(folder), reporter:
        rows = _all(targets, exported, judges, base, folder.path, (request.jobs, reporter))
        folder.end("done", DONE)
    summary = {"command": COMMAND, "folder": str(folder.path), "targets": rows, "exit_code": DONE}
    return Outcome(COMMAND, folder.path, DONE, "", (_table(rows),), summary)


def _judges(request: Request, campaign: Campaign, fit: Fit) -> tuple[Recording, ...]:
    """The recordings that no fit has seen and the model can be asked for; raises DataError where there is none."""
    from linid.export.loss import held_out

    chosen = residual_recordings(held_out(campaign.recordings), fit.result)
    if not chosen:
        raise DataError(
            ", ".join(str(f) for f in request.files),
            f"holds no recording that a {fit.result.model} model can be asked for",
            "Give free wheels, or recordings with the channels that the model needs, or none.",
        )
    return chosen


def _exported(fit: Fit, model: Path, options: ExportOptions, recordings: Sequence[Recording]) -> Exported:
    """The model with its name and the step that it was identified with."""
    from linid.export.target import Exported, step_of, word_of

    step = step_of(fit.result, recordings)
    stem = model.resolve().parent.name if model.stem in ("parameters", "model_after") else model.stem
    return Exported(fit.result, word_of(options.name or stem).lower(), step, tuple(recordings))


def _all(
    targets: Sequence[Target],
    exported: Exported,
    judges: Sequence[Recording],
    base: FitResult | None,
    folder: Path,
    means: tuple[int, Reporter],
) -> list[dict[str, Any]]:
    """Write every target; what the table and the summary say of each. means: threads and who is told of progress."""
    from linid.export.loss import measure_model

    jobs, reporter = means
    rows = []
    measured = None
    for done, target in enumerate(targets):
        reporter.step("targets", done, len(targets))
        files = target.files(exported)  # first: what cannot be made is refused before anything takes long
        if judges and measured is None:
            measured = measure_model(exported.result, base, judges, jobs)
        loss = _loss(target, exported, measured, judges, jobs)
        rows.append(_written(target, exported, files, loss, folder / target.name))
    reporter.step("targets", len(targets), len(targets))
    return rows


def _loss(
    target: Target, exported: Exported, measured: Measured | None, judges: Sequence[Recording], jobs: int
) -> Loss | None:
    from linid.export.loss import measure_loss

    if measured is None:
        return None
    return measure_loss(measured, None if target.whole else target.simplified(exported), judges, jobs)


def _written(
    target: Target, exported: Exported, files: dict[str, bytes], loss: Loss | None, folder: Path
) -> dict[str, Any]:
    """Write the files of one target with what they cost."""
    from linid.export.loss import readme
    from linid.export.program.words import title_of, units_of

    for name in files:
        if Path(name).is_absolute() or ".." in Path(name).parts:
            raise UsageError(f"target {target.name!r}", f"names the file {name!r} outside its folder", "Correct it.")
    lacks = target.lacks(exported)
    lines = (title_of(exported), f"{target.name}: {target.purpose}", units_of(exported), "", *sorted(files))
    for name, content in files.items():
        write_atomic(folder / name, content)
    write_text(folder / "README.txt", readme(lines, loss, lacks))
    row: dict[str, Any] = {"target": target.name, "files": [str(folder / name) for name in sorted(files)]}
    row |= {"lacks": list(lacks), "loss": None if loss is None else loss.row()}
    if loss is not None:
        write_text(folder / "loss.json", json.dumps(row["loss"], indent=1, allow_nan=False) + "\n")
    return row


def _table(rows: Sequence[dict[str, Any]]) -> object:
    from rich import box
    from rich.table import Table

    table = Table(title="Exports", title_justify="left", box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
    for name in ("Target", "Files", "Loss"):
        table.add_column(name, overflow="fold")
    for row in rows:
        files = "\n".join(row["files"])
        text = "not computed: give held-out recordings" if row["loss"] is None else row["loss"]["text"]
        table.add_row(row["target"], files, text.replace("; ", "\n"))
    return table
