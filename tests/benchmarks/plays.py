"""Where turns tell of play: `python -m tests.benchmarks.plays --seed 22931 --count 8`.

Campaigns of the challenge with play between motor and reading, with another effect and with none, so many of each.
Printed per campaign: quartiles of what its turns tell of play, each by itself, in deviations of the encoder's noise; at
the end for how many of each kind play would be tried with `VISIBLE_PLAY` of linid/recording/motion.py at half, once
and twice its value.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.benchmarks.with_and_without import campaigns_with_and_without

PLAY = "backlash"
FACTORS = (0.5, 1.0, 2.0)


def quartiles_told(path: Path) -> list[float]:
    """Quartiles of what the turns of a campaign's fitted recordings tell of play, in deviations of the noise."""
    from linid.api import read

    motions = [r.motion for r in read(path / "campaign.yaml").recordings if r.split == "fit"]
    told = [play for motion in motions for play in motion.plays]
    noise = max(motion.position_noise for motion in motions)
    return [float(x) / noise for x in np.quantile(told, (0.25, 0.5, 0.75))] if told else [0.0, 0.0, 0.0]


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    from linid.recording.motion import VISIBLE_PLAY

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=22931)
    parser.add_argument("--count", type=int, default=8, help="campaigns of each kind")
    options = parser.parse_args(arguments)
    found: dict[str, list[list[float]]] = defaultdict(list)
    for words, label, path in campaigns_with_and_without(PLAY, "play", options.seed, options.count):
        told = quartiles_told(path)
        found[words].append(told)
        print(f"{label}: quartiles {told[0]:.3g}, {told[1]:.3g}, {told[2]:.3g}", flush=True)
    for factor in FACTORS:
        tried = {words: sum(one[1] > factor * VISIBLE_PLAY for one in told) for words, told in found.items()}
        print(
            f"VISIBLE_PLAY {factor * VISIBLE_PLAY:g}: " + ", ".join(f"{n} with {words}" for words, n in tried.items())
        )


if __name__ == "__main__":
    main()
