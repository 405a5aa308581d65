"""The search from scratch: random candidates alone, no regression and no start values, in stages.

Every stage is the same: candidates drawn at random over a box, generations of the genetic algorithm, and of all that
were tried the best ones that lie apart. Friction is searched by the free wheels; the motor first by what its force
balance leaves at a pole pitch and a spacing of the windings, the rest of it being linear; the best candidates apart are
polished by least squares, many in few steps, the best in more.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.free_run import FreeRun
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.force_balance import ForceBalance, decoded
from linid.identification.optimise.genetic import search
from linid.identification.optimise.least_squares import LeastSquaresFit, levenberg_marquardt
from linid.identification.result import Generation
from linid.identification.settings import SCRATCH, Ending, Progress, SearchSettings
from linid.identification.space.search_space import SearchSpace
from linid.physics.motors.registry import MOTORS
from linid.recording.recording import Recording

# Candidates and generations of each stage, and how many of the best apart are kept: with half as many friction ends
# elsewhere in 6 of 20 seeds on the free wheels of the paper's table 3.
_FRICTION = (256, 8, 16)
_PITCH = (1024, 6, 8)
_SHAPE, _SHAPE_ELSEWHERE = (48, 3, 4), (16, 1, 1)
_FEW, _MORE, _LAST = Ending(8, 1.0, 1.0), Ending(60, 0.1, 0.01), Ending(100, 1e-3)
_APART = 0.05  # in some search coordinate
_THOROUGH = 2  # pole pitches whose field shapes are looked at closely
_SHAPE_APART = 0.1
_SPACING_APART = 0.04  # of a turn, between the windings
_FRICTION_RIVALS, _RIVALS = 8, 4  # of the polished candidates, that are polished further


@dataclass(frozen=True)
class Scratch:
    """Where the search from scratch ended. point: (p,) search coordinates; cost: there, dimensionless; evaluations:
    candidates simulated; history: best cost after each polished candidate."""

    point: Array
    cost: float
    evaluations: int
    history: tuple[Generation, ...]


class Archive:
    """A cost function that remembers all that it was asked for."""

    def __init__(self, cost: Callable[[Array], Array]) -> None:
        self.cost = cost
        self.points: list[Array] = []
        self.costs: list[Array] = []

    def __call__(self, population: Array) -> Array:
        """Costs (C,) of candidates (C, p)."""
        values = self.cost(population)
        self.points.append(np.atleast_2d(population))
        self.costs.append(values)
        return values

    def apart(self, count: int, distance: float | Array) -> Array:
        """The best candidates (m, p), m at most `count`, of which no two are nearer in every coordinate. distance: that
        keeps two apart, one or (p,), in search coordinates."""
        points, costs = np.concatenate(self.points), np.concatenate(self.costs)
        chosen: list[Array] = []
        for index in np.argsort(costs, kind="stable"):
            if all(np.any(np.abs(points[index] - other) > distance) for other in chosen):
                chosen.append(points[index])
            if len(chosen) == count:
                break
        return np.array(chosen)


def explored(
    cost: Callable[[Array], Array], dimension: int, budget: tuple[int, int, int], distance: float | Array, seed: int
) -> Array:
    """The best candidates apart (m, p) after random ones and some generations. cost: candidates (C, p) -> (C,);
    dimension: p; budget: candidates per generation, generations, how many are kept; distance: that keeps two apart, one
    or (p,), in search coordinates."""
    population, generations, kept = budget
    archive = Archive(cost)
    settings = SearchSettings(population=population, generations=generations, patience=generations, seed=seed)
    search(archive, np.empty((0, dimension)), dimension, settings)
    return archive.apart(kept, distance)


def search_from_scratch(
    problem: Problem, recordings: Sequence[Recording], seed: int, progress: Progress | None = None
) -> Scratch:
    """Minimise a fit's coarse problem from random candidates alone.

    problem: over a box that no regression has drawn (`scratch_space`); recordings: those of the fit; seed: of all that
    is random here. Source of the generations: DEAP, as in `search`.
    """
    draws = random.Random(seed)
    seeds = [draws.randrange(2**32) for _ in range(32)]
    space, cost = problem.space, Cost(problem)
    starts = _friction_starts(problem, cost, seeds[0])
    driven = tuple(r for r in recordings if r.kind != "free_wheel")
    if driven and MOTORS[space.model.kind].phases and "electrical_wavenumber" in space.names:
        starts = _motor_starts(problem, cost, driven, starts, seeds[1:])
    elif driven or not _wheels(problem):
        starts = np.vstack([starts, explored(cost, starts.shape[1], _FRICTION, _APART, seeds[1])])
    history: list[Generation] = []
    total = len(starts) + min(_RIVALS, len(starts)) + 1

    def kept(found: LeastSquaresFit) -> LeastSquaresFit:
        best = min([found.cost, *(line.best for line in history)])
        history.append(Generation(SCRATCH, len(history) + 1, cost.evaluations, best, found.cost))
        if progress is not None:
            progress("search from scratch", len(history), total, best)
        return found

    def polished(start: Array, ending: Ending) -> LeastSquaresFit:
        return kept(levenberg_marquardt(problem, cost, start, ending=ending, final=False))

    few = sorted((polished(start, _FEW) for start in starts), key=lambda one: one.cost)
    more = min((polished(one.point, _MORE) for one in few[:_RIVALS]), key=lambda one: one.cost)
    # Weights follow the residuals, so the last steps may end a little higher.
    last = min(more, kept(polished_to_the_end(problem, cost, more.point)), key=lambda one: one.cost)
    return Scratch(last.point, last.cost, cost.evaluations, tuple(history))


def polished_to_the_end(problem: Problem, cost: Cost, point: Array) -> LeastSquaresFit:
    """The nearest minimum, point (p,) to begin with."""
    return levenberg_marquardt(problem, cost, point, ending=_LAST, final=False)


def _friction_starts(problem: Problem, total: Cost, seed: int) -> Array:
    """A candidate (1, p) whose friction and mass the free wheels prefer; all else in the middle of the box. total: what
    it takes is counted there."""
    space, free = problem.space, _wheels(problem)
    motor = {p.name for p in MOTORS[space.model.kind].parameters}
    columns = [k for k, name in enumerate(space.names) if name not in motor]
    middle = np.full((1, len(space.names)), 0.5)
    if not free or not columns:
        return middle
    part = Problem(space, free)
    of_wheels = Cost(part)

    def of_friction(population: Array) -> Array:
        whole = np.repeat(middle, population.shape[0], axis=0)
        whole[:, columns] = population
        return of_wheels(whole)

    rows = explored(of_friction, len(columns), _FRICTION, _APART, seed)
    held = replace(part, space=_held(space, motor, middle[0]))
    cost = Cost(held)
    few = sorted(
        (levenberg_marquardt(held, cost, row, ending=_FEW, final=False) for row in rows), key=lambda one: one.cost
    )
    more = [levenberg_marquardt(held, cost, one.point, ending=_MORE, final=False) for one in few[:_FRICTION_RIVALS]]
    total.evaluations += of_wheels.evaluations + cost.evaluations
    starts = middle.copy()
    starts[:, columns] = min(more, key=lambda one: one.cost).point
    return starts


def _wheels(problem: Problem) -> tuple[FreeRun, ...]:
    """The objectives of free wheels alone."""
    return tuple(
        part
        for part in problem.parts
        if isinstance(part, FreeRun) and all(r.kind == "free_wheel" for r in part.recordings)
    )


def _held(space: SearchSpace, names: set[str], point: Array) -> SearchSpace:
    """The space with some parameters held at a point's values (p,)."""
    values = space.values(point)
    return space.holding({name: values[name] for name in space.names if name in names})


