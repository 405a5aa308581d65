"""The search from scratch: random candidates alone, no regression and no start values, in stages.

Every stage is the same: candidates drawn at random over a box, generations of the genetic algorithm, and of all that
were tried the best ones that lie apart. Friction is searched by the free wheels; the motor first by what its force
balance leaves at a pole pitch and a spacing of the windings, the rest of it being linear; the best candidates apart are
polished by least squares, many in few steps, the best in more.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
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
# Of the mean square of residuals: candidates in one valley differ by up to a twentieth, others by a third and more.
_ALIKE = 0.1
_TOGETHER = 4  # candidates of the friction that are polished before one is followed to a goal
_POLISHED = 19  # candidates in all, at the most usual


@dataclass(frozen=True)
class Scratch:
    """Where the search from scratch ended. point: (p,) search coordinates; cost: there, dimensionless; evaluations:
    candidates simulated; history: best cost after each polished candidate."""

    point: Array
    cost: float
    evaluations: int
    history: tuple[Generation, ...]


@dataclass(frozen=True)
class Goal:
    """Where a search may end before its time: it only looks whether what another one found is found again.

    total, wheels: cost of all data and of the free wheels alone at which it ends, dimensionless; candidates: that it
    may simulate, all stages together; a stage that has begun is ended.
    """

    total: float
    wheels: float
    candidates: int


_NO_GOAL = Goal(0.0, 0.0, 2**62)


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
    problem: Problem,
    recordings: Sequence[Recording],
    seed: int,
    progress: Progress | None = None,
    goal: Goal | None = None,
) -> Scratch:
    """Minimise a fit's coarse problem from random candidates alone.

    problem: over a box that no regression has drawn (`scratch_space`); recordings: those of the fit; seed: of all that
    is random here; goal: pole pitch after pole pitch is followed to its end until it is reached, None: all are, and
    the best is taken. Source of the generations: DEAP, as in `search`.
    """
    draws = random.Random(seed)
    seeds = [draws.randrange(2**32) for _ in range(32)]
    space, cost = problem.space, Cost(problem)
    aim = _NO_GOAL if goal is None else goal
    starts = _friction_starts(problem, cost, seeds[0], aim.wheels)
    driven = tuple(r for r in recordings if r.kind != "free_wheel")
    batches = iter([starts])
    if driven and MOTORS[space.model.kind].phases and "electrical_wavenumber" in space.names:
        batches = _motor_starts(problem, cost, driven, starts, seeds[1:])
    elif driven or not free_wheel_parts(problem):
        batches = iter([np.vstack([starts, explored(cost, starts.shape[1], _FRICTION, _APART, seeds[1])])])
    if goal is None:
        batches = iter([np.vstack(list(batches))])
    descent = _Descent(problem, cost, aim, progress)
    for batch in batches:
        descent.follow(batch)
        if descent.ended:
            break
    assert descent.best is not None
    # Whoever passes a goal may be on the way to a lower minimum. Weights follow the residuals, so that the last steps
    # may end a little higher.
    descent.kept(polished_to_the_end(problem, cost, descent.best.point))
    return Scratch(descent.best.point, descent.best.cost, cost.evaluations, tuple(descent.history))


class _Descent:
    """The polishing of candidates, and its best cost after each. total: cost function that counts them."""

    def __init__(self, problem: Problem, total: Cost, goal: Goal, progress: Progress | None) -> None:
        self.problem, self.total, self.goal, self.progress = problem, total, goal, progress
        self.history: list[Generation] = []
        self.best: LeastSquaresFit | None = None

    @property
    def ended(self) -> bool:
        """Whether the goal is reached or may be sought no longer."""
        reached = self.best is not None and self.best.cost <= self.goal.total
        return reached or self.total.evaluations >= self.goal.candidates

    def follow(self, starts: Array) -> None:
        """Polish candidates, starts (m, p): all in few steps, the best that move apart in more, until the goal."""
        few: list[LeastSquaresFit] = []
        for start in starts:
            few.append(self.polished(start, _FEW))
            if self.ended:
                return
        few.sort(key=lambda one: one.cost)
        self.total.evaluations += len(few)  # at most
        for one in moving_apart(self.problem, few, _RIVALS):
            self.polished(one.point, _MORE)
            if self.ended:
                return

    def polished(self, start: Array, ending: Ending) -> LeastSquaresFit:
        """The least squares from a candidate, start (p,)."""
        ending = replace(ending, cost=self.goal.total)
        return self.kept(levenberg_marquardt(self.problem, self.total, start, ending=ending, final=False))

    def kept(self, found: LeastSquaresFit) -> LeastSquaresFit:
        """What was found, written down."""
        if self.best is None or found.cost < self.best.cost:
            self.best = found
        number = len(self.history) + 1
        self.history.append(Generation(SCRATCH, number, self.total.evaluations, self.best.cost, found.cost))
        if self.progress is not None:
            self.progress("search from scratch", number, max(_POLISHED, number), self.best.cost)
        return found


def moving_apart(problem: Problem, few: Sequence[LeastSquaresFit], count: int) -> list[LeastSquaresFit]:
    """The first `count` of some fits, best first, of which no two move alike.

    Shapes of a field that push alike lie far apart in their parameters, and would all be polished to one minimum.
    """
    chosen: list[tuple[LeastSquaresFit, list[Array]]] = []
    for fit in few:
        rows = [row[0] for row in problem.residuals(fit.point[None, :], fit.offsets[None, :])]
        if not any(_alike(rows, others) for _, others in chosen):
            chosen.append((fit, rows))
        if len(chosen) == count:
            break
    return [fit for fit, _ in chosen]


def _alike(rows: Sequence[Array], others: Sequence[Array]) -> bool:
    """Whether two fits' residuals (N,) of each part differ by far less than either of them."""
    with np.errstate(invalid="ignore", over="ignore"):
        return all(
            np.mean((a - b) ** 2) <= _ALIKE * min(np.mean(a**2), np.mean(b**2))
            for a, b in zip(rows, others, strict=True)
        )


