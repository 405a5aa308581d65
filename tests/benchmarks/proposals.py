"""Arguments of proposed terms beside the base alone: `python -m tests.benchmarks.proposals FOLDER [--derive]`.

FOLDER holds a challenge of causes outside the library (`linid challenge make --kinds unknown`), or of none. Effects of
the library are not tried: what is judged is the proposal itself, in some seconds a campaign. --derive: the same with
each threshold at half and at twice its value (shares: as far from 1; quantiles: squared, and their square roots).
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from linid.challenge.files import CAMPAIGN_FILE, KEYS_FILE, Key, read_keys_file
from linid.challenge.outside import CAUSES
from linid.challenge.proposals import cause_of, grade
from linid.diagnosis.base import fit_base_model, numbered
from linid.diagnosis.means import Means
from linid.diagnosis.proposed import bent, waves
from linid.diagnosis.proposed import propose as rules
from linid.diagnosis.proposed.problem import Problem, problem_of
from linid.diagnosis.proposed.regression import Regression
from linid.recording.campaign import read_campaign
from linid.threads import one_thread

SEED = 1
# Thresholds of the choice, of the search (and where they stand), and those of them that are shares of the best.
THRESHOLDS = ("AS_GOOD", "FINER", "WORTH", "SURE", "LEAST_CLOSED", "LEAST_EXCESS", "LEAST_GAIN")
SEARCHING = {"LEAST_PART": waves, "BENDS": bent}
SHARES = ("AS_GOOD",)


def posed(folder: Path, name: str, kind: str) -> tuple[Problem, list[Regression], float]:
    """What a campaign's base leaves, the families that predict it, and the seconds that these took."""
    recordings = numbered(read_campaign(folder / name / CAMPAIGN_FILE).recordings)
    with one_thread():
        base = fit_base_model(recordings, kind, {}, Means(1, seed=SEED), [])
        begun = time.process_time()
        problem = problem_of(base.judge, base.fitted, SEED)
        return problem, rules.judged_families(problem), time.process_time() - begun


def mark(key: Key, problem: Problem, judged: Sequence[Regression]) -> tuple[str, str]:
    """exact, related, wrong or silent (where nothing is hidden: silent or false), and the proposal in words."""
    found = rules.propose(problem, judged)
    cause = cause_of(key)
    if found is None:
        return "silent", "nothing"
    words = f"{' + '.join(found.arguments)} ({found.family.form}), closes {found.closed:.2f}"
    return ("false" if cause is None else grade(found.arguments, CAUSES[cause].arguments)), words


@contextmanager
def threshold(name: str, factor: float) -> Iterator[str]:
    """A threshold of the proposal at another value, and that in words."""
    place = SEARCHING.get(name, rules)
    before = getattr(place, name)
    if isinstance(before, tuple):
        value = tuple(quantile ** (1.0 / factor) for quantile in before)
        words = ", ".join(f"{quantile:.2g}" for quantile in value)
    else:
        value = 1.0 - (1.0 - before) * factor if name in SHARES else min(before * factor, 1.0)
        words = f"{value:g}"
    setattr(place, name, value)
    try:
        yield words
    finally:
        setattr(place, name, before)


def main() -> None:
    """Print what is proposed for each campaign, the rates, and with --derive those of other thresholds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--derive", action="store_true")
    arguments = parser.parse_args()
    keys, _ = read_keys_file(arguments.folder / KEYS_FILE)
    marks: Counter[str] = Counter()
    others: dict[str, Counter[str]] = {}
    for name, key in keys.items():
        problem, judged, seconds = posed(arguments.folder, name, key.motor)
        grade_of, words = mark(key, problem, judged)
        marks[grade_of] += 1
        print(f"{name} {'+'.join(key.effects) or 'nothing'}: {words}: {grade_of} [{seconds:.1f} s]", flush=True)
        for constant in (*THRESHOLDS, *SEARCHING) if arguments.derive else ():
            for factor in (0.5, 2.0):
                with threshold(constant, factor) as words:
                    again = rules.judged_families(problem) if constant in (*SEARCHING, "LEAST_GAIN") else judged
                    others.setdefault(f"{constant} {words}", Counter())[mark(key, problem, again)[0]] += 1
    print(f"as they are: {dict(marks)}")
    for label, counts in others.items():
        print(f"{label}: {dict(counts)}")


if __name__ == "__main__":
    main()
