"""The stand's plant under imposed voltages: forcer, bristles and three phase currents, eqs. (31) and (39).

Kept free of `linid.simulation`, as `linid.stand.plant` is. The power stage is an ideal amplifier: where its vector
turns with the field it does so at every instant, not loop by loop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from linid.arrays import Array
from linid.kernel_cache import kept
from linid.stand.modes import loop_times, voltage_wave
from linid.stand.plant import PlantParameters, friction_rates, phase_constant, plant_parameters

if TYPE_CHECKING:
    from linid.stand.description import AxisDescription, Winding
    from linid.stand.mode_descriptions import SineVoltage, SquareVoltage

# y, v, w, three currents, then energies: work, friction loss, electrical input, copper loss.
_STATES = 10


class Circuit(NamedTuple):
    """The windings and how their voltages are shared out, SI.

    inverse: (3, 3) of the inductances in 1/H; star: the neutral floats; turning: the voltage vector turns with the
    field; shares: (3,) of the wave for each phase, where it does not.
    """

    resistance: float
    inverse: Array
    star: bool
    turning: bool
    shares: Array


@dataclass(frozen=True)
class VoltageRun:
    """Exact motion under imposed voltages at the logged instants: (n,) arrays in SI units, phases (3, n).

    phase_voltages: in V across separate windings, in a star to the mean of the three terminals. work: done on the
    forcer by motor and constant force; loss: by friction; supplied: electrical input; heat: in the copper; all in J.
    peak: (lowest, highest) position in m over all integration steps.
    """

    t: Array
    y: Array
    v: Array
    w: Array
    phase_currents: Array
    phase_voltages: Array
    work: Array
    loss: Array
    supplied: Array
    heat: Array
    peak: tuple[float, float]


def circuit(winding: Winding, phases: tuple[float, float, float] | None) -> Circuit:
    """The kernel's numbers of described windings.

    phases: each one's share of the wave, dimensionless, None: the vector turns with the field.
    """
    star = winding.connection == "star"
    # The three currents of a star sum to zero: M acts like so much less of L.
    mutual = 0.0 if star else winding.mutual_inductance_h
    own = winding.inductance_h - winding.mutual_inductance_h
    inverse: Array = np.asarray(np.linalg.inv(own * np.eye(3) + mutual * np.ones((3, 3))), dtype=np.float64)
    return Circuit(winding.resistance_ohm, inverse, star, phases is None, np.array(phases or (0.0, 0.0, 0.0)))


def simulate_by_voltage(
    description: AxisDescription, mode: SineVoltage | SquareVoltage, *, substeps: int | None = None
) -> VoltageRun:
    """Integrate the described axis from rest, without currents, under the imposed voltages of a recording.

    substeps: integration steps per drive loop period (default: as described). Source: eqs. (31), (39), (40) to (45).
    """
    assert description.winding is not None
    wave = voltage_wave(mode, loop_times(mode, description))
    parts = plant_parameters(description, mode.added_mass_kg), circuit(description.winding, mode.phases)
    start, steps = (mode.start_position_m, description.drive.loop_period_s), substeps or description.substeps
    states, voltages, low, high = _integrate(*parts, *wave, *start, steps, description.loops_per_sample)
    y, v, w, *currents, work, loss, supplied, heat = states.T.copy()
    t: Array = np.arange(y.size, dtype=np.float64) * np.float64(description.measurement.sample_period_s)
    return VoltageRun(t, y, v, w, np.array(currents), voltages.T.copy(), work, loss, supplied, heat, (low, high))


@kept()
def _voltages(y: float, wave: float, p: PlantParameters, c: Circuit, out: Array) -> None:
    """Voltages (3,) in V that the wave's value in V makes at y in m, in a star without their mean."""
    for j in range(3):
        if c.turning:
            out[j] = p.polarity * wave * math.sin(p.density * y + p.shift + 2 * math.pi / 3 * (j - 1))
        else:
            out[j] = c.shares[j] * wave
    if c.star:
        mean = (out[0] + out[1] + out[2]) / 3.0
        for j in range(3):
            out[j] -= mean


@kept()
def _rates(s: Array, wave: float, p: PlantParameters, c: Circuit, out: Array) -> None:
    """Time derivatives of all states into out."""
    y, v, w = s[0], s[1], s[2]
    voltages, drop = np.empty(3), np.empty(3)
    _voltages(y, wave, p, c, voltages)
    force = supplied = heat = mean = 0.0
    for j in range(3):
        constant = phase_constant(y, j - 1, p)
        force += constant * s[3 + j]
        drop[j] = voltages[j] - constant * v - c.resistance * s[3 + j]
        mean += drop[j] / 3.0
        supplied += voltages[j] * s[3 + j]
        heat += c.resistance * s[3 + j] ** 2
    for j in range(3):
        out[3 + j] = 0.0
        for k in range(3):
            out[3 + j] += c.inverse[j, k] * (drop[k] - mean if c.star else drop[k])
    w_rate, resist, loss = friction_rates(v, w, p)
    push = force + p.constant_force
    out[0], out[1], out[2] = v, (push - resist) / p.mass, w_rate
    out[6], out[7] = push * v, loss
    out[8], out[9] = supplied, heat


@kept()
def _integrate(
    p: PlantParameters,
    c: Circuit,
    first: Array,
    last: Array,
    start: float,
    period: float,
    substeps: int,
    loops_per_sample: int,
) -> tuple[Array, Array, float, float]:
    """Kernel: classical Runge-Kutta steps; states (n, 10), voltages (n, 3), extremes of y.

    first, last: (loops,) V at the beginning and the end of each loop.
    """
    rows = first.shape[0] // loops_per_sample
    states, voltages = np.empty((rows, _STATES)), np.empty((rows, 3))
    s, k = np.zeros(_STATES), np.empty((4, _STATES))
    s[0] = low = high = start
    h = period / substeps
    for loop in range(first.shape[0]):
        if loop % loops_per_sample == 0:
            states[loop // loops_per_sample] = s
            _voltages(s[0], first[loop], p, c, voltages[loop // loops_per_sample])
        for step in range(substeps):
            begin = first[loop] + (last[loop] - first[loop]) * step / substeps
            end = first[loop] + (last[loop] - first[loop]) * (step + 1) / substeps
            _rates(s, begin, p, c, k[0])
            _rates(s + h / 2 * k[0], (begin + end) / 2, p, c, k[1])
            _rates(s + h / 2 * k[1], (begin + end) / 2, p, c, k[2])
            _rates(s + h * k[2], end, p, c, k[3])
            s = s + h / 6 * (k[0] + 2 * k[1] + 2 * k[2] + k[3])
            low, high = min(low, s[0]), max(high, s[0])
    return states, voltages, low, high
