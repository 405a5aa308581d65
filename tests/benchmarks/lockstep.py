"""What simulations side by side save: `python -m tests.benchmarks.lockstep`.

Of the generated stand: windows 0.1 s ahead along measured positions with the motor's forces filled in, one candidate;
windows and half a second of driven runs at the simulated position; and free wheels from start to rest: by the kernel of
one at a time and by that of many, in turn in one process: least processor time of several calls.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np

from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.free_run import FreeRun
from linid.physics.model import Model
from linid.simulation.run import Segments, Simulator
from tests.benchmarks.__main__ import as_sine
from tests.benchmarks.jacobian import DRIVEN
from tests.identification.stand import FREE_WHEELS, stand

WINDOWS, CANDIDATES = (1, 4, 8, 32), (1, 4, 16)
_SAMPLES = 500  # of a driven run: half a second, in which no last bit decides where it ends


def least(functions: tuple[Callable[[], object], ...], calls: int) -> list[float]:
    """Least thread time in s of each function, called in turn."""
    best = [math.inf] * len(functions)
    for call in range(calls + 1):  # the first one compiles
        for k, function in enumerate(functions):
            begin = time.thread_time()
            function()
            best[k] = min(best[k], time.thread_time() - begin) if call else math.inf
    return best


def compared(
    simulator: Simulator, params: np.ndarray, segments: Segments, starts: np.ndarray, guided: bool, calls: int
) -> dict[str, float]:
    """ms of one at a time and of many, their ratio, and the largest difference of positions in m."""
    alone = Simulator(simulator.model, simulator.inputs, simulator.substeps, specialised=True)
    found = []

    def run(one: Simulator) -> Callable[[], None]:
        return lambda: found.append(one.run(params, segments, starts, guided=guided)[0])

    single, many = least((run(alone), run(simulator)), calls)
    apart = float(np.nanmax(np.abs(found[0] - found[1])))
    return {"one at a time, ms": 1e3 * single, "many, ms": 1e3 * many, "ratio": single / many, "apart, m": apart}


def _runs(objective: Ahead, params: np.ndarray) -> tuple[Segments, np.ndarray]:
    """The beginnings of all recordings, and start states (C, R, 3) there."""
    count = objective.simulator.inputs.counts.size
    runs = Segments(np.arange(count), np.zeros(count, dtype=np.int64), np.full(count, _SAMPLES))
    first, motion = objective.simulator.inputs.sample_offsets[:-1], objective.motion
    state = np.stack([motion.y[first], motion.v[first], np.full(count, np.nan)], axis=1)
    return runs, np.tile(state, (len(params), 1, 1))


def figures(calls: int = 25) -> dict[str, dict[str, float]]:
    """All of it, by name."""
    campaign, out = stand(), {}
    for kind in ("sine", "theta"):
        truth = as_sine(campaign.truth) if kind == "sine" else campaign.truth
        model = Model(kind)
        vector = model.vector({p.name: truth.get(p.name, p.default) for p in model.parameters})[None]
        objective = Ahead(model, tuple(r for r in campaign.recordings if r.name in DRIVEN), 2, 1)
        starts, whole = objective._starts(vector), objective.segments
        for count in (*(WINDOWS if kind == "theta" else ()), whole.count.size):
            first = min(100, whole.count.size - count)
            part = Segments(*(column[first : first + count] for column in whole))
            some = starts[:, first : first + count]
            out[f"{kind}, {count} windows"] = compared(objective.simulator, vector, part, some, True, calls)
        free = compared(objective.simulator, vector, whole, starts, False, calls)
        out[f"{kind}, {whole.count.size} windows, free"] = free
        for count in CANDIDATES:
            runs, at = _runs(objective, np.repeat(vector, count, axis=0))
            name = f"{kind}, {runs.count.size} driven runs, candidates: {count}"
            out[name] = compared(objective.simulator, np.repeat(vector, count, axis=0), runs, at, False, calls)
    model = Model("friction")
    wheels = FreeRun(model, tuple(r for r in campaign.recordings if r.name in FREE_WHEELS), 2, 1)
    vector = model.vector({p.name: campaign.truth.get(p.name, p.default) for p in model.parameters})
    for count in CANDIDATES:
        params = np.repeat(vector[None], count, axis=0)
        params[:, 4:8] *= np.exp(0.2 * np.random.default_rng(0).standard_normal((count, 4)))
        starts = wheels.starts(np.zeros((count, wheels.nuisances)))
        name = f"{len(FREE_WHEELS)} free wheels, candidates: {count}"
        out[name] = compared(wheels.simulator, params, wheels.segments, starts, False, calls)
    return out


def main() -> None:
    """The command."""
    for name, values in figures().items():
        print(f"{name:32s}" + "".join(f"  {what} {value:.3g}" for what, value in values.items()), flush=True)


if __name__ == "__main__":
    main()
