"""The global search: a genetic algorithm on DEAP's operators, or DEAP's CMA-ES; both stop for stated reasons.

Every generation can be saved and resumed to the last bit.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from linid.arrays import Array
from linid.errors import ConfigError
from linid.identification.optimise.least_squares import LeastSquaresFit
from linid.identification.optimise.operators import crossover, drawing_from, mutation, selection
from linid.identification.optimise.search_state import SearchState
from linid.identification.settings import PLAIN, SearchSettings

CostFunction = Callable[[Array], Array]
Watcher = Callable[["SearchState"], None]


class _Fitness:
    """What DEAP's selection and elitism need of an individual: a comparable value, smaller is better; values: (1,) what
    a roulette weighs, larger is better."""

    def __init__(self, cost: float) -> None:
        self.cost = cost
        self.values = (1.0 / max(cost, 1e-300),)

    def __gt__(self, other: _Fitness) -> bool:
        return self.cost < other.cost

    def __lt__(self, other: _Fitness) -> bool:
        return self.cost > other.cost


class _Individual(list):  # type: ignore[type-arg]
    """Search coordinates with their fitness."""

    def __init__(self, point: list[float], cost: float = np.inf) -> None:
        super().__init__(point)
        self.fitness = _Fitness(cost)


def _clip(point: list[float]) -> list[float]:
    return [min(max(float(coordinate), 0.0), 1.0) for coordinate in point]


def _latin_hypercube(size: int, dimension: int, generator: random.Random) -> list[list[float]]:
    columns = []
    for _ in range(dimension):
        cells = [(k + generator.random()) / size for k in range(size)]
        generator.shuffle(cells)
        columns.append(cells)
    return [list(row) for row in zip(*columns, strict=True)]


def initial_population(seeds: Array, size: int, dimension: int, seed: int) -> Array:
    """Seeds (S, p) as they are, half the rest scattered around them, the other half a Latin hypercube."""
    generator = random.Random(seed)
    rows = [_clip(list(row)) for row in np.atleast_2d(seeds)][:size] if seeds.size else []
    near = (size - len(rows)) // 2 if rows else 0
    count = len(rows)
    for k in range(near):
        spread = 0.02 * 4.0 ** (k % 3)
        rows.append(_clip([coordinate + generator.gauss(0.0, spread) for coordinate in rows[k % count]]))
    rows += _latin_hypercube(size - len(rows), dimension, generator) if len(rows) < size else []
    return np.array(rows)


def _update(state: SearchState, settings: SearchSettings) -> None:
    order = int(np.argmin(state.costs))
    cost = state.costs[order]
    if cost < state.best_cost * (1.0 - settings.tolerance):
        state.stalled = 0
    else:
        state.stalled += 1
    if cost < state.best_cost:
        state.best_cost, state.best = float(cost), list(state.population[order])
    state.history.append(
        [float(state.generation), float(state.evaluations), state.best_cost, float(np.median(state.costs))]
    )


def stop_reason(state: SearchState, settings: SearchSettings) -> str | None:
    """Why the search ends now, with the value that decided; None: it goes on."""
    if state.stalled >= settings.patience and settings.method != PLAIN:
        return (
            f"{state.method}: no relative gain above {settings.tolerance:g} in {settings.patience} generations "
            f"(generation {state.generation}, cost {state.best_cost:.4g})"
        )
    if state.generation >= settings.generations:
        return f"{state.method}: budget of {settings.generations} generations used (cost {state.best_cost:.4g})"
    return None


def _freeze(state: tuple[Any, ...]) -> Any:
    return [list(part) if isinstance(part, tuple) else part for part in state]


def _thaw(state: Any) -> tuple[Any, ...]:
    return tuple(tuple(part) if isinstance(part, list) else part for part in state)


class _Numpy:
    """numpy with a generator of its own as `numpy.random`."""

    def __init__(self, generator: Any) -> None:
        self.random = generator

    def __getattr__(self, name: str) -> Any:
        return getattr(np, name)


def _genetic_step(state: SearchState, cost: CostFunction, settings: SearchSettings) -> None:
    """One generation: selection, crossover and mutation as the settings have them, and elitism."""
    from deap import tools

    generator = random.Random()
    generator.setstate(_thaw(state.random_state))
    dimension = len(state.best)
    chosen, crossed = selection(settings, generator), crossover(settings, generator)
    mutated = mutation(settings, generator, dimension)
    parents = [_Individual(g, c) for g, c in zip(state.population, state.costs, strict=True)]
    elite = tools.selBest(parents, settings.elite)
    children: list[_Individual] = []
    while len(children) < settings.population - settings.elite:
        one, two = (_Individual(list(p)) for p in chosen(parents, 2))
        if generator.random() < settings.crossover_rate:
            crossed(one, two)
        for child in (one, two):
            mutated(child)
            children.append(_Individual(_clip(child)))
    del children[settings.population - settings.elite :]
    costs = cost(np.array(children))
    state.evaluations += len(children)
    state.population = [list(e) for e in elite] + [list(c) for c in children]
    state.costs = [e.fitness.cost for e in elite] + [float(c) for c in costs]
    state.random_state = _freeze(generator.getstate())


def _cma_step(state: SearchState, cost: CostFunction, settings: SearchSettings) -> None:
    """One generation of DEAP's CMA-ES; candidates outside the box are judged at its border plus a penalty."""
    from deap import cma

    dimension = len(state.best)
    strategy = cma.Strategy(
        centroid=list(state.best), sigma=0.15, lambda_=settings.population, mu=settings.population // 2
    )
    for name, value in state.extra.items():
        setattr(strategy, name, np.array(value) if isinstance(value, list) else value)
    generator = np.random.RandomState()
    generator.set_state(("MT19937", np.array(state.random_state[1], dtype=np.uint32), *state.random_state[2:]))
    generate = drawing_from(cma.Strategy.generate, generator, numpy=_Numpy(generator))
    drawn = generate(strategy, _Individual)
    inside = np.array([_clip(individual) for individual in drawn])
    costs = cost(inside)
    for individual, boxed, value in zip(drawn, inside, costs, strict=True):
        individual.fitness = _Fitness(float(value) * (1.0 + float(np.sum((np.array(individual) - boxed) ** 2))))
    strategy.update(drawn)
    keep = ("centroid", "sigma", "pc", "ps", "C", "B", "BD", "diagD", "update_count")
    state.extra = {
        name: value.tolist() if isinstance(value := getattr(strategy, name), np.ndarray) else value for name in keep
    }
    state.evaluations += len(drawn)
    state.population = inside.tolist()
    state.costs = [float(c) for c in costs]
    raw: Any = generator.get_state(legacy=True)
    state.random_state = [raw[0], raw[1].tolist(), int(raw[2]), int(raw[3]), float(raw[4])]
    assert len(state.population[0]) == dimension


