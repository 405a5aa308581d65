"""Where pushes stand out: `python -m tests.benchmarks.pushes --seed 22914 --count 8`.

Campaigns of the challenge with a push, with another effect and with none, so many of each. Printed per campaign: the
push that the screening of the base finds, its lead over other moments, its contrast to the rest of its recording and
its share of the log power; at the end how many of each kind would be tried with `LEAST_CONTRAST` of
linid/diagnosis/screen.py at half, once and twice its value.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tests.benchmarks.with_and_without import campaigns_with_and_without

if TYPE_CHECKING:
    from linid.identification.guess.effect_values import Trial

PUSH = "external_disturbance"
FACTORS = (0.5, 1.0, 2.0)


def found_push(path: Path) -> Trial:
    """What the screening of a campaign's base promises of a push."""
    from linid.api import read
    from linid.diagnosis.base import fit_base_model, numbered
    from linid.diagnosis.means import Means
    from linid.diagnosis.screen import Screening
    from linid.interface.stages import base_kind

    recordings = numbered(read(path / "campaign.yaml").recordings)
    base = fit_base_model(recordings, base_kind(recordings), {}, Means(), [])
    (found,) = Screening(base.judge.fits, base.fitted, 1).screen(base.fitted, only=[PUSH])
    return found.trial


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    from linid.diagnosis.forward import LEAST_LEAD, MOMENTS_GAIN
    from linid.diagnosis.screen import LEAST_CONTRAST

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=22914)
    parser.add_argument("--count", type=int, default=8, help="campaigns of each kind")
    options = parser.parse_args(arguments)
    trials: dict[str, list[Trial]] = defaultdict(list)
    for words, label, path in campaigns_with_and_without(PUSH, "a push", options.seed, options.count):
        one = found_push(path)
        trials[words].append(one)
        print(f"{label}: lead {one.lead:.1f}, contrast {one.contrast:.3g}, share {one.explained:.4f}", flush=True)
    print(
        "\n| missing | tried at half the contrast | as it is | at twice | for the share alone |\n|---|---|---|---|---|"
    )
    for words, found in trials.items():
        leading = [one for one in found if one.lead >= LEAST_LEAD]
        large = sum(one.explained > MOMENTS_GAIN for one in leading)
        counts = [
            sum(max(one.contrast / (f * LEAST_CONTRAST), one.explained / MOMENTS_GAIN) >= 1.0 for one in leading)
            for f in FACTORS
        ]
        print(f"| {words} | " + " | ".join(f"{n} of {len(found)}" for n in (*counts, large)) + " |")


if __name__ == "__main__":
    main()
