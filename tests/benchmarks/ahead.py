"""Errors 0.1 s ahead, ours and the true term's told alike: `python -m tests.benchmarks.ahead FOLDER`.

FOLDER: a challenge of causes outside the library with results and oracles (`python -m tests.benchmarks.outside`).
What the true term leaves is told along the measured motion: position and speed are right at every row, and what lacks
is integrated. A simulation also starts from a bristle that nobody measured and meets inputs that jump. Here the models
of a diagnosis are told both ways.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from statistics import median

from linid.api import read
from linid.challenge.answers import ORACLE_FILE
from linid.challenge.files import CAMPAIGN_FILE, DIAGNOSIS_FILE, KEYS_FILE, RESULTS_FOLDER, read_keys_file
from linid.diagnosis.oracle import ahead_along
from linid.identification.model_file import load_model
from linid.report.result_files import MODEL_AFTER
from linid.workflow.commands.diagnose import BEFORE_FILE


def ratios(folder: Path, name: str) -> tuple[bool, float, float] | None:
    """Whether the models have a term, and the error ahead over the true term's, along the motion and simulated; None
    where no true term is known."""
    results = folder / RESULTS_FOLDER / name
    known = json.loads((results / ORACLE_FILE).read_text(encoding="utf-8")).get("ahead")
    if not known:
        return None
    said = json.loads((results / DIAGNOSIS_FILE).read_text(encoding="utf-8"))
    held = [one for one in read(folder / name / CAMPAIGN_FILE).recordings if one.split == "held_out"]
    before, after = (ahead_along(load_model(results / file), held) for file in (BEFORE_FILE, MODEL_AFTER))
    simulated = said["measures"]["ahead"]
    kept = bool((said.get("proposal") or {}).get("kept"))
    return kept, after / before / known, simulated["after"] / simulated["before"] / known


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args(arguments).folder
    found = []
    for name, key in read_keys_file(folder / KEYS_FILE)[0].items():
        one = ratios(folder, name)
        if one is not None:
            found.append(one)
            words = f"{name} {'+'.join(key.effects)}: {'with a' if one[0] else 'no'} term"
            print(f"{words}, along {one[1]:.2f}, simulated {one[2]:.2f}", flush=True)
    for words, some in (("all", found), ("with a term", [one for one in found if one[0]])):
        if some:
            along, simulated = (median(one[k] for one in some) for k in (1, 2))
            print(f"median of {words} ({len(some)}): along {along:.2f}, simulated {simulated:.2f}")


if __name__ == "__main__":
    main()
