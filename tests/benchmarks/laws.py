"""Which friction law a diagnosis names: `python -m tests.benchmarks.laws --seed 31 --count 12`.

Campaigns of the hidden plant, each of its laws by turns, with the challenge's own recordings (slow ramps below
breakaway hold presliding motion); --without-presliding leaves those out, --kinds single hides an effect of the library
beside the law. Printed per campaign: the true law, the preferred one, those not told from it, and the gap in floors
before and after; at the end rates. "Not told" counts as no answer, another law than the true one as a false one.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

TRUE = {"maxwell": "maxwell_slip"}  # the plant's names of laws that linid calls otherwise


def decided(path: Path, presliding: bool) -> dict[str, Any]:
    """The law that a campaign's recordings prefer before any effect is selected, with CPU seconds of the decision."""
    from linid.api import read
    from linid.diagnosis.base import fit_base_model, numbered
    from linid.diagnosis.laws import choose_law
    from linid.diagnosis.means import Means
    from linid.interface.stages import base_kind

    recordings = read(path / "campaign.yaml").recordings
    recordings = numbered([r for r in recordings if presliding or not r.name.startswith("slow_ramp")])
    base = fit_base_model(recordings, base_kind(recordings), {}, Means(), [])
    start = time.process_time()
    choice = choose_law(base.judge, base.fitted)
    before, after = (base.judge.excess(one.residual) for one in (base.fitted, choice.chosen.fitted))
    seconds = time.process_time() - start
    return {"law": choice.law, "told": choice.told, "alike": choice.alike, "gap": (before, after), "seconds": seconds}


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    from linid.challenge.create import make_challenge
    from linid.challenge.hidden_axis import LAWS
    from linid.challenge.make import Plan

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--seed", type=int, default=31)
    parser.add_argument("--count", type=int, default=12, help="campaigns per law")
    parser.add_argument("--laws", default=",".join(LAWS))
    parser.add_argument("--kinds", default="none")
    parser.add_argument("--without-presliding", action="store_true")
    options = parser.parse_args(arguments)
    outcomes: Counter[tuple[str, str]] = Counter()
    seconds = []
    for law in options.laws.split(","):
        with TemporaryDirectory() as folder:
            plan = Plan(seed=options.seed, kinds=tuple(options.kinds.split(",")), laws=(law,))
            names = make_challenge(plan, options.count, Path(folder) / "made")
            for name in names:
                one = decided(Path(folder) / "made" / name, not options.without_presliding)
                outcome = one["law"] if one["told"] or one["law"] != "lugre" else "not told"
                outcomes[TRUE.get(law, law), outcome] += 1
                seconds.append(one["seconds"])
                print(
                    f"{law} {name} {'+'.join(names[name].effects)}: {outcome}, alike {one['alike']}, "
                    "gap {:.2f} -> {:.2f} floors, ".format(*one["gap"])
                    + f"{one['seconds']:.1f} s",
                    flush=True,
                )
    for (true, said), count in sorted(outcomes.items()):
        print(f"{true}: {said} {count}")
    right = sum(count for (true, said), count in outcomes.items() if true == said)
    false = sum(count for (true, said), count in outcomes.items() if said not in (true, "not told"))
    print(f"right {right}, false {false} of {sum(outcomes.values())}; {sum(seconds) / len(seconds):.1f} CPU s each")


if __name__ == "__main__":
    main()
