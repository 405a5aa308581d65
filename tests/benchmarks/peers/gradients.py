"""Peers whose derivatives are exact: least squares from random starts, and multiple shooting."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.peers.problems import Problem, linid_simulation
from tests.benchmarks.peers.simulators import SIMULATORS
from tests.benchmarks.peers.watch import Done, Watch, noted_errors

Array = NDArray[np.float64]


def _exact_multistart(
    problem: Problem, simulation: Any, seed: int, watch: Watch, slope: Callable[[Array], Array]
) -> None:
    """scipy's least_squares from random starts, with a peer's exact derivatives."""
    from scipy.optimize import least_squares

    generator = np.random.default_rng(seed)
    errors = noted_errors(problem, simulation, watch)
    slope(problem.space.encode(problem.first))
    watch.begin = time.process_time()  # compiled by now, as the others are
    while True:
        start = np.clip(generator.random(problem.dimension), 1e-6, 1.0 - 1e-6)
        least_squares(errors, start, jac=slope, bounds=(0.0, 1.0), x_scale="jac")


def diffrax_least_squares(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """Least squares on diffrax, with its forward differentiation of the solver."""
    from tests.benchmarks.peers.with_jax import derivatives

    slope = derivatives(problem, SIMULATORS["diffrax Kvaerno5"].usual)
    _exact_multistart(problem, simulation, seed, watch, slope)


def casadi_least_squares(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """Least squares on CVODES with its forward sensitivities, as PEtab's AMICI does too."""
    from tests.benchmarks.peers.with_casadi import Sensitivities

    slope = Sensitivities(problem, SIMULATORS["CasADi CVODES"].usual).jacobian
    _exact_multistart(problem, simulation, seed, watch, slope)


def amici_least_squares(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """Least squares on AMICI, the simulator of PEtab problems, with its forward sensitivities."""
    from tests.benchmarks.peers.with_amici import Amici

    _exact_multistart(problem, simulation, seed, watch, Amici(problem, SIMULATORS["AMICI"].usual).jacobian)


def heyoka_least_squares(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """Least squares on heyoka, with its variational equations."""
    from tests.benchmarks.peers.with_heyoka import Taylor

    slope = Taylor(problem, SIMULATORS["heyoka Taylor"].usual).jacobian
    _exact_multistart(problem, simulation, seed, watch, slope)


def ipopt_multistart(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """IPOPT on multiple shooting from random parameters, the states at the nodes those of the measured motion.

    Its iterates are no simulations: what each is worth is asked of linid's, which takes a hundredth of an iteration.
    """
    from tests.benchmarks.peers.with_ipopt import Shooting, watched_by

    simulate, model = linid_simulation(problem), problem.space.model
    ended: list[Done] = []

    def look(x: Array) -> bool:
        x = np.clip(x, 0.0, 1.0)
        cost = problem.cost(lambda values: simulate(model.vector(values)[None, :])[0], x)
        try:
            watch.look(x, cost)
        except Done as done:
            ended.append(done)
        return bool(ended)

    shooting = Shooting(problem, watched_by(look, problem.dimension), fast=shutil.which("gcc") is not None)
    generator = np.random.default_rng(seed)
    watch.begin = time.process_time()  # compiled by now, as the others are
    while not ended:
        shooting.solve(np.clip(generator.random(problem.dimension), 1e-6, 1.0 - 1e-6))
    raise ended[0]
