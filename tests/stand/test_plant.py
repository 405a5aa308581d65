"""The plant against closed forms, conservation of energy, mpmath and an implicit solver."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from linid.stand.description import AxisDescription, SineMotor, ThetaMotor
from linid.stand.modes import Command, command
from linid.stand.plant import PlantRun, motor_harmonics, phase_currents, plant_parameters, simulate, thrust
from tests.stand.printed_friction import printed_friction


def constant(n: int, *, control: int = 0, current: float = 0.0, push: float = 0.0, v0: float = 0.0) -> Command:
    """A command that holds current (A) and push (N) over n drive loops."""
    return Command(control, np.full(n, current), np.zeros(n), np.zeros(n), np.full(n, push), v0)


def changed(description: AxisDescription, **values: object) -> AxisDescription:
    return AxisDescription.model_validate(description.model_dump() | values)


def energy_error(run: PlantRun, mass: float, stiffness: float) -> float:
    """Largest imbalance of work = kinetic + bristle energy + loss, over the largest energy turned over."""
    stored = mass * run.v**2 / 2 + stiffness * run.w**2 / 2
    return float(np.max(np.abs(run.work - run.loss - stored + stored[0])) / max(run.loss[-1], stored.max()))


def test_energy_is_conserved_in_every_mode(stand: AxisDescription) -> None:
    stiffness = stand.friction.bristle_stiffness_n_per_m
    for mode in stand.campaign:
        run = simulate(stand, command(mode, stand), start_position=mode.start_position_m, added_mass=mode.added_mass_kg)
        assert energy_error(run, stand.mass_kg + mode.added_mass_kg, stiffness) < 1e-9, mode.name


def test_energy_is_conserved_with_constant_force_and_push(stand: AxisDescription) -> None:
    tilted = changed(stand, constant_force_n=2.5)
    run = simulate(tilted, constant(10_000, push=3.0), start_position=0.1)
    assert run.work[-1] == pytest.approx(5.5 * (run.y[-1] - run.y[0]), rel=1e-9)
    assert energy_error(run, tilted.mass_kg, tilted.friction.bristle_stiffness_n_per_m) < 1e-9


@pytest.mark.parametrize("v0", [1.3, -0.6])
@pytest.mark.parametrize("added_mass", [0.0, 1.0])
def test_free_wheel_with_coulomb_and_viscous_friction_has_its_closed_form(
    stand: AxisDescription, v0: float, added_mass: float
) -> None:
    # With F_S = F_C the steady bristle deflection does not depend on speed, so it stays steady while v keeps its sign.
    friction = stand.friction.model_dump() | {"static_force_n": stand.friction.coulomb_force_n}
    plain = changed(stand, friction=friction)
    run = simulate(plain, constant(20_000, v0=v0), start_position=0.4, added_mass=added_mass)
    mass, coulomb = plain.mass_kg + added_mass, plain.friction.coulomb_force_n
    viscous = plain.friction.viscous_friction_n_s_per_m
    rate, terminal, sign = viscous / mass, coulomb / viscous, math.copysign(1, v0)
    stop = math.log1p(abs(v0) / terminal) / rate
    t = run.t[run.t < stop]
    v = sign * ((abs(v0) + terminal) * np.exp(-rate * t) - terminal)
    y = 0.4 + sign * ((abs(v0) + terminal) * -np.expm1(-rate * t) / rate - terminal * t)
    assert 50 < len(t) < len(run.t)
    np.testing.assert_allclose(run.v[: len(t)], v, atol=1e-11)
    np.testing.assert_allclose(run.y[: len(t)], y, atol=1e-12)


def test_stuck_forcer_rests_where_the_bristles_hold_it(stand: AxisDescription) -> None:
    # A push below breakaway deflects the bristles; the stuck axis ends with R = push. LuGre creeps while it settles,
    # so the deflection is that of the bristles plus a little sliding: only w has the exact value.
    run = simulate(stand, constant(40_000, push=1.0), start_position=0.4)
    assert run.w[-1] == pytest.approx(1.0 / stand.friction.bristle_stiffness_n_per_m, rel=1e-6)
    assert abs(run.v[-1]) < 1e-8


@pytest.mark.parametrize("static_force", [1.72, 3.198])
def test_integrator_converges_with_fourth_order_while_speed_keeps_its_sign(
    stand: AxisDescription, static_force: float
) -> None:
    # Long loop period and a broad Stribeck curve keep the error above rounding.
    friction = stand.friction.model_dump() | {"static_force_n": static_force, "stribeck_velocity_m_per_s": 0.1}
    drive = stand.drive.model_dump() | {"loop_period_s": 1e-3, "current_time_constant_s": 2e-3}
    coarse = changed(stand, friction=friction, drive=drive)
    driven = constant(150, control=1, current=0.3, v0=0.05)
    runs = {k: simulate(coarse, driven, start_position=0.2, substeps=k) for k in (10, 20, 40, 320)}
    assert runs[320].v.min() > 0
    errors = [float(np.max(np.abs(runs[k].v - runs[320].v))) for k in (10, 20, 40)]
    orders = [math.log2(errors[i] / errors[i + 1]) for i in (0, 1)]
    assert errors[2] > 1e-13
    assert all(3.7 < order < 4.5 for order in orders), (errors, orders)


@pytest.mark.parametrize("name", ["freewheel_4", "slow_ramp_1", "sine_current_2", "square_current_2", "moves_3"])
def test_halving_the_step_moves_nothing_that_the_encoder_sees(stand: AxisDescription, name: str) -> None:
    mode = next(mode for mode in stand.campaign if mode.name == name)
    told = command(mode, stand)
    runs = [
        simulate(stand, told, start_position=mode.start_position_m, added_mass=mode.added_mass_kg, substeps=k)
        for k in (stand.substeps, 2 * stand.substeps)
    ]
    # Kinks at v = 0 cost the order, not the accuracy: a tenth of the encoder's resolution is never reached.
    assert np.max(np.abs(runs[0].y - runs[1].y)) < 0.1 * stand.measurement.position_resolution_m


def test_motion_agrees_with_an_implicit_solver_of_the_printed_equations(sine_stand: AxisDescription) -> None:
    friction, motor, amplitude = sine_stand.friction, sine_stand.motor, 0.3
    assert isinstance(motor, SineMotor)
    run = simulate(sine_stand, constant(6000, control=1, current=amplitude), start_position=0.39)

    def rates(t: float, s: np.ndarray) -> list[float]:
        y, v, w = s
        w_rate, resist = printed_friction(friction, v, w)
        i_q = amplitude * -math.expm1(-t / sine_stand.drive.current_time_constant_s)
        force = 0.0
        for j in (1, 2, 3):
            angle = motor.electrical_wavenumber_per_m * y + motor.commutation_offset_rad
            current = -i_q * math.sin(angle + 2 * math.pi / 3 * (j - 2))  # K_f < 0: phases inverted
            force += motor.force_constant_n_per_a * math.sin(angle + motor.winding_displacement_rad * (j - 2)) * current
        return [v, (force - resist) / sine_stand.mass_kg, w_rate]

    twin = solve_ivp(rates, (0, 0.3), [0.39, 0, 0], "Radau", t_eval=run.t, rtol=1e-9, atol=1e-12)
    assert np.ptp(run.y) > 0.1
    np.testing.assert_allclose(run.y, twin.y[0], atol=2e-7)
    np.testing.assert_allclose(run.w, twin.y[2], atol=1e-8)


@settings(max_examples=40, deadline=None)
@given(nome=st.floats(0.01, 0.9), winding=st.floats(0.05, 1.5), z=st.floats(-10, 10))
def test_theta_field_is_the_difference_of_jacobi_thetas(nome: float, winding: float, z: float) -> None:
    motor = ThetaMotor(
        kind="theta",
        force_constant_n_per_a=1.0,
        electrical_wavenumber_per_m=0.5,
        winding_displacement_rad=1.0,
        commutation_offset_rad=0.0,
        winding_length_rad=winding,
        nome=nome,
    )
    harmonics, density, displacement, _ = motor_harmonics(motor)
    assert (density, displacement) == (1.0, 2.0)
    ours = sum(c * math.sin(n * 2 * z) for n, c in harmonics)
    with mpmath.workdps(30):
        q = mpmath.mpf(nome)

        def theta(x: mpmath.mpf) -> mpmath.mpf:
            return mpmath.jtheta(3, x, q) - mpmath.jtheta(3, x - mpmath.pi / 2, q)

        exact = theta(mpmath.mpf(z) - winding) - theta(mpmath.mpf(z) + winding)
    assert ours == pytest.approx(float(exact), abs=1e-12)


@settings(max_examples=50, deadline=None)
@given(y=st.floats(0, 0.78), i_q=st.floats(-4, 4))
def test_commutation_makes_force_proportional_to_q_current(sine_stand: AxisDescription, y: float, i_q: float) -> None:
    motor = sine_stand.motor.model_dump() | {"winding_displacement_rad": 2 * math.pi / 3}
    for force_constant in (30.0, -30.0):
        matched = changed(sine_stand, motor=motor | {"force_constant_n_per_a": force_constant})
        assert thrust(y, i_q, plant_parameters(matched)) == pytest.approx(45 * i_q, abs=1e-11)


def test_default_stand_pushes_45_newton_per_ampere_and_180_at_its_limit(stand: AxisDescription) -> None:
    p = plant_parameters(stand)
    for y in np.linspace(0, 0.0283, 57):
        # Field harmonics 5 and 7 do not vanish with balanced currents, but q^25 leaves nothing of them.
        assert thrust(y, 1.0, p) == pytest.approx(45, rel=1e-6)
        assert thrust(y, stand.drive.current_limit_a, p) == pytest.approx(180, rel=1e-6)


def test_paper_winding_displacement_makes_thrust_vary_within_the_pole_pitch(sine_stand: AxisDescription) -> None:
    p = plant_parameters(sine_stand)
    forces = [thrust(y, 1.0, p) for y in np.linspace(0.3, 0.3 + math.pi / 222, 500)]
    displacement = 0.5368
    assert min(forces) == pytest.approx(133.8 * (1 - math.cos(displacement)), rel=1e-3)
    assert max(forces) == pytest.approx(133.8 * math.sqrt(3) * math.sin(displacement), rel=1e-3)


@settings(max_examples=30, deadline=None)
@given(y=st.floats(0, 0.78), i_q=st.floats(-4, 4))
def test_phase_currents_are_balanced_and_carry_the_q_current(stand: AxisDescription, y: float, i_q: float) -> None:
    phases = phase_currents(plant_parameters(stand), np.array([y]), np.array([i_q]))[:, 0]
    assert sum(phases) == pytest.approx(0, abs=1e-13)
    assert sum(phases**2) == pytest.approx(1.5 * i_q**2, abs=1e-12)


def test_current_loop_lags_by_its_time_constant_and_is_limited(stand: AxisDescription) -> None:
    run = simulate(stand, constant(200, control=1, current=10.0), start_position=0.2)
    limit, lag = stand.drive.current_limit_a, stand.drive.current_time_constant_s
    np.testing.assert_allclose(run.q_current, -limit * np.expm1(-run.t / lag), rtol=1e-6)
