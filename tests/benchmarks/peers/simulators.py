"""One interface to every simulator: problem and setting in, a function from parameter values to positions out.

All solve the same equations: LuGre friction and the motor's field as a sum of odd harmonics.
"""

from __future__ import annotations

import importlib.metadata
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linid.physics.friction import PARAMETERS as FRICTION
from linid.recording.recording import Recording
from linid.recording.splines import cubic_spline_coefficients
from linid.simulation.reference import simulate_reference
from tests.benchmarks.peers.problems import Problem, Simulation, linid_simulation

Array = NDArray[np.float64]

HARMONICS = 12
HEAD = 16  # numbers of a candidate before its harmonics


@dataclass(frozen=True)
class Simulator:
    """make(problem, setting): a simulation; settings: from coarse to fine; usual: the one used in fits; packages: what
    must be installed; limits: kind of problem -> why it cannot be expressed; parallel: simulates many candidates at
    once, values of all -> (C, N)."""

    name: str
    make: Callable[[Problem, Any], Simulation]
    settings: tuple[Any, ...]
    usual: Any
    packages: tuple[str, ...] = ()
    limits: tuple[tuple[str, str], ...] = ()
    parallel: Callable[[Problem, Any], Callable[[list[dict[str, float]]], Array]] | None = None


def missing(packages: tuple[str, ...]) -> str:
    """Why something cannot run here: the packages that are not installed, or nothing."""
    absent = []
    for package in packages:
        try:
            importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            absent.append(package)
    return f"not installed: {', '.join(absent)}" if absent else ""


def harmonics(kind: str, values: dict[str, float]) -> Array:
    """(HARMONICS,) N/A: amplitudes of sin((2 k + 1) angle), from eq. 31, or eqs. 33 and 37 written as Fourier series:
    Theta_0(z) = 8 sum over odd n of q^(n^2) sin(2 n z_L) sin(2 n z)."""
    out = np.zeros(HARMONICS)
    if kind == "sine":
        out[0] = values["force_constant"]
    elif kind == "theta":
        n = 2 * np.arange(HARMONICS) + 1
        out[:] = 8.0 * values["force_constant"] * values["nome"] ** (n * n) * np.sin(2 * n * values["winding_length"])
    return out


def candidate(kind: str, values: dict[str, float], added_mass: float) -> Array:
    """(HEAD + HARMONICS,) what the compiled right-hand sides read: friction, mass, field and its harmonics."""
    out = np.zeros(HEAD + HARMONICS)
    out[: len(FRICTION)] = [values[p.name] for p in FRICTION]
    out[7] += added_mass
    if kind in ("sine", "theta"):
        turns = 2.0 if kind == "theta" else 1.0
        out[8:11] = [turns * values[n] for n in ("electrical_wavenumber", "winding_displacement", "commutation_offset")]
        out[HEAD:] = harmonics(kind, values)
        significant = np.flatnonzero(np.abs(out[HEAD:]) > 1e-12 * np.max(np.abs(out[HEAD:])))
        out[11] = significant[-1] + 1 if significant.size else 0
    return out


def currents(recording: Recording) -> tuple[float, float, Array]:
    """Start in s, period in s and spline coefficients (n - 1, 3, 4) of the phase currents; all zero for free wheels."""
    n = recording.t.size
    dt = float(recording.t[-1] - recording.t[0]) / (n - 1)
    channels = recording.phase_currents
    if recording.kind == "free_wheel" or channels is None or not np.any(channels):
        return float(recording.t[0]), dt, np.zeros((0, 3, 4))
    return float(recording.t[0]), dt, np.transpose(cubic_spline_coefficients(dt, channels), (1, 0, 2))


def by_linid(problem: Problem, substeps: int) -> Simulation:
    simulate = linid_simulation(problem, substeps)
    model = problem.space.model
    return lambda values: simulate(model.vector(values)[None, :])[0]


def many_by_linid(problem: Problem, substeps: int) -> Callable[[list[dict[str, float]]], Array]:
    simulate = linid_simulation(problem, substeps)
    model = problem.space.model
    return lambda values: simulate(np.array([model.vector(v) for v in values]))


def by_scipy(problem: Problem, rtol: float) -> Simulation:
    """solve_ivp with LSODA on linid's reference equations, one call per recording."""
    kind = problem.space.model.kind

    def simulate(values: dict[str, float]) -> Array:
        rows = []
        for recording, start in zip(problem.recordings, problem.starts(values), strict=True):
            try:
                rows.append(simulate_reference(kind, values, recording, tuple(start), rtol=rtol)[0])
            except (RuntimeError, ValueError, OverflowError):
                rows.append(np.full(recording.t.size, math.nan))
        return np.concatenate(rows)

    return simulate


