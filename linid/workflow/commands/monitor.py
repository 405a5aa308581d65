"""monitor: campaigns of one machine over time, each against the model of its commissioning."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.config import YamlFile, validate_yaml
from linid.errors import ConfigError
from linid.recording.campaign import CampaignFile, is_campaign
from linid.report.files import csv_text
from linid.report.monitor import Visit, monitor_console, monitor_page
from linid.workflow.batch.file import JobSpec
from linid.workflow.batch.run import run_jobs
from linid.workflow.cluster.connection import connected
from linid.workflow.run.model_path import model_path
from linid.workflow.run.outcome import CHANGED, DONE, Outcome
from linid.workflow.run.run_folder import write_text

if TYPE_CHECKING:
    from linid.identification.result import FitResult
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request

COMMAND = "monitor"
TABLE_HEADER = ("campaign", "recorded", "status", "item", "kind", "value", "low", "high", "unit", "commissioned")


def monitor(request: Request, reporter: Reporter, *, model: Path) -> Outcome:
    """Diagnose every campaign against a MODEL, and write table and page of what has changed.

    Raises ConfigError for the model and for files that are no campaigns; a campaign that fails is named in the outcome,
    and the others are kept.
    """
    from linid.identification.model_file import load_model

    path = model_path(model, str(model))
    since = load_model(path)
    visits = in_time(request.files)
    specs = _jobs(visits, path, request)
    if request.dry_run:
        jobs = [{"campaign": spec.label, "file": spec.files[0]} for spec in specs]
        return Outcome(COMMAND, None, summary={"command": COMMAND, "dry_run": True, "campaigns": jobs})
    with connected(request, reporter) as cluster:
        outcome = run_jobs(specs, request, reporter, {"since": str(path)}, cluster)
    assert outcome.folder is not None
    return _summed_up(outcome, _found(visits, specs, outcome.folder), since)


def in_time(files: Sequence[Path]) -> tuple[tuple[Path, str], ...]:
    """Campaign files with the day of their recordings ("" where none is given), in order where all have one.

    Raises ConfigError for a file that is no campaign.
    """
    found = []
    for path in files:
        if not is_campaign(path):
            raise ConfigError(str(path), "is no campaign", "Give campaigns (YAML), whose held-out recordings judge.")
        recorded = validate_yaml(YamlFile(path), CampaignFile).recorded
        found.append((path, "" if recorded is None else recorded.isoformat().removesuffix("T00:00:00")))
    return tuple(sorted(found, key=lambda one: one[1]) if all(day for _, day in found) else found)


def _jobs(visits: Sequence[tuple[Path, str]], model: Path, request: Request) -> tuple[JobSpec, ...]:
    """One diagnosis per campaign; its label is the name of its folder, made unique."""
    specs: list[JobSpec] = []
    settings = request.settings.model_copy(update={"figures": "none"})
    for path, _ in visits:
        stem = path.resolve().parent.name if path.stem == "campaign" else path.stem
        labels, label, number = {spec.label for spec in specs}, stem, 1
        while label in labels:
            number += 1
            label = f"{stem}_{number}"
        models = {"since": str(model.absolute())}
        specs.append(JobSpec(label, "diagnose", settings, {"files": (str(path.absolute()),)}, models, {"model": None}))
    return tuple(specs)


def _found(visits: Sequence[tuple[Path, str]], specs: Sequence[JobSpec], folder: Path) -> tuple[Visit, ...]:
    """What the diagnoses that were done say."""
    out = []
    for (_, day), spec in zip(visits, specs, strict=True):
        file = folder / spec.label / "diagnosis.json"
        if file.exists():
            out.append(Visit(spec.label, day, json.loads(file.read_text(encoding="utf-8"))))
    return tuple(out)


def _summed_up(outcome: Outcome, found: Sequence[Visit], since: FitResult) -> Outcome:
    """Table, page and exit code of the whole."""
    assert outcome.folder is not None
    write_text(outcome.folder / "monitor.csv", csv_text(TABLE_HEADER, [row for one in found for row in one.rows()]))
    write_text(outcome.folder / "report.html", monitor_page(found, since))
    changed = [one.label for one in found if one.changed]
    last = found[-1] if found else None
    code = outcome.exit_code or (CHANGED if last is not None and last.changed else DONE)
    summary: dict[str, Any] = {
        **outcome.summary,
        "command": COMMAND,
        "exit_code": code,
        "changed": changed,
        "campaigns": [asdict(one.brief()) for one in found],
    }
    key = "nothing has changed" if not changed else f"changed in {len(changed)} of {len(found)} campaigns"
    tables = (*(outcome.tables if outcome.exit_code else ()), monitor_console(found))
    return replace(outcome, command=COMMAND, exit_code=code, key_figure=key, tables=tables, summary=summary)
