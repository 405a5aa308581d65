"""The equations for diffrax: compiled by jax, mapped over recordings and candidates, differentiable."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

# One core, as every other peer has; must be set before jax is imported.
os.environ.setdefault(
    "XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1 inter_op_parallelism_threads=1"
)

import diffrax
import jax
import jax.numpy as jnp

from tests.benchmarks.peers.problems import Problem
from tests.benchmarks.peers.simulators import HARMONICS, HEAD, candidate, currents

jax.config.update("jax_enable_x64", True)

Array = NDArray[np.float64]


def _field(t: Any, state: Any, args: Any) -> Any:
    d, t_0, dt, spline = args
    y, v, w = state
    ratio = jnp.abs(v) / d[2]
    level = d[0] + (d[1] - d[0]) * jnp.exp(-(ratio ** d[3]))
    w_rate = v - d[4] * jnp.abs(v) * w / level
    force = 0.0
    if spline.shape[0]:
        k = jnp.clip(((t - t_0) / dt).astype(int), 0, spline.shape[0] - 1)
        powers = (t - t_0 - k * dt) ** jnp.arange(4)
        angle = d[8] * y + d[9] * jnp.arange(-1, 2) + d[10]
        odd = 2 * jnp.arange(HARMONICS) + 1
        force = jnp.sum(d[HEAD:] @ jnp.sin(odd[:, None] * angle) * (spline[k] @ powers))
    a = (force - d[4] * w - d[5] * w_rate - d[6] * v) / d[7]
    return jnp.stack([v, a, w_rate])


def solve(d: Any, start: Any, ts: Any, t_0: Any, dt: Any, spline: Any, rtol: Any, adjoint: Any = None) -> Any:
    """Positions (n,) of one recording; Kvaerno5 with a PID controller, as diffrax's documentation has it for stiff
    equations."""
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(_field),
        diffrax.Kvaerno5(),
        ts[0],
        ts[-1],
        None,
        start,
        args=(d, t_0, dt, spline),
        saveat=diffrax.SaveAt(ts=ts),
        max_steps=100_000,
        throw=False,
        stepsize_controller=diffrax.PIDController(rtol=rtol, atol=1e-4 * rtol, pcoeff=0.3, icoeff=0.4),
        adjoint=diffrax.RecursiveCheckpointAdjoint() if adjoint is None else adjoint,
    )
    return jnp.where(solution.result == diffrax.RESULTS.successful, solution.ys[:, 0], jnp.nan)


def stacked(problem: Problem) -> tuple[Array, Array, Array, Array]:
    """Times (R, n), starts (R,), periods (R,) and splines (R, n - 1, 3, 4); all recordings are of equal length."""
    rows = [currents(r) for r in problem.recordings]
    times = np.array([r.t for r in problem.recordings])
    return times, np.array([r[0] for r in rows]), np.array([r[1] for r in rows]), np.array([r[2] for r in rows])


def positions(problem: Problem, rtol: float) -> Callable[[list[dict[str, float]]], Array]:
    """Values of C candidates -> positions (C, N) in m, by one call of compiled code."""
    kind = problem.space.model.kind
    times, t_0, dt, spline = stacked(problem)
    over_recordings = jax.vmap(solve, in_axes=(0, 0, 0, 0, 0, 0, None))
    over_candidates = jax.jit(jax.vmap(over_recordings, in_axes=(0, 0, None, None, None, None, None)))

    def simulate(candidates: list[dict[str, float]]) -> Array:
        d = np.array([[candidate(kind, v, r.added_mass) for r in problem.recordings] for v in candidates])
        starts = np.array([problem.starts(v) for v in candidates])
        found = over_candidates(d, starts, times, t_0, dt, spline, rtol)
        return np.asarray(found).reshape(len(candidates), -1)

    return simulate


def derivatives(problem: Problem, rtol: float) -> Callable[[Array], Array]:
    """Point of the unit cube (p,) -> Jacobian (N, p) of the positions, by forward differentiation of the solver.

    The way from the unit cube to the right-hand side's numbers is differentiated by differences: it is smooth.
    """
    kind = problem.space.model.kind
    times, t_0, dt, spline = stacked(problem)

    def slope(d: Any, start: Any, d_dot: Any, start_dot: Any, *rest: Any) -> Any:
        def along(d: Any, start: Any) -> Any:
            return solve(d, start, *rest, adjoint=diffrax.ForwardMode())

        return jax.jvp(along, (d, start), (d_dot, start_dot))[1]

    over_recordings = jax.vmap(slope, in_axes=(0, 0, 0, 0, 0, 0, 0, 0, None))
    over_genes = jax.jit(jax.vmap(over_recordings, in_axes=(None, None, 0, 0, None, None, None, None, None)))

    def numbers(x: Array) -> tuple[Array, Array]:
        values = problem.values(x)
        return np.array([candidate(kind, values, r.added_mass) for r in problem.recordings]), problem.starts(values)

    def jacobian(x: Array) -> Array:
        h = 1e-6
        d, start = numbers(x)
        pairs = []
        for column in range(x.size):
            up, down = x.copy(), x.copy()
            up[column], down[column] = min(x[column] + h, 1.0), max(x[column] - h, 0.0)
            width = up[column] - down[column]
            pairs.append([(a - b) / width for a, b in zip(numbers(up), numbers(down), strict=True)])
        d_dots, start_dots = (np.array([pair[k] for pair in pairs]) for k in (0, 1))
        found = over_genes(d, start, d_dots, start_dots, times, t_0, dt, spline, rtol)
        return np.nan_to_num(np.asarray(found).reshape(x.size, -1).T, nan=0.0, posinf=0.0, neginf=0.0)

    return jacobian
