"""What a Jacobian costs in simulations: `python -m tests.benchmarks.jacobian [--kind theta] [--effects A,B]`.

Of a motor's fit to the generated stand (free wheels as free runs, all else ahead), by differences and carried along
with the simulation, in one process one after the other: least processor time of several calls. A column's share is what
sixteen columns more cost, per column and internal step of the simulation ahead. Along the measured motion the same is
asked of the force balance.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from itertools import count
from unittest import mock

import numpy as np

from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.free_run import FreeRun
from linid.identification.objectives.objective import Directions
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.linearisation import Linearisation
from linid.identification.space.search_space import SearchParameter, SearchSpace
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.simulation.lanes import LANES
from linid.simulation.run import Simulator
from tests.benchmarks.__main__ import as_sine
from tests.identification.stand import FREE_WHEELS, stand
from tests.simulation.axis_with_effects import SAMPLES

DRIVEN = ("sine_position_1", "sine_position_2", "sine_current_1", "sine_current_2", "moves_1", "moves_2")


def problem_of(kind: str, effects: tuple[str, ...] = (), substeps: int = 2) -> tuple[Problem, np.ndarray]:
    """All parameters of motor, friction and effects free near the truth, and the point where they are true; of effects
    those that `SAMPLES` gives."""
    campaign = stand()
    truth = as_sine(campaign.truth) if kind == "sine" else dict(campaign.truth)
    for effect in effects:
        truth |= SAMPLES[effect]
    model = Model(kind, effects)
    preset = {name for effect in effects for name in find_effect(effect).preset}
    wheels = tuple(r for r in campaign.recordings if r.name in FREE_WHEELS)
    driven = tuple(r for r in campaign.recordings if r.name in DRIVEN)
    values = {p.name: truth.get(p.name, p.default) for p in model.parameters}
    searched = []
    for parameter in model.parameters:
        value = values[parameter.name]
        if parameter.name in preset or value == 0.0:
            continue
        if parameter.name == "static_force":
            value /= values["coulomb_force"]
        elif parameter.name == "bristle_damping":
            value /= 2.0 * np.sqrt(values["bristle_stiffness"] * values["mass"])
        near = (value / 1.2, value * 1.2) if value > 0.0 else (value - 0.1, value + 0.1)
        searched.append(SearchParameter(parameter.name, *near, log=value > 0.0))
    space = SearchSpace(model, tuple(searched), values)
    return Problem(space, (FreeRun(model, wheels, substeps, 1), Ahead(model, driven, substeps, 1))), space.encode(
        values
    )


def least(function: Callable[[], object], calls: int) -> float:
    """Least processor time in s of some calls, after one that compiles."""
    function()
    times = []
    for _ in range(calls):
        begin = time.process_time()
        function()
        times.append(time.process_time() - begin)
    return min(times)


def costs(kind: str, effects: tuple[str, ...] = (), calls: int = 7) -> dict[str, float]:
    """Columns, simulations per Jacobian by differences and carried along, and a column's ns per internal step."""
    problem, point = problem_of(kind, effects)
    x = np.concatenate([point, np.zeros(problem.nuisances)])
    line = Linearisation(problem, Cost(problem))
    line.reweight(x)
    one = least(lambda: line.batch(x[None]), calls)
    number = count(1)
    carried = least(lambda: line.tangent(x + 1e-12 * next(number)), calls)  # that of the last point is kept
    with mock.patch.object(Problem, "carries_slopes", False):
        differences = least(lambda: line.tangent(x), calls)
    ahead = problem.parts[1]
    assert isinstance(ahead, Ahead)
    vector = problem.space.vectors(point)[0]
    simulator, segments = ahead.simulator, ahead.segments
    starts = np.zeros((segments.count.size, 3))
    starts[:, 0], starts[:, 1] = ahead.motion.y[ahead.flat_first], ahead.motion.v[ahead.flat_first]
    steps = simulator.run(vector[None], segments, starts[None], guided=True)[2]

    def wide(blocks: int) -> float:
        directions = Directions(np.zeros((blocks * LANES, vector.size)), np.zeros((blocks * LANES, 0)))
        directions.params[:, 0] = vector[0]
        moved = np.zeros((segments.count.size, 3, blocks * LANES))
        return least(lambda: simulator.slopes(vector, directions.params, segments, starts, moved), calls)

    names = [parameter.name for parameter in problem.space.parameters]
    tangents = np.zeros((len(names), vector.size))
    for k, name in enumerate(names):
        tangents[k, ahead.model.slot(name)] = vector[ahead.model.slot(name)]
    alone = Simulator(simulator.model, simulator.inputs, simulator.substeps, simulator.jobs, specialised=True)
    windows = {
        name: least(lambda of=of: of.run(vector[None], segments, starts[None], guided=True), calls)  # type: ignore[misc]
        for name, of in (("side by side", simulator), ("one at a time", alone))
    }
    still_starts = np.zeros((segments.count.size, 3, len(names)))
    of_windows = least(lambda: simulator.slopes(vector, tangents, segments, starts, still_starts), calls)
    still = ahead.motion.y, ahead.motion.v, ahead.motion.standstill
    moved_too = np.vstack([vector, vector + 1e-4 * tangents])
    begins = np.full((len(moved_too), len(ahead.recordings)), np.nan)
    along = least(lambda: simulator.along(moved_too[:1], *still, begins[:1]), calls)
    column = (wide(3) - wide(1)) / (2 * LANES * steps)
    return {
        "columns": len(point) + 2.0,
        "simulations by differences": differences / one,
        "simulations carried along": carried / one,
        "windows alone, in simulations side by side": of_windows / windows["side by side"],
        "windows alone, in simulations one at a time": of_windows / windows["one at a time"],
        "ns per internal step": 1e9 * one / steps,
        "ns per internal step and column": 1e9 * column,
        "along, by differences": least(lambda: simulator.along(moved_too, *still, begins), calls) / along,
        "along, carried": least(lambda: simulator.slopes_along(vector, tangents, *still), calls) / along,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kind", choices=["sine", "theta"], default="theta", help="the motor [theta]")
    parser.add_argument("--effects", default="", help="beside it, of tests/simulation/axis_with_effects.py")
    given = parser.parse_args()
    for name, value in costs(given.kind, tuple(filter(None, given.effects.split(",")))).items():
        print(f"{name:40s} {value:8.2f}")


if __name__ == "__main__":
    main()