def polished_to_the_end(problem: Problem, cost: Cost, point: Array) -> LeastSquaresFit:
    """The nearest minimum, point (p,) to begin with."""
    return levenberg_marquardt(problem, cost, point, ending=_LAST, final=False)


def _friction_starts(problem: Problem, total: Cost, seed: int, goal: float) -> Array:
    """A candidate (1, p) whose friction and mass the free wheels prefer; all else in the middle of the box. total: what
    it takes is counted there; goal: cost that is enough."""
    space, free = problem.space, free_wheel_parts(problem)
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
    best = _polished_wheels(held, cost, rows, goal)
    total.evaluations += of_wheels.evaluations + cost.evaluations
    starts = middle.copy()
    starts[:, columns] = best.point
    return starts


def _polished_wheels(held: Problem, cost: Cost, rows: Array, goal: float) -> LeastSquaresFit:
    """The best of candidates, rows (m, p), polished by the free wheels: many in few steps, the best in more.

    goal: cost that is enough, for which a few candidates after the others are followed to their end; 0: all at once.
    """

    def polished(start: Array, ending: Ending) -> LeastSquaresFit:
        return levenberg_marquardt(held, cost, start, ending=replace(ending, cost=goal), final=False)

    size, rivals = (_TOGETHER, 1) if goal else (len(rows), _FRICTION_RIVALS)
    found: list[LeastSquaresFit] = []
    for first in range(0, len(rows), size):
        few = sorted((polished(row, _FEW) for row in rows[first : first + size]), key=lambda one: one.cost)
        found += [polished(one.point, _MORE) for one in few[:rivals]]
        if found[-1].cost <= goal:
            break
    return min(found, key=lambda one: one.cost)


def free_wheel_parts(problem: Problem) -> tuple[FreeRun, ...]:
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
) -> Iterator[Array]:
    """Candidates (m, p) of a motor at each pole pitch and spacing, by what the force balance leaves, best first, with
    the shapes of its field that suit."""
    space = problem.space
    balance = ForceBalance(driven, space)
    reach = 3.0 / max(balance.stroke, 1e-9)
    pitches = explored(balance.cost, 2, _PITCH, np.array([balance.share(reach), _SPACING_APART]), seeds[0])
    values = space.values(starts[0])
    motor = MOTORS[space.model.kind]
    own = {p.name for p in motor.parameters}
    friction = {name: values[name] for name in space.names if name not in own}
    told = bool(free_wheel_parts(problem))
    for number, pitch in enumerate(pitches):
        found = motor.of_first_harmonic(decoded(balance, pitch, values["mass"]), space.fixed)
        base = space.encode({**found, **friction} if told else {**friction, **found})
        shaped = [k for k, name in enumerate(space.names) if name in dict(MOTORS[space.model.kind].shape)]
        if not shaped:
            yield base[None, :]
            continue

        def of_shape(population: Array, base: Array = base, shaped: list[int] = shaped) -> Array:
            whole = np.repeat(base[None, :], population.shape[0], axis=0)
            whole[:, shaped] = population
            return cost(whole)

        budget = _SHAPE if number < _THOROUGH else _SHAPE_ELSEWHERE
        shapes = explored(of_shape, len(shaped), budget, _SHAPE_APART, seeds[1 + number])
        rows = np.repeat(base[None, :], shapes.shape[0], axis=0)
        rows[:, shaped] = shapes
        yield rows
