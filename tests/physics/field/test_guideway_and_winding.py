"""The infinite guideway in its three forms, and windings in it: closed forms against integration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linid.physics.field.geometry import MotorGeometry, design, exact_thrust
from linid.physics.field.guideway import (
    field_magnitude,
    gaussian_guideway,
    harmonic,
    k_of,
    magnet_guideway,
    magnet_harmonics,
    nome_of,
    theta_guideway,
)
from linid.physics.field.winding import (
    Winding,
    back_emf_per_speed,
    force_harmonics,
    force_per_current,
    half_coil_angle,
    ripple_share,
    sine_force_constant,
    theta_force_constant,
)
from linid.physics.motors.theta import fundamental_force_constant
from linid.physics.theta import Theta0

PITCH, PEAK, SIGMA_X = 0.01415, 0.44, 0.012
WINDING = Winding(0.025, 0.0124, 110)
SHEET = {
    "magnet": {"width_mm": 24, "length_mm": 10, "thickness_mm": 4, "remanence_t": 1.25},
    "air_gap_mm": 6.5,
    "pole_pitch_mm": 14.15,
    "coil": {"width_mm": 30, "length_mm": 12.4, "turns": 110},
    "phase_spacing_mm": 9.4333,
}


@settings(deadline=None)
@given(st.floats(0.05, 1.5), st.floats(-40.0, 40.0))
def test_gaussians_theta_functions_and_harmonics_are_one_field(k: float, y: float) -> None:
    gaussians = float(gaussian_guideway(y, k))
    assert float(theta_guideway(y, k)) == pytest.approx(gaussians, abs=1e-12)
    series = sum(harmonic(n, k) * math.cos(n * math.pi * y) for n in range(1, 8 + 2 * math.ceil(4.0 / k), 2))
    assert series == pytest.approx(gaussians, abs=1e-12)


@given(st.floats(0.02, 2.0))
def test_nome_and_k_are_inverse(k: float) -> None:
    assert k_of(nome_of(k)) == pytest.approx(k, rel=1e-9)


def test_a_guideway_needs_a_width() -> None:
    with pytest.raises(ValueError, match="above zero"):
        gaussian_guideway(0.3, 0.0)


def test_harmonics_of_the_exact_magnets_add_up_to_their_field() -> None:
    geometry = MotorGeometry.model_validate(SHEET)
    orders = (1, 3, 5, 7, 9, 11)
    amplitudes = magnet_harmonics(geometry.pair, geometry.pole_pitch, [0.0, 0.009], orders)
    y = np.linspace(0.0, geometry.pole_pitch, 9)
    waves = np.cos(np.pi / geometry.pole_pitch * np.outer(orders, y))
    for row, x in zip(amplitudes, (0.0, 0.009), strict=True):
        direct = magnet_guideway(y, geometry.pair, geometry.pole_pitch, x, pairs=40)
        assert row @ waves == pytest.approx(direct, abs=2e-4 * abs(row[0]))


@settings(max_examples=15, deadline=None)
@given(st.floats(0.15, 0.9), st.floats(-1.0, 1.0), st.floats(0.3, 1.7))
def test_thrust_in_closed_form_is_the_integral_along_the_wires(k: float, place: float, length: float) -> None:
    """(2) by quadrature against (28), (30) in a cosine field and against (37), (38) in the Gaussian one."""
    winding, y = Winding(0.025, length * PITCH, 110), place * PITCH

    def cosine(x: float, at: float) -> float:
        return PEAK * math.exp(-((x / SIGMA_X) ** 2)) * math.cos(math.pi * at / PITCH)

    def gaussian(x: float, at: float) -> float:
        return PEAK * math.exp(-((x / SIGMA_X) ** 2)) * float(gaussian_guideway(at / PITCH, k))

    sine = sine_force_constant(PEAK, SIGMA_X, winding, PITCH)
    closed = sine * math.sin(math.pi * y / PITCH)
    assert closed == pytest.approx(force_per_current(cosine, winding, y), rel=1e-9, abs=1e-9 * abs(sine))
    theta = theta_force_constant(PEAK, SIGMA_X, winding, field_magnitude(k))
    z = 0.5 * math.pi * y / PITCH
    closed = theta * float(Theta0(z, nome_of(k), half_coil_angle(winding, PITCH)))
    assert closed == pytest.approx(force_per_current(gaussian, winding, y), rel=1e-9, abs=1e-9 * abs(theta))


@pytest.mark.parametrize("place", [0.07, 0.31, 0.5])
@pytest.mark.parametrize("k", [0.25, 0.46])
def test_back_emf_and_thrust_constant_are_one_number(k: float, place: float) -> None:
    """(4) differentiated from the flux through the area against (2) along the wires: V s/m = N/A."""

    def gaussian(x: float, at: float) -> float:
        return PEAK * math.exp(-((x / SIGMA_X) ** 2)) * float(gaussian_guideway(at / PITCH, k))

    emf = back_emf_per_speed(gaussian, WINDING, place * PITCH, 0.02 * PITCH)
    thrust = force_per_current(gaussian, WINDING, place * PITCH)
    constant = theta_force_constant(PEAK, SIGMA_X, WINDING, field_magnitude(k))
    assert emf == pytest.approx(thrust, rel=1e-8, abs=1e-8 * constant)


def test_a_design_agrees_with_what_a_fit_would_report() -> None:
    """The best sine of the theta model is the sine model's constant times the field's first harmonic."""
    found = design(MotorGeometry.model_validate(SHEET))
    theta = found.theta
    fundamental = fundamental_force_constant(theta["force_constant"], theta["winding_length"], theta["nome"])
    assert found.best_sine_constant == pytest.approx(fundamental, rel=1e-12)
    assert found.sine["electrical_wavenumber"] == pytest.approx(2.0 * theta["electrical_wavenumber"])
    assert found.sine["winding_displacement"] == pytest.approx(2.0 * theta["winding_displacement"])
    assert 0.5 * math.pi / theta["electrical_wavenumber"] == pytest.approx(0.01415)
    assert 2.0 * theta["winding_length"] / theta["electrical_wavenumber"] == pytest.approx(0.0124)


def test_exact_thrust_is_the_integral_along_the_wires() -> None:
    """The harmonics against (2) by quadrature in the summed field of forty-one exact pairs."""
    geometry = MotorGeometry.model_validate(SHEET)
    amplitudes = exact_thrust(geometry)
    nodes, weights = np.polynomial.legendre.leggauss(16)
    half = 0.5 * geometry.winding.length_x
    for place in (0.2, 0.5):
        y = place * geometry.pole_pitch
        wires = y + 0.5 * geometry.winding.length_y * np.array([-1.0, 1.0])
        lines = [magnet_guideway(wires, geometry.pair, geometry.pole_pitch, half * x, pairs=40) for x in nodes]
        integral = half * geometry.winding.turns * sum(w * (b[0] - b[1]) for w, b in zip(weights, lines, strict=True))
        series = sum(a * math.sin(n * math.pi * place) for n, a in amplitudes.items())
        assert series == pytest.approx(integral, rel=1e-3)


def test_the_matched_theta_has_the_exact_harmonics() -> None:
    found = design(MotorGeometry.model_validate(SHEET))
    matched = found.matched
    harmonics = force_harmonics(matched["nome"], matched["winding_length"])
    assert matched["force_constant"] * harmonics[1] == pytest.approx(found.exact[1], rel=1e-12)
    if matched["nome"] > 0.03:
        assert matched["force_constant"] * harmonics[3] == pytest.approx(found.exact[3], rel=1e-9)
    else:
        assert harmonics[3] / harmonics[1] * found.exact[3] / found.exact[1] < 0.0  # no nome has this sign


def test_turns_and_remanence_scale_the_constants() -> None:
    one = design(MotorGeometry.model_validate(SHEET))
    doubled = {**SHEET, "coil": {**SHEET["coil"], "turns": 220}}  # type: ignore[dict-item]
    assert design(MotorGeometry.model_validate(doubled)).theta["force_constant"] == pytest.approx(
        2.0 * one.theta["force_constant"]
    )
    turned = {**SHEET, "magnet": {**SHEET["magnet"], "remanence_t": -1.25}}  # type: ignore[dict-item]
    assert design(MotorGeometry.model_validate(turned)).sine["force_constant"] == pytest.approx(
        -one.sine["force_constant"]
    )


def test_ripple_is_that_of_the_harmonics() -> None:
    """By sampling Theta0 over a period and taking its Fourier series."""
    nome, half = 0.35, 0.6
    z = np.linspace(0.0, np.pi, 512, endpoint=False)
    spectrum = np.abs(np.fft.rfft(Theta0(z, nome, half)))
    higher = np.sqrt(np.sum(spectrum[2:] ** 2)) / spectrum[1]
    assert ripple_share(force_harmonics(nome, half), balanced=False) == pytest.approx(higher, rel=1e-9)
    without = np.sqrt(np.sum(spectrum[2:] ** 2) - spectrum[3] ** 2 - spectrum[9] ** 2) / spectrum[1]
    assert ripple_share(force_harmonics(nome, half), balanced=True) == pytest.approx(without, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "fact"),
    [
        ({"pole_pitch_mm": 8.0}, "overlap"),
        ({"coil": {"width_mm": 30, "length_mm": 30, "turns": 110}}, "two pole pitches"),
        ({"magnet": {"width_mm": 24, "length_mm": 10, "thickness_mm": 4, "remanence_t": 0}}, "zero"),
        ({"air_gap_mm": -1}, "greater than 0"),
        ({"halbach": True}, "Extra inputs"),
    ],
)
def test_impossible_dimensions_are_refused(change: dict[str, object], fact: str) -> None:
    with pytest.raises(ValueError, match=fact):
        MotorGeometry.model_validate({**SHEET, **change})
