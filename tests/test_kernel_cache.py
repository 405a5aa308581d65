"""The cache of compiled functions under several processes: each kernel is compiled once, and none is stopped by it."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import time
from pathlib import Path

from linid.kernel_cache import LOCK_FILE, locked

ROOT = Path(__file__).resolve().parents[1]
COMPILE = """
import sys
from pathlib import Path
from numba import njit
from linid.kernel_cache import before_compilation
from linid.simulation.compiled import KernelCache, fingerprint

def outer(x):
    return x + x

twice = njit(outer)
twice._cache = KernelCache(outer, Path.cwd(), "key")
before_compilation(lambda: Path(f"waits_{sys.argv[1]}").touch())
assert twice(21) == 42
print(sum(twice.stats.cache_hits.values()), sum(twice.stats.cache_misses.values()))
"""


def held(path: Path) -> bool:
    """Whether a process that asks now would have to wait."""
    with path.open("a") as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        return False


def test_of_processes_that_need_a_kernel_at_once_one_compiles_it_and_the_others_load_it(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "LINID_CACHE_DIR": str(tmp_path)}
    lock = locked(tmp_path / "outer-key.lock")
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", COMPILE, str(k)], cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True
        )
        for k in range(3)
    ]
    while len(list(tmp_path.glob("waits_*"))) < 3:
        assert all(process.poll() is None for process in processes)
        time.sleep(0.01)
    time.sleep(0.5)
    assert all(process.poll() is None for process in processes) and not list(tmp_path.glob("*.nbi"))
    lock.release()
    told = sorted(process.communicate(timeout=300.0)[0].split()[0] for process in processes)
    assert told == ["0", "1", "1"] and len(list(tmp_path.glob("*.nbc"))) == 1
    assert not held(tmp_path / "outer-key.lock")


def test_kernels_are_compiled_side_by_side(tmp_path: Path) -> None:
    """The lock of one does not stop another."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "LINID_CACHE_DIR": str(tmp_path)}
    lock = locked(tmp_path / "other-key.lock")
    subprocess.run([sys.executable, "-c", COMPILE, "0"], cwd=tmp_path, env=environment, check=True, timeout=300.0)
    assert len(list(tmp_path.glob("*.nbc"))) == 1 and held(tmp_path / "other-key.lock")
    lock.release()


def test_an_unwritable_cache_does_not_stop_the_work(tmp_path: Path) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.touch()
    assert locked(in_the_way / LOCK_FILE) is None
    assert in_the_way.is_file() and in_the_way.stat().st_size == 0
    in_the_way.unlink()  # from then on the same lock holds
    lock = locked(in_the_way / LOCK_FILE)
    assert held(in_the_way / LOCK_FILE)
    lock.release()
    assert not held(in_the_way / LOCK_FILE)


LOAD = """
import sys
import numpy as np
from numba import njit
from linid.kernel_cache import SharedCache

@njit
def counted(values, name):
    found = [x for x in values if x > 2.0]  # allocates
    if hash(name) == 0:  # hashes
        return 0.0
    if len(found) < 2:
        raise KeyError(name)
    return np.sqrt(np.array(found)).sum()

counted._cache = SharedCache(counted.py_func)
print(counted(np.array([1.0, 4.0, 9.0]), "coulomb"))
try:
    counted(np.array([1.0]), "coulomb")
except KeyError:
    print("KeyError")
from numba.core.registry import cpu_target
loaded = bool(counted.stats.cache_hits)
print(loaded, "numba.np.polynomial.polynomial_functions" in sys.modules)
thrice = njit(lambda x: 3 * np.abs(x))  # what needs to be compiled still is
print(thrice(-2.0))
"""


def test_machine_code_runs_without_what_compiling_needs(tmp_path: Path) -> None:
    """Also such that allocates memory, raises and hashes text: a name that it calls by and nobody knows stops the
    process."""
    (tmp_path / "load.py").write_text(LOAD)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path / "numba")}
    environment["LINID_CACHE_DIR"] = str(tmp_path)
    runs = [
        subprocess.run(
            [sys.executable, "load.py"], cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True, check=True
        ).stdout.split()
        for _ in range(2)
    ]
    assert runs == [["5.0", "KeyError", "False", "True", "6.0"], ["5.0", "KeyError", "True", "False", "6.0"]]
