"""A slow twin of the voltage-driven simulation on scipy, written from the equations alone, with its energies."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from linid.arrays import Array
from linid.recording.recording import Recording
from linid.simulation.reference import motor_force


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

    winding: star (the neutral floats, L stands for L - M) or separate; values: SI by canonical name; start: y, v, w.
    Raises RuntimeError when scipy gives up.
    """
    assert recording.phase_voltages is not None
    t = recording.t
    spline = CubicSpline(t, recording.phase_voltages, axis=1)
    mutual = values.get("mutual_inductance", 0.0) if winding == "separate" else 0.0
    inductance = (values["phase_inductance"] - mutual) * np.eye(3) + mutual * np.ones((3, 3))
    inverse = np.linalg.inv(inductance)
    resistance = values["phase_resistance"]
    mass = values["mass"] + recording.added_mass
    sigma_0, sigma_1, sigma_2 = values["bristle_stiffness"], values["bristle_damping"], values["viscous_friction"]
    coulomb, static = values["coulomb_force"], values["static_force"]
    v_s, alpha = values["stribeck_velocity"], values["stribeck_exponent"]

    def constants(y: float) -> Array:
        return np.array([motor_force(kind, values, y, unit) for unit in np.eye(3)])

    def rates(time: float, state: Array) -> Array:
        y, v, w = state[:3]
        currents = state[3:6]
        emf = constants(y) * v
        voltages = spline(time)
        if winding == "star":
            voltages = voltages - np.mean(voltages - emf)
        current_rates = inverse @ (voltages - emf - resistance * currents)
        level = coulomb + (static - coulomb) * math.exp(-(abs(v / v_s) ** alpha))
        w_rate = v - sigma_0 * abs(v) * w / level
        thrust = float(constants(y) @ currents)
        a = (thrust - sigma_0 * w - sigma_1 * w_rate - sigma_2 * v) / mass
        powers = [voltages @ currents, resistance * currents @ currents, thrust * v]
        return np.concatenate([[v, a, w_rate], current_rates, powers])

    solution = solve_ivp(
        rates,
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
