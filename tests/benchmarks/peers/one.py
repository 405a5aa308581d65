"""One measurement in a process of its own: `python -m tests.benchmarks.peers.one fit PROBLEM PEER SEED LIMIT TARGET`.

Prints JSON lines: {"ready": ...} when the clock starts, then every improvement.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import time
from typing import Any

# One core for every peer; read when the libraries load.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")


def say(line: dict[str, Any]) -> None:
    """One line of JSON to the process that waits for it."""
    sys.__stdout__.write(json.dumps(line) + "\n")  # type: ignore[union-attr]
    sys.__stdout__.flush()  # type: ignore[union-attr]


def fit(problem_name: str, peer: str, seed: int, limit: float, target: float) -> None:
    """Run one fit; the first simulation, which compiles, is made before the clock starts."""
    from tests.benchmarks.peers.fits import FITS
    from tests.benchmarks.peers.problems import make_problem
    from tests.benchmarks.peers.simulators import SIMULATORS
    from tests.benchmarks.peers.watch import Done, Watch, peak_memory

    problem = make_problem(problem_name)
    chosen = FITS[peer]
    simulator = SIMULATORS[chosen.simulator]
    usual = problem.substeps if simulator.usual is None else simulator.usual
    begin = time.perf_counter()
    simulation = simulator.make(problem, usual)
    problem.cost(simulation, problem.space.encode(problem.first))
    say({"ready": True, "first_simulation_s": time.perf_counter() - begin, "mb": peak_memory()})
    watch = Watch(limit, target, say)
    end = "ended by itself"
    try:
        with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):
            chosen.run(problem, simulation, seed, watch)
    except Done:
        end = "target" if watch.best <= watch.target else "limit"
    seconds = time.process_time() - watch.begin
    say({"end": end, "s": seconds, "evaluations": watch.evaluations, "mb": peak_memory()})


def main() -> None:
    """See the head of the file."""
    kind, *rest = sys.argv[1:]
    if kind == "fit":
        fit(rest[0], rest[1], int(rest[2]), float(rest[3]), float(rest[4]))
        return
    from tests.benchmarks.peers import speed

    say(speed.over_the_box(rest[0]) if kind == "box" else speed.measure(rest[0], rest[1]))


if __name__ == "__main__":
    main()