def _motor_starts(
    problem: Problem, cost: Cost, driven: Sequence[Recording], starts: Array, seeds: Sequence[int]
) -> Array:
    """Candidates (m, p) of a motor: pole pitch and spacing by what the force balance leaves, then its field's shape."""
    space = problem.space
    balance = ForceBalance(driven, space)
    reach = 3.0 / max(balance.stroke, 1e-9)
    pitches = explored(balance.cost, 2, _PITCH, np.array([balance.share(reach), _SPACING_APART]), seeds[0])
    values = space.values(starts[0])
    motor = MOTORS[space.model.kind]
    own = {p.name for p in motor.parameters}
    friction = {name: values[name] for name in space.names if name not in own}
    told = bool(_wheels(problem))
    rows = []
    for number, pitch in enumerate(pitches):
        found = motor.of_first_harmonic(decoded(balance, pitch, values["mass"]), space.fixed)
        base = space.encode({**found, **friction} if told else {**friction, **found})
        shaped = [k for k, name in enumerate(space.names) if name in dict(MOTORS[space.model.kind].shape)]
        if not shaped:
            rows.append(base)
            continue

        def of_shape(population: Array, base: Array = base, shaped: list[int] = shaped) -> Array:
            whole = np.repeat(base[None, :], population.shape[0], axis=0)
            whole[:, shaped] = population
            return cost(whole)

        budget = _SHAPE if number < _THOROUGH else _SHAPE_ELSEWHERE
        for shape in explored(of_shape, len(shaped), budget, _SHAPE_APART, seeds[1 + number]):
            row = base.copy()
            row[shaped] = shape
            rows.append(row)
    return np.array(rows)
