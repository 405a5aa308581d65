"""How much two threads are worth: `python -m tests.benchmarks.threads [--runs 8]`.

Batches of all shapes that fits ask for, of the generated stand: by one thread and by two, in turn in one process; a
run's figure is the ratio of the least wall times of several calls. Needs two cores that nobody else uses.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.free_run import FreeRun
from linid.identification.objectives.objective import Directions
from linid.physics.model import Model
from tests.benchmarks.jacobian import DRIVEN
from tests.identification.stand import FREE_WHEELS, stand
from tests.simulation.axis_with_effects import SAMPLES

CANDIDATES = 16
AIM = 1.9
Batch = Callable[[], object]


def batches() -> dict[str, tuple[Batch, Batch]]:
    """By name: a batch by one thread and by two."""
    campaign, out = stand(), {}
    driven = tuple(r for r in campaign.recordings if r.name in DRIVEN)
    wheels = tuple(r for r in campaign.recordings if r.name in FREE_WHEELS)

    def vectors(model: Model, count: int) -> np.ndarray:
        values = campaign.truth | SAMPLES["cogging"]
        vector = model.vector({p.name: values.get(p.name, p.default) for p in model.parameters})
        return np.repeat(vector[None], count, axis=0)

    def both(name: str, part: Ahead | FreeRun, ask: Callable[[Ahead | FreeRun], object]) -> None:
        other = replace(part, jobs=2)
        out[name] = (lambda: ask(part)), (lambda: ask(other))

    theta, full, friction = Model("theta"), Model("theta", ("cogging",)), Model("friction")
    for count in (1, CANDIDATES):
        for name, model in (("windows", theta), ("windows with cogging", full)):
            ahead, params = Ahead(model, driven, 2, 1), vectors(model, count)
            both(f"{name}, candidates: {count}", ahead, lambda p, v=params: p.simulate_along(v))
        free, params = FreeRun(friction, wheels, 2, 1), vectors(friction, count)
        none = np.zeros((count, free.nuisances))
        both(f"free wheels, candidates: {count}", free, lambda p, v=params, z=none: p.residuals(v, z))
    ahead = Ahead(theta, driven, 2, 1)
    size = vectors(theta, 1).shape[1]
    columns = Directions(np.eye(14, size, 8), np.zeros((14, 0)))
    both("windows with 14 derivatives", ahead, lambda p: p.slopes(vectors(theta, 1)[0], np.zeros(0), columns))
    both("along, candidates: 16", ahead, lambda p: p._starts(vectors(theta, CANDIDATES)))
    return out


def ratio(batch: tuple[Batch, Batch], calls: int) -> tuple[float, float]:
    """Least wall time in s by one thread, and how many times that by two."""
    best = [math.inf, math.inf]
    for _ in range(calls):
        for k, function in enumerate(batch):
            begin = time.perf_counter()
            function()
            best[k] = min(best[k], time.perf_counter() - begin)
    return best[0], best[0] / best[1]


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=8)
    parser.add_argument("--calls", type=int, default=8, help="of each, in a run")
    options = parser.parse_args()
    for name, batch in batches().items():
        ratio(batch, 1)  # compiles
        found = [ratio(batch, options.calls) for _ in range(options.runs)]
        ratios = sorted(one for _, one in found)
        reached = sum(one >= AIM for one in ratios)
        print(
            f"{name:38s} {1e3 * found[0][0]:7.2f} ms; two threads {ratios[0]:.2f} to {ratios[-1]:.2f} times as fast, "
            f"{AIM} in {reached} of {len(ratios)}",
            flush=True,
        )


if __name__ == "__main__":
    main()
