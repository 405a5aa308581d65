"""Which friction law recordings prefer: `python -m tests.benchmarks.laws --seed 31 --count 12`.

Campaigns of the hidden plant, each of its laws by turns and every one on an axis of its own, with the challenge's own
recordings (slow ramps below breakaway hold presliding motion); --without-presliding leaves those out, --kinds single
hides an effect of the library beside the law. The law is decided along the measured motion before any effect is
selected. Printed per campaign: the true law, the preferred one, those not told from it, the gap in floors before and
after, and what a race of other laws promises of it; with --evidence what each law gains over LuGre; at the end rates.
"Not told" (LuGre stays, with words on it) counts as no answer, another law than the true one as a false one.

--derive tells where the thresholds of linid/diagnosis/laws.py come from: how the evidence of true and of other laws is
distributed, and what is decided with each threshold at half, once and twice its value.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING
from unittest import mock

import numpy as np

if TYPE_CHECKING:
    from linid.diagnosis.laws import LawChoice, LawTrial

TRUE = {"maxwell": "maxwell_slip"}  # the plant's names of laws that linid calls otherwise
NOT_TOLD = "not told"
FACTORS = (0.5, 1.0, 2.0)
# What a threshold is counted from: that of the breakaway force is a factor.
THRESHOLDS = {"LEAST_CLOSED": 0.0, "EQUAL": 0.0, "REFUTED": 0.0, "VISIBLE_BREAKAWAY": 1.0, "VISIBLE_BRISTLE": 0.0}


@dataclass(frozen=True)
class Decision:
    """One campaign: the true law, the answer, laws not told from it, the gap in floors under LuGre and under the law,
    what other laws promise of it after a race, CPU seconds of the decision; trials: of all laws; changed: answers and
    laws alike with one threshold times a factor.
    """

    true: str
    said: str
    alike: tuple[str, ...]
    gap: tuple[float, float]
    promised: float
    seconds: float
    trials: tuple[LawTrial, ...]
    changed: dict[tuple[str, float], tuple[str, tuple[str, ...]]] = field(default_factory=dict)


def answer(choice: LawChoice) -> str:
    """The law that is named, or that none is told."""
    from linid.physics.laws.registry import LUGRE

    return NOT_TOLD if choice.law == LUGRE and not choice.told else choice.law


def decided(path: Path, true: str, *, presliding: bool = True, derive: bool = False) -> Decision:
    """The law that a campaign's recordings prefer before any effect is selected."""
    from linid.api import read
    from linid.diagnosis import laws
    from linid.diagnosis.base import fit_base_model, numbered
    from linid.diagnosis.means import Means
    from linid.interface.stages import base_kind

    recordings = read(path / "campaign.yaml").recordings
    recordings = numbered([r for r in recordings if presliding or not r.name.startswith("slow_ramp")])
    base = fit_base_model(recordings, base_kind(recordings), {}, Means(), [])
    start = time.process_time()
    trials = laws.try_laws(base.judge, base.fitted)
    rows = base.judge.fits.rows_of(base.fitted.recordings)
    choice = laws.decide(base.judge, trials, rows)
    seconds = time.process_time() - start
    promise = laws.promised(base.judge, base.fitted)
    changed = {}
    for name, origin in THRESHOLDS.items() if derive else ():
        for factor in FACTORS:
            with mock.patch.object(laws, name, origin + factor * (getattr(laws, name) - origin)):
                other = laws.decide(base.judge, trials, rows)
            changed[name, factor] = (answer(other), other.alike)
    gap = tuple(base.judge.excess(one.residual) for one in (base.fitted, choice.chosen.fitted))
    return Decision(true, answer(choice), choice.alike, gap, promise, seconds, trials, changed)  # type: ignore[arg-type]


def outcome(pairs: Iterable[tuple[str, str]]) -> str:
    """How many answers (true law, said) are right, none, and false; and how many other laws are named on LuGre axes."""
    made = list(pairs)
    right, none = sum(true == said for true, said in made), sum(said == NOT_TOLD for _, said in made)
    lugre = [said for true, said in made if true == "lugre"]
    other = sum(said not in ("lugre", NOT_TOLD) for said in lugre)
    return (
        f"right {right}, not told {none}, false {len(made) - right - none} of {len(made)}; "
        f"another law on {other} of {len(lugre)} LuGre axes"
    )


