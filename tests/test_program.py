"""The process of a command: its exit code, what it owes others at its end, and that it does not wait for the rest."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import IO

import pytest

BEGIN = """
import atexit, sys, time
from pathlib import Path
import click
from linid.cli.program import run_program

class Slow:
    def __del__(self, touch=Path("taken_apart").touch):
        touch()

kept = Slow()
"""


def run(
    tmp_path: Path, body: str, *under: str, stdout: int | IO[str] = subprocess.PIPE
) -> subprocess.CompletedProcess[str]:
    """A process that runs a click command with this body, under a module with options."""
    file = tmp_path / "program.py"
    lines = "".join(f"    {line}\n" for line in body.strip().splitlines())
    file.write_text(f"{BEGIN}\n@click.command()\ndef command():\n{lines}\nrun_program(command)\n")
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[1])}
    command = [sys.executable, *under, str(file)]
    return subprocess.run(
        command, cwd=tmp_path, env=environment, stdout=stdout, stderr=subprocess.PIPE, text=True, check=False
    )


@pytest.mark.parametrize(("body", "code"), [("pass", 0), ("sys.exit(5)", 5), ("raise click.UsageError('no')", 2)])
def test_the_exit_code_is_the_commands(tmp_path: Path, body: str, code: int) -> None:
    assert run(tmp_path, body).returncode == code


def test_what_is_printed_and_registered_is_done_and_nothing_taken_apart(tmp_path: Path) -> None:
    done = run(tmp_path, "atexit.register(Path('registered').touch)\nprint('x' * 100_000)")
    assert done.stdout == "x" * 100_000 + "\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["program.py", "registered"]


def test_a_process_of_a_pool_is_waited_for(tmp_path: Path) -> None:
    body = """
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
global pool
pool = ProcessPoolExecutor(1, mp_context=get_context("fork"))
pool.submit(time.sleep, 0.5)
pool.submit(Path("waited").touch)
"""
    assert run(tmp_path, body).returncode == 0
    assert (tmp_path / "waited").exists()


def test_a_traced_process_ends_as_python_does(tmp_path: Path) -> None:
    """A profiler writes at the end what it has seen."""
    assert run(tmp_path, "pass", "-m", "cProfile", "-o", "profile").returncode == 0
    assert (tmp_path / "profile").exists()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full, a disk that is always full")
def test_output_that_nobody_takes_is_no_success(tmp_path: Path) -> None:
    with open("/dev/full", "w") as full:
        assert run(tmp_path, "sys.stdout.write('lost')", stdout=full).returncode != 0


def test_a_fault_of_the_program_shows_its_traceback(tmp_path: Path) -> None:
    done = run(tmp_path, "1 / 0")
    assert done.returncode == 1 and "ZeroDivisionError" in done.stderr


THREADS = """
import ctypes, threading
libc = ctypes.CDLL(None)
libc.fopen.restype = ctypes.c_void_p
together = threading.Barrier(8)
def take():
    libc.malloc(100_000)
    together.wait()
threads = [threading.Thread(target=take) for _ in range(8)]
for thread in threads: thread.start()
for thread in threads: thread.join()
out = ctypes.c_void_p(libc.fopen(b"pools.xml", b"w"))
libc.malloc_info(0, out)
libc.fclose(out)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="pools of memory are glibc's")
@pytest.mark.parametrize(("asked", "pools"), [("", 2), ("5", 5)])
def test_threads_share_pools_of_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, asked: str, pools: int) -> None:
    """Unless the user says how many there may be."""
    monkeypatch.delenv("MALLOC_ARENA_MAX", raising=False)
    if asked:
        monkeypatch.setenv("MALLOC_ARENA_MAX", asked)
    assert run(tmp_path, THREADS).returncode == 0
    assert (tmp_path / "pools.xml").read_text().count("<heap nr=") == pools
