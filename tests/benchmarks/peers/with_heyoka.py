"""The equations for heyoka: Taylor series compiled by LLVM, variational equations for exact derivatives.

|v| is s v with a parameter s = 1 or -1 that an event turns at v = 0; what it multiplies is zero there, so that states
and sensitivities pass without a jump. Currents are cubic polynomials from one sample to the next, their coefficients
parameters that are set anew at every sample.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

from linid.physics.friction import PARAMETERS as FRICTION
from linid.recording.recording import Recording
from tests.benchmarks.peers.problems import Problem
from tests.benchmarks.peers.simulators import HARMONICS, candidate, currents
from tests.benchmarks.peers.slopes import by_differences

Array = NDArray[np.float64]

# Parameters of the integrator: friction and mass as in linid's table (its exponent is 2 and not among them), the field,
# then those that change on the way: s, the sample's time and the three currents' coefficients.
LAW = tuple(p.name for p in FRICTION if p.name != "stribeck_exponent")
FIELD = {
    "friction": (),
    "sine": ("force_constant", "electrical_wavenumber", "winding_displacement", "commutation_offset"),
    "theta": (
        "force_constant",
        "electrical_wavenumber",
        "winding_displacement",
        "commutation_offset",
        "winding_length",
        "nome",
    ),
}
# Steps of one recording after which it has failed: the stand takes 200, an explicit method more for stiffer bristles.
MOST = 3_000
_MASS = LAW.index("mass")
# Speeds, in Stribeck velocities, at which a step has to end: from farther off its series do not see friction's peak.
_ENDS = (5.0, 2.5)
_COOLDOWN = 1e-9  # s after a reversal in which another one is not looked for


@dataclass(frozen=True)
class Compiled:
    """One integrator and where its parameters are; first: its state before anything happened."""

    integrator: Any
    first: Array
    sign: int
    rows: slice | None

    @property
    def sensitivities(self) -> slice:
        """Where the derivatives of the position are in the state."""
        return self.integrator.get_vslice(order=1, component=0)


def _turn(index: int) -> Callable[[Any, int], bool]:
    def callback(integrator: Any, direction: int) -> bool:
        integrator.pars[index] = -integrator.pars[index]
        return True

    return callback


def _thrust(kind: str, y: Any, harmonics: int, sign: int) -> Any:
    """Motor force in N at y in m as an expression of parameters after those of friction."""
    field = {name: hy.par[len(LAW) + k] for k, name in enumerate(FIELD[kind])}
    s = hy.time - hy.par[sign + 1]
    terms = []
    for j in range(3):
        c = [hy.par[sign + 2 + 4 * j + power] for power in range(4)]
        current = c[0] + s * (c[1] + s * (c[2] + s * c[3]))
        angle = (
            field["electrical_wavenumber"] * y + (j - 1) * field["winding_displacement"] + field["commutation_offset"]
        )
        if kind == "sine":
            terms.append(current * hy.sin(angle))
            continue
        odd = [2.0 * k + 1.0 for k in range(harmonics)]
        waves = [
            8.0 * field["nome"] ** (n * n) * hy.sin(2.0 * n * field["winding_length"]) * hy.sin(2.0 * n * angle)
            for n in odd
        ]
        terms.append(current * hy.sum(waves))
    return field["force_constant"] * hy.sum(terms)


@cache
def compiled(kind: str, tolerance: float, harmonics: int, exact: bool) -> Compiled:
    """The integrator of a kind of problem; exact: with sensitivities to what is searched, and to z."""
    y, v, z = hy.make_vars("y", "v", "z")  # m, m/s, and the bristle's force in N
    law = {name: hy.par[k] for k, name in enumerate(LAW)}
    fixed = len(LAW) + len(FIELD[kind])
    turn = hy.par[fixed]
    decay = hy.exp(-((v / law["stribeck_velocity"]) ** 2.0))
    level = law["coulomb_force"] + (law["static_force"] - law["coulomb_force"]) * decay
    w_rate = v - turn * v * z / level
    force = -z - law["bristle_damping"] * w_rate - law["viscous_friction"] * v
    if kind != "friction":
        force = force + _thrust(kind, y, harmonics, fixed)
    system: Any = [(y, v), (v, force / law["mass"]), (z, law["bristle_stiffness"] * w_rate)]
    falling = hy.event_direction.negative
    events = [hy.t_event(turn * v, callback=_turn(fixed), direction=falling, cooldown=_COOLDOWN)] + [
        hy.t_event(turn * v - u * law["stribeck_velocity"], callback=lambda *_: True, direction=falling) for u in _ENDS
    ]
    if exact:
        searched = range(fixed) if kind == "friction" else range(len(LAW), fixed)
        system = hy.var_ode_sys(system, [hy.par[k] for k in searched] + ([z] if kind == "friction" else []), order=1)
    integrator = hy.taylor_adaptive(
        system, state=[0.0, 0.0, 0.0], tol=tolerance, t_events=events, compact_mode=kind == "theta"
    )
    return Compiled(
        integrator, integrator.state.copy(), fixed, None if kind == "friction" else slice(fixed + 1, fixed + 14)
    )


class Taylor:
    """Positions and their exact Jacobian of a problem's recordings at a relative tolerance."""

    def __init__(self, problem: Problem, tolerance: float) -> None:
        self.problem, self.tolerance = problem, tolerance
        self.kind = problem.space.model.kind
        self.inputs = [_rows(r) for r in problem.recordings]

    def positions(self, values: dict[str, float]) -> Array:
        """(N,) m; nan from the first recording on that needs too many steps."""
        return self._all(values, False)[:, 0]

    def jacobian(self, x: Array) -> Array:
        """(N, p) m at a point of the unit cube (p,); zero where the positions are nan.

        The way from the unit cube to the integrator's parameters is smooth and differentiated by differences.
        """
        slopes = self._all(self.problem.values(x), True)
        chain = by_differences(lambda at: np.concatenate(self._numbers(self.problem.values(at))), x)
        recordings, width = len(self.problem.recordings), slopes.shape[1]
        parameters, firsts = chain[:-recordings], chain[-recordings:]
        out = slopes[:, : parameters.shape[0]] @ parameters
        if width > parameters.shape[0]:  # the bristle's first force depends on the friction too
            samples = [r.t.size for r in self.problem.recordings]
            out += slopes[:, -1:] * np.repeat(firsts, samples, axis=0)
        return np.nan_to_num(out, nan=0.0, posinf=0.0, neginf=0.0)

    def _numbers(self, values: dict[str, float]) -> tuple[Array, Array]:
        """What derivatives are taken by, and the first bristle forces (R,) in N."""
        names = LAW if self.kind == "friction" else FIELD[self.kind]
        first = self.problem.starts(values)[:, 2] * values["bristle_stiffness"]
        return np.array([values[name] for name in names]), first

    def _all(self, values: dict[str, float], exact: bool) -> Array:
        if values["stribeck_exponent"] != 2.0:
            raise ValueError("heyoka's Taylor series need a Stribeck exponent of 2")
        harmonics = 1
        if self.kind == "theta":  # few for flat fields, all for the steepest ones; compiled once each
            needed = int(candidate(self.kind, values, 0.0)[11])
            harmonics = next(count for count in (4, HARMONICS) if needed <= count)
        program = compiled(self.kind, self.tolerance, harmonics, exact)
        rows, failed = [], False
        for k, (recording, start) in enumerate(zip(self.problem.recordings, self.problem.starts(values), strict=True)):
            found = None if failed else _run(program, values, self.kind, recording, start, self.inputs[k], exact)
            failed = found is None
            width = 1 if not exact else program.sensitivities.stop - program.sensitivities.start
            rows.append(np.full((recording.t.size, width), np.nan) if found is None else found)
        return np.vstack(rows)


