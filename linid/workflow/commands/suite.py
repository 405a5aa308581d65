"""challenge export, answer, score of a submission: a suite that others can enter."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.errors import UsageError
from linid.workflow.commands.challenge import COMMAND, diagnose_with_linid, run
from linid.workflow.run.outcome import DONE, Outcome
from linid.workflow.run.run_folder import versions, write_text

if TYPE_CHECKING:
    from linid.challenge.answers import Answer
    from linid.challenge.run import Diagnose
    from linid.challenge.submission import CampaignAnswer
    from linid.workflow.run.reporter import Reporter

# What the diagnosis calls a coordinate -> the argument of an answer.
_ARGUMENT = {
    "|velocity|": "velocity",
    "time": "time",
    "position": "position",
    "pole_phase": "position",
    "velocity": "velocity",
    "direction": "direction",
    "regime": "velocity",
    "current": "motor_force",
}


def export(
    folder: Path,
    reporter: Reporter,
    *,
    seed: int | None = None,
    size: int | None = None,
    groups: tuple[str, ...] = (),
    keys: Path | None = None,
    secret_seed: bool = False,
    jobs: int = 1,
) -> Outcome:
    """Write a suite into `folder` and its keys beside it (or into the file `keys`).

    seed, size, groups: by default those of the suite of this version.
    """
    from linid.challenge.suite import DEFAULT_SEED, DEFAULT_SIZE, GROUPS
    from linid.challenge.suite_files import default_keys, export_suite

    path = keys or default_keys(folder)
    with reporter:
        manifest = export_suite(
            folder,
            path,
            seed=DEFAULT_SEED if seed is None else seed,
            size=DEFAULT_SIZE if size is None else size,
            groups=groups or tuple(GROUPS),
            secret_seed=secret_seed,
            jobs=jobs,
            progress=lambda done, total: reporter.step("campaigns", done, total),
        )
    summary = {
        "command": f"{COMMAND} export",
        "folder": str(folder),
        "keys": str(path),
        "suite": manifest.suite,
        "seed": manifest.seed,
        "groups": manifest.sizes,
        "campaigns": list(manifest.campaigns),
        "exit_code": DONE,
    }
    key = f"suite {manifest.suite}: {len(manifest.campaigns)} campaigns"
    return Outcome(COMMAND, folder, DONE, key, (f"{key}\nKeys: {path}",), summary)


def answer(
    folder: Path,
    out: Path,
    reporter: Reporter,
    *,
    jobs: int = 1,
    resume: bool = False,
    diagnose: Diagnose = diagnose_with_linid,
) -> Outcome:
    """Diagnose every campaign of a suite and write what is found as a submission; the keys are not opened.

    Diagnoses go to folder/results, where resume keeps those that are there. Campaigns whose diagnosis fails are left
    out; exit code 1 then. Raises UsageError where `out` exists and resume is False, or results are there already.
    """
    from linid.challenge.answers import read_answers
    from linid.challenge.submission import submission_text
    from linid.challenge.suite_files import check_files, read_manifest

    if out.exists() and not resume:
        raise UsageError(str(out), "exists", "Name another file by --out, or go on with --resume.")
    manifest = read_manifest(folder)
    check_files(folder, manifest)
    done = run(folder, reporter, jobs=jobs, resume=resume, diagnose=diagnose)
    found = read_answers(folder, manifest.campaigns)
    answers = {
        name: _answered(one, dependences(folder, name))
        for name, one in found.items()
        if name not in done.summary["failed"]
    }
    write_text(out, submission_text(manifest.suite, f"linid {versions()['linid']}", answers))
    summary = {**done.summary, "command": f"{COMMAND} answer", "suite": manifest.suite, "submission": str(out)}
    return Outcome(COMMAND, out, done.exit_code, done.key_figure, done.tables, summary)


def _answered(found: Answer, arguments: tuple[str, ...]) -> CampaignAnswer:
    """A diagnosis as an answer; effects of other packages are no names of the list."""
    from linid.challenge.catalogue import LISTED
    from linid.challenge.hidden_axis import LAWS
    from linid.challenge.outside import ARGUMENTS
    from linid.challenge.submission import CampaignAnswer

    entries = [entry for entry in found.entries if entry.effect in LISTED]
    shares = {
        entry.effect: {"share": entry.stated.share, "low": entry.stated.low, "high": entry.stated.high}
        for entry in entries
        if entry.stated.share is not None
    }
    unknown = found.status == "unknown" or found.another_cause
    if found.proposal is not None:
        arguments = tuple(dict.fromkeys(_ARGUMENT.get(name, name) for name in found.proposal.arguments))
    return CampaignAnswer.model_validate(
        {
            "effects": tuple(entry.effect for entry in entries),
            "shares": shares,
            "unknown": unknown,
            "arguments": tuple(name for name in arguments if name in ARGUMENTS) if unknown else (),
            "law": found.law if found.law in LAWS else None,
        }
    )


def dependences(folder: Path, name: str) -> tuple[str, ...]:
    """What the diagnosis of a suite's campaign says that the rest depends on, as arguments of an answer."""
    from linid.challenge.files import DIAGNOSIS_FILE, RESULTS_FOLDER

    path = folder / RESULTS_FOLDER / name / DIAGNOSIS_FILE
    body: Mapping[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    called = {one["label"]: one["coordinate"] for one in body.get("where", ())}
    said = ((body.get("budget") or {}).get("unexplained") or {}).get("depends_on", ())
    found = (_ARGUMENT.get(called.get(label, label)) for label in said)
    return tuple(dict.fromkeys(argument for argument in found if argument))


def score_submission(
    submission: Path, reporter: Reporter, *, suite: Path | None = None, keys: Path | None = None
) -> Outcome:
    """Score a submission against a suite's keys; nothing is written.

    suite: its folder, whose manifest the keys are checked against; keys: by default those beside that folder. Raises
    UsageError where neither is given.
    """
    from linid.challenge.entry_score import EVERY, score_entry
    from linid.challenge.submission import check_campaigns, read_submission, some_of
    from linid.challenge.suite import read_suite_keys
    from linid.challenge.suite_files import check_keys, default_keys, read_manifest
    from linid.report.challenge import rate_text
    from linid.report.entry import entry_body, entry_tables

    path = keys or (default_keys(suite) if suite else None)
    if path is None:
        raise UsageError(str(submission), "is a submission, and no keys are named", "Give --keys FILE, or --suite DIR.")
    sealed = read_suite_keys(path)
    if suite is not None:
        check_keys(path, sealed, read_manifest(suite))
    entry = read_submission(submission)
    missing = check_campaigns(entry, sealed.suite, tuple(sealed.keys), str(submission))
    score = score_entry(sealed.keys, sealed.groups, entry.answers)
    with reporter:
        if missing:
            reporter.warn(f"no answer to {len(missing)} of {len(sealed.keys)} campaigns: {some_of(missing)}")
    every = score.groups[EVERY].rates
    summary = {
        "command": f"{COMMAND} score",
        "submission": str(submission),
        "entrant": entry.entrant,
        "suite": sealed.suite,
        "missing": list(missing),
        "exit_code": DONE,
        **entry_body(score),
    }
    key = f"points: {rate_text(every['points'])}; named: {rate_text(every['named'])}"
    return Outcome(COMMAND, None, DONE, key, entry_tables(score, entry.entrant), summary)
