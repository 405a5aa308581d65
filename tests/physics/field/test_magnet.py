"""A bar magnet's field by Biot and Savart's law against magpylib's exact cuboid and against what must hold anyway."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linid.physics.field.magnet import BarMagnet, bar_magnet_field
from linid.physics.field.magnet_pair import GaussianField, MagnetPair, fit_gaussian, pair_field

magpylib = pytest.importorskip("magpylib", reason="magpylib is not installed")
BAR = BarMagnet(0.020, 0.012, 0.004, 1.2)
length = st.floats(1e-3, 0.1)


def exact(points: np.ndarray, magnet: BarMagnet) -> np.ndarray:
    cuboid = magpylib.magnet.Cuboid(
        dimension=(magnet.size_x, magnet.size_y, magnet.size_z), polarization=(0.0, 0.0, magnet.remanence)
    )
    return np.asarray(cuboid.getB(points)).reshape(-1, 3)


def relative(points: np.ndarray, magnet: BarMagnet) -> float:
    true = exact(points, magnet)
    error = np.linalg.norm(bar_magnet_field(points, magnet) - true, axis=1)
    return float(np.max(error / np.linalg.norm(true, axis=1)))


def test_the_field_is_that_of_the_exact_cuboid() -> None:
    """Far, near, a hundredth of a millimetre from a face, beside an edge's end, and inside."""
    random = np.random.default_rng(1)
    around = random.uniform(-0.03, 0.03, (300, 3))
    inside = random.uniform(-0.95, 0.95, (50, 3)) * [0.010, 0.006, 0.002]
    close = np.array(
        [[0, 0, 0.00201], [0.01001, 0, 0], [0, 0.00601, 0.001], [0.02, 0.006, 0.002], [0.01, 0.02, 0.002], [0, 0, 0.5]]
    )
    assert relative(around, BAR) < 1e-9
    assert relative(inside, BAR) < 1e-9
    assert relative(close, BAR) < 1e-6


@settings(max_examples=40, deadline=None)
@given(length, length, length, st.floats(-1.4, 1.4).filter(lambda b: abs(b) > 0.01), st.data())
def test_any_magnet_seen_from_outside(a: float, b: float, c: float, remanence: float, data: st.DataObject) -> None:
    place = np.array([data.draw(st.floats(-2.0, 2.0)) for _ in range(3)])
    if np.max(np.abs(place)) < 0.51:
        place[0] = 0.6
    assert relative((place * [a, b, c])[None, :], BarMagnet(a, b, c, remanence)) < 1e-6


def test_no_field_line_ends() -> None:
    """The flux through a closed box around the magnet vanishes."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    a, b = np.meshgrid(nodes, nodes)
    area = np.outer(weights, weights).ravel()
    half = np.array([0.013, 0.009, 0.005])
    total, size = 0.0, 0.0
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        for side in (-1.0, 1.0):
            points = np.zeros((a.size, 3))
            points[:, axis] = side * half[axis]
            points[:, others[0]] = half[others[0]] * a.ravel()
            points[:, others[1]] = half[others[1]] * b.ravel()
            flux = area * bar_magnet_field(points, BAR)[:, axis] * half[others[0]] * half[others[1]]
            total += side * float(flux.sum())
            size += float(np.abs(flux).sum())
    assert abs(total) < 1e-6 * size


def test_far_away_it_is_a_dipole() -> None:
    """On its axis B = mu_0 m / (2 pi r^3), with m the magnetisation times the volume."""
    distance = 2.0
    moment = BAR.remanence * BAR.size_x * BAR.size_y * BAR.size_z  # times 1 / mu_0
    field = bar_magnet_field([[0.0, 0.0, distance]], BAR)[0]
    assert field[2] == pytest.approx(moment / (2.0 * np.pi * distance**3), rel=1e-4)


def test_the_pair_is_two_magnets() -> None:
    pair = MagnetPair(BAR, 0.006)
    x, y = np.array([0.0, 0.004, 0.015]), np.array([0.001, -0.005, 0.02])
    lift = 0.5 * (pair.gap + BAR.size_z)
    true = sum(exact(np.column_stack([x, y, np.full(3, side * lift)]), BAR)[:, 2] for side in (1.0, -1.0))
    assert pair_field(x, y, pair) == pytest.approx(true, rel=1e-9)
    assert pair_field(x, y, pair, 0.001) == pytest.approx(pair_field(x, y, pair, -0.001), rel=1e-12)


def test_the_gaussian_is_the_nearest_one() -> None:
    """No other parameters fit better, the stated error is the true one, and polarity and scale are kept."""
    pair = MagnetPair(BAR, 0.006)
    found = fit_gaussian(pair)
    x, y = np.meshgrid(np.linspace(-found.reach_x, found.reach_x, 49), np.linspace(-found.reach_y, found.reach_y, 49))
    field = pair_field(x, y, pair)

    def rms(g: GaussianField) -> float:
        return float(np.sqrt(np.mean((g.at(x, y) - field) ** 2)) / np.max(field))

    least = rms(found)
    assert least == pytest.approx(found.rms_error, rel=0.02)
    for name in ("peak", "sigma_x", "sigma_y"):
        for factor in (0.97, 1.03):
            moved = {**found.__dict__, name: getattr(found, name) * factor}
            assert rms(GaussianField(**moved)) > least
    turned = fit_gaussian(MagnetPair(BarMagnet(BAR.size_x, BAR.size_y, BAR.size_z, -BAR.remanence), 0.006))
    assert turned.peak == pytest.approx(-found.peak, rel=1e-9) and turned.sigma_y == pytest.approx(found.sigma_y)
    larger = fit_gaussian(MagnetPair(BarMagnet(0.040, 0.024, 0.008, 1.2), 0.012))
    assert larger.peak == pytest.approx(found.peak, rel=1e-6)
    assert larger.sigma_x == pytest.approx(2.0 * found.sigma_x, rel=1e-6)
