"""Pieces of one computation in threads: all are done once, errors come out, a fork has threads of its own."""

from __future__ import annotations

import multiprocessing
import threading
import time

import pytest

from linid.simulation.threads import summed


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("pieces", [0, 1, 2, 50])
def test_every_piece_is_done_once(threads: int, pieces: int) -> None:
    done: list[int] = []

    def work(piece: int) -> int:
        done.append(piece)
        return piece + 1

    assert summed(work, range(pieces), threads) == sum(range(pieces + 1))
    assert sorted(done) == list(range(pieces))


def test_two_threads_work_at_once() -> None:
    both = threading.Barrier(2, timeout=30.0)
    assert summed(lambda _: both.wait() * 0 + 1, range(2), 2) == 2


@pytest.mark.parametrize("bad", [0, 1])
def test_an_error_ends_all_pieces(bad: int) -> None:
    """Of this thread's piece or of the other's, whichever takes it."""
    both = threading.Barrier(2, timeout=30.0)
    done: list[int] = []

    def work(piece: int) -> int:
        if piece < 2:
            both.wait()
        if piece == bad:
            raise ValueError("piece")
        time.sleep(0.01)
        done.append(piece)
        return 1

    with pytest.raises(ValueError, match="piece"):
        summed(work, range(1000), 2)
    count = len(done)
    assert count < 900
    time.sleep(0.1)
    assert len(done) == count, "somebody still works"


def test_helpers_that_are_busy_elsewhere_are_not_waited_for() -> None:
    """Several callers share the threads, as fits side by side do."""
    free = threading.Event()

    def slow(_: int) -> int:
        free.wait(30.0)
        return 1

    other = threading.Thread(target=summed, args=(slow, range(2), 2))
    other.start()
    time.sleep(0.1)
    assert summed(lambda piece: piece, range(100), 2) == sum(range(100))
    free.set()
    other.join()


def _in_the_child(answers: multiprocessing.SimpleQueue[int]) -> None:
    both = threading.Barrier(2, timeout=30.0)
    answers.put(summed(lambda _: both.wait() * 0 + 1, range(2), 2))


def test_a_fork_starts_threads_of_its_own() -> None:
    summed(lambda piece: piece, range(10), 2)
    context = multiprocessing.get_context("fork")
    answers: multiprocessing.SimpleQueue[int] = context.SimpleQueue()
    child = context.Process(target=_in_the_child, args=(answers,))
    child.start()
    child.join(60.0)
    assert child.exitcode == 0 and answers.get() == 2
