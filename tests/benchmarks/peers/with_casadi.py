"""The equations for CasADi: solved by SUNDIALS' CVODES, whose forward sensitivities are exact derivatives."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from linid.recording.recording import Recording
from tests.benchmarks.peers.problems import Problem

Array = NDArray[np.float64]

_UNITS = ca.DM([1.0, 1.0, 1e-4])  # of y, v and the bristle


def parameters(problem: Problem, x: Any) -> dict[str, Any]:
    """SI values as expressions of a point of the unit cube (p,), as `Problem.values` has them in numbers."""
    values: dict[str, Any] = dict(problem.space.fixed)
    for k, p in enumerate(problem.space.parameters):
        values[p.name] = p.lower * (p.upper / p.lower) ** x[k] if p.log else p.lower + (p.upper - p.lower) * x[k]
    values["static_force"] *= values["coulomb_force"]
    values["bristle_damping"] *= 2.0 * ca.sqrt(values["bristle_stiffness"] * values["mass"])
    return values


def level(values: dict[str, Any], v: Any) -> Any:
    """Friction force of steady sliding in N, without its viscous part."""
    decay = ca.exp(-((ca.fabs(v) / values["stribeck_velocity"]) ** values["stribeck_exponent"]))
    return values["coulomb_force"] + (values["static_force"] - values["coulomb_force"]) * decay


def rate(values: dict[str, Any], added_mass: float, state: Any) -> Any:
    """d/dt of y in m, v in m/s and w in m of a free wheel."""
    v, w = state[1], state[2]
    w_rate = v - values["bristle_stiffness"] * ca.fabs(v) * w / level(values, v)
    force = -values["bristle_stiffness"] * w - values["bristle_damping"] * w_rate - values["viscous_friction"] * v
    return ca.vertcat(v, force / (values["mass"] + added_mass), w_rate)


def start_of(values: dict[str, Any], state: Array) -> Any:
    """Start state (3,) of a candidate, the bristle steady where it is not given."""
    y, v, w = (float(one) for one in state)
    steady = np.sign(v) * level(values, v) / values["bristle_stiffness"]
    return ca.vertcat(y, v, steady if np.isnan(w) else w)


class Sensitivities:
    """Free wheels by CVODES: positions (N,) at a point of the unit cube, and their Jacobian (N, p) by its forward
    sensitivities."""

    def __init__(self, problem: Problem, rtol: float) -> None:
        self.problem = problem
        x, state = ca.SX.sym("x", problem.dimension), ca.SX.sym("s", 3)
        values = parameters(problem, x)
        self._runs = []
        for k, recording in enumerate(problem.recordings):
            right = rate(values, recording.added_mass, state * _UNITS) / _UNITS
            grid = recording.t - recording.t[0]
            options = {"reltol": rtol, "abstol": 1e-2 * rtol, "max_num_steps": 200_000, "print_stats": False}
            run = ca.integrator(f"run_{k}", "cvodes", {"x": state, "p": x, "ode": right}, 0.0, grid[1:], options)
            free = ca.MX.sym("x", problem.dimension)
            start = start_of(parameters(problem, free), problem.states[k])
            y = ca.horzcat(start[0], run(x0=start / _UNITS, p=free)["xf"][0, :]).T
            self._runs.append((ca.Function("y", [free], [y]), ca.Function("j", [free], [ca.jacobian(y, free)])))

    def positions(self, x: Array) -> Array:
        """(N,) m; nan where CVODES gives up."""
        return np.concatenate([self._one(run, x, recording)[:, 0] for (run, _), recording in self._pairs()])

    def jacobian(self, x: Array) -> Array:
        """(N, p) m; zero where CVODES gives up."""
        rows = [self._one(slopes, x, recording, x.size) for (_, slopes), recording in self._pairs()]
        return np.nan_to_num(np.vstack(rows), nan=0.0, posinf=0.0, neginf=0.0)

    def _pairs(self) -> list[tuple[Any, Recording]]:
        return list(zip(self._runs, self.problem.recordings, strict=True))

    def _one(self, function: Any, x: Array, recording: Recording, width: int = 1) -> Array:
        try:
            return np.array(function(x)).reshape(recording.t.size, width)
        except RuntimeError:
            return np.full((recording.t.size, width), np.nan)
