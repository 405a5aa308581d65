"""What a capable user would do otherwise: `python -m tests.benchmarks.baselines SUITE --out FOLDER [--jobs N]`.

Writes a submission per method into FOLDER, scores all with the keys beside the suite, and prints a table in Markdown.
Needs `pip install scikit-learn pysindy`; methods whose package is missing are left out. With --linid it scores
FOLDER/linid.json, too (`linid challenge answer SUITE --out FOLDER/linid.json`).
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from linid.challenge.entry_score import EVERY, score_entry
from linid.challenge.rates import Rate
from linid.challenge.run import in_processes
from linid.challenge.submission import read_submission
from linid.challenge.suite import read_suite_keys
from linid.challenge.suite_files import default_keys, read_manifest
from tests.benchmarks.baselines.columns import base_of, rows_of
from tests.benchmarks.baselines.methods import METHODS

NEEDS = {"LASSO": "sklearn", "Gaussian process": "sklearn", "SINDy": "pysindy"}
COLUMNS = {
    "points": "points",
    "named": "named of hidden",
    "wrong": "wrong of named",
    "false_alarms": "false alarms",
    "told": "unlisted causes told",
    "astray": "... told where none is",
    "arguments_main": "arguments with the main one",
    "arguments_exact": "arguments exact",
}


def answered(
    folder: Path, name: str, methods: tuple[str, ...]
) -> tuple[str, dict[str, dict[str, Any]], dict[str, float]]:
    """The answers of all methods to one campaign, and their seconds."""
    answers, seconds = {}, {}
    with threadpool_limits(1):  # small matrices: threads cost more than they bring
        rows = rows_of(folder / name / "campaign.yaml")
        base = base_of(rows)
        for method in methods:
            begin = time.process_time()
            answers[method] = METHODS[method](rows, base)
            seconds[method] = time.process_time() - begin
    return name, answers, seconds


def row(submission: Path, keys: Path) -> str:
    """A row of the table: rates in per cent with their 95 % intervals."""
    sealed, entry = read_suite_keys(keys), read_submission(submission)
    rates = score_entry(sealed.keys, sealed.groups, entry.answers).groups[EVERY].rates
    return f"| {entry.entrant} | " + " | ".join(_cell(rates[name]) for name in COLUMNS) + " |"


def _cell(rate: Rate) -> str:
    if not rate.total:
        return "-"
    return f"{100 * rate.value:.0f} ({100 * rate.low:.0f} to {100 * rate.high:.0f})"


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("suite", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--linid", action="store_true")
    options = parser.parse_args(arguments)
    manifest = read_manifest(options.suite)
    methods = tuple(name for name in METHODS if find_spec(NEEDS.get(name, "numpy")))
    bodies: dict[str, dict[str, Any]] = {name: {} for name in methods}
    spent = dict.fromkeys(methods, 0.0)
    tasks = [(options.suite, name, methods) for name in manifest.campaigns]
    for name, answers, seconds in in_processes(answered, tasks, options.jobs):
        for method in methods:
            bodies[method][name] = answers[method]
            spent[method] += seconds[method]
    options.out.mkdir(parents=True, exist_ok=True)
    files = []
    for method, body in bodies.items():
        files.append(options.out / f"{method.replace(' ', '_')}.json")
        content = {"suite": manifest.suite, "entrant": method, "answers": body}
        files[-1].write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    if options.linid:
        files.append(options.out / "linid.json")
    print("| method | " + " | ".join(COLUMNS.values()) + " |")
    print("|---|" + "---|" * len(COLUMNS))
    for file in files:
        print(row(file, default_keys(options.suite)))
    print({method: f"{spent[method] / len(manifest.campaigns):.1f} s a campaign" for method in methods})


if __name__ == "__main__":
    main()
