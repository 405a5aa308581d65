"""Kernels compiled before a command needs them: here, and beside this by a process of its own.

Nothing takes a first command on a fresh machine longer. numba compiles on one core at a time; kernels that share most
of their parts are compiled in one process, one after the other.
"""

from __future__ import annotations

import atexit
import gc
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from linid.installed_kernels import PROCESSOR_FILE, processor_of
from linid.kernel_cache import cache_folder
from linid.own_process import own_python
from linid.physics.laws.registry import LAWS, LUGRE
from linid.physics.model import VECTOR_SIZE, Model
from linid.simulation.compiled import (
    kernel_folder,
    load_along_slopes,
    load_kernel,
    load_lockstep,
    load_lockstep_slopes,
    load_slopes,
    load_told,
)
from linid.simulation.inputs import Inputs
from linid.simulation.run import Simulator, whole_recordings
from linid.simulation.steering import UNSTEERED

_SERVE = "from linid.simulation.compile_ahead import serve; serve()"
_SAMPLES, _PERIOD = 9, 1e-3  # of the motion that kernels are tried on; s
_VALUE = 0.1  # of all parameters, SI
_STEPS = sorted({law.steps for law in LAWS.values()})
_EFFECT, _TOLD = "quadratic_drag", "gravity"  # any that has all kernels, and any whose force is told beforehand


class Plan(NamedTuple):
    """Names of kernels to be compiled here, and beside that, in this order; wait: whether to go on with all of them."""

    here: tuple[str, ...]
    beside: tuple[str, ...]
    wait: bool


class _Kernel(NamedTuple):
    """load() -> the compiled function; use(): calls it once."""

    load: Callable[[], Any]
    use: Callable[[], object]


def _simulator(model: Model, steered: bool = False) -> Simulator:
    """A model over a motor that rests; steered: by a drive."""
    n = _SAMPLES
    one, none = np.ones(1), np.zeros(1)
    ends = np.array([0, n - 1]), np.array([0, n])
    flags = np.ones(1, dtype=np.bool_), np.zeros(1, dtype=np.bool_)
    coefficients, sampled = np.zeros((n - 1, 4, 4)), np.zeros((3, n))
    inputs = Inputs(coefficients, sampled, *ends, none, _PERIOD * one, none, *flags, none, none)
    course = np.zeros(n - 1)
    drive = UNSTEERED._replace(
        y=course, v=course, ahead=course, current=np.zeros(n - 1), integral=np.zeros(1), phases=3
    )
    return Simulator(model, inputs, steering=drive if steered else UNSTEERED)


def _run(model: Model, guided: bool = False, steered: bool = False) -> object:
    simulator = _simulator(model, steered)
    params, starts = np.full((1, VECTOR_SIZE), _VALUE), np.zeros((1, 1, 3))
    return simulator.run(params, whole_recordings(simulator.inputs), starts, guided=guided)


def _along(model: Model) -> object:
    rest, still = np.zeros(_SAMPLES), np.ones(_SAMPLES, dtype=np.bool_)
    return _simulator(model).along(np.full((1, VECTOR_SIZE), _VALUE), rest, rest, still, np.zeros((1, 1)))


def _slopes(model: Model) -> object:
    simulator = _simulator(model)
    start, moved = np.zeros((1, 3)), np.zeros((1, 3, 1))
    params, directions = np.full(VECTOR_SIZE, _VALUE), np.zeros((1, VECTOR_SIZE))
    return simulator.slopes(params, directions, whole_recordings(simulator.inputs), start, moved)


def _along_slopes(model: Model) -> object:
    rest, still = np.zeros(_SAMPLES), np.ones(_SAMPLES, dtype=np.bool_)
    return _simulator(model).slopes_along(np.full(VECTOR_SIZE, _VALUE), np.zeros((1, VECTOR_SIZE)), rest, rest, still)


def _readings(model: Model) -> object:
    rest = np.zeros(_SAMPLES)
    return _simulator(model).readings(np.full((1, VECTOR_SIZE), _VALUE), rest, rest)


def _kernels() -> dict[str, _Kernel]:
    plain, full = Model("theta"), Model("theta", (_EFFECT,))
    found = {
        "windows": _Kernel(load_lockstep, partial(_run, plain, guided=True)),
        "closed loops": _Kernel(
            lambda: load_kernel(None, bare=True).simulate_tasks, partial(_run, plain, steered=True)
        ),
        "derivatives": _Kernel(load_lockstep_slopes, partial(_slopes, plain)),
        "derivatives with effects": _Kernel(load_slopes, partial(_slopes, full)),
        "windows with effects": _Kernel(load_told, partial(_run, Model("theta", (_TOLD,)), guided=True)),
        "run with effects": _Kernel(lambda: load_kernel().simulate_tasks, partial(_run, full)),
        "along with effects": _Kernel(lambda: load_kernel().along_tasks, partial(_along, full)),
        "derivatives along with effects": _Kernel(load_along_slopes, partial(_along_slopes, full)),
        "readings with effects": _Kernel(lambda: load_kernel().reading_tasks, partial(_readings, full)),
    }
    for law in _STEPS:

        def load(law: str = law, bare: bool = True) -> Any:
            return load_kernel(None, bare=bare, law=law).along_tasks

        found[_along_under(law)] = _Kernel(load, partial(_along, Model("theta", law=law)))
        if law != LUGRE:
            with_effects = partial(_along, Model("theta", (_EFFECT,), law=law))
            found[_with_effects_under(law)] = _Kernel(partial(load, bare=False), with_effects)
    return found


