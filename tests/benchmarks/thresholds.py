"""Where the thresholds of the selection come from: `python -m tests.benchmarks.thresholds --out docs/thresholds.md`.

Campaigns of the challenge are made from stated seeds, of several kinds: crowds, single effects, none, and effects that
are in no library. On each, effects are proposed by the forward steps, and every proposed one gets its evidence on the
held-out rows with all others there: gain, certainty and share of the log power closed. Which are there is known. The
table says how the evidence of true and absent effects is distributed, and what the tests keep of either with each
threshold at half, once and twice its value. Goes on with --resume.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from linid.diagnosis import held_out_tests, select
from linid.diagnosis.base import fit_base_model, numbered
from linid.diagnosis.descent import THOROUGH
from linid.diagnosis.held_out_tests import Part, is_trifle, stands
from linid.diagnosis.judge import Evidence
from linid.diagnosis.means import Means
from linid.diagnosis.screen import Screening
from linid.diagnosis.shares import shares_of
from linid.interface.stages import base_kind
from linid.physics.effects.registry import EFFECTS, find_effect

# (kind, campaigns, seed); none of the seeds is that of a recorded run.
SETS = (("crowd", 8, 901), ("single", 8, 902), ("none", 4, 903), ("unknown", 4, 904), ("pair", 8, 905))
THRESHOLDS = (
    "CERTAINTY",
    "LEAST_GAIN",
    "LEAST_CLOSED",
    "LEAST_CLOSED_ALONE",
    "LEAST_POWER_ALONE",
    "MOST_OF_POWER",
    "SURE",
    "SURE_ALONE",
    "NO_TRIFLE",
    "LEAST_PORTION",
    "TO_THE_FLOOR",
    "LEAST_LOG_SHARE",
)
_KNOWN = {effect.name for effect in EFFECTS}
MATTERS = 0.05  # of the gap's power or of its logarithm: true effects of less are counted apart


def evidence(path: Path, truth: dict[str, float]) -> list[dict[str, Any]]:
    """Every effect that is proposed on a campaign, with its evidence; truth: share of the gap by effect."""
    from linid.api import read

    recordings = numbered(read(path).recordings)
    base = fit_base_model(recordings, base_kind(recordings), {}, Means(2), [])
    screening = Screening(base.judge.fits, base.fitted, 2)
    full, _ = select.forward(base, screening, lambda stage, done, total: None)
    full = base.judge.fits.fit(full.model, full.values, full.preset, screening.to_fit(full), THOROUGH)
    portions = shares_of(base.judge, base.fitted, full, 2).portions
    out = []
    for name in full.model.effects:
        part = select.part_of(base.judge, base.fitted, full, name, 2)
        known = {"effect": name, "there": name in truth, "share": truth.get(name, 0.0)}
        own = {
            "alone": len(portions) == 1,
            "part": part.share,
            "log_share": part.log_share,
            "portion": portions[name].share,
        }
        out.append({**known, **own, **part.evidence.__dict__})
    missed = [{"effect": n, "share": s} for n, s in truth.items() if n not in full.model.effects]
    return [*out, *({**one, "there": True, "proposed": False} for one in missed)]


def kept(rows: Sequence[dict[str, Any]], changed: dict[str, float]) -> tuple[float, int, int]:
    """Recall of true effects that matter, how many of those, and absent effects that stand the tests."""
    proposed = [row for row in rows if row.get("proposed", True)]
    with mock.patch.multiple(held_out_tests, **changed):
        found = [row for row in proposed if stands(_part(row)) and (row["alone"] or not _is_trifle(row))]
    matter = [row for row in rows if _matters(row) and row["effect"] in _KNOWN]
    good = [row for row in found if _matters(row)]
    absent = [row for row in found if not row["there"]]
    return len(good) / max(len(matter), 1), len(matter), len(absent)


def _matters(row: dict[str, Any]) -> bool:
    """Whether a row is that of a true effect that takes enough of the gap to be named."""
    return bool(row["there"] and max(row["share"], row.get("log_share", 0.0)) >= MATTERS)


def _is_trifle(row: dict[str, Any]) -> bool:
    return is_trifle(_part(row), row["portion"])


def _part(row: dict[str, Any]) -> Part:
    fields = ("gain", "certainty", "closed", "power", "power_closed")
    evidence = Evidence(*(row[name] for name in fields))
    return Part(row["effect"], evidence, None, row["part"], row["log_share"])  # type: ignore[arg-type]


def report(rows: Sequence[dict[str, Any]]) -> str:
    """The table as Markdown."""
    lines = [
        "# Thresholds of the selection",
        "",
        "`python -m tests.benchmarks.thresholds` writes this page: campaigns (kind, count, seed) "
        + ", ".join(f"{kind} {count} {seed}" for kind, count, seed in SETS)
        + ".",
        "",
        "| proposed effects | count | gain | certainty | closed | of the power | of the log power |",
        "|---|---|---|---|---|---|---|",
    ]
    proposed = [row for row in rows if row.get("proposed", True)]
    groups = {
        "true, 5 % of the gap and more": [r for r in proposed if _matters(r)],
        "true, less": [r for r in proposed if r["there"] and not _matters(r)],
        "absent": [r for r in proposed if not r["there"]],
    }
    groups["absent, in single recordings"] = [r for r in groups["absent"] if find_effect(r["effect"]).per_recording]
    for words, group in groups.items():
        cells = [str(len(group))]
        for name in ("gain", "certainty", "closed", "portion", "log_share"):
            values = [row[name] for row in group]
            cells.append(" / ".join(f"{x:.2g}" for x in np.quantile(values, [0.1, 0.5, 0.9])) if values else "-")
        lines.append(f"| {words} | " + " | ".join(cells) + " |")
    lines += ["", "Quantiles 10 / 50 / 90 %. What the tests keep:", ""]
    lines += ["| threshold | value | at half | as it is | at twice |", "|---|---|---|---|---|"]
    for name in THRESHOLDS:
        value = float(getattr(held_out_tests, name))
        cells = []
        for factor in (0.5, 1.0, 2.0):
            recall, count, absent = kept(rows, {name: factor * value})
            cells.append(f"{100 * recall:.0f} % of {count}, {absent} absent")
        lines.append(f"| `{name}` | {value:g} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Make what is missing, gather the evidence, write the page."""
    from linid.challenge.create import make_challenge
    from linid.challenge.files import CAMPAIGN_FILE, KEYS_FILE, read_keys
    from linid.challenge.make import Plan

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, default=Path("thresholds"), help="folder for campaigns and evidence")
    parser.add_argument("--out", type=Path, default=Path("docs/thresholds.md"))
    parser.add_argument("--resume", action="store_true", help="keep what is there")
    options = parser.parse_args()
    store = options.work / "evidence.json"
    known = json.loads(store.read_text(encoding="utf-8")) if options.resume and store.exists() else {}
    for kind, count, seed in SETS:
        folder = options.work / kind
        if not (folder / KEYS_FILE).exists():
            make_challenge(replace(Plan(seed), kinds=(kind,)), count, folder, jobs=2)  # type: ignore[arg-type]
        for name, key in read_keys(folder / KEYS_FILE).items():
            if f"{kind}/{name}" not in known:
                known[f"{kind}/{name}"] = evidence(folder / name / CAMPAIGN_FILE, dict(key.shares))
                store.write_text(json.dumps(known), encoding="utf-8")
                print(kind, name, flush=True)
    rows = [row for found in known.values() for row in found]
    options.out.write_text(report(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
