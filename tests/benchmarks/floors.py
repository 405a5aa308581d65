"""How floors hang on internal steps, and on the draws of noise: `python -m tests.benchmarks.floors --seed 5 --count 3`.

Campaigns of the hidden plant without an effect; the true model's free runs and predictions 0.1 s ahead of every
recording, measured anew by four seeds each with the steps that whole runs take and with those of the draws. Printed per
campaign and for all: mean and deviation of the logarithm of the floors' ratio.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest import mock

import numpy as np

SEEDS = (1, 2, 3, 4)
MANY = 32  # internal steps per sample, more than any


def ratios(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Logarithms (n, 2) of floors in few steps over those in as many as whole runs take, and between two seeds, of free
    runs and ahead."""
    from linid.api import read
    from linid.diagnosis import measures
    from linid.diagnosis.base import fit_base_model, numbered
    from linid.diagnosis.means import Means
    from linid.identification.optimise.time_step import choose_substeps
    from linid.interface.stages import base_kind

    recordings = numbered(read(path / "campaign.yaml").recordings)
    one = fit_base_model(recordings, base_kind(recordings), {}, Means(), []).fitted
    substeps = choose_substeps(one.model, recordings, one.values)
    task = measures._Task(one.model, one.vector[None], substeps, 1)

    def floors(most: int, seed: int) -> np.ndarray:
        with mock.patch.object(measures, "_DRAWN_STEPS", most):
            found = [measures._noise_floors(task, r, task.balance(r), seed)[:2] for r in recordings]
        return np.log(np.array(found))

    usual = [floors(MANY, seed) for seed in SEEDS]
    few = [floors(measures._DRAWN_STEPS, seed) for seed in SEEDS]
    by_steps = np.concatenate([a - b for a, b in zip(few, usual, strict=True)])
    return by_steps, np.concatenate([a - b for a, b in combinations(usual, 2)])


def said(found: np.ndarray) -> str:
    """Mean and deviation of logarithms (n, 2)."""
    mean, deviation = found.mean(axis=0), found.std(axis=0)
    return f"free runs {mean[0]:+.4f} +- {deviation[0]:.4f}, ahead {mean[1]:+.5f} +- {deviation[1]:.5f}"


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    from linid.challenge.files import write_hidden_campaign
    from linid.challenge.make import Plan, make_campaign

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--count", type=int, default=3)
    options = parser.parse_args(arguments)
    all_steps, all_seeds = [], []
    for index in range(options.count):
        hidden = make_campaign(Plan(options.seed, kinds=("none",)), index)
        with TemporaryDirectory() as folder:
            write_hidden_campaign(hidden, Path(folder), fresh=False)
            by_steps, by_seeds = ratios(Path(folder) / hidden.name)
        all_steps.append(by_steps)
        all_seeds.append(by_seeds)
        print(f"{hidden.name}: by steps: {said(by_steps)}; by seeds: {said(by_seeds)}", flush=True)
    print(f"all: by steps: {said(np.concatenate(all_steps))}; by seeds: {said(np.concatenate(all_seeds))}")


if __name__ == "__main__":
    main()
