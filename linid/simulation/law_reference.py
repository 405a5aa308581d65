"""Slow twins on scipy of the friction laws beside LuGre's, written from the equations alone; for tests."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from linid.arrays import Array
from linid.simulation.reference import Friction

_STEP = 1e-5  # s, of Maxwell's elements


@dataclass(frozen=True)
class LawRun:
    """A reference run of n samples: y in m and v in m/s, (n,); work of the outer force and what is lost by friction up
    to each, and what is stored in springs then, in J, (n,).

    work, lost, stored: (n,) in J.
    """

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
    force += values.get("slip_force_bend", 0.0) * np.array([1.0, -1.0, -1.0, 1.0])
    force += values.get("slip_force_twist", 0.0) * np.array([-1.0, 3.0, -3.0, 1.0]) / 3.0
    return force / force.sum(), values["bristle_stiffness"] * stiff / stiff.sum()


def _maxwell(values: dict[str, float], t: Array, outer: CubicSpline, start: tuple[float, float], h: float) -> LawRun:
    """Maxwell's elements by midpoint steps of h seconds, each clamped to its limit where a step has brought it."""
    friction, mass, (shares, stiff) = Friction.of(values), values["mass"], _elements(values)
    steps = round(float(t[1] - t[0]) / h)
    x, (y, v), work, lost = np.zeros(shares.size), start, 0.0, 0.0
    rows = np.empty((5, t.size))

    def resistance(x: Array, travel: float, v: float) -> float:
        limit = shares * friction.level(v)
        pulls = stiff * (x + travel)
        sticking = stiff[np.abs(pulls) < limit].sum() / values["bristle_stiffness"]
        held = float(np.minimum(np.maximum(pulls, -limit), limit).sum())
        return held + (friction.sigma_1 * float(sticking) + friction.sigma_2) * v

    for n in range(t.size):
        rows[:, n] = y, v, work, lost, 0.5 * float(stiff @ x**2)
        if n + 1 == t.size:
            break
        pushes = outer(t[n] + h * (np.arange(steps) + 0.5)).tolist()
        for push in pushes:
            middle = v + 0.5 * h * (push - resistance(x, 0.0, v)) / mass
            resist = resistance(x, 0.5 * h * middle, middle)
            v += h * (push - resist) / mass
            y += h * middle
            limit = shares * friction.level(v) / stiff
            moved = np.minimum(np.maximum(x + h * middle, -limit), limit)
            work += h * push * middle
            lost += h * resist * middle - 0.5 * float(stiff @ (moved**2 - x**2))
            x = moved
    return LawRun(*rows)


def simulate_law(
    law: str, values: dict[str, float], t: Array, force: Array, start: tuple[float, float], *, max_step: float = 1e-4
) -> LawRun:
    """Motion of a mass under a force in N at times t (n,) in s, a cubic spline between, under a friction law.

    values: SI by canonical name; start: y in m and v in m/s, with springs at rest; max_step: s. Raises RuntimeError
    when scipy gives up. Sources: those of `linid.physics.laws`.
    """
    outer, friction, mass = CubicSpline(t, force), Friction.of(values), values["mass"]
    if law == "maxwell_slip":
        return _maxwell(values, t, outer, start, min(max_step, _STEP))
    bend = _dahl if law == "dahl" else _elasto_plastic

    def rates(time: float, state: Array) -> list[float]:
        _, v, w, *_ = map(float, state)
        rate, push, spring = bend(values, friction, v, w), float(outer(time)), friction.sigma_0 * w
        resist = spring + friction.sigma_1 * rate + friction.sigma_2 * v
        return [v, (push - resist) / mass, rate, push * v, resist * v - spring * rate]

    solution = solve_ivp(
        rates, (t[0], t[-1]), [*start, 0.0, 0.0, 0.0], t_eval=t, rtol=1e-9, atol=1e-12, max_step=max_step
    )
    if not solution.success:
        raise RuntimeError(f"reference integration stopped: {solution.message}")
    y, v, w, work, lost = solution.y
    return LawRun(y, v, work, lost, 0.5 * friction.sigma_0 * w**2)
