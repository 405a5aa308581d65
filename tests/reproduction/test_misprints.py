"""The misprints that docs/paper.md lists: the formula as printed fails where the corrected one holds."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from scipy.integrate import dblquad, quad, solve_ivp

from linid.physics.field.guideway import gaussian_guideway, k_of, nome_of
from linid.physics.field.sine_scope import PAPER_FIT, best_k, delta
from linid.physics.field.winding import Winding, flux_linkage, force_per_current
from linid.physics.theta import theta3
from linid.reproduction.printed import TABLE_2, TABLE_3, meant

FIT_ERROR = 5e-4  # of the paper's fit (25) to its k_N, N up to 100
FAR = 4.0 * FIT_ERROR


def fitted_k(number: int, sign: float = -1.0) -> float:
    """(25), with the sign of its exponent."""
    a_0, a_1, a_2, a_3 = PAPER_FIT
    return a_0 - a_1 * math.exp(sign * a_2 * number**a_3)


def double_sum(k: float, pairs: int, *, power: int = 2, distance: int = -1, divided: bool = True) -> float:
    """(24) by its double sum. power: of k in (22)'s exponent; distance: sign of j in (23)'s (i + sign j)^2; divided:
    (23) by k^2; as printed: 1, 1, False."""
    own = 2.0 * 0.5 * math.sqrt(math.pi) * math.exp(-0.25 * k**power * math.pi**2) * ((k * math.pi) ** 2 - 2.0)
    i = np.arange(-pairs, pairs + 1, dtype=float)
    signs = (-1.0) ** (i[:, None] + i)
    apart = (i[:, None] + distance * i) ** 2
    bracket = (i[:, None] - i) ** 2 + k * k
    mixed = signs * np.exp(-apart / (2.0 * k * k)) * bracket * math.sqrt(0.5 * math.pi)
    return float(own * i.size + np.sum(mixed) / (k * k if divided else 1.0))


@pytest.mark.parametrize("pairs", [1, 3, 10, 30])
def test_only_the_full_correction_of_22_and_23_gives_25(pairs: int) -> None:
    assert double_sum(0.41, pairs) == pytest.approx(delta(0.41, pairs), rel=1e-12)
    assert best_k(pairs) == pytest.approx(fitted_k(pairs), abs=FIT_ERROR)
    for wrong in ({"power": 1}, {"distance": 1}, {"divided": False}):
        sides = [double_sum(fitted_k(pairs) + side, pairs, **wrong) for side in (-FAR, FAR)]  # type: ignore[arg-type]
        assert sides[0] * sides[1] > 0.0, wrong  # no zero near the paper's own k_N


def test_the_exponent_of_25_is_negative() -> None:
    for number in (1, 4, 20, 100):
        assert best_k(number) == pytest.approx(fitted_k(number), abs=FIT_ERROR)
        assert abs(best_k(number) - fitted_k(number, sign=1.0)) > 0.05
    assert fitted_k(1000, sign=1.0) < -100.0  # there is no limit


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_with_the_sign_of_5_and_29_a_shorted_winding_would_drive_the_forcer(sign: float) -> None:
    """sign: of K_V. Force K_f sin I as in (31); no voltage, no friction: kinetic and magnetic energy may only fall."""
    constant, inductance, resistance, mass, wavenumber = 30.0, 2e-3, 5.0, 0.588, 222.0

    def rates(t: float, s: np.ndarray) -> list[float]:
        y, v, current = s
        wave = constant * math.sin(wavenumber * y)
        return [v, wave * current / mass, (sign * wave * v - resistance * current) / inductance]

    found = solve_ivp(rates, (0.0, 0.005), [0.0, 1.0, 0.0], rtol=1e-10, atol=1e-12)
    energy = 0.5 * mass * found.y[1] ** 2 + 0.5 * inductance * found.y[2] ** 2
    assert np.all(np.diff(energy) <= 1e-12) if sign < 0.0 else energy[-1] > 1.01 * energy[0]


def test_the_minus_of_44_is_a_field_moved_by_a_pole_against_31() -> None:
    second = meant(TABLE_2)
    y, pitch = np.linspace(0.0, 0.1, 50), math.pi / second["electrical_wavenumber"]
    angle = second["electrical_wavenumber"] * y + second["commutation_offset"]
    moved = second["electrical_wavenumber"] * (y + pitch) + second["commutation_offset"]
    assert -second["force_constant"] * np.sin(angle) == pytest.approx(second["force_constant"] * np.sin(moved))
    assert -second["force_constant"] > 0.0  # by (44) the coefficient is positive


def test_the_flux_of_3_to_5_needs_the_winding_s_position() -> None:
    """Within fixed limits the flux never changes; within those that travel its slope is the thrust over the current."""
    winding, step = Winding(0.03, 0.0124, 10), 1e-5

    def field(x: float, y: float) -> float:
        return float(gaussian_guideway(y / 0.01415, 0.4)) * math.exp(-((x / 0.02) ** 2))

    for y in (0.002, 0.006):
        slope = (flux_linkage(field, winding, y + step) - flux_linkage(field, winding, y - step)) / (2.0 * step)
        assert -slope == pytest.approx(force_per_current(field, winding, y), rel=1e-5)
        assert abs(slope) > 1e-3


def test_the_weight_of_27_is_squared_too() -> None:
    """The squared error of (26) over x: exp(-2 x^2/sigma^2), not exp(-x^2/sigma^2)."""
    sigma, k = 0.3, 0.4

    def error(y: float) -> float:
        return float(gaussian_guideway(y, k)) - math.cos(math.pi * y)

    whole = dblquad(lambda x, y: (math.exp(-((x / sigma) ** 2)) * error(y)) ** 2, 0.0, 0.5, -2.0, 2.0, epsrel=1e-8)[0]
    along = quad(lambda y: error(y) ** 2, 0.0, 0.5)[0]
    assert whole == pytest.approx(along * sigma * math.sqrt(0.5 * math.pi), rel=1e-6)
    assert abs(whole / (along * sigma * math.sqrt(math.pi)) - 1.0) > 0.2


def test_it_is_tau_that_lies_in_the_upper_half_plane() -> None:
    """(33) with a nome of the upper half-plane beyond the unit circle diverges; exp(i pi tau) lies within it."""
    for q, converges in ((1.05j, False), (cmath.exp(1j * math.pi * 0.3j), True)):
        last = abs(q ** (40 * 40))
        assert (last < 1e-12) is converges
    nome = cmath.exp(1j * math.pi * 0.3j).real
    assert theta3(0.4, nome) == pytest.approx(
        1.0 + 2.0 * sum(nome ** (n * n) * math.cos(0.8 * n) for n in range(1, 20))
    )


def test_what_table_3_means() -> None:
    third = meant(TABLE_3)
    assert k_of(third["nome"]) == pytest.approx(0.535, abs=5e-4) and nome_of(0.5) == pytest.approx(0.5397, abs=1e-4)
    assert 4.0 * abs(third["winding_length"]) / math.pi == pytest.approx(1.75, abs=5e-3)  # l_y / chi, by (37) and (35)
    assert TABLE_3[1].value == pytest.approx(math.pi / 3.0, abs=5e-4)  # z_p of windings 120 degrees apart
