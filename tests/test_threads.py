"""Linear algebra on one thread, for all who are inside at a time."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest
import scipy.linalg  # noqa: F401 - its library of linear algebra, beside numpy's
from threadpoolctl import threadpool_info, threadpool_limits

from linid.threads import ONE_THREAD, load_with_one_thread, one_thread


def counts() -> set[int]:
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


def test_the_limit_holds_until_the_last_one_leaves() -> None:
    with threadpool_limits(2):
        before = counts()
        first, second = one_thread(), one_thread()
        first.__enter__()
        second.__enter__()
        assert counts() == {1}
        first.__exit__(None, None, None)
        assert counts() == {1}
        second.__exit__(None, None, None)
        assert counts() == before


def test_every_thread_may_limit_and_lift() -> None:
    with threadpool_limits(2):
        before = counts()
        with one_thread():
            assert counts() == {1}

        def elsewhere() -> set[int]:
            with one_thread():
                return counts()

        with ThreadPoolExecutor(1) as pool:
            assert pool.submit(elsewhere).result() == {1}
            first, last = one_thread(), one_thread()
            first.__enter__()
            pool.submit(last.__enter__).result()
            first.__exit__(None, None, None)
            assert counts() == {1}
            pool.submit(last.__exit__, None, None, None).result()
            assert counts() == before
        with threadpool_limits(1):
            assert counts() == {1}


def test_libraries_that_are_loaded_later_begin_with_one_thread_unless_the_user_says_so() -> None:
    code = (
        "from linid.threads import load_with_one_thread; load_with_one_thread(); import numpy, scipy.linalg\n"
        "from threadpoolctl import threadpool_info; print({each['num_threads'] for each in threadpool_info()})"
    )
    bare = {name: value for name, value in os.environ.items() if name not in ONE_THREAD}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=bare, check=True)
    assert done.stdout.strip() == "{1}"


def test_the_number_of_the_user_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "environ", {"OPENBLAS_NUM_THREADS": "3"})
    load_with_one_thread()
    assert {name: os.environ[name] for name in ONE_THREAD} == {**ONE_THREAD, "OPENBLAS_NUM_THREADS": "3"}
