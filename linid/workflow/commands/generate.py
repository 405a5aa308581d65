"""generate: the scope exports of a described axis, as a campaign folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict, Unpack

from linid.errors import UsageError
from linid.workflow.run.outcome import DONE, Outcome
from linid.workflow.run.run_folder import fresh_folder

if TYPE_CHECKING:
    from linid.workflow.run.reporter import Reporter

COMMAND = "generate"


class Written(TypedDict, total=False):
    """How the exports are written."""

    layout: str
    decimal_mark: str
    overwrite: bool


def generate_campaign(
    axis: Path,
    out: Path | None,
    reporter: Reporter,
    *,
    seed: int = 1,
    only: Sequence[str] = (),
    dry_run: bool = False,
    **written: Unpack[Written],
) -> Outcome:
    """Simulate, measure and write the campaign of an axis description (YAML).

    written: see `linid.stand.export.write_campaign`, which has the defaults.
    Raises ConfigError for the description, UsageError for unknown names or when files would be overwritten.
    """
    from linid.stand.description import load_axis_description
    from linid.stand.export import write_campaign
    from linid.stand.generate import generate

    description = load_axis_description(axis)
    names = [mode.name for mode in description.campaign if not only or mode.name in only]
    if dry_run:
        summary = {"command": COMMAND, "dry_run": True, "axis": description.name, "recordings": names, "seed": seed}
        return Outcome(COMMAND, None, summary=summary)
    folder = out or fresh_folder(COMMAND)
    if folder.is_file():
        raise UsageError(f"--out {folder}", "is a file", "Name a folder.")
    reporter.say(f"generating {len(names)} recordings of axis {description.name}, seed {seed}")
    generated = generate(description, seed=seed, only=list(only) or None)
    paths = write_campaign(generated, folder, **written)
    summary = {
        "command": COMMAND,
        "folder": str(folder),
        "files": [str(p) for p in paths],
        "seed": seed,
        "exit_code": DONE,
    }
    return Outcome(COMMAND, folder, DONE, f"{len(generated.recordings)} recordings", (), summary)