def _rows(recording: Recording) -> Array:
    """(n - 1, 13) start of the interval in s and the currents' coefficients in A / s^k; empty for free wheels."""
    _, dt, spline = currents(recording)
    times = np.arange(spline.shape[0]) * dt
    return np.column_stack([times, spline.reshape(spline.shape[0], 12)])


def _run(
    program: Compiled,
    values: dict[str, float],
    kind: str,
    recording: Recording,
    start: Array,
    inputs: Array,
    exact: bool,
) -> Array | None:
    """(n, 1) positions in m, or (n, q) their derivatives; nothing where the steps do not suffice."""
    one, grid = program.integrator, recording.t - recording.t[0]
    one.time = 0.0
    one.reset_cooldowns()
    one.state[:] = program.first
    one.state[:3] = start[0], start[1], start[2] * values["bristle_stiffness"]
    one.pars[: program.sign] = [values[name] for name in (*LAW, *FIELD[kind])]
    one.pars[_MASS] += recording.added_mass
    one.pars[program.sign] = -1.0 if start[1] < 0.0 else 1.0
    wanted = program.sensitivities if exact else slice(0, 1)
    if program.rows is None:
        outcome, *_, states = one.propagate_grid(grid, max_steps=MOST)
        return states[:, wanted] if outcome == hy.taylor_outcome.time_limit else None
    out = np.empty((grid.size, wanted.stop - wanted.start))
    out[0] = one.state[wanted]
    return (
        out if _driven(program, inputs if inputs.size else np.zeros((grid.size - 1, 13)), grid, out, wanted) else None
    )


def _driven(program: Compiled, inputs: Array, grid: Array, out: Array, wanted: slice) -> bool:
    """Fill out (n, q) sample by sample; whether it succeeded."""
    one, state, pars = program.integrator, program.integrator.state, program.integrator.pars
    propagate, sign, rows, good = one.propagate_until, program.sign, program.rows, hy.taylor_outcome.time_limit
    for k in range(grid.size - 1):
        pars[rows] = inputs[k]
        v = state[1]
        if v * pars[sign] < 0.0:
            pars[sign] = -pars[sign]
        elif v == 0.0:
            pars[sign] = _first_direction(program)
        if propagate(grid[k + 1], max_steps=MOST)[0] != good:
            return False
        out[k + 1] = state[wanted]
    return True


def _first_direction(program: Compiled) -> float:
    """1 or -1: where the motor goes from rest, by the speed after a very short step."""
    one = program.integrator
    before, time = one.state.copy(), one.time
    one.propagate_for(1e-7)
    direction = -1.0 if one.state[1] < 0.0 else 1.0
    one.state[:], one.time = before, time
    one.reset_cooldowns()
    return direction
