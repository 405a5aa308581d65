"""Multiple shooting by CasADi and IPOPT: the states at the ends of short segments are variables beside the parameters.

Within a segment go steps of RODAS3 (Rosenbrock, four stages, order 3, L-stable, so that stiff bristles cost nothing).
The simulated positions are variables too: so the objective's Hessian in the sense of Gauss and Newton is a diagonal.
"""

from __future__ import annotations

import contextlib
import math
import tempfile
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from linid.identification.signals.motion import measure_motion
from linid.recording.recording import Recording
from tests.benchmarks.peers.problems import Problem
from tests.benchmarks.peers.simulators import HARMONICS, currents
from tests.benchmarks.peers.with_casadi import level, parameters, start_of

Array = NDArray[np.float64]

UNITS = np.array([1e-3, 1e-1, 1e-4])  # of y in m, v in m/s, w in m: what the states at the nodes are multiples of
RESIDUAL = 1e-5  # m, the unit of position errors in the objective
SEGMENT = {"friction": 50, "sine": 25, "theta": 25}  # samples between two nodes
SUBSTEPS = {"friction": 1, "sine": 2, "theta": 2}  # steps per sample: errors of 0.03 um and 0.4 um
# RODAS3 in the form that needs no product with the Jacobian: times, weights of earlier stages, of time's derivative.
_GAMMA = 0.5
_TIMES = (0.0, 0.0, 1.0, 1.0)
_OF_TIME = (0.5, 1.5, 0.0, 0.0)
_STATES: tuple[tuple[float, ...], ...] = ((), (0.0,), (2.0, 0.0), (2.0, 0.0, 1.0))
_SLOPES: tuple[tuple[float, ...], ...] = ((), (4.0,), (1.0, -1.0), (1.0, -1.0, -8.0 / 3.0))
_LAST = (2.0, 0.0, 1.0, 1.0)


def odd_sines(angle: Any, count: int) -> list[Any]:
    """sin((2 k + 1) angle) for k below count, by their recurrence."""
    out = [-ca.sin(angle), ca.sin(angle)]
    for _ in range(count - 1):
        out.append(2.0 * ca.cos(2.0 * angle) * out[-1] - out[-2])
    return out[1:]


def harmonics_of(values: dict[str, Any]) -> list[Any]:
    """N/A: amplitudes of the odd harmonics of twice the angle, of a theta motor."""
    waves = odd_sines(2.0 * values["winding_length"], HARMONICS)
    sizes = [values["nome"] ** float((2 * k + 1) ** 2) for k in range(HARMONICS)]
    return [8.0 * values["force_constant"] * size * wave for size, wave in zip(sizes, waves, strict=True)]


def thrust(kind: str, values: dict[str, Any], sizes: list[Any], y: Any, i: list[Any]) -> Any:
    """Motor force in N at y in m with the currents i in A; sizes: `harmonics_of` the values, for theta motors."""
    force: Any = 0.0
    for j in range(3):
        angle = values["electrical_wavenumber"] * y + (j - 1) * values["winding_displacement"]
        angle += values["commutation_offset"]
        if kind == "sine":
            force += i[j] * values["force_constant"] * ca.sin(angle)
        else:
            waves = odd_sines(2.0 * angle, HARMONICS)
            force += i[j] * sum(size * wave for size, wave in zip(sizes, waves, strict=True))
    return force


def rates(values: dict[str, Any], mass: Any, state: Any, force: Any) -> Any:
    """d/dt of y in m, v in m/s and w in m; mass in kg with what was added, force in N of the motor."""
    v, w = state[1], state[2]
    w_rate = v - values["bristle_stiffness"] * ca.fabs(v) * w / level(values, v)
    force -= values["bristle_stiffness"] * w + values["bristle_damping"] * w_rate + values["viscous_friction"] * v
    return ca.vertcat(v, force / mass, w_rate)


def values_of(problem: Problem, x: Any) -> dict[str, Any]:
    """SI values as expressions of a point of the unit cube (p,)."""
    if problem.space.model.kind == "friction":
        return parameters(problem, x)
    values: dict[str, Any] = dict(problem.space.fixed)
    for k, p in enumerate(problem.space.parameters):
        values[p.name] = p.lower * (p.upper / p.lower) ** x[k] if p.log else p.lower + (p.upper - p.lower) * x[k]
    if problem.space.model.kind == "theta":  # what is searched is the amplitude of the first harmonic
        values["force_constant"] /= 8.0 * values["nome"] * ca.sin(2.0 * values["winding_length"])
    return values


