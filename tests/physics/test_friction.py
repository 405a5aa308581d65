"""The LuGre step against the matrix exponential, and what friction does: resist, hold, dissipate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from linid.physics.friction import lugre_step, stribeck, stribeck_fall


@dataclass(frozen=True)
class Step:
    """Arguments of one step; exponents of ten where a parameter spans decades."""

    v: float
    w: float  # in parts of level / sigma_0
    v_mid: float
    w_mid: float  # likewise
    level: float
    fall: float  # in parts of the level
    force: float
    force_rate: float
    mass: float
    sigma_0: float
    sigma_1: float
    sigma_2: float
    h: float

    def arguments(self) -> tuple[Any, ...]:
        reach = self.level / self.sigma_0
        middle = (self.v_mid, self.w_mid * reach, self.level, -self.fall * self.level)
        body = (self.mass, self.sigma_0, self.sigma_1, self.sigma_2)
        return self.v, self.w * reach, middle, self.force, self.force_rate, body, self.h


def decades(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda x: 10.0**x)


speeds = st.one_of(st.floats(-5, 5), st.floats(-1e-3, 1e-3), st.just(0.0))
steps = st.builds(
    Step,
    v=speeds,
    w=st.floats(-1.3, 1.3),
    v_mid=speeds,
    w_mid=st.floats(-1.3, 1.3),
    level=decades(-1, 2),
    fall=st.floats(0, 1.5),
    force=st.floats(-200, 200),
    force_rate=st.floats(-1e5, 1e5),
    mass=decades(-2, 2),
    sigma_0=decades(2, 8),
    sigma_1=decades(-2, 3),
    sigma_2=st.one_of(decades(-3, 2), st.just(0.0)),
    h=decades(-6, -3),
)


def slope(s: Step) -> float:
    """dw'/dv at mid-step with the step's safety bounds, from the derivative of v - sigma_0 |v| w / g(v)."""
    direction = math.copysign(1.0, s.v_mid) if s.v_mid else 0.0
    rate = s.sigma_0 * abs(s.v_mid) / s.level
    exact = 1.0 - direction * s.w_mid * (1.0 + s.fall)
    lowest = max(-1.0, -0.5 * s.mass * rate / (s.h * (s.sigma_0 + s.sigma_1 * rate)))
    return min(max(exact, lowest), 2.0)


def exact_step(s: Step) -> tuple[float, float, float]:
    """v, w and displacement of the linearised system by the matrix exponential, at 60 digits."""
    v, w, middle, force, force_rate, body, h = s.arguments()
    v, w, v_mid, level, force, force_rate, h = map(mpmath.mpf, (v, w, middle[0], middle[2], force, force_rate, h))
    mass, s0, s1, s2 = map(mpmath.mpf, body)
    rate, gradient = s0 * abs(v_mid) / level, mpmath.mpf(slope(s))
    bristle = [gradient, -rate, 0, 0, v_mid - gradient * v_mid]  # w' in terms of v, w, y, force, 1
    mover = [(-s1 * x - y) / mass for x, y in zip(bristle, (s2, s0, 0, -1, 0), strict=True)]
    system = mpmath.matrix([mover, bristle, [1, 0, 0, 0, 0], [0, 0, 0, 0, force_rate], [0, 0, 0, 0, 0]])
    end = mpmath.expm(system * h) * mpmath.matrix([v, w, 0, force, 1])
    return float(end[0]), float(end[1]), float(end[2])


@settings(max_examples=300, deadline=None)
@given(s=steps)
@example(s=Step(5.0, 1.0, 5.0, 1.0, 1.0, 0.0, 10.0, 0.0, 0.5, 1e8, 100.0, 2.0, 1e-3))
@example(s=Step(0.0, 0.3, 0.0, 0.3, 3.0, 0.0, 1.0, 0.0, 0.6, 1e4, 90.0, 2.5, 1e-6))
@example(s=Step(1.0, 1.0, 1.0, 1.0, 2.0, 0.0, 1.0, 0.0, 0.6, 1e4, 90.0, 0.0, 1e-3))  # singular: nothing pulls back
@example(s=Step(0.1, 0.5, 0.1, 0.5, 1.0, 0.0, 1.0, 0.0, 1.0, 1e4, 200.0, 0.0, 1e-3))
def test_the_step_is_exact_for_the_linearised_system(s: Step) -> None:
    with mpmath.workdps(60):
        exact = exact_step(s)
    v, w, displacement = lugre_step(*s.arguments())
    # What enters the sums sets the rounding: the speed that forces can give within the step, the bristle's reach.
    pull = (
        abs(s.force) + abs(s.force_rate) * s.h + 3 * s.level + (s.sigma_1 * 3 + s.sigma_2) * (abs(s.v) + abs(s.v_mid))
    )
    fast = abs(s.v) + abs(s.v_mid) + pull * s.h / s.mass
    assert v == pytest.approx(exact[0], rel=1e-10, abs=1e-11 * fast)
    assert w == pytest.approx(exact[1], rel=1e-10, abs=1e-11 * (s.level / s.sigma_0 + fast * s.h))
    assert displacement == pytest.approx(exact[2], rel=1e-10, abs=1e-11 * fast * s.h)


friction = st.fixed_dictionaries(
    {"coulomb": st.floats(0.1, 20), "extra": st.floats(0, 3), "v_s": decades(-3, 0), "alpha": st.floats(0.5, 2)}
)


@given(p=friction, v=st.floats(-5, 5))
def test_stribeck_curve_falls_from_static_to_coulomb_force_alike_both_ways(p: dict[str, float], v: float) -> None:
    coulomb, static = p["coulomb"], p["coulomb"] * (1 + p["extra"])
    level = stribeck(v, coulomb, static, p["v_s"], p["alpha"])
    exact = coulomb + (static - coulomb) * math.exp(-(abs(v / p["v_s"]) ** p["alpha"]))
    assert level == pytest.approx(exact, rel=1e-14)
    assert stribeck(-v, coulomb, static, p["v_s"], p["alpha"]) == level
    assert stribeck(0.0, coulomb, static, p["v_s"], p["alpha"]) == pytest.approx(static)


@given(p=friction, v=st.floats(1e-4, 2.0), sign=st.sampled_from([-1.0, 1.0]))
def test_fall_is_speed_times_the_curves_slope(p: dict[str, float], v: float, sign: float) -> None:
    arguments = p["coulomb"], p["coulomb"] * (1 + p["extra"]), p["v_s"], p["alpha"]
    _, fall = stribeck_fall(sign * v, *arguments)
    with mpmath.workdps(30):
        coulomb, static, v_s, alpha = map(mpmath.mpf, arguments)
        exact = v * mpmath.diff(lambda x: coulomb + (static - coulomb) * mpmath.exp(-((x / v_s) ** alpha)), v)
    assert fall == pytest.approx(float(exact), rel=1e-9, abs=1e-12)


def constant_force_run(force: float, v: float, w: float, seconds: float, **p: float) -> tuple[float, float, float]:
    """v, w and travel under a constant force, each step linearised at the state itself."""
    h, travel = 1e-4, 0.0
    for _ in range(round(seconds / h)):
        level, fall = stribeck_fall(v, p["coulomb"], p["static"], p["v_s"], 2.0)
        v, w, d = lugre_step(v, w, (v, w, level, fall), force, 0.0, (p["mass"], p["s0"], p["s1"], p["s2"]), h)
        travel += d
    return v, w, travel


STAND = {"coulomb": 1.72, "static": 3.198, "v_s": 2.993e-3, "mass": 0.588, "s0": 1.169e4, "s1": 92.14, "s2": 2.517}


@pytest.mark.parametrize("stiffness", [1e4, 1e6, 1e8])
@pytest.mark.parametrize("speed", [0.05, -0.7, 5.0])
def test_steady_sliding_resists_with_stribeck_plus_viscous_force(speed: float, stiffness: float) -> None:
    p = STAND | {"s0": stiffness}
    resistance = math.copysign(stribeck(speed, 1.72, 3.198, 2.993e-3, 2.0), speed) + p["s2"] * speed
    v, w, _ = constant_force_run(resistance, speed, 0.0, 3.0, **p)  # the bristle starts relaxed
    assert v == pytest.approx(speed, rel=1e-4)
    assert stiffness * w + p["s2"] * v == pytest.approx(resistance, rel=1e-5)


@pytest.mark.parametrize("stiffness", [1e4, 1e6, 1e8])
def test_a_small_force_deflects_a_resting_axis_like_a_spring(stiffness: float) -> None:
    # Far below breakaway, LuGre creeps by force/level times the travel: first order in the load.
    force = 1e-4 * STAND["static"]
    _, w, travel = constant_force_run(force, 0.0, 0.0, 1.0, **STAND | {"s0": stiffness})
    assert w == pytest.approx(force / stiffness, rel=1e-6)
    assert travel == pytest.approx(force / stiffness, rel=1e-3)


@settings(max_examples=100, deadline=None)
@given(
    v=st.floats(-5, 5),
    start=st.floats(-1, 1),
    stiffness=decades(3, 8),
    damping=st.floats(0.0, 1.0),
    mass=decades(-1, 1),
    h=decades(-6, -3.3),
)
def test_friction_alone_only_takes_energy(
    v: float, start: float, stiffness: float, damping: float, mass: float, h: float
) -> None:
    # Kinetic plus bristle energy never grows while F_S = F_C and sigma_1 keeps LuGre passive; the midpoint of the
    # linearisation is the true one here, found by iteration.
    coulomb = 2.0
    w = start * coulomb / stiffness
    s1 = damping * 0.2 * math.sqrt(stiffness * mass) if v == 0 else damping * coulomb / max(abs(v), 1.0)
    energy = 0.5 * mass * v * v + 0.5 * stiffness * w * w
    largest = energy
    body = (mass, stiffness, s1, 0.5)
    for _ in range(50):
        v_mid, w_mid = v, w
        for _ in range(20):
            v_mid, w_mid, _ = lugre_step(v, w, (v_mid, w_mid, coulomb, 0.0), 0.0, 0.0, body, 0.5 * h)
        v, w, _ = lugre_step(v, w, (v_mid, w_mid, coulomb, 0.0), 0.0, 0.0, body, h)
        before, energy = energy, 0.5 * mass * v * v + 0.5 * stiffness * w * w
        slack = 0.02 * coulomb * coulomb / stiffness + 1e-12 * largest
        assert energy <= before + slack


def test_one_step_over_random_states_stays_finite() -> None:
    # A predictor far off must never blow up: what the bounds of the slope are for.
    rng = np.random.default_rng(5)
    for _ in range(2000):
        s = Step(
            v=rng.uniform(-5, 5),
            w=rng.uniform(-2, 2),
            v_mid=rng.uniform(-5, 5) * 10 ** rng.uniform(-6, 0),
            w_mid=rng.uniform(-2, 2),
            level=10 ** rng.uniform(-3, 2),
            fall=rng.uniform(0, 5),
            force=rng.uniform(-200, 200),
            force_rate=rng.uniform(-1e5, 1e5),
            mass=10 ** rng.uniform(-2, 2),
            sigma_0=10 ** rng.uniform(2, 8),
            sigma_1=10 ** rng.uniform(-2, 4),
            sigma_2=rng.uniform(0, 10),
            h=10 ** rng.uniform(-7, -2.5),
        )
        v, w, displacement = lugre_step(*s.arguments())
        assert all(map(math.isfinite, (v, w, displacement))), s
        bound = 20 * (abs(s.v) + abs(s.v_mid)) + 20 * s.h / s.mass * (
            abs(s.force) + abs(s.force_rate) * s.h + 4 * s.level + (s.sigma_1 + s.sigma_2) * 10
        )
        assert abs(v) < bound, s
