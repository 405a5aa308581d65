"""Independent fits in threads or on workers: order, threads, and what happens when one fails or the caller stops."""

from __future__ import annotations

import pickle
import threading
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pytest

from linid.diagnosis.balance import Balance
from linid.parallel_tasks import in_parallel
from linid.physics.model import Model
from tests.diagnosis.machine import Noise, recording


@pytest.mark.parametrize(("jobs", "each"), [(1, 1), (2, 1), (3, 1), (8, 2)])
def test_results_come_in_order_and_the_threads_are_shared_out(jobs: int, each: int) -> None:
    def function(item: int, threads: int) -> tuple[int, int]:
        time.sleep(0.02 * (4 - item))  # the last one ends first
        return item**2, threads

    assert list(in_parallel(function, [1, 2, 3, 4], jobs)) == [(k, (k**2, each)) for k in (1, 2, 3, 4)]
    assert list(in_parallel(function, [], jobs)) == []


def test_a_single_item_gets_all_threads_and_no_pool() -> None:
    def function(item: int, threads: int) -> tuple[int, str]:
        return threads, threading.current_thread().name

    assert list(in_parallel(function, [7], 4)) == [(7, (4, threading.main_thread().name))]


def test_an_error_drops_what_has_not_begun() -> None:
    begun = []

    def function(item: int, threads: int) -> int:
        begun.append(item)
        time.sleep(0.05)
        if item == 0:
            raise ValueError("no such fit")
        return item

    with pytest.raises(ValueError, match="no such fit"):
        list(in_parallel(function, range(20), 2))
    assert len(begun) < 10


class Elsewhere:
    """Workers to which everything travels pickled, as to another process."""

    def map(self, function: Callable[[int, int], int], items: Sequence[int]) -> Iterator[int]:
        for item in items:
            yield pickle.loads(pickle.dumps(function))(pickle.loads(pickle.dumps(item)), 1)


def doubled(item: int, threads: int) -> tuple[int, int, str]:
    return 2 * item, threads, threading.current_thread().name


def test_workers_do_several_items_and_a_single_one_stays_here() -> None:
    here = threading.main_thread().name
    assert list(in_parallel(doubled, [1, 2], 4, Elsewhere())) == [(1, (2, 1, here)), (2, (4, 1, here))]  # type: ignore[arg-type]
    assert list(in_parallel(doubled, [3], 4, Elsewhere())) == [(3, (6, 4, here))]  # type: ignore[arg-type]


def test_a_balance_that_has_travelled_gives_the_same_bits() -> None:
    runs = [recording(f"run_{k}", noise=Noise(1e-6, 1e-3), seed=k, duration=0.5, number=k + 1) for k in range(2)]
    model, more = Model("force"), Model("force", ("constant_force",))
    balance = Balance(model, runs, 2, 1, {"key": [1.0]})
    vector = model.vector({p.name: 1.3 * p.lower + 1e-3 for p in model.parameters})
    extended = more.vector({p.name: 1.3 * p.lower + 1e-3 for p in more.parameters})
    first = [balance.residual(model, vector), balance.residual(more, extended)]
    travelled: Balance = pickle.loads(pickle.dumps(balance))
    assert travelled.memory == {"key": [1.0]} and travelled.jobs == 1
    second = [travelled.residual(model, vector), travelled.residual(more, extended)]
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))
    here, there = balance.noise(model, vector), travelled.noise(model, vector)
    assert np.array_equal(here.encoder, there.encoder) and np.array_equal(here.inputs, there.inputs)
    assert np.std(first[0]) > 0.0
