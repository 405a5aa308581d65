"""Every peer's fit of a problem, set up as its own documentation advises, all in the unit cube of linid's search
coordinates."""

from __future__ import annotations

import random
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linid.identification.guess.first_values import seed_candidates
from linid.identification.objectives.problem import Cost
from linid.identification.objectives.problem import Problem as FitProblem
from linid.identification.optimise.genetic import search
from linid.identification.optimise.least_squares import levenberg_marquardt
from linid.identification.optimise.stages import ALIKE, APART, refine_first_candidates
from linid.identification.settings import FitSettings, SearchSettings
from linid.identification.signals.motion import Motion, measure_motion
from tests.benchmarks.peers import gradients
from tests.benchmarks.peers.problems import LOST, Problem, linid_simulation
from tests.benchmarks.peers.simulators import SIMULATORS
from tests.benchmarks.peers.watch import Watch, noted_errors

Array = NDArray[np.float64]
# Relative step of finite differences where the peer lets one choose: the square root of what LSODA resolves.
STEP = 1e-4


@dataclass(frozen=True)
class Fit:
    """run(problem, simulation, seed, watch): the fit; simulator: on which; packages: what it needs besides;
    repeats: whether the seed matters; limits: kind of problem -> why it is left out."""

    name: str
    run: Callable[[Problem, Any, int, Watch], None]
    simulator: str
    packages: tuple[str, ...] = ()
    repeats: bool = True
    limits: tuple[tuple[str, str], ...] = ()

    @property
    def needs(self) -> tuple[str, ...]:
        """All packages."""
        return tuple(dict.fromkeys((*self.packages, *SIMULATORS[self.simulator].packages)))

    def refuses(self, kind: str) -> str:
        """Why it cannot take a problem, or nothing."""
        return {**dict(SIMULATORS[self.simulator].limits), **dict(self.limits)}.get(kind, "")


@dataclass
class PositionError:
    """The common cost as an objective of linid: one class of residuals, start states as given."""

    problem: Problem
    watch: Watch
    substeps: int
    name: str = "position_error"
    nuisances: int = 0
    robust: bool = False
    floor: float = 0.0

    def __post_init__(self) -> None:
        self.recordings = self.problem.recordings
        self.simulate = linid_simulation(self.problem, self.substeps)
        self.measured = self.problem.measured
        counts = np.array([r.t.size for r in self.recordings])
        self.classes = np.zeros(self.measured.size, dtype=np.int64)
        self.groups = np.repeat(np.arange(counts.size, dtype=np.int64), counts)
        self.group_recording = np.arange(counts.size, dtype=np.int64)
        self.signal = self.measured - np.mean(self.measured)
        self.xs: Array = np.zeros((0, self.problem.dimension))

    @property
    def motion(self) -> Motion:
        """The measured motion (unused by the search)."""
        return measure_motion(self.recordings)

    def residuals(self, params: Array, offsets: Array) -> Array:
        """(C, N) position errors in m, each row noted."""
        errors = self.simulate(params) - self.measured
        errors = np.nan_to_num(np.clip(errors, -LOST, LOST), nan=LOST, posinf=LOST, neginf=LOST)
        model, space = self.problem.space.model, self.problem.space
        values = [{p.name: float(row[model.slot(p.name)]) for p in model.parameters} for row in params]
        self.watch.many(np.array([space.encode(v) for v in values]), np.sqrt(np.mean(errors**2, axis=1)))
        return errors


def _linid(problem: Problem, seed: int, watch: Watch, starts: Array, others: Array) -> None:
    coarse = FitProblem(problem.space, (PositionError(problem, watch, 1),))
    fine = FitProblem(problem.space, (PositionError(problem, watch, problem.substeps),))
    cost = Cost(coarse)
    refined = refine_first_candidates(coarse, cost, starts) if starts.size else []
    others = np.vstack([*(found.point for found in refined), starts, others])
    alike = [found for found in refined if found.cost <= ALIKE * min(one.cost for one in refined)]
    state, _ = search(cost, others, problem.dimension, SearchSettings(seed=seed), starts=alike)
    last = Cost(fine)
    rivals = [found.point for found in alike if np.max(np.abs(found.point - state.best)) > APART]
    for rival in (np.array(state.best), *rivals):
        levenberg_marquardt(fine, last, rival, final=False)


