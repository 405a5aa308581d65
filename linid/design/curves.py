"""Curves of a motor by its dimensions: field along the guideway, thrust over current, best k of finite guideways."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from linid.physics.field.geometry import MotorDesign

_NUMBERS = (1, 2, 5, 10, 20, 50, 100, 1000, 10_000)


def best_k_rows() -> Iterator[tuple[float, ...]]:
    """Rows of the number N and the ratio k_N at which 2 N + 1 magnets are nearest to a cosine (24)."""
    from linid.physics.field.sine_scope import best_k

    return ((float(n), best_k(n)) for n in _NUMBERS)


GUIDEWAY_COLUMNS = ("y_m", "exact_t", "gaussian_t", "cosine_t")
THRUST_COLUMNS = ("y_m", "exact_n_per_a", "theta_n_per_a", "theta_matched_n_per_a", "sine_n_per_a")
_SAMPLES = 201


def guideway_rows(made: MotorDesign) -> Iterator[tuple[float, ...]]:
    """Field along two pole pitches in the middle of the guideway: rows of y in m and, in T, the exact field, the
    Gaussian one and a cosine.
    """
    import numpy as np

    from linid.physics.field.guideway import magnet_harmonics, theta_guideway

    orders = range(1, 20, 2)
    pitch = made.geometry.pole_pitch
    amplitudes = magnet_harmonics(made.geometry.pair, pitch, 0.0, tuple(orders))[0]
    y = np.linspace(-pitch, pitch, _SAMPLES)
    exact = np.cos(np.pi / pitch * np.outer(y, orders)) @ amplitudes
    gaussian = made.gaussian.peak * theta_guideway(y / pitch, made.k)
    cosine = made.gaussian.peak * np.cos(np.pi * y / pitch)
    return (tuple(map(float, row)) for row in zip(y, exact, gaussian, cosine, strict=True))


def thrust_rows(made: MotorDesign) -> Iterator[tuple[float, ...]]:
    """Thrust over current of the middle winding along two pole pitches: rows of y in m and, in N/A, exact, theta, theta
    with matched harmonics, sine of the fundamental.
    """
    import numpy as np

    from linid.physics.theta import Theta0

    pitch = made.geometry.pole_pitch
    y = np.linspace(0.0, 2.0 * pitch, _SAMPLES)
    exact = sum(a * np.sin(n * np.pi * y / pitch) for n, a in made.exact.items())
    shapes = [
        theta["force_constant"] * Theta0(theta["electrical_wavenumber"] * y, theta["nome"], theta["winding_length"])
        for theta in (made.theta, made.matched)
    ]
    sine = made.exact[1] * np.sin(np.pi * y / pitch)
    return (tuple(map(float, row)) for row in zip(y, np.asarray(exact), *shapes, sine, strict=True))


def parameter_rows(made: MotorDesign) -> Iterator[tuple[str, str, float, str]]:
    """Rows of model, parameter, value and unit, SI, of the sine, the theta and the matched theta model."""
    from linid.physics.motors.registry import MOTORS

    for name, kind, values in (
        ("sine", "sine", made.sine),
        ("theta", "theta", made.theta),
        ("theta, matched", "theta", made.matched),
    ):
        for parameter in MOTORS[kind].parameters:
            yield name, parameter.name, values[parameter.name], parameter.unit
