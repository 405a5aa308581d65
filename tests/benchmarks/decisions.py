"""Where the thresholds of proposed terms come from: `python -m tests.benchmarks.decisions FOLDER [--without-true]`.

FOLDER is made by `python -m tests.benchmarks.outside FOLDER --make N --seed S`. Its campaigns are diagnosed once, and
what each decision was given is kept (decisions.json beside the results; what is there is not computed again). The table
says how many decisions another value would turn: each threshold at half, once and twice its value. Of the range of the
mass it says how far the mass of the base lay from the truth.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

from linid.challenge.files import KEYS_FILE, RESULTS_FOLDER, Key, read_keys_file
from linid.diagnosis import held_out_tests, instead, lacking, lead, unknowns
from linid.diagnosis.judge import Evidence
from linid.diagnosis.report_data import Change, RecordingChange
from linid.workflow.commands.diagnose import BEFORE_FILE
from tests.benchmarks.outside import WITHOUT_FOLDER, judged, left_out

FILE = "decisions.json"
Record = dict[str, Any]


def _instead(given: Sequence[Any]) -> bool:
    return instead.does_without_effects(*given)


def _not_asked(given: Sequence[Any]) -> bool:
    """Whether a term that would do without the effects is not looked for."""
    _, by_effects, beside, _ = given
    return _instead(given) and instead.leave_next_to_nothing(by_effects, beside)


def _turned_in_the_model(given: Sequence[Any]) -> bool:
    *as_found, in_the_model = given
    return in_the_model and not instead.is_hopeless(*as_found)


def _likely(given: Sequence[float]) -> bool:
    certainty, closed = given
    return held_out_tests.is_likely(held_out_tests.Part("", Evidence(0.0, certainty, closed, 0.0, 0.0), None))  # type: ignore[arg-type]


def _worse(given: Sequence[Sequence[float]]) -> bool:
    changes = [RecordingChange("", "", "held_out", {"ahead": Change(*one[:3])}) for one in given]
    return lacking.worse_somewhere(changes, [bool(one[3]) for one in given])


# By threshold: the module in which it stands, under which name its decision is recorded, and that decision.
DECISIONS: dict[str, tuple[Any, str, Callable[[Any], bool]]] = {
    "INSTEAD": (instead, "instead", _instead),
    "LEFT_BY_FORM": (instead, "instead", _instead),
    "NEXT_TO_NOTHING": (instead, "instead", _not_asked),
    "HOPELESS": (instead, "hopeless", _turned_in_the_model),
    "LIKELY": (held_out_tests, "likely", _likely),
    "SMALL_RISE": (lacking, "worse", _worse),
}


@contextmanager
def recorded() -> Iterator[Record]:
    """What the decisions are given from now on; terms alone, and models with a term, are asked even where there is no
    hope for them."""
    out: Record = {"instead": [], "hopeless": [], "likely": [], "worse": []}
    first, likely, worse = lead.does_without_effects, lacking.is_likely, lacking.worse_somewhere
    as_found: list[list[float]] = []  # what a model is asked after

    def told(little: bool) -> bool:
        if as_found:
            out["hopeless"].append([*as_found.pop(), little])
        return little

    def without(*given: float, its_shape: bool) -> bool:
        out["instead"].append([*map(float, given), its_shape])
        return told(first(*given, its_shape=its_shape))

    def no_more(*given: float) -> bool:
        return told(instead.leaves_no_more(*given))

    def hopeless(*given: float) -> bool:
        as_found.append([*map(float, given)])
        return False

    def is_likely(part: held_out_tests.Part) -> bool:
        out["likely"].append([part.evidence.certainty, part.evidence.closed])
        return likely(part)

    def somewhere(changes: Sequence[RecordingChange], chances: Sequence[bool]) -> bool:
        ahead = [change.changes["ahead"] for change in changes]
        out["worse"].append([[one.before, one.after, one.floor, c] for one, c in zip(ahead, chances, strict=True)])
        return worse(changes, chances)

    with ExitStack() as stack:
        for place, name, function in (
            (lead, "does_without_effects", without),
            (lead, "leaves_no_more", no_more),
            (lead, "is_hopeless", hopeless),
            (lead, "leave_next_to_nothing", lambda *_: False),
            (lacking, "is_likely", is_likely),
            (lacking, "worse_somewhere", somewhere),
        ):
            stack.enter_context(mock.patch.object(place, name, function))
        yield out


def records(folder: Path, keys: dict[str, Key], without: bool) -> dict[str, Record]:
    """What the decisions of all campaigns were given, by campaign."""
    out = {}
    for name, key in keys.items():
        results = folder / (WITHOUT_FOLDER if without else RESULTS_FOLDER) / name
        if not (results / FILE).exists():
            with recorded() as given:
                if without:
                    left_out(folder, name, key)
                else:
                    judged(folder, name, key, None, False)
            before = json.loads((results / BEFORE_FILE).read_text(encoding="utf-8"))
            masses = [one["value"] for one in before["estimates"] if one["name"] == "mass"]
            given["mass"] = [masses[0], key.base["mass"]] if masses and "mass" in key.base else []
            (results / FILE).write_text(json.dumps(given), encoding="utf-8")
            print(f"{name}: {', '.join(f'{len(x)} {k}' for k, x in given.items())}", flush=True)
        out[name] = json.loads((results / FILE).read_text(encoding="utf-8"))
    return out


def turned(name: str, given: Sequence[Any], factor: float) -> int:
    """How many decisions a threshold at another value turns."""
    place, _, decide = DECISIONS[name]
    value = factor * float(getattr(place, name))
    usual = [decide(one) for one in given]
    with mock.patch.object(place, name, value):
        return sum(decide(one) != before for one, before in zip(given, usual, strict=True))


def report(found: dict[str, Record]) -> list[str]:
    """The table as Markdown, and how far masses lay from the truth."""
    lines = ["| threshold | value | decisions | yes | turned at half | at twice |", "|---|---|---|---|---|---|"]
    for name, (place, kind, decide) in DECISIONS.items():
        given = [one for record in found.values() for one in record[kind]]
        yes = sum(map(decide, given))
        cells = (len(given), yes, turned(name, given, 0.5), turned(name, given, 2.0))
        lines.append(f"| `{name}` | {getattr(place, name):g} | " + " | ".join(map(str, cells)) + " |")
    apart = [abs(math.log(record["mass"][0] / record["mass"][1])) for record in found.values() if record["mass"]]
    if apart:
        factor = math.exp(max(apart))
        lines += ["", f"Masses of the base are a factor of {factor:.2f} off at most in {len(apart)} campaigns"]
        lines[-1] += f" (`MASS_RANGE` {unknowns.MASS_RANGE:g})."
    return lines


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--without-true", action="store_true", help="leave the true effect out of consideration")
    options = parser.parse_args(arguments)
    keys, _ = read_keys_file(options.folder / KEYS_FILE)
    print("\n".join(report(records(options.folder, keys, options.without_true))))


if __name__ == "__main__":
    main()
