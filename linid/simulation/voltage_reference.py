"""A slow twin of the voltage-driven simulation on scipy, written from the equations alone, with its energies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import PPoly

from linid.arrays import Array
from linid.recording.input_course import input_coefficients
from linid.recording.recording import Recording
from linid.simulation.reference import Friction, motor_force


@dataclass(frozen=True)
class DrivenByVoltage:
    """A reference run: y (n,) m, v (n,) m/s, currents (3, n) A, and up to each sample the electrical input, copper
    loss, mechanical work and stored magnetic energy, (n,) J each."""

    y: Array
    v: Array
    currents: Array
    electrical: Array
    copper: Array
    mechanical: Array
    stored: Array


@dataclass(frozen=True)
class _Run:
    """The equations of a motor and its windings under its phase voltages."""

    kind: str
    winding: str
    values: dict[str, float]
    friction: Friction
    voltages: PPoly
    inverse: Array  # of the inductances, 1/H
    mass: float

    def constants(self, y: float) -> Array:
        """Force per current (3,) in N/A, and back-EMF per speed, at y in m."""
        return np.array([motor_force(self.kind, self.values, y, unit) for unit in np.eye(3)])

    def rates(self, time: float, state: Array) -> Array:
        """Time derivatives of y, v, w, the currents, and three energies: electrical input, copper loss, work."""
        y, v, w = state[:3]
        currents, friction, resistance = state[3:6], self.friction, self.values["phase_resistance"]
        emf = self.constants(y) * v
        voltages = self.voltages(time)
        if self.winding == "star":
            voltages = voltages - np.mean(voltages - emf)
        current_rates = self.inverse @ (voltages - emf - resistance * currents)
        w_rate = v - friction.sigma_0 * abs(v) * w / friction.level(v)
        thrust = float(self.constants(y) @ currents)
        a = (thrust - friction.sigma_0 * w - friction.sigma_1 * w_rate - friction.sigma_2 * v) / self.mass
        powers = [voltages @ currents, resistance * currents @ currents, thrust * v]
        return np.concatenate([[v, a, w_rate], current_rates, powers])


def simulate_voltage_reference(
    kind: str,
    winding: str,
    values: dict[str, float],
    recording: Recording,
    start: tuple[float, float, float],
    start_currents: tuple[float, float, float],
    *,
    rtol: float = 1e-10,
    max_step: float = 1e-3,
) -> DrivenByVoltage:
    """Motion and currents of a sine or theta motor under a recording's phase voltages; eqs. 5, 31, 39, 40 to 45.

    winding: star (the neutral floats, L stands for L - M) or separate; values: SI by canonical name; start: y
    in m, v in m/s, w in m; start_currents: A; rtol: relative tolerance, dimensionless; max_step: s.
    Raises RuntimeError when scipy gives up.
    """
    assert recording.phase_voltages is not None
    t = recording.t
    mutual = values.get("mutual_inductance", 0.0) if winding == "separate" else 0.0
    inductance = (values["phase_inductance"] - mutual) * np.eye(3) + mutual * np.ones((3, 3))
    inverse = np.asarray(np.linalg.inv(inductance), dtype=np.float64)
    between = input_coefficients(recording, recording.phase_voltages)
    spline, mass = PPoly(between.transpose(2, 1, 0)[::-1], t), values["mass"] + recording.added_mass
    run = _Run(kind, winding, values, Friction.of(values), spline, inverse, mass)
    solution = solve_ivp(
        run.rates,
        (t[0], t[-1]),
        np.concatenate([start, start_currents, np.zeros(3)]),
        method="LSODA",
        t_eval=t,
        rtol=rtol,
        atol=np.concatenate([[1e-11, 1e-10, 1e-13], np.full(3, 1e-11), np.full(3, 1e-11)]),
        max_step=max_step,
    )
    if not solution.success:
        raise RuntimeError(f"reference integration stopped: {solution.message}")
    y, v, _, *rest = solution.y
    currents = np.array(rest[:3])
    stored = 0.5 * np.einsum("in,ij,jn->n", currents, inductance, currents)
    return DrivenByVoltage(y, v, currents, rest[3], rest[4], rest[5], stored)
