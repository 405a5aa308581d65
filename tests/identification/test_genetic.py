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
