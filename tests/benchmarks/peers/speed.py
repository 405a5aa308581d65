"""Time per simulation at equal accuracy, and over a whole population: every setting of every simulator."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linid.identification.signals.motion import measure_motion
from linid.simulation.reference import simulate_reference
from tests.benchmarks.__main__ import as_sine
from tests.benchmarks.peers.problems import Problem, make_problem, rms, truth
from tests.benchmarks.peers.simulators import SIMULATORS, Simulator, missing

Array = NDArray[np.float64]

CASES = {"free wheel": ("friction", "freewheel_2"), "driven": ("sine", "moves_1")}
POPULATION = 16
DRAWS = 24  # random candidates of the search box
USABLE = 1e-6  # m, RMS error up to which a random candidate counts as simulated
_ENOUGH = 0.3  # s of repeats per setting


def speed_problem(case: str) -> tuple[Problem, dict[str, float]]:
    """One whole recording as a problem, and the stand's true values (driven: the sine motor of equal thrust)."""
    kind, name = CASES[case]
    problem = make_problem(kind)
    recording = next(r for r in problem.sources if r.name == name)
    motion = measure_motion([recording])
    # The driven recording begins at rest: what the bristle holds there is nobody's business here.
    state = np.array([[motion.y[0], motion.v[0], math.nan] if kind == "friction" else [motion.y[0], 0.0, 0.0]])
    values = as_sine(truth()) if kind == "sine" else truth()
    return replace(problem, sources=(recording,), recordings=(recording,), states=state), values


def tight(problem: Problem, values: dict[str, float]) -> Array:
    """Positions (N,) in m by scipy's LSODA with tolerances far below all others."""
    rows = [
        simulate_reference(problem.space.model.kind, values, r, tuple(s), rtol=1e-11, max_step=1e-3)[0]
        for r, s in zip(problem.recordings, problem.starts(values), strict=True)
    ]
    return np.concatenate(rows)


def seconds(call: Callable[[], Any]) -> float:
    """Least processor time in s of several calls of what has been compiled."""
    times: list[float] = []
    while not times or (sum(times) < _ENOUGH and len(times) < 200):
        begin = time.process_time()
        call()
        times.append(time.process_time() - begin)
    return min(times)


def measure(case: str, name: str) -> dict[str, Any]:
    """All settings of one simulator on one case: rows of setting, error in m and s; or why it cannot."""
    simulator = SIMULATORS[name]
    problem, values = speed_problem(case)
    reason = missing(simulator.packages) or dict(simulator.limits).get(problem.space.model.kind, "")
    if reason:
        return {"reason": reason}
    exact = tight(problem, values)
    rows = []
    for setting in simulator.settings:
        simulate = simulator.make(problem, setting)
        error = rms(simulate(values) - exact)
        rows.append({"setting": setting, "error": error, "s": seconds(lambda f=simulate: f(values))})
        if rows[-1]["s"] > 60.0:
            break
    usual = problem.substeps if simulator.usual is None else simulator.usual
    return {"rows": rows, "population": _population(simulator, problem, values, usual), "usual": usual}


def _population(simulator: Simulator, problem: Problem, values: dict[str, float], usual: Any) -> float | None:
    """s per simulation when POPULATION candidates are simulated by one call."""
    if simulator.parallel is None:
        return None
    many = simulator.parallel(problem, usual)
    candidates = [
        {**values, "viscous_friction": values["viscous_friction"] * (1.0 + 0.01 * k)} for k in range(POPULATION)
    ]
    many(candidates)
    return seconds(lambda: many(candidates)) / POPULATION


def over_the_box(name: str) -> dict[str, Any]:
    """Random candidates of the friction problem's search box: share simulated to USABLE, mean s of one simulation."""
    simulator = SIMULATORS[name]
    reason = missing(simulator.packages)
    if reason:
        return {"reason": reason}
    problem, _ = speed_problem("free wheel")
    usual = problem.substeps if simulator.usual is None else simulator.usual
    simulate = simulator.make(problem, usual)
    fine = SIMULATORS["linid"].make(problem, 256)
    generator = np.random.default_rng(1)
    spent, usable = 0.0, 0
    simulate(problem.values(np.full(problem.dimension, 0.5)))
    for _ in range(DRAWS):
        values = problem.values(generator.random(problem.dimension))
        begin = time.process_time()
        found = simulate(values)
        spent += time.process_time() - begin
        error = rms(found - fine(values))
        usable += bool(error < USABLE)
    return {"s": spent / DRAWS, "usable": usable / DRAWS, "usual": usual}


def at_error(rows: list[dict[str, Any]], error: float) -> dict[str, Any] | None:
    """The fastest setting whose error is not above `error`."""
    good = [row for row in rows if row["error"] <= error]
    return min(good, key=lambda row: row["s"]) if good else None
