"""The cache of compiled kernels under several processes: one compiles at a time, and none is stopped by it."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import time
from pathlib import Path

from linid.physics.kernel_cache import LOCK_FILE, CompileLock

ROOT = Path(__file__).resolve().parents[2]
COMPILE = """
import sys
from pathlib import Path
from numba import njit
from linid.physics.kernel_cache import lock_compilation

lock_compilation()
Path("ready").touch()

@njit
def twice(x):
    return x + x

assert twice(21) == 42
Path("compiled").touch()
"""


def held(path: Path) -> bool:
    """Whether a process that asks now would have to wait."""
    with path.open("a") as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        return False


def test_a_process_compiles_only_while_no_other_does(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "LINID_CACHE_DIR": str(tmp_path)}
    with (tmp_path / LOCK_FILE).open("a") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        process = subprocess.Popen([sys.executable, "-c", COMPILE], cwd=tmp_path, env=environment)
        while not (tmp_path / "ready").exists():
            assert process.poll() is None
            time.sleep(0.01)
        time.sleep(1.0)
        assert process.poll() is None and not (tmp_path / "compiled").exists()
    assert process.wait(timeout=300.0) == 0 and (tmp_path / "compiled").exists()
    assert not held(tmp_path / LOCK_FILE)


def test_nested_compilations_hold_the_lock_until_the_last_ends(tmp_path: Path) -> None:
    lock = CompileLock(tmp_path / "new" / LOCK_FILE)
    lock.on_start(None)
    lock.on_start(None)
    lock.on_end(None)
    assert held(lock.path)
    lock.on_end(None)
    assert not held(lock.path)


def test_an_unwritable_cache_does_not_stop_the_work(tmp_path: Path) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.touch()
    lock = CompileLock(in_the_way / LOCK_FILE)
    lock.on_start(None)
    lock.on_end(None)
    assert in_the_way.is_file() and in_the_way.stat().st_size == 0
    in_the_way.unlink()  # from then on the same lock holds
    lock.on_start(None)
    assert held(lock.path)
    lock.on_end(None)
    assert not held(lock.path)