def _along_under(law: str) -> str:
    return f"along under {law}"


def _with_effects_under(law: str) -> str:
    return f"along with effects under {law}"


_LAWS = tuple(_along_under(law) for law in _STEPS if law != LUGRE)
FIT = Plan(("windows", _along_under(LUGRE)), ("derivatives",), wait=True)
_EFFECTS = (
    "derivatives",
    "along with effects",
    "derivatives along with effects",
    "readings with effects",
    "windows with effects",
    "derivatives with effects",
)
DIAGNOSIS = Plan((_along_under(LUGRE), "windows", *_LAWS, "closed loops"), (*_EFFECTS, "run with effects"), wait=False)
PLANS = {"fit-friction": FIT, "fit-motor": FIT, "diagnose": DIAGNOSIS}
# All that diagnoses may need, as long in both; one in which another law stands in LuGre's place needs it with effects.
_OTHERS = tuple(_with_effects_under(law) for law in _STEPS if law != LUGRE)
ALL = Plan((*DIAGNOSIS.here, _EFFECTS[0], *_OTHERS[:1]), (*_EFFECTS[1:], "run with effects", *_OTHERS[1:]), wait=True)


def lacking(plan: Plan) -> tuple[list[str], list[str]]:
    """Kernels of a plan that are not on this machine yet: to be compiled here, and beside."""
    kernels = _kernels()
    here, beside = ([name for name in names if not _is_kept(kernels[name])] for names in plan[:2])
    return here, beside


class Compilation:
    """Kernels of a plan that are not on this machine yet, being compiled beside this process from now on."""

    def __init__(self, plan: Plan) -> None:
        here, beside = lacking(plan)
        if kernel_folder() != cache_folder():  # what another process compiles would be lost
            beside = []
        self._plan, self._kernels, self._here = plan, _kernels(), here
        self._total = len(here) + len(beside)
        self._helper = _begun(beside) if beside and sys.executable else None

    def finish(self, step: Callable[[int, int], None]) -> None:
        """Compile the rest here, and wait for what is compiled beside this where the plan says so; step: told how many
        of how many are there."""
        for done, name in enumerate(self._here):
            step(done, self._total)
            self._kernels[name].use()
        if self._helper is not None and self._plan.wait:
            assert self._helper.stdout is not None
            step(len(self._here), self._total)
            for more, _ in enumerate(self._helper.stdout, 1):  # a line for each; none where it is lost
                step(len(self._here) + more, self._total)


def install() -> None:
    """Compile all kernels into LINID_CACHE_DIR for an installation, and leave nothing else there.

    Where those of this source and processor are there, nothing is compiled.
    Raises OSError where that folder cannot be written.
    """
    from numba.core.registry import cpu_target

    folder, processor = cache_folder(), processor_of(cpu_target.target_context.codegen())
    told = folder / PROCESSOR_FILE
    there = told.is_file() and told.read_text(encoding="utf-8") == processor and not any(lacking(ALL))
    if not there:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        Compilation(ALL).finish(lambda done, total: print(f"{done} of {total} kernels", flush=True))
        told.write_text(processor, encoding="utf-8")
    shutil.rmtree(folder / "numba", ignore_errors=True)
    for lock in folder.glob("*.lock"):
        lock.unlink()


def serve() -> None:
    """Compile the kernels named on the command line, and write each name once it is there."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches who waits, and that ends this process
    gc.disable()  # what is compiled stays: to look through it is a seventh of the time
    kernels = _kernels()
    for name in sys.argv[1:]:
        kernels[name].use()
        print(name, flush=True)


def _is_kept(kernel: _Kernel) -> bool:
    return bool(kernel.load()._cache.begun)


def _begun(names: Sequence[str]) -> subprocess.Popen[bytes] | None:
    try:
        helper = subprocess.Popen([*own_python(_SERVE), *names], stdout=subprocess.PIPE)
    except OSError:  # no process to be had: what it would compile is compiled here when it is needed
        return None
    atexit.register(_end, helper)
    return helper


def _end(helper: subprocess.Popen[bytes]) -> None:
    helper.kill()
    helper.wait()
