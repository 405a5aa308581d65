"""The cache of compiled kernels under several processes: one compiles at a time, and a source keeps its time."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import time
from pathlib import Path

from linid.physics.kernel_cache import LOCK_FILE, CompileLock
from linid.simulation import emitter

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
    (tmp_path / "file").touch()
    lock = CompileLock(tmp_path / "file" / LOCK_FILE)
    lock.on_start(None)
    lock.on_end(None)


def test_a_source_that_is_written_twice_is_the_same_file_for_numba(tmp_path: Path) -> None:
    """numba holds machine code for stale when time or size of the source differ."""
    stamps = set()
    script = "from linid.simulation.emitter import load_kernel; print(load_kernel().__file__)"
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "LINID_CACHE_DIR": str(tmp_path)}
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        path = Path(done.stdout.strip())
        assert path.parent == tmp_path and path.read_text(encoding="utf-8") == emitter.emit()
        stamps.add((path.stat().st_mtime, path.stat().st_size))
        path.unlink()
        time.sleep(0.02)
    assert len(stamps) == 1