def one_step(problem: Problem, h: float) -> Any:
    """Function of one step of h s: (state (3,) in UNITS, t in s since the sample, the currents' coefficients (12,) in
    A / s^k, added mass in kg, point (p,)) -> state after it."""
    state, t, spline = ca.SX.sym("state", 3), ca.SX.sym("t"), ca.SX.sym("spline", 12)
    added, x = ca.SX.sym("added"), ca.SX.sym("x", problem.dimension)
    kind, values, units = problem.space.model.kind, values_of(problem, x), ca.DM(UNITS)
    sizes = harmonics_of(values) if kind == "theta" else []

    def right(at: Any, moment: Any) -> Any:
        i = [sum(spline[4 * j + power] * moment**power for power in range(4)) for j in range(3)]
        force = 0.0 if kind == "friction" else thrust(kind, values, sizes, at[0] * units[0], i)
        return rates(values, values["mass"] + added, at * units, force) / units

    slope = right(state, t)
    matrix = ca.inv(ca.SX.eye(3) / (h * _GAMMA) - ca.jacobian(slope, state))
    by_time = ca.jacobian(slope, t)
    stages: list[Any] = []
    for k in range(4):
        at = state + _weighted(_STATES[k], stages)
        total = right(at, t + _TIMES[k] * h) + _weighted(_SLOPES[k], stages) / h + _OF_TIME[k] * h * by_time
        stages.append(matrix @ total)
    return ca.Function("step", [state, t, spline, added, x], [state + _weighted(_LAST, stages)])


def _weighted(weights: tuple[float, ...], stages: list[Any]) -> Any:
    return sum((a * stage for a, stage in zip(weights, stages, strict=True)), ca.SX.zeros(3))