def _words(seed: int) -> int | list[int]:
    """A seed as numpy's old generator takes it: 32 bits at a time."""
    return seed if seed < 2**32 else [seed % 2**32, seed // 2**32]


def _refuse_other(state: SearchState, dimension: int, settings: SearchSettings) -> None:
    """ConfigError for a state that this search cannot go on from."""
    found = (state.method, len(state.best), len(state.population))
    if found != (settings.method, dimension, settings.population):
        raise ConfigError(
            "checkpoint",
            "is of another search: method {}, {} unknowns, {} candidates".format(*found),
            "Delete it to start this search anew.",
        )


def search(
    cost: CostFunction,
    seeds: Array,
    dimension: int,
    settings: SearchSettings,
    *,
    starts: Sequence[LeastSquaresFit] = (),
    spent: int = 0,
    resume: SearchState | None = None,
    watch: Watcher | None = None,
) -> tuple[SearchState, str]:
    """Minimise `cost` over [0, 1]^dimension; returns the last state and why it stopped.

    cost: search coordinates (C, p) -> (C,); seeds: (S, p) start candidates; starts: those in minima of their own,
    kept in the state; spent: evaluations that these took; watch: called after each generation. Raises ConfigError
    for a state of another search. The same seed gives the same result on any number of threads, resumed or not.
    """
    if resume is not None:
        _refuse_other(resume, dimension, settings)
        state = resume
    else:
        population = initial_population(seeds, settings.population, dimension, settings.seed)
        costs = cost(population)
        best = int(np.argmin(costs))
        if settings.method == "cma":
            raw: Any = np.random.RandomState(_words(settings.seed)).get_state(legacy=True)
            random_state: Any = [raw[0], raw[1].tolist(), int(raw[2]), int(raw[3]), float(raw[4])]
        else:
            random_state = _freeze(random.Random(settings.seed).getstate())
        state = SearchState(
            settings.method,
            0,
            population.tolist(),
            [float(c) for c in costs],
            population[best].tolist(),
            np.inf,
            0,
            spent + population.shape[0],
            random_state,
            starts=[start.point.tolist() for start in starts],
            start_offsets=[start.offsets.tolist() for start in starts],
        )
        _update(state, settings)
        if watch is not None:
            watch(state)
    while (reason := stop_reason(state, settings)) is None:
        state.generation += 1
        (_cma_step if settings.method == "cma" else _genetic_step)(state, cost, settings)
        _update(state, settings)
        if watch is not None:
            watch(state)
    return state, reason
