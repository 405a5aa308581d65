"""A slow twin of the compiled simulation on scipy, written from the equations alone; for tests and benchmarks."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from linid.recording.recording import Recording

Array = NDArray[np.float64]


def _theta0(z: float, q: float, z_L: float) -> float:
    """Theta0 from the double Gaussian-free definition: differences of theta3 series (eqs. 33, 36, 37)."""

    def theta3(x: float) -> float:
        reach = 3 + math.ceil(math.sqrt(40.0 / -math.log(q)))
        return 1.0 + 2.0 * sum(q ** (n * n) * math.cos(2 * n * x) for n in range(1, reach))

    def theta(x: float) -> float:
        return theta3(x) - theta3(x - math.pi / 2)

    return theta(z - z_L) - theta(z + z_L)


def motor_force(kind: str, values: dict[str, float], y: float, currents: Array) -> float:
    """Motor force in N at position y (m) and phase currents (3,) A, from eqs. 31 and 39."""
    if kind == "force":
        return values["force_constant"] * float(currents[0])
    if kind == "friction":
        return 0.0
    density, displacement, shift = values["guideway_density"], values["winding_displacement"], values["shift"]
    total = 0.0
    for j in (1, 2, 3):
        angle = density * y + displacement * (j - 2) + shift
        shape = math.sin(angle) if kind == "sine" else _theta0(angle, values["nome"], values["winding_length"])
        total += shape * float(currents[j - 1])
    return values["force_constant"] * total


def simulate_reference(
    kind: str,
    values: dict[str, float],
    recording: Recording,
    start: tuple[float, float, float],
    *,
    rtol: float = 1e-9,
    method: str = "LSODA",
    max_step: float | None = None,
) -> tuple[Array, Array]:
    """Position (n,) m and velocity (n,) m/s by scipy.integrate.solve_ivp; eqs. 40-45 as corrected.

    values: canonical parameter name -> SI value; start: y, v, w. Raises RuntimeError when scipy gives up.
    """
    t = recording.t
    channels = recording.phase_currents if recording.phase_currents is not None else recording.drive_input
    spline = None if channels is None else CubicSpline(t, np.atleast_2d(channels), axis=1)
    mass = values["mass"] + recording.added_mass
    sigma_0, sigma_1, sigma_2 = values["bristle_stiffness"], values["bristle_damping"], values["viscous_friction"]
    coulomb, static = values["coulomb_force"], values["static_force"]
    v_s, alpha = values["stribeck_velocity"], values["stribeck_exponent"]
    constant = values.get("constant_force", 0.0)

    def right_hand_side(time: float, state: Array) -> list[float]:
        y, v, w = state
        level = coulomb + (static - coulomb) * math.exp(-(abs(v / v_s) ** alpha))
        w_rate = v - sigma_0 * abs(v) * w / level
        resistance = sigma_0 * w + sigma_1 * w_rate + sigma_2 * v
        force = 0.0 if spline is None else motor_force(kind, values, y, spline(time))
        return [v, (force + constant - resistance) / mass, w_rate]

    solution = solve_ivp(
        right_hand_side,
        (t[0], t[-1]),
        list(start),
        method=method,
        t_eval=t,
        rtol=rtol,
        atol=[1e-11, 1e-10, 1e-13],
        max_step=np.inf if max_step is None else max_step,
    )
    if not solution.success:
        raise RuntimeError(f"reference integration stopped: {solution.message}")
    return solution.y[0], solution.y[1]
