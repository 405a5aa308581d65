"""Theta functions and the motors' force against mpmath's Jacobi theta functions, at 30 digits."""

from __future__ import annotations

import math
from collections.abc import Callable

import mpmath
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from linid.physics.field.winding import force_harmonics
from linid.physics.motors.harmonics import sine_cosine
from linid.physics.motors.motor import MAX_HARMONICS
from linid.physics.motors.registry import MOTORS
from linid.physics.motors.theta import fundamental_force_constant
from linid.physics.theta import GAUSSIAN_NOME, Theta, Theta0, harmonic_coefficients, theta3
from tests.compiled_motor import harmonics, thrust, thrusts

TOLERANCE = 1e-12  # times the function's amplitude, or times 1 where the amplitude is less
JUST_ABOVE = math.nextafter(GAUSSIAN_NOME, 1.0)
GRID = [
    0.001,
    0.01,
    0.1,
    0.3,
    0.493,
    0.5,
    math.nextafter(0.5, 1.0),
    0.7,
    0.85,
    GAUSSIAN_NOME,
    JUST_ABOVE,
    0.95,
    0.99,
    0.999,
]

nomes = st.floats(0.001, 0.999)
angles = st.floats(-20.0, 20.0)
Exact = Callable[[mpmath.mpf], mpmath.mpf]


@pytest.fixture(autouse=True)
def thirty_digits() -> object:
    with mpmath.workdps(30):
        yield


def exact_theta(q: float) -> Exact:
    nome = mpmath.mpf(q)
    return lambda z: mpmath.jtheta(3, z, nome) - mpmath.jtheta(3, z - mpmath.pi / 2, nome)


def exact_theta_0(q: float, z_L: float) -> Exact:
    theta = exact_theta(q)
    return lambda z: theta(z - mpmath.mpf(z_L)) - theta(z + mpmath.mpf(z_L))


def tolerance(q: float) -> float:
    """Absolute tolerance for an amplitude theta3(0, q), which is at least 1."""
    return TOLERANCE * float(mpmath.jtheta(3, 0, q))


@settings(max_examples=150, deadline=None)
@given(z=angles, q=nomes)
@example(z=math.pi / 2, q=0.999)
@example(z=1e-9, q=JUST_ABOVE)
def test_theta3_and_theta_are_jacobis(z: float, q: float) -> None:
    assert float(theta3(z, q)) == pytest.approx(float(mpmath.jtheta(3, z, q)), abs=tolerance(q))
    assert float(Theta(z, q)) == pytest.approx(float(exact_theta(q)(mpmath.mpf(z))), abs=tolerance(q))


@settings(max_examples=150, deadline=None)
@given(z=angles, q=nomes, z_L=st.floats(0.02, 1.55))
def test_theta0_is_the_difference_over_the_coil(z: float, q: float, z_L: float) -> None:
    assert float(Theta0(z, q, z_L)) == pytest.approx(float(exact_theta_0(q, z_L)(mpmath.mpf(z))), abs=2 * tolerance(q))


@pytest.mark.parametrize("q", GRID)
def test_the_whole_period_agrees_at_every_nome(q: float) -> None:
    z = np.linspace(-2 * math.pi, 2 * math.pi, 81)
    exact = [float(mpmath.jtheta(3, x, q)) for x in z]
    np.testing.assert_allclose(theta3(z, q), exact, rtol=0, atol=tolerance(q))
    for function, exact_function in (
        (lambda x: Theta(x, q), exact_theta(q)),
        (lambda x: Theta0(x, q, 0.688), exact_theta_0(q, 0.688)),
    ):
        values = np.array([float(exact_function(mpmath.mpf(x))) for x in z])
        # Relative to the function's own amplitude, which is 4 q at small nomes.
        np.testing.assert_allclose(function(z), values, rtol=0, atol=TOLERANCE * np.max(np.abs(values)))


