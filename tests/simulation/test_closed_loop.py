"""Axes in a drive's cascade: a mass in closed form, the stand's own drive, effects and other friction laws."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from linid.physics.model import Model
from linid.recording import Recording
from linid.simulation.closed_loop import ClosedLoop, follow, measured_q_current
from linid.simulation.controller import Controller, load_controller
from linid.stand.description import AxisDescription, load_axis_description
from linid.stand.generate import generate, true_parameters

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
MASS, CONSTANT = 0.6, 40.0
FRICTIONLESS = {
    "coulomb_force": 1e-12,
    "static_force": 1e-12,
    "stribeck_velocity": 1.0,
    "stribeck_exponent": 2.0,
    "bristle_stiffness": 1.0,
    "bristle_damping": 0.0,
    "viscous_friction": 0.0,
    "mass": MASS,
    "force_constant": CONSTANT,
}
T = np.arange(300) * 1e-3
STEP = Recording("step", T, np.full(T.size, 1e-3))  # a commanded millimetre, from rest at zero


def step_response(cycle: float, integral_time: float | None = None) -> ClosedLoop:
    controller = Controller(
        position_gain_per_s=30.0,
        velocity_gain_a_s_per_m=1.0,
        velocity_integral_time_s=integral_time,
        current_limit_a=1e6,
        current_time_constant_s=0.0,
        cycle_time_s=cycle,
    )
    return follow(Model("force"), FRICTIONLESS, controller, STEP, (0.0, 0.0))


def closed_form(integral_time: float | None) -> np.ndarray:
    """The same mass in continuous loops: m y'' = K (Kp e + integral of e Kp / Tn), e = Kv (r - y) - y'."""
    gain, kv = CONSTANT / MASS, 30.0
    tn = math.inf if integral_time is None else integral_time
    # States y, v and the integral, less the reference; solved by the matrix exponential's eigenvectors.
    a = np.array([[0.0, 1.0, 0.0], [-gain * kv, -gain, gain], [-kv / tn, -1.0 / tn, 0.0]])
    values, vectors = np.linalg.eig(a)
    weights = np.linalg.solve(vectors, np.array([-1e-3, 0.0, 0.0], dtype=complex))
    return np.real((vectors[0] * weights) @ np.exp(np.outer(values, T))) + 1e-3


@pytest.mark.parametrize("integral_time", [None, 0.1])
def test_a_mass_answers_a_step_as_its_differential_equation_says(integral_time: float | None) -> None:
    """Errors fall with the cycle, in proportion: the drive holds its current for one."""
    exact = closed_form(integral_time)
    cycles = np.array([1e-3, 5e-4, 2.5e-4, 1.25e-4])
    errors = [float(np.abs(step_response(c, integral_time).y - exact).max()) for c in cycles]
    slope = np.polyfit(np.log(cycles), np.log(errors), 1)[0]
    assert slope == pytest.approx(1.0, abs=0.1)
    assert errors[-1] < 0.01 * 1e-3  # of the step


def test_the_current_is_limited() -> None:
    """At the limit a mass accelerates evenly."""
    controller = Controller(current_limit_a=0.5, velocity_integral_time_s=0.01, current_time_constant_s=0.0)
    far = Recording("far", T, np.full(T.size, 5.0))
    run = follow(Model("force"), FRICTIONLESS, controller, far, (0.0, 0.0))
    assert np.all(np.abs(run.current) <= 0.5)
    np.testing.assert_allclose(run.v, 0.5 * CONSTANT / MASS * T, atol=1e-9)
    assert np.abs(run.following_error - (5.0 - run.y)).max() == 0.0


@pytest.mark.parametrize("name", ["sine_position_1", "moves_1"])
@pytest.mark.parametrize("file", ["stand_axis.yaml", "stand_axis_sine.yaml"])
def test_the_stand_follows_as_its_own_drive_makes_it(file: str, name: str) -> None:
    """The stand is another program, with Runge-Kutta steps and a current loop of its own."""
    from linid.stand.modes import command

    described = load_axis_description(CONFIGS / file).model_dump()
    described["campaign"] = [mode for mode in described["campaign"] if mode["name"] == name]
    description = AxisDescription.model_validate(described)
    generated = generate(description, seed=1)
    exact, drive = generated.exact[name], description.drive
    told = command(description.campaign[0], description)
    every = description.loops_per_sample
    reference = Recording(name, exact.t, told.y_reference[::every])
    controller = Controller(
        position_gain_per_s=drive.position_gain_per_s,
        velocity_gain_a_s_per_m=drive.velocity_gain_a_s_per_m,
        velocity_integral_time_s=drive.velocity_gain_a_s_per_m / drive.velocity_integral_gain_a_per_m,
        velocity_feedforward=drive.velocity_feedforward,
        current_limit_a=drive.current_limit_a,
        current_time_constant_s=drive.current_time_constant_s,
        cycle_time_s=drive.loop_period_s,
    )
    kind = description.motor.kind
    known = {p.name for p in Model(kind).parameters}
    values = {key: value for key, value in generated.truth.items() if key in known}
    run = follow(Model(kind), values, controller, reference)
    following = reference.y - exact.y
    assert np.abs(run.y - exact.y).max() < 0.05 * np.abs(following).max()


def test_effects_and_other_friction_act_in_the_loop() -> None:
    """What the reference asks for at rest, friction and a constant force leave to the integral."""
    controller = load_controller(CONFIGS / "controller.yaml")
    values = FRICTIONLESS | {"coulomb_force": 2.0, "static_force": 2.5, "stribeck_velocity": 0.01}
    values |= {"bristle_stiffness": 1e4, "bristle_damping": 50.0}
    t = np.arange(2000) * 1e-3
    course = Recording("there", t, 0.05 * np.sin(3.0 * t) ** 3)
    loads = {"lugre": {}, "coulomb": {}, "dahl": {}}
    for law in loads:
        model = Model("force", ("constant_force",), law=law)
        run = follow(model, values | {"constant_force": 8.0}, controller, course)
        plain = follow(Model("force", law=law), values, controller, course)
        assert np.abs(run.following_error).max() < 1e-3
        later = t > 1.0  # once the integral has it
        needed = np.mean((plain.current - run.current)[later])
        assert needed == pytest.approx(8.0 / CONSTANT, rel=0.05)


@pytest.mark.parametrize("file", ["stand_axis.yaml", "stand_axis_sine.yaml"])
def test_the_q_current_is_what_the_drive_commutates(file: str) -> None:
    """A constant q-current is found again in the phase currents that the stand's drive makes of it."""
    from linid.stand.plant import phase_currents, plant_parameters

    description = load_axis_description(CONFIGS / file)
    y = np.linspace(0.3, 0.5, 400)
    currents = phase_currents(plant_parameters(description), y, np.full(y.size, 0.7))
    generated = true_parameters(description)
    kind = description.motor.kind
    values = {p.name: generated[p.name] for p in Model(kind).parameters if p.name in generated}
    logged = Recording("run", np.arange(y.size) * 1e-3, y, phase_currents=currents)
    np.testing.assert_allclose(measured_q_current(Model(kind), values, logged), 0.7, rtol=1e-9)
