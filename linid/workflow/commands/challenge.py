"""challenge: make campaigns with withheld effects, run the diagnosis over them, score it against the keys."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.report.files import finite
from linid.workflow.run.outcome import DONE, Outcome
from linid.workflow.run.run_folder import Interrupted, fresh_folder, write_text

if TYPE_CHECKING:
    from linid.challenge.make import Plan
    from linid.challenge.run import Diagnose, Diagnosed
    from linid.challenge.score import Score
    from linid.diagnosis.oracle import TermOracle
    from linid.workflow.run.reporter import Reporter

COMMAND = "challenge"
SCORE_FOLDER = "score"


def make(
    plan: Plan, count: int, out: Path | None, reporter: Reporter, *, keys: Path | None = None, jobs: int = 1
) -> Outcome:
    """Make `count` campaigns of a challenge; keys: where theirs go, by default into the folder.

    Raises UsageError for folders that hold something.
    """
    from linid.challenge.create import make_challenge
    from linid.challenge.files import KEYS_FILE

    folder = out or fresh_folder(COMMAND)
    with reporter:
        made = make_challenge(
            plan,
            count,
            folder,
            keys_path=keys,
            jobs=jobs,
            progress=lambda done, total: reporter.step("campaigns", done, total),
        )
    summary = {
        "command": f"{COMMAND} make",
        "folder": str(folder),
        "keys": str(keys or folder / KEYS_FILE),
        "campaigns": list(made),
        "seed": plan.seed,
        "exit_code": DONE,
    }
    return Outcome(COMMAND, folder, DONE, f"{len(made)} campaigns", (), summary)


def diagnose_with_linid(path: Path, out: Path, jobs: int, without: Sequence[str] = ()) -> Any:
    """The project's own diagnosis of a campaign file into `out`, and then its forecast against fresh recordings.

    Where there are recordings of the commissioning, against the model that is fitted to those. without: effects of the
    library that are left out of consideration."""
    from linid import api
    from linid.challenge.answers import FRESH_FILE
    from linid.challenge.checks import fresh_gaps, fresh_text
    from linid.challenge.files import CAMPAIGN_FILE, COMMISSIONED_FOLDER, DIAGNOSIS_FILE, FRESH_FOLDER
    from linid.diagnosis.measures import measure_gaps
    from linid.report.result_files import MODEL_AFTER
    from linid.workflow.commands.diagnose import diagnose_campaign

    before = path.parent.parent / COMMISSIONED_FOLDER / path.parent.name / CAMPAIGN_FILE
    found = diagnose_campaign(path, out, jobs, without, since=before if before.exists() else None)
    fresh = path.parent.parent / FRESH_FOLDER / path.parent.name / CAMPAIGN_FILE
    if fresh.exists():
        stated = json.loads((out / DIAGNOSIS_FILE).read_text(encoding="utf-8"))
        recordings = api.read(fresh).recordings
        gaps, _ = measure_gaps(api.load(out / MODEL_AFTER).result, recordings, jobs=jobs, floors=False)
        write_text(out / FRESH_FILE, fresh_text(fresh_gaps(stated, gaps)))
    return found


def true_effects_closure(path: Path, effects: Sequence[str]) -> tuple[float, dict[str, float]] | None:
    """Closure that the base with exactly these effects reaches on a campaign file, and what each closes of that which
    the others leave; None if the library lacks one."""
    from linid import api
    from linid.diagnosis.oracle import oracle as known_to
    from linid.interface.stages import base_kind
    from linid.physics.effects.registry import EFFECTS

    if not effects or not set(effects) <= {effect.name for effect in EFFECTS}:
        return None
    campaign = api.read(path)
    reached = known_to(campaign.recordings, base_kind(campaign.recordings), effects, dict(campaign.known))
    if reached is None:
        return None
    return reached.shares.closed[0], {part.name: part.evidence.power_closed for part in reached.parts}


def oracle(
    folder: Path, reporter: Reporter, *, keys: Path | None = None, jobs: int = 1, resume: bool = False
) -> Outcome:
    """For every campaign the closure that its true effects reach, into results/NAME/oracle.json; not for axes that were
    recorded twice, whose model is given.

    Raises DataError when the keys cannot be read, Interrupted after Ctrl-C or SIGTERM.
    """
    from linid.challenge.answers import ORACLE_FILE
    from linid.challenge.files import CAMPAIGN_FILE, KEYS_FILE, RESULTS_FOLDER, read_keys_file
    from linid.challenge.run import in_processes

    sealed, more = read_keys_file(keys or folder / KEYS_FILE)
    results = folder / RESULTS_FOLDER
    tasks = [
        (folder / name / CAMPAIGN_FILE, key.effects, results / name / ORACLE_FILE, more.get("plan"))
        for name, key in sealed.items()
        if key.kind not in ("changed", "unchanged") and not (resume and (results / name / ORACLE_FILE).exists())
    ]
    with reporter:
        try:
            for done, _ in enumerate(in_processes(write_oracle, tasks, jobs), 1):
                reporter.step("oracle", done, len(tasks))
        except KeyboardInterrupt:
            raise Interrupted(folder) from None
    summary = {"command": f"{COMMAND} oracle", "folder": str(results), "campaigns": len(tasks), "exit_code": DONE}
    return Outcome(COMMAND, results, DONE, f"{len(tasks)} campaigns", (), summary)


def true_term_oracle(path: Path, effects: Sequence[str], plan: Mapping[str, Any] | None) -> TermOracle | None:
    """What the base reaches on a campaign file with what its only cause, one outside the library, truly does.

    plan: from the keys, by which the hidden plant is made again; None where they have none, or other effects act.
    """
    from linid import api
    from linid.challenge.outside import OUTSIDE
    from linid.challenge.term import plan_of, true_term
    from linid.diagnosis.oracle import oracle_of_term
    from linid.interface.stages import base_kind

    if plan is None or len(effects) != 1 or effects[0] not in OUTSIDE:
        return None
    campaign = api.read(path)
    terms = true_term(plan_of(plan), int(path.parent.name.rsplit("_", 1)[1]) - 1)
    term = [terms[recording.name] for recording in campaign.recordings]
    return oracle_of_term(campaign.recordings, base_kind(campaign.recordings), term, dict(campaign.known))


def write_oracle(path: Path, effects: Sequence[str], target: Path, plan: Mapping[str, Any] | None) -> None:
    """Write to `target` the closure that the true effects reach on a campaign file; plan: see `true_term_oracle`."""
    stated = _stated_closure(target.parent, effects) if len(effects) == 1 else None
    term = true_term_oracle(path, effects, plan) if stated is None else None
    stated = stated if term is None else term.closure
    reached = (stated, {effects[0]: stated}) if stated is not None else true_effects_closure(path, effects)
    closure, each = reached or (None, {})
    body = finite({"effects": list(effects), "closure": closure, "each": each, "ahead": term and term.ahead})
    write_text(target, json.dumps(body, allow_nan=False) + "\n")


def _stated_closure(folder: Path, effects: Sequence[str]) -> float | None:
    """The closure of exactly these effects if the diagnosis in a folder has fitted them anyway."""
    from linid.challenge.files import DIAGNOSIS_FILE

    path = folder / DIAGNOSIS_FILE
    if not path.exists():
        return None
    body = json.loads(path.read_text(encoding="utf-8"))
    for entry in body.get("ranking", ()):
        if set(entry.get("effects", ())) == set(effects) and entry.get("closure") is not None:
            return float(entry["closure"])
    closed = body.get("budget", {}).get("closed")
    named = body["verdict"].get("effects", ())
    return float(closed) if closed is not None and len(named) == len(effects) and set(named) == set(effects) else None


def run(
    folder: Path, reporter: Reporter, *, jobs: int = 1, resume: bool = False, diagnose: Diagnose = diagnose_with_linid
) -> Outcome:
    """Diagnose all campaigns of a challenge; the keys are not opened. Exit code 1 when diagnoses failed.

    Raises DataError without campaigns, UsageError when results exist and resume is False, Interrupted after Ctrl-C or
    SIGTERM.
    """
    from linid.challenge.files import RESULTS_FOLDER
    from linid.challenge.run import run_challenge

    def progress(done: int, total: int, last: Diagnosed) -> None:
        reporter.step("diagnoses", done, total)
        if last.error:
            reporter.warn(f"{last.campaign}: {last.error}")
        else:
            reporter.detail(f"{last.campaign}: {last.status} in {last.seconds:.1f} s")

    with reporter:
        try:
            ended = run_challenge(folder, diagnose, jobs=jobs, resume=resume, progress=progress)
        except KeyboardInterrupt:
            raise Interrupted(folder) from None
    failed = [one.campaign for one in ended if one.status == "failed"]
    code = 1 if failed else DONE
    results = folder / RESULTS_FOLDER
    summary = {
        "command": f"{COMMAND} run",
        "folder": str(results),
        "campaigns": [asdict(one) for one in ended],
        "failed": failed,
        "exit_code": code,
    }
    key = f"{len(ended) - len(failed)} of {len(ended)} campaigns diagnosed"
    return Outcome(COMMAND, results, code, key, (key,), summary)


def score(folder: Path, reporter: Reporter, *, keys: Path | None = None, figures: bool = True) -> Outcome:
    """Score the results of a challenge against its keys; writes DIR/score and returns the tables.

    Raises DataError when keys or results cannot be read.
    """
    from linid.challenge.answers import read_answers
    from linid.challenge.files import KEYS_FILE, read_keys
    from linid.challenge.score import score as scored
    from linid.report.challenge import (
        bin_table,
        budget_table,
        proposal_table,
        rate_text,
        score_table,
        share_table,
        write_score_csv,
    )

    sealed = read_keys(keys or folder / KEYS_FILE)
    result = scored(sealed, read_answers(folder, sealed))
    target = folder / SCORE_FOLDER
    body = score_body(result)
    write_text(target / "score.json", json.dumps(body, indent=1, allow_nan=False) + "\n")
    write_score_csv(result, target)
    if figures:
        _write_figures(result, target, reporter)
    summary = {"command": f"{COMMAND} score", "folder": str(target), "exit_code": DONE, **body}
    found = result.budgets["all"].rates["found"]
    key = f"named first: {rate_text(result.rates['top_1'])}; effects with 5 % of the gap found: {rate_text(found)}"
    outside = (proposal_table(result),) if result.proposals.rates["proposed"].total else ()
    tables = (score_table(result), budget_table(result), share_table(result), bin_table(result), *outside)
    return Outcome(COMMAND, target, DONE, key, tables, summary)


def score_body(result: Score) -> dict[str, Any]:
    """All figures of a score as JSON-able values; what is not a number becomes null."""
    rows, columns, counts = result.confusion
    body: dict[str, Any] = {
        "schema": 2,
        "rates": {name: {**asdict(rate), "value": rate.value} for name, rate in result.rates.items()},
        "closure": result.closure,
        "relative_closure": result.relative_closure,
        "proposals": {
            "rates": {name: {**asdict(one), "value": one.value} for name, one in result.proposals.rates.items()},
            "relative_closure": result.proposals.closure,
            "closures": result.proposals.count,
        },
        "budgets": {
            group: {
                "campaigns": one.campaigns,
                "rates": {name: {**asdict(rate), "value": rate.value} for name, rate in one.rates.items()},
                "share_bins": [asdict(part) for part in one.bins],
            }
            for group, one in result.budgets.items()
        },
        "strength_bins": [asdict(one) for one in result.bins],
        "confusion": {"rows": list(rows), "columns": list(columns), "counts": [list(c) for c in counts]},
        "campaigns": [asdict(line) for line in result.lines],
    }
    cleaned: dict[str, Any] = finite(body)
    return cleaned


def _write_figures(result: Score, folder: Path, reporter: Reporter) -> None:
    from linid.errors import DataError
    from linid.report.figures.challenge import budget_figure, confusion_figure, rates_figure
    from linid.report.style import save

    for stem, draw in (("rates", rates_figure), ("budget", budget_figure), ("confusion", confusion_figure)):
        try:
            save(draw(result), folder / stem)
        except DataError as error:
            reporter.detail(f"no {stem} figure: {error.fact}")