@settings(max_examples=60, deadline=None)
@given(z=st.floats(-5.0, 5.0), q=nomes)
def test_theta_is_even_has_period_pi_and_changes_sign_after_half_of_it(z: float, q: float) -> None:
    # Shifting z by a rounded pi moves it by an ulp; the steepest slope at q = 0.999 is about 1e3.
    slack = 10 * tolerance(q)
    assert float(theta3(-z, q)) == pytest.approx(float(theta3(z, q)), abs=slack)
    assert float(theta3(z + math.pi, q)) == pytest.approx(float(theta3(z, q)), abs=slack)
    assert float(Theta(z + math.pi / 2, q)) == pytest.approx(-float(Theta(z, q)), abs=slack)
    assert float(Theta0(-z, q, 0.7)) == pytest.approx(-float(Theta0(z, q, 0.7)), abs=slack)


@settings(max_examples=60, deadline=None)
@given(z=angles, q=st.floats(0.001, 0.98), z_L=st.floats(0.02, 1.55))
def test_theta0_is_a_sum_over_odd_harmonics(z: float, q: float, z_L: float) -> None:
    nome, total, n = mpmath.mpf(q), mpmath.mpf(0), 1
    while nome ** (n * n) > mpmath.mpf(10) ** -25:
        total += 8 * nome ** (n * n) * mpmath.sin(2 * n * mpmath.mpf(z_L)) * mpmath.sin(2 * n * mpmath.mpf(z))
        n += 2
    assert float(Theta0(z, q, z_L)) == pytest.approx(float(total), abs=2 * tolerance(q))


def test_harmonics_are_left_out_only_below_rounding() -> None:
    out = np.zeros(MAX_HARMONICS)
    count = harmonic_coefficients(0.3, GAUSSIAN_NOME, out)
    assert count < MAX_HARMONICS
    assert GAUSSIAN_NOME ** ((2 * count + 1) ** 2) < 1e-14 * GAUSSIAN_NOME
    assert out[0] == pytest.approx(8 * GAUSSIAN_NOME * math.sin(0.6), rel=1e-15)


@pytest.mark.parametrize("q", [0.0, 1.0, -0.1, 1.5, math.nan])
def test_nomes_outside_the_unit_interval_are_refused(q: float) -> None:
    for call in (lambda: theta3(0.1, q), lambda: Theta(0.1, q), lambda: Theta0(0.1, q, 0.5)):
        with pytest.raises(ValueError, match="outside"):
            call()


def test_arrays_keep_their_shape() -> None:
    assert theta3(np.zeros((2, 3)), 0.5).shape == (2, 3)
    assert Theta0([0.1, 0.2], 0.5, 0.7).shape == (2,)


currents = st.tuples(st.floats(-4, 4), st.floats(-4, 4), st.floats(-4, 4))


NAMES = tuple(parameter.name for parameter in MOTORS["theta"].parameters)


def kernel_force(kind: str, p: list[float], y: float, i: tuple[float, float, float]) -> float:
    """What the compiled simulation does: prepare once, then one of the two branches per step."""
    return thrust(kind, dict(zip(NAMES, p, strict=False)), y, i)


@settings(max_examples=150, deadline=None)
@given(
    y=st.floats(-0.05, 0.05), i=currents, density=st.floats(20, 300), step=st.floats(0.05, 6.2), shift=st.floats(-6, 6)
)
def test_sine_force_is_the_direct_sum(
    y: float, i: tuple[float, float, float], density: float, step: float, shift: float
) -> None:
    angle = mpmath.mpf(density) * mpmath.mpf(y) + mpmath.mpf(shift)
    exact = sum(mpmath.sin(angle + j * mpmath.mpf(step)) * i[j + 1] for j in (-1, 0, 1))
    assert kernel_force("sine", [1.0, density, step, shift], y, i) == pytest.approx(float(exact), abs=1e-12)


