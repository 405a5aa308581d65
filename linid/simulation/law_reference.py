"""Slow twins on scipy of the friction laws beside LuGre's, written from the equations alone; for tests."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from linid.arrays import Array
from linid.simulation.reference import Friction

_PULL = 3e5  # 1/s, by which an element that slips is drawn to a limit that falls


@dataclass(frozen=True)
class LawRun:
    """A reference run of n samples: y in m, v in m/s, work in J done by the outer force up to each, lost in J by friction
    but for what springs store, stored in J."""

    y: Array
    v: Array
    work: Array
    lost: Array
    stored: Array


def _dahl(values: dict[str, float], friction: Friction, v: float, w: float) -> float:
    u = friction.sigma_0 * w / values["coulomb_force"] * math.copysign(1.0, v)
    return v * math.copysign(abs(1.0 - u) ** values["dahl_exponent"], 1.0 - u)


def _elasto_plastic(values: dict[str, float], friction: Friction, v: float, w: float) -> float:
    steady = friction.level(v) / friction.sigma_0
    elastic = values["breakaway_share"] * friction.coulomb / friction.sigma_0
    slip = 0.0
    if v * w > 0.0 and abs(w) > elastic:
        middle = 0.5 * (steady + elastic)
        slip = 1.0
        if abs(w) < steady:
            slip = 0.5 * math.sin(math.pi * (abs(w) - middle) / (steady - elastic)) + 0.5
    return v * (1.0 - slip * abs(w) / steady) if slip else v


def _elements(values: dict[str, float]) -> tuple[Array, Array]:
    """Shares of the sliding force, and stiffnesses in N/m."""
    stiff = values["slip_stiffness_ratio"] ** np.arange(4)
    force = 1.0 + values["slip_force_tilt"] * np.linspace(-1.0, 1.0, 4)
    return force / force.sum(), values["bristle_stiffness"] * stiff / stiff.sum()


def _maxwell(values: dict[str, float], friction: Friction) -> Callable[[float, Array], tuple[float, Array, float]]:
    shares, stiff = _elements(values)

    def rates(v: float, x: Array) -> tuple[float, Array, float]:
        """Resistance but for the viscous one in N, rates of the elements in m/s, and lost power in W."""
        limit = shares * friction.level(v) / stiff
        slips = (np.abs(x) >= limit) & (x * v > 0.0)
        beyond = np.where(np.abs(x) > limit, _PULL * (np.abs(x) - limit), 0.0) * np.sign(x)
        rate = np.where(slips, 0.0, v) - beyond
        held = np.clip(stiff * x, -stiff * limit, stiff * limit)
        damping = friction.sigma_1 * float(stiff[~slips].sum()) / values["bristle_stiffness"] * v
        return float(held.sum()) + damping, rate, float((held + 0.0) @ (v - rate)) + damping * v

    return rates


def simulate_law(
    law: str, values: dict[str, float], t: Array, force: Array, start: tuple[float, float], *, max_step: float = 1e-4
) -> LawRun:
    """Motion of a mass under a force in N at times t (n,) in s, a cubic spline between, under a friction law.

    values: SI by canonical name; start: y in m and v in m/s, with springs at rest; max_step: s. Raises RuntimeError
    when scipy gives up. Sources: those of `linid.physics.laws`.
    """
    outer, friction, mass = CubicSpline(t, force), Friction.of(values), values["mass"]
    if law in ("dahl", "elasto_plastic"):
        bend = _dahl if law == "dahl" else _elasto_plastic

        def friction_of(v: float, x: Array) -> tuple[float, Array, float]:
            rate = bend(values, friction, v, float(x[0]))
            force = friction.sigma_0 * float(x[0]) + friction.sigma_1 * rate
            return force, np.array([rate]), force * v - friction.sigma_0 * float(x[0]) * rate

        stiff = np.array([friction.sigma_0])
    else:
        friction_of, stiff = _maxwell(values, friction), _elements(values)[1]

    def rates(time: float, state: Array) -> Array:
        v, x = float(state[1]), state[2:-2]
        resist, rate, lost = friction_of(v, x)
        push = float(outer(time))
        a = (push - resist - friction.sigma_2 * v) / mass
        return np.concatenate([[v, a], rate, [push * v, lost + friction.sigma_2 * v * v]])

    first = np.concatenate([start, np.zeros(stiff.size + 2)])
    solution = solve_ivp(
        rates, (t[0], t[-1]), first, method="RK45", t_eval=t, rtol=1e-9, atol=1e-12, max_step=max_step
    )
    if not solution.success:
        raise RuntimeError(f"reference integration stopped: {solution.message}")
    y, v, *x, work, lost = solution.y
    return LawRun(y, v, work, lost, 0.5 * np.einsum("i,ij->j", stiff, np.array(x) ** 2))
