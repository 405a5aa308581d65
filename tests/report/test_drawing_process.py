"""Figures drawn by a process of their own are those that are drawn here, and none is lost with it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from linid.report.figures import drawing_process
from linid.report.figures.drawing_process import Order, Ordered
from linid.report.figures.write import Drawing, validation_drawings
from tests.report.samples import gap, move


@pytest.fixture(autouse=True)
def nobody_waits() -> Iterator[None]:
    drawing_process._dismiss()
    yield
    drawing_process._dismiss()


def order(folder: Path, how_many: str = "all") -> Order:
    return Order(partial(validation_drawings, [gap()], [move(n=300)]), how_many, folder, ("png",), 1)


def refused() -> list[Drawing]:
    raise OSError(28, "No space left on device")


def contents(paths: list[Path]) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in paths}


def test_another_process_draws_the_same(tmp_path: Path) -> None:
    drawing_process.begin()
    (helper,) = drawing_process._waiting
    seen: list[tuple[int, int, str]] = []
    there = contents(Ordered(order(tmp_path / "there")).files(lambda *done: seen.append(done)))
    here = contents(Ordered(order(tmp_path / "here")).files())
    assert there == here and len(here) == 3
    assert [done[0] for done in seen] == [1, 2, 3] and {done[1] for done in seen} == {3}
    assert helper.poll() is not None  # gone


def test_what_fails_there_is_raised_here(tmp_path: Path) -> None:
    taken = tmp_path / "taken"
    taken.write_bytes(b"")
    drawing_process.begin()
    asked = Ordered(order(taken))
    assert asked._helper is not None
    with pytest.raises(OSError, match="taken"):
        asked.files()


def test_a_lost_process_costs_nothing(tmp_path: Path) -> None:
    drawing_process.begin()
    drawing_process._waiting[0].kill()
    drawing_process._waiting[0].wait()
    assert len(Ordered(order(tmp_path)).files()) == 3
    drawing_process.begin()
    asked = Ordered(order(tmp_path / "later"))
    assert asked._helper is not None
    asked._helper.kill()
    assert len(asked.files()) == 3


def test_what_cannot_travel_is_drawn_here(tmp_path: Path) -> None:
    drawing_process.begin()
    drawings = validation_drawings([gap()], [move(n=300)])
    assert len(Ordered(Order(lambda: drawings, "all", tmp_path, ("png",), 1)).files()) == 3
    drawing_process.begin()
    with pytest.raises(OSError, match="No space left"):  # the function of a module that the process does not find
        Ordered(Order(refused, "all", tmp_path, ("png",), 1)).files()


def test_nothing_is_drawn_where_none_is_wanted(tmp_path: Path) -> None:
    drawing_process.begin()
    assert Ordered(order(tmp_path, "none")).files() == []
    assert len(drawing_process._waiting) == 1  # for the next one that wants some


def test_a_process_that_is_not_asked_ends_with_who_began_it(tmp_path: Path) -> None:
    code = "from linid.report.figures import drawing_process as d; d.begin(); print(d._waiting[0].pid, flush=True)"
    code += "; import os; os._exit(3)"  # as if it were killed
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 3
    pid = int(done.stdout)
    deadline = time.monotonic() + 60.0
    while alive(pid):
        assert time.monotonic() < deadline, "it still waits"
        time.sleep(0.1)


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return Path(f"/proc/{pid}/stat").exists() and ") Z " not in Path(f"/proc/{pid}/stat").read_text(encoding="utf-8")