def _by_compiled(problem: Problem, solve: Callable[[Array, Recording, Array], Array]) -> Simulation:
    """solve(start, recording, data): positions of one recording; data: what the compiled right-hand sides read."""
    kind = problem.space.model.kind
    inputs = [currents(r) for r in problem.recordings]

    def simulate(values: dict[str, float]) -> Array:
        rows = []
        for recording, start, (t_0, dt, spline) in zip(problem.recordings, problem.starts(values), inputs, strict=True):
            head = candidate(kind, values, recording.added_mass)
            head[12:15] = t_0, dt, spline.shape[0]
            rows.append(solve(start, recording, np.concatenate([head, spline.ravel()])))
        return np.concatenate(rows)

    return simulate


def by_numbalsoda(problem: Problem, rtol: float) -> Simulation:
    """LSODA in C++ on a right-hand side compiled by numba: never enters the interpreter."""
    from numbalsoda import lsoda

    from tests.benchmarks.peers.compiled import address

    def solve(start: Array, recording: Recording, data: Array) -> Array:
        states, ok = lsoda(address(), start, recording.t, data, rtol=rtol, atol=1e-4 * rtol, mxstep=200_000)
        return states[:, 0].copy() if ok else np.full(recording.t.size, math.nan)

    return _by_compiled(problem, solve)


def by_numba(problem: Problem, substeps: int) -> Simulation:
    """Classical Runge-Kutta with fixed steps, the loop and the right-hand side compiled by numba."""
    from tests.benchmarks.peers.compiled import runge_kutta

    def solve(start: Array, recording: Recording, data: Array) -> Array:
        out = np.empty(recording.t.size)
        runge_kutta(start, data[12], data[13], substeps, data, out)
        return out

    return _by_compiled(problem, solve)


def by_diffrax(problem: Problem, rtol: float) -> Simulation:
    from tests.benchmarks.peers.with_jax import positions

    many = positions(problem, rtol)
    return lambda values: many([values])[0]


def many_by_diffrax(problem: Problem, rtol: float) -> Callable[[list[dict[str, float]]], Array]:
    from tests.benchmarks.peers.with_jax import positions

    return positions(problem, rtol)


def by_mujoco(problem: Problem, substeps: int) -> Simulation:
    """A sliding body with the LuGre friction of MuJoCo's `dcmotor` actuator, its voltage zero."""
    from tests.benchmarks.peers.with_mujoco import simulation

    return simulation(problem, substeps)


def by_casadi(problem: Problem, rtol: float) -> Simulation:
    """CVODES on CasADi's expressions, compiled for its virtual machine."""
    from tests.benchmarks.peers.with_casadi import Sensitivities

    runs = Sensitivities(problem, rtol)
    return lambda values: runs.positions(problem.space.encode(values))


def by_heyoka(problem: Problem, tolerance: float) -> Simulation:
    """Taylor series with adaptive steps, compiled by LLVM; |v| is switched by events."""
    from tests.benchmarks.peers.with_heyoka import Taylor

    return Taylor(problem, tolerance).positions


def by_amici(problem: Problem, tolerance: float) -> Simulation:
    """CVODES on the C++ that AMICI writes and compiles."""
    from tests.benchmarks.peers.with_amici import Amici

    return Amici(problem, tolerance).positions


_NO_TABLE = "left out: a spline's nodes are constants of its model, 303 for every piece of a recording"
_NO_SPLINE = "left out: its integrators take inputs that are constant between the samples, not splines"
_NO_FIELD = "has no motor whose force depends on position and three phase currents, except by callbacks written in full"
SIMULATORS = {
    s.name: s
    for s in (
        Simulator("linid", by_linid, (1, 2, 3, 4, 8, 16), None, parallel=many_by_linid),
        Simulator("scipy LSODA", by_scipy, (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10), 1e-7),
        Simulator("numbalsoda LSODA", by_numbalsoda, tuple(10.0**-k for k in range(3, 12)), 1e-7, ("numbalsoda",)),
        Simulator("numba RK4", by_numba, (1, 2, 3, 4, 6, 8, 12, 16, 32, 64), 8),
        Simulator(
            "diffrax Kvaerno5",
            by_diffrax,
            (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9),
            1e-6,
            ("diffrax", "jax"),
            parallel=many_by_diffrax,
        ),
        Simulator(
            "CasADi CVODES",
            by_casadi,
            (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10),
            1e-7,
            ("casadi",),
            (("sine", _NO_SPLINE), ("theta", _NO_SPLINE)),
        ),
        Simulator(
            "AMICI",
            by_amici,
            (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11),
            1e-7,
            ("amici", "antimony"),
            (("sine", _NO_TABLE), ("theta", _NO_TABLE)),
        ),
        Simulator("heyoka Taylor", by_heyoka, tuple(10.0**-k for k in range(3, 14)), 1e-6, ("heyoka",)),
        Simulator(
            "MuJoCo RK4",
            by_mujoco,
            (1, 2, 4, 8, 16, 32, 64),
            2,
            ("mujoco",),
            (("sine", _NO_FIELD), ("theta", _NO_FIELD)),
        ),
    )
}
