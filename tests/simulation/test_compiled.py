"""Compiled kernels on disk: found again by other processes, and made anew only where what they do has changed."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from linid.installed_kernels import SWITCH
from linid.kernel_cache import before_compilation
from linid.physics.effects.registry import EFFECTS
from linid.physics.model import Model
from linid.simulation.binding import compiled
from linid.simulation.bundle import Bundle
from linid.simulation.compiled import KernelCache, entry_of, fingerprint
from linid.simulation.kernel import simulate_tasks_with
from linid.simulation.terms import terms_of

ROOT = Path(__file__).resolve().parents[2]
# Compiles or loads the kernel of a free wheel and says what numba's cache did.
RUN = """
import numpy as np
from linid.physics.model import Model
from linid.simulation.compiled import load_lockstep, entry_of
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from linid.recording.recording import Recording

t = np.arange(0.0, 0.05, 1e-3)
simulator = Simulator(Model("friction"), pack_inputs([Recording("r", t, np.zeros_like(t), kind="free_wheel")]), 2)
start = np.array([[[0.0, 1.0, np.nan]]])
y = simulator.run(Model("friction").vector({})[None, :], whole_recordings(simulator.inputs), start)
stats = load_lockstep().stats
print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()), repr(float(y[0][0, -1])))
"""


def started(cache: Path) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "LINID_CACHE_DIR": str(cache), SWITCH: "0"}
    return subprocess.Popen([sys.executable, "-c", RUN], env=environment, stdout=subprocess.PIPE, text=True)


def test_processes_share_a_cache_and_a_third_compiles_nothing(tmp_path: Path) -> None:
    workers = [started(tmp_path / "cache") for _ in range(2)]
    said = [worker.communicate(timeout=300)[0].split() for worker in workers]
    assert [worker.returncode for worker in workers] == [0, 0]
    third = started(tmp_path / "cache").communicate(timeout=300)[0].split()
    assert third[:2] == ["1", "0"]
    assert {tuple(one[2:]) for one in (*said, third)} == {tuple(third[2:])}
    (kept,) = (tmp_path / "cache").glob("lockstep_tasks-*.nbc")
    _, kind, (machine_code, names) = pickle.loads(kept.read_bytes())[0]
    assert kind == "object" and len(names) < 0.1 * len(machine_code)  # no intermediate code, which would be longer


def test_loaded_kernels_bring_no_more_of_numba_than_they_call() -> None:
    code = "import sys; from linid.simulation.compile_ahead import _kernels; "
    code += "[kernel.use() for kernel in _kernels().values()]; print('numba.np.arraymath' in sys.modules)"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for _ in range(2):  # the first one may have to compile
        run = [sys.executable, "-c", code]
        said = subprocess.run(run, env=environment, capture_output=True, text=True, check=True, timeout=600).stdout
    assert said.split() == ["False"]


def test_a_cache_that_cannot_be_written_stops_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    worker = started(tmp_path / "file" / "cache")
    assert worker.communicate(timeout=300)[0].split()[:2] == ["0", "1"] and worker.returncode == 0


def test_compilation_is_said_once_and_never_where_the_cache_has_it(tmp_path: Path) -> None:
    def called(factor: int) -> None:
        def outer(x):
            return factor * x

        function = njit(outer)
        function._cache = KernelCache(outer, tmp_path, fingerprint(outer))
        assert function(3) == 3 * factor

    said: list[str] = []
    try:
        before_compilation(lambda: said.append("compiling"))
        called(2)
        called(5)
        assert said == ["compiling"]
        before_compilation(lambda: said.append("again"))
        called(2)
        assert said == ["compiling"]
        called(7)
        assert said == ["compiling", "again"]
    finally:
        before_compilation(None)


def test_closures_with_other_functions_inside_are_told_apart(tmp_path: Path) -> None:
    """One name and one place in the source, and yet not the same machine code."""

    def made(inner: object, factor: float) -> object:
        terms = Bundle(inner=inner, factor=3)

        def outer(x):
            return factor * terms.inner(x) * terms.factor

        function = njit(outer)
        function._cache = KernelCache(outer, tmp_path, fingerprint(outer))
        return function

    @compiled
    def plus(x):
        return x + 1.0

    @compiled
    def minus(x):
        return x - 1.0

    for _ in range(2):
        assert [made(f, k)(1.5) for f in (plus, minus) for k in (1.0, 2.0)] == [7.5, 15.0, 1.5, 3.0]
    again = made(minus, 2.0)
    assert again(2.0) == 6.0 and sum(again.stats.cache_hits.values()) == 1
    assert len(list(tmp_path.glob("*.nbc"))) == 4


SOURCE = '''
import math
from linid.physics.effects.effect import term
SCALE = {scale}
@term
def inner(x):
    """{docstring}"""
    return SCALE * x
{comment}
@term
def outer(x):
    """Outer."""
    return inner(x) {sign} 1.0
'''


def of_source(**changed: object) -> str:
    names: dict[str, object] = {"__name__": "example"}
    given = {"scale": 2.0, "docstring": "Inner.", "comment": "", "sign": "+", **changed}
    exec(SOURCE.format(**given), names)
    return fingerprint(names["outer"])


@pytest.mark.parametrize(
    "changed", [{"docstring": "Other words."}, {"comment": "\n# A comment."}, {"scale": 2}], ids=lambda c: next(iter(c))
)
def test_a_fingerprint_is_that_of_what_functions_do(changed: dict[str, object]) -> None:
    assert (of_source(**changed) == of_source()) is ("scale" not in changed)
    assert of_source(sign="-") != of_source()


def test_fingerprints_of_kernels_differ_with_their_effects() -> None:
    models = [Model("sine"), Model("theta"), *(Model("sine", (e.name,)) for e in EFFECTS if "sine" in e.kinds)]
    found = {fingerprint(simulate_tasks_with(terms_of(model))) for model in models}
    found |= {fingerprint(simulate_tasks_with(terms_of())), fingerprint(simulate_tasks_with(terms_of(bare=True)))}
    assert len(found) == len(models) + 2
    assert fingerprint(simulate_tasks_with(terms_of())) == fingerprint(simulate_tasks_with(terms_of()))


def test_constants_count_but_not_where_they_are() -> None:
    numbers = np.arange(3.0)

    def with_array(x):
        return x + numbers[1]

    before = fingerprint(with_array)
    numbers[1] = 5.0
    assert fingerprint(with_array) != before


def test_what_a_kernel_is_made_of_has_no_machine_code_of_its_own() -> None:
    @compiled
    def twice(x: float) -> float:
        return 2.0 * x

    @njit
    def entry(x: float) -> float:
        return twice(x) + 1.0  # type: ignore[no-any-return]

    assert entry(3.0) == 7.0
    for function, made in ((twice, False), (entry, True)):
        (one,) = function.overloads.values()
        assert one.library._codegen._engine.is_symbol_defined(one.fndesc.mangled_name) is made


def test_what_cannot_be_compiled_leaves_no_lock_behind() -> None:
    def wrong(x):
        return x + "a"

    entry = entry_of(wrong)
    for _ in range(2):  # the second would wait for the first
        with pytest.raises(TypingError):
            entry(1.0)
        assert entry._cache._lock is None
