"""Measurement: what the scope makes of the exact motion: sensor noise, then quantisation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from linid.arrays import Array

if TYPE_CHECKING:
    from linid.stand.description import Measurement


def quantise(x: Array, resolution: float) -> Array:
    """x (any shape) rounded to the nearest multiple of resolution (same unit), of the same shape; unchanged when that
    is 0.

    1/resolution is taken as a whole number where it is one, so that the values are the doubles nearest to the decimal
    numbers that the scope prints.
    """
    if resolution == 0:
        return x.copy()
    steps = 1 / resolution
    if abs(steps - round(steps)) < 1e-6 * steps:
        return np.asarray(np.round(x * round(steps)) / round(steps))
    return np.asarray(np.round(x / resolution) * resolution)


def measure(
    y: Array, phase_currents: Array, measurement: Measurement, *, seed: int, index: int, powered: bool
) -> tuple[Array, Array]:
    """Logged position (n,) in m and phase currents (3, n) in A of an exact motion: y (n,) in m, phase_currents (3, n)
    in A.

    index: the recording's place in the campaign; each recording has its own noise stream, so leaving others out does
    not change it. powered: False while the power stage is off; the scope then logs exact zeros for current.
    """
    random = np.random.default_rng([seed, index])
    y_noise = measurement.position_noise_rms_m * random.standard_normal(y.shape)
    i_noise = measurement.current_noise_rms_a * random.standard_normal(phase_currents.shape)
    logged = quantise(y + y_noise, measurement.position_resolution_m)
    if not powered:
        return logged, np.zeros_like(phase_currents)
    # Adding 0.0 turns the -0.0 of rounding into 0.0.
    return logged + 0.0, quantise(phase_currents + i_noise, measurement.current_resolution_a) + 0.0


def measure_voltages(phase_voltages: Array, measurement: Measurement, *, seed: int, index: int) -> Array:
    """Logged phase voltages (3, n) in V of exact ones (3, n); seed, index as in `measure`, the noise stream is their
    own.
    """
    random = np.random.default_rng([seed, index, 1])
    noise = measurement.voltage_noise_rms_v * random.standard_normal(phase_voltages.shape)
    return quantise(phase_voltages + noise, measurement.voltage_resolution_v) + 0.0