class Shooting:
    """One nonlinear program: the unit cube's point (p,), the states at the nodes (3, S), the positions (N,).

    watched: (number of unknowns, number of equations) -> IPOPT's callback; fast: compiled by the C compiler first.
    """

    def __init__(self, problem: Problem, watched: Callable[[int, int], Any] | None = None, fast: bool = False) -> None:
        self.problem, self.kind = problem, problem.space.model.kind
        self.length = SEGMENT[self.kind]
        # (recording, first sample) of every segment; the last one of a recording may reach beyond its end.
        self.segments = [
            (k, begin) for k, r in enumerate(problem.recordings) for begin in range(0, r.t.size - 1, self.length)
        ]
        count, p = len(self.segments), problem.dimension
        x, nodes = ca.MX.sym("x", p), ca.MX.sym("nodes", 3, count)
        ends, inside = self._simulated(x, nodes)
        firsts = [start_of(values_of(problem, x), problem.states[k]) / ca.DM(UNITS) for k in range(len(self.starts))]
        follows = [k for k in range(1, count) if self.segments[k][1]]
        found = ca.vec(inside)[self._samples().tolist()]
        positions = ca.MX.sym("y", found.numel())
        measured = np.concatenate([r.y[1:] for r in problem.recordings])
        program = {
            "x": ca.vertcat(x, ca.vec(nodes), positions),
            "f": ca.sumsqr(positions) / measured.size,
            "g": ca.vertcat(
                ca.vec(ends[:, [k - 1 for k in follows]] - nodes[:, follows]),
                ca.vec(nodes[:, self.starts] - ca.horzcat(*firsts)),
                (found * UNITS[0] - measured) / RESIDUAL - positions,
            ),
        }
        self.size, equations = program["x"].numel(), program["g"].numel()
        ipopt = {"print_level": 0, "sb": "yes", "max_iter": 100}
        options: dict[str, Any] = {"print_time": False, "ipopt": ipopt}
        if fast:
            options |= {"jit": True, "compiler": "shell", "jit_options": {"flags": ["-O1"]}}
        options["hess_lag"] = _gauss(self.size, measured.size, equations)
        if watched is not None:
            self.callback = options["iteration_callback"] = watched(self.size, equations)
        self.folder = tempfile.TemporaryDirectory()
        with contextlib.chdir(self.folder.name):  # where compiling leaves its files
            self.solver = ca.nlpsol("shooting", "ipopt", program, options)
        self.simulated = ca.Function("simulated", [x, nodes], [ends, found * UNITS[0]])

    @property
    def starts(self) -> list[int]:
        """Segments with which a recording begins."""
        return [k for k, (_, begin) in enumerate(self.segments) if begin == 0]

    def _samples(self) -> NDArray[np.int64]:
        """Where the positions of all samples but the first of each recording are among those of all segments."""
        rows = []
        for k, (recording, begin) in enumerate(self.segments):
            left = min(self.length, self.problem.recordings[recording].t.size - 1 - begin)
            rows.append(k * self.length + np.arange(left))
        return np.concatenate(rows)

    def _simulated(self, x: Any, nodes: Any) -> tuple[Any, Any]:
        """States (3, S) at the segments' ends in UNITS and positions (length, S) at their samples in UNITS."""
        steps = SUBSTEPS[self.kind]
        h = self.problem.recordings[0].period / steps
        chain = one_step(self.problem, h).mapaccum(self.length * steps)
        state, point = ca.MX.sym("state", 3), ca.MX.sym("x", x.numel())
        splines, added = ca.MX.sym("splines", 12, self.length), ca.MX.sym("added")
        times = np.tile(np.arange(steps) * h, self.length)[None, :]
        repeated = ca.horzcat(*(splines[:, n // steps] for n in range(self.length * steps)))
        states = chain(state, times, repeated, added, ca.repmat(point, 1, self.length * steps))
        out = [states[:, -1], states[0, steps - 1 :: steps].T]
        one = ca.Function("segment", [state, splines, added, point], out).map(len(self.segments))
        inputs = np.hstack([self._splines(k, begin) for k, begin in self.segments])
        masses = np.array([[self.problem.recordings[k].added_mass for k, _ in self.segments]])
        ends, inside = one(nodes, inputs, masses, ca.repmat(x, 1, len(self.segments)))
        return ends, inside

    def _splines(self, k: int, begin: int) -> Array:
        """(12, length) coefficients of the currents of one segment; zero beyond the recording's end."""
        out = np.zeros((12, self.length))
        spline = currents(self.problem.recordings[k])[2][begin : begin + self.length]
        out[:, : spline.shape[0]] = spline.reshape(spline.shape[0], 12).T
        return out

    def start(self, x: Array) -> Array:
        """All unknowns at a point (p,): nodes on the measured motion, the bristle that of steady sliding."""
        values = self.problem.values(x)
        nodes = np.array([_measured(self.problem.recordings[k], begin, values) for k, begin in self.segments])
        errors = np.zeros(self.size - x.size - nodes.size)
        return np.concatenate([x, (nodes / UNITS).ravel(), errors])

    def solve(self, x: Array) -> Array:
        """The point of the unit cube at which IPOPT ends from a start (p,)."""
        lower, upper = np.full(self.size, -np.inf), np.full(self.size, np.inf)
        lower[: x.size], upper[: x.size] = 0.0, 1.0
        found = self.solver(x0=self.start(x), lbx=lower, ubx=upper, lbg=0.0, ubg=0.0)
        return np.array(found["x"]).ravel()[: x.size]


def watched_by(look: Callable[[Array], bool], dimension: int) -> Callable[[int, int], Any]:
    """IPOPT's callback: look(point of the unit cube (p,)) says with every iterate whether to stop."""

    class Look(ca.Callback):  # type: ignore[misc]
        """Called by IPOPT with what `nlpsol` gives back."""

        def __init__(self, unknowns: int, equations: int) -> None:
            ca.Callback.__init__(self)
            self.lengths = {"f": 1, "x": unknowns, "lam_x": unknowns, "g": equations, "lam_g": equations}
            self.construct("look", {})

        def get_n_in(self) -> int:
            return int(ca.nlpsol_n_out())

        def get_n_out(self) -> int:
            return 1

        def get_sparsity_in(self, k: int) -> Any:
            length = self.lengths.get(ca.nlpsol_out(k), 0)
            return ca.Sparsity.dense(length, 1) if length else ca.Sparsity(0, 0)

        def eval(self, found: Any) -> list[int]:
            places = [ca.nlpsol_out(k) for k in range(len(found))]
            return [int(look(np.array(found[places.index("x")]).ravel()[:dimension]))]

    return Look


def _measured(recording: Recording, sample: int, values: dict[str, float]) -> Array:
    """y in m, v in m/s and steady w in m at a sample of the measured motion."""
    v = float(measure_motion([recording]).v[sample])
    decay = math.exp(-((v / values["stribeck_velocity"]) ** 2))
    steady = values["coulomb_force"] + (values["static_force"] - values["coulomb_force"]) * decay
    return np.array([recording.y[sample], v, math.tanh(v / 1e-2) * steady / values["bristle_stiffness"]])


def _gauss(size: int, samples: int, equations: int) -> Any:
    """The objective's Hessian, which is constant, without the constraints' curvature; positions stand last."""
    places = list(range(size - samples, size))
    curve = ca.DM.triplet(places, places, ca.DM([2.0 / samples] * samples), size, size)
    unknowns, weight, multipliers = ca.MX.sym("x", size), ca.MX.sym("f"), ca.MX.sym("g", equations)
    return ca.Function("hessian", [unknowns, ca.MX(0, 1), weight, multipliers], [weight * ca.MX(curve)])