@settings(max_examples=250, deadline=None)
@given(
    y=st.floats(-0.05, 0.05),
    i=currents,
    density=st.floats(10, 150),
    step=st.floats(0.025, 3.1),
    shift=st.floats(-3, 3),
    z_L=st.floats(0.02, 1.55),
    q=nomes,
)
@example(y=0.01, i=(1.0, -0.4, 0.3), density=111.0, step=1.047, shift=0.768, z_L=0.688, q=GAUSSIAN_NOME)
@example(y=0.01, i=(1.0, -0.4, 0.3), density=111.0, step=1.047, shift=0.768, z_L=0.688, q=JUST_ABOVE)
def test_theta_force_is_the_direct_sum_of_jacobi_thetas_in_both_branches(
    y: float, i: tuple[float, float, float], density: float, step: float, shift: float, z_L: float, q: float
) -> None:
    shape = exact_theta_0(q, z_L)
    z = mpmath.mpf(density) * mpmath.mpf(y) + mpmath.mpf(shift)
    exact = sum(shape(z + j * mpmath.mpf(step)) * i[j + 1] for j in (-1, 0, 1))
    total = sum(map(abs, i)) + 1.0
    # The slope of the steepest field carries the rounding of density * y + shift: 1e3 at q = 0.999.
    slack = 2 * tolerance(q) * total
    assert kernel_force("theta", [1.0, density, step, shift, z_L, q], y, i) == pytest.approx(float(exact), abs=slack)


@settings(max_examples=200, deadline=None)
@given(angle=st.one_of(st.floats(-50, 50), st.floats(-1.5e6, 1.5e6)))
@example(angle=0.25 * math.pi)
@example(angle=-0.75 * math.pi)
@example(angle=1e5 * math.pi)
def test_sine_and_cosine_without_branches(angle: float) -> None:
    sine, cosine = sine_cosine(angle)
    assert sine == pytest.approx(float(mpmath.sin(mpmath.mpf(angle))), abs=2.3e-16)
    assert cosine == pytest.approx(float(mpmath.cos(mpmath.mpf(angle))), abs=2.3e-16)


@pytest.mark.parametrize("kind", ["force", "sine", "theta"])
@pytest.mark.parametrize("q", [0.3, 0.85, JUST_ABOVE])
@pytest.mark.parametrize("n", [1, 255, 256, 257, 1000])
def test_many_forces_are_those_of_one_after_the_other(kind: str, q: float, n: int) -> None:
    generator = np.random.default_rng(n)
    y, i = generator.uniform(-0.3, 0.5, n), generator.standard_normal((3, n))
    p = [30.0, 111.0, 1.047, 0.768, 0.688, q]
    one = [kernel_force(kind, p, place, (a, b, c)) for place, a, b, c in zip(y, *i, strict=True)]
    many = thrusts(kind, dict(zip(NAMES, p, strict=True)), y, i)
    np.testing.assert_allclose(many, one, rtol=0.0, atol=1e-12 * 30.0 * 20.0)
    if kind == "force":
        assert many == pytest.approx(30.0 * i[0])


def test_the_two_branches_join_at_the_switch() -> None:
    for y in np.linspace(0, 0.03, 31):
        below, above = (
            kernel_force("theta", [7.0, 111.0, 1.047, 0.768, 0.688, q], float(y), (1.0, -0.4, -0.6))
            for q in (GAUSSIAN_NOME, JUST_ABOVE)
        )
        assert below == pytest.approx(above, abs=1e-12 * 7.0 * 5.5)


def test_a_force_motor_needs_no_table() -> None:
    assert harmonics("force", {}) == 0 and harmonics("sine", {}) == 1


@pytest.mark.parametrize("nome", [0.1, 0.493, JUST_ABOVE, 0.97])
def test_the_spectrum_is_that_of_the_series(nome: float) -> None:
    found = MOTORS["theta"].spectrum({"winding_length": 0.688, "nome": nome})
    for n, amplitude in force_harmonics(nome, 0.688).items():
        assert found.get(n, 0.0) == pytest.approx(amplitude, abs=1e-13 * force_harmonics(nome, 0.688)[1] + 1e-15)
    assert MOTORS["sine"].spectrum({}) == {1: 1.0}


@pytest.mark.parametrize("q", [0.05, 0.493, GAUSSIAN_NOME, JUST_ABOVE, 0.97])
def test_fundamental_force_constant_is_the_first_harmonic(q: float) -> None:
    # First Fourier coefficient of the force of the middle phase over one period of z, by the trapezoidal rule (exact).
    z = np.arange(512) * math.pi / 512
    shape = 7.75 * Theta0(z, q, 0.688)
    assert fundamental_force_constant(7.75, 0.688, q) == pytest.approx(2 * np.mean(shape * np.sin(2 * z)), rel=1e-12)