def linid(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """linid's own way: first guesses refined and genetic search of whole populations at a coarse step, then a
    least-squares fit at the usual one."""
    candidates = seed_candidates(
        problem.space, problem.space.model, problem.sources, problem.first, problem.densities, FitSettings()
    )
    _linid(problem, seed, watch, *candidates)


def linid_blind(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """linid without its first guess: what search, least squares and speed do alone."""
    _linid(problem, seed, watch, *np.zeros((2, 0, problem.dimension)))


def _cost(problem: Problem, simulation: Any, watch: Watch) -> Callable[[Any], float]:
    def cost(x: Any) -> float:
        x = np.asarray(x, dtype=float)
        value = problem.cost(simulation, x)
        watch.look(x, value)
        return value

    return cost


def deap_ga(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """A plain genetic algorithm on DEAP's toolbox, one solve_ivp per candidate and recording, as in the paper."""
    from deap import algorithms, base, creator, tools

    random.seed(seed)
    if not hasattr(creator, "PeerFitness"):
        creator.create("PeerFitness", base.Fitness, weights=(-1.0,))
        creator.create("PeerIndividual", list, fitness=creator.PeerFitness)
    cost = _cost(problem, simulation, watch)
    box = base.Toolbox()
    box.register("coordinate", random.random)
    box.register("individual", tools.initRepeat, creator.PeerIndividual, box.coordinate, problem.dimension)
    box.register("population", tools.initRepeat, list, box.individual)
    box.register("evaluate", lambda individual: (cost(individual),))
    box.register("mate", tools.cxSimulatedBinaryBounded, eta=20.0, low=0.0, up=1.0)
    box.register("mutate", tools.mutPolynomialBounded, eta=20.0, low=0.0, up=1.0, indpb=1.0 / problem.dimension)
    box.register("select", tools.selTournament, tournsize=3)
    algorithms.eaSimple(box.population(n=100), box, cxpb=0.9, mutpb=0.5, ngen=10**6, verbose=False)


def scipy_evolution(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """differential_evolution with its defaults, L-BFGS-B least squares included."""
    from scipy.optimize import differential_evolution

    bounds = [(0.0, 1.0)] * problem.dimension
    differential_evolution(_cost(problem, simulation, watch), bounds, rng=seed, maxiter=10**6)


def _least_squares(problem: Problem, simulation: Any, watch: Watch, start: Array) -> None:
    from scipy.optimize import least_squares

    inside = np.clip(start, 1e-6, 1.0 - 1e-6)
    errors = noted_errors(problem, simulation, watch)
    least_squares(errors, inside, bounds=(0.0, 1.0), x_scale="jac", diff_step=STEP)


def scipy_multistart(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """least_squares from uniformly random starts, one after the other."""
    generator = np.random.default_rng(seed)
    while True:
        _least_squares(problem, simulation, watch, generator.random(problem.dimension))


def scipy_from_guess(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """least_squares from linid's first guess, whose making is part of the time."""
    candidates = seed_candidates(
        problem.space, problem.space.model, problem.sources, problem.first, problem.densities, FitSettings()
    )
    for start in np.vstack(candidates):
        _least_squares(problem, simulation, watch, start)


def pints_cmaes(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """PINTS: CMA-ES on the bounded error measure from a random start; again when it stops."""
    import pints

    class Error(pints.ErrorMeasure):  # type: ignore[misc]
        """The common cost."""

        def n_parameters(self) -> int:
            return problem.dimension

        def __call__(self, x: Any) -> float:
            return cost(x)

    cost = _cost(problem, simulation, watch)
    np.random.seed(seed)
    boundaries = pints.RectangularBoundaries([0.0] * problem.dimension, [1.0] * problem.dimension)
    while True:
        start = boundaries.sample()[0]
        controller = pints.OptimisationController(Error(), start, boundaries=boundaries, method=pints.CMAES)
        controller.set_log_to_screen(False)
        controller.run()


def lmfit_leastsq(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """lmfit's default method (leastsq, bounds by its transformation) from random starts."""
    import lmfit

    errors = noted_errors(problem, simulation, watch)
    generator = np.random.default_rng(seed)
    names = problem.space.names
    while True:
        parameters = lmfit.Parameters()
        for name, value in zip(names, generator.random(problem.dimension), strict=True):
            parameters.add(name, value=value, min=0.0, max=1.0)
        lmfit.minimize(lambda p: errors([p[n].value for n in names]), parameters, epsfcn=STEP**2)


def cma_bipop(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """pycma: fmin2 in the unit box, a quarter of its width as first step, BIPOP restarts."""
    import cma

    generator = np.random.default_rng(seed)
    options = {"bounds": [0.0, 1.0], "seed": seed + 1, "verbose": -9}
    cma.fmin2(
        _cost(problem, simulation, watch),
        lambda: generator.random(problem.dimension),
        0.25,
        options,
        restarts=9,
        bipop=True,
    )


def pypesto_multistart(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """pyPESTO: its multistart of L-BFGS-B (its default optimizer), gradients by its finite differences."""
    import logging

    import pypesto
    from pypesto.optimize import OptimizeOptions

    logging.getLogger("pypesto").setLevel(logging.CRITICAL)
    np.random.seed(seed)
    objective = pypesto.FD(pypesto.Objective(fun=_cost(problem, simulation, watch)), grad=True, delta_fun=STEP)
    task = pypesto.Problem(objective, lb=np.zeros(problem.dimension), ub=np.ones(problem.dimension))
    pypesto.optimize.minimize(
        task,
        pypesto.optimize.ScipyOptimizer(),
        n_starts=1000,
        progress_bar=False,
        options=OptimizeOptions(allow_failed_starts=False),
    )


def mujoco_sysid(problem: Problem, simulation: Any, seed: int, watch: Watch) -> None:
    """MuJoCo's sysid: its box-constrained Gauss-Newton from random starts."""
    from mujoco import sysid

    generator = np.random.default_rng(seed)
    errors = noted_errors(problem, simulation, watch)

    def residual(x: Any, parameters: Any) -> tuple[list[Array], None, None]:
        """In mm; x: (p,), or one candidate per column when sysid takes differences."""
        x = np.asarray(x)
        columns = [errors(column) / 1e-3 for column in x.reshape(problem.dimension, -1).T]
        return [columns[0] if x.ndim == 1 else np.stack(columns, axis=1)], None, None

    while True:
        parameters = sysid.ParameterDict()
        for name, value in zip(problem.space.names, generator.random(problem.dimension), strict=True):
            parameters.add(sysid.Parameter(name, value, 0.0, 1.0))
        try:
            parameters.move_off_bounds()
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                sysid.optimize(parameters, residual, "mujoco", verbose=False, eps=STEP)
        except (np.linalg.LinAlgError, ValueError):
            continue  # a start from which it cannot go on


_SLOW_FIELD = "left out: the sine motor tells as much, and compiling takes minutes"
FITS = {
    f.name: f
    for f in (
        Fit("linid", linid, "linid"),
        Fit("linid without its first guess", linid_blind, "linid"),
        Fit("DEAP GA, solve_ivp", deap_ga, "scipy LSODA", ("deap",)),
        Fit("scipy differential_evolution, solve_ivp", scipy_evolution, "scipy LSODA"),
        Fit("scipy least_squares multistart, solve_ivp", scipy_multistart, "scipy LSODA"),
        Fit("scipy least_squares from linid's guess, solve_ivp", scipy_from_guess, "scipy LSODA", repeats=False),
        Fit("PINTS CMA-ES, solve_ivp", pints_cmaes, "scipy LSODA", ("pints",)),
        Fit("lmfit leastsq multistart, solve_ivp", lmfit_leastsq, "scipy LSODA", ("lmfit",)),
        Fit("pycma BIPOP, solve_ivp", cma_bipop, "scipy LSODA", ("cma",)),
        Fit("pyPESTO multistart, solve_ivp", pypesto_multistart, "scipy LSODA", ("pypesto",)),
        Fit("pycma BIPOP, numbalsoda", cma_bipop, "numbalsoda LSODA", ("cma",)),
        Fit("scipy least_squares multistart, numbalsoda", scipy_multistart, "numbalsoda LSODA"),
        Fit(
            "diffrax, exact derivatives, least_squares multistart",
            gradients.diffrax_least_squares,
            "diffrax Kvaerno5",
            limits=(("theta", _SLOW_FIELD),),
        ),
        Fit("CasADi, CVODES sensitivities, least_squares multistart", gradients.casadi_least_squares, "CasADi CVODES"),
        Fit("AMICI, forward sensitivities, least_squares multistart", gradients.amici_least_squares, "AMICI"),
        Fit("heyoka, variational equations, least_squares multistart", gradients.heyoka_least_squares, "heyoka Taylor"),
        Fit("CasADi, multiple shooting, IPOPT multistart", gradients.ipopt_multistart, "linid", ("casadi",)),
        Fit("MuJoCo sysid multistart", mujoco_sysid, "MuJoCo RK4", ("mujoco", "absl-py", "imageio", "tabulate")),
    )
}
