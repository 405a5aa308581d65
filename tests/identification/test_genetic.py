"""The global search draws from its own generators: the interpreter's stay as they are, threads share nothing."""

from __future__ import annotations

import random
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from linid.identification.optimise.genetic import search
from linid.identification.optimise.search_state import SearchState
from linid.identification.settings import SearchSettings


def bowls(point: np.ndarray) -> np.ndarray:
    return np.sum((point - 0.3) ** 2, axis=1) + 0.05 * np.sum(np.cos(20.0 * point) ** 2, axis=1)


def searched(method: str, seed: int) -> SearchState:
    return search(bowls, np.full((1, 5), 0.8), 5, SearchSettings(method=method, population=16, seed=seed))[0]


@pytest.mark.parametrize("method", ["genetic", "plain", "cma"])
def test_searches_side_by_side_are_those_one_after_the_other(method: str) -> None:
    seeds = range(1, 9)
    alone = [searched(method, seed) for seed in seeds]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(lambda seed: searched(method, seed), seeds)) == alone
    assert len({tuple(state.best) for state in alone}) == len(alone)


@pytest.mark.parametrize("method", ["genetic", "cma"])
def test_the_callers_generators_stay_as_they_are(method: str) -> None:
    before, numpys = random.getstate(), np.random.get_state()[1].copy()
    searched(method, 3)
    assert random.getstate() == before and np.array_equal(np.random.get_state()[1], numpys)


@pytest.mark.parametrize("selection", ["tournament", "roulette"])
@pytest.mark.parametrize("crossover", ["simulated_binary", "blend", "two_point", "uniform"])
@pytest.mark.parametrize("mutation", ["polynomial", "gaussian"])
def test_every_operator_finds_a_bowl(selection: str, crossover: str, mutation: str) -> None:
    """Not by its first, random candidates: these lie ten times as far off."""

    def bowl(point: np.ndarray) -> np.ndarray:
        return np.sum((point - 0.3) ** 2, axis=1)

    operators = {"selection": selection, "crossover": crossover, "mutation": mutation}
    settings = SearchSettings(method="plain", population=40, generations=60, seed=2, **operators)  # type: ignore[arg-type]
    state, reason = search(bowl, np.empty((0, 4)), 4, settings)
    assert state.generation == 60 and "60 generations used" in reason
    assert state.best_cost < 0.1 * state.history[0][2] and state.best_cost < 0.005
    assert all(0.0 <= x <= 1.0 for row in state.population for x in row)
    before = random.getstate()
    assert search(bowl, np.empty((0, 4)), 4, settings)[0] == state and random.getstate() == before


def test_without_crossover_and_mutation_nothing_new_is_tried() -> None:
    tried: list[tuple[float, ...]] = []

    def bowl(point: np.ndarray) -> np.ndarray:
        tried.extend(map(tuple, point))
        return np.sum((point - 0.3) ** 2, axis=1)

    settings = SearchSettings(method="plain", population=20, generations=5, crossover_rate=0.0, mutation_rate=0.0)
    search(bowl, np.empty((0, 3)), 3, settings)
    assert set(tried) == set(tried[:20])