def derivation(found: Sequence[Decision]) -> str:
    """The evidence of true and of other laws, and what is decided with other thresholds, as Markdown."""
    groups: dict[str, list[LawTrial]] = defaultdict(list)
    for one in found:
        for trial in one.trials[1:]:
            other = "on LuGre axes" if one.true == "lugre" else "on axes of a third law"
            groups[f"`{trial.law}` where it is true" if trial.law == one.true else f"others {other}"].append(trial)
            if trial.law == "dahl" and one.true != "dahl":
                groups[f"`dahl` where `{one.true}` is true"].append(trial)
    lines = ["| law | count | gain | certainty | closed |", "|---|---|---|---|---|"]
    for words, group in sorted(groups.items()):
        cells = [
            " / ".join(f"{x:.2g}" for x in np.quantile([getattr(t.on_held_out, name) for t in group], [0.1, 0.5, 0.9]))
            for name in ("gain", "certainty", "closed")
        ]
        lines.append(f"| {words} | {len(group)} | " + " | ".join(cells) + " |")
    lines += ["", "Over LuGre on held-out rows, quantiles 10 / 50 / 90 %. What is decided:", ""]
    lines += ["| threshold | times | right | not told | false | true law alone |", "|---|---|---|---|---|---|"]
    for name in THRESHOLDS:
        for factor in FACTORS:
            answers = [(one.true, *one.changed[name, factor]) for one in found]
            right = sum(true == said for true, said, _ in answers)
            none = sum(said == NOT_TOLD for _, said, _ in answers)
            alone = sum(true == said and not alike for true, said, alike in answers)
            lines.append(f"| `{name}` | {factor:g} | {right} | {none} | {len(answers) - right - none} | {alone} |")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    from linid.challenge.files import write_hidden_campaign
    from linid.challenge.hidden_axis import LAWS
    from linid.challenge.make import Plan, make_campaign

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=31)
    parser.add_argument("--count", type=int, default=12, help="campaigns per law")
    parser.add_argument("--first", type=int, default=0, help="number of the first campaign, from 0")
    parser.add_argument("--laws", default=",".join(LAWS))
    parser.add_argument("--kinds", default="none")
    parser.add_argument("--without-presliding", action="store_true")
    parser.add_argument("--evidence", action="store_true", help="print what each law gains")
    parser.add_argument("--derive", action="store_true", help="print where the thresholds come from")
    options = parser.parse_args(arguments)
    chosen, found = options.laws.split(","), []
    for index in range(options.first, options.first + options.count * len(LAWS)):
        law = LAWS[index % len(LAWS)]
        if law not in chosen:
            continue
        hidden = make_campaign(Plan(options.seed, kinds=tuple(options.kinds.split(",")), laws=(law,)), index)
        with TemporaryDirectory() as folder:
            write_hidden_campaign(hidden, Path(folder), fresh=False)
            one = decided(
                Path(folder) / hidden.name,
                TRUE.get(law, law),
                presliding=not options.without_presliding,
                derive=options.derive,
            )
        found.append(one)
        print(
            f"{hidden.name} {'+'.join(effect.name for effect in hidden.effects)} {one.true}: {one.said}, "
            f"alike {', '.join(one.alike) or '-'}, gap {one.gap[0]:.2f} -> {one.gap[1]:.2f} floors, "
            f"promised {one.promised:.2f}, {one.seconds:.1f} s",
            flush=True,
        )
        for trial in one.trials if options.evidence else ():
            for words, e in (("fitted", trial.on_fitted), ("held out", trial.on_held_out)):
                print(f"    {trial.law} {words}: gain {e.gain:.4f}, {e.certainty:.1f} sigma, closed {e.closed:.2f}")
    for (true, said), count in sorted(Counter((one.true, one.said) for one in found).items()):
        print(f"{true}: {said} {count}")
    print(f"{outcome((one.true, one.said) for one in found)}; {np.mean([one.seconds for one in found]):.1f} CPU s each")
    if options.derive:
        print(derivation(found))


if __name__ == "__main__":
    main()
