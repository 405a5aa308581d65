"""The motor's force balance as a cost of few candidates' coordinates: pole pitch and spacing of the windings alone.

At these two the thrust of a field's first harmonic is linear in K_f cos(alpha_S) and K_f sin(alpha_S), and friction at
speed in F_C and sigma_2: variable projection (Golub and Pereyra 1973) solves for them, and the residual is the cost.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from linid.arrays import Array
from linid.identification.guess.regression import moving_rows
from linid.identification.signals.motion import measure_motion
from linid.identification.space.scratch import WAVENUMBERS
from linid.identification.space.search_space import SearchSpace
from linid.recording.recording import Recording

_ROWS = 2500  # of the balance, at most


class ForceBalance:
    """Balance of driven recordings with phase currents. Candidates (C, 2) in [0, 1]: electrical wavenumber by its
    logarithm, and spacing of the windings over a turn."""

    def __init__(self, recordings: Sequence[Recording], space: SearchSpace) -> None:
        rows = moving_rows(recordings, measure_motion(recordings))
        every = slice(None, None, rows.a.size // _ROWS + 1)
        self.acceleration, self.y = rows.a[every], rows.y[every]
        self.currents = rows.inputs[:, every]
        v = rows.v[every]
        self.rest = np.column_stack([-np.sign(v), -v, np.ones(v.size)])
        self.stroke = float(np.ptp(self.y))
        self.turns = space.model.turns
        self.total = float(self.acceleration @ self.acceleration)

    def share(self, difference: float) -> float:
        """A difference of wavenumbers (rad/m), at their geometric mean, in search coordinates."""
        low, high = WAVENUMBERS
        return difference / math.sqrt(low * high) / math.log(high / low)

    def values(self, point: Array) -> tuple[float, float]:
        """Electrical wavenumber in rad/m and winding displacement in rad, electrical, of a candidate, point (2,)."""
        low, high = WAVENUMBERS
        return low * (high / low) ** float(point[0]), 2.0 * math.pi * float(point[1])

    def solved(self, point: Array) -> tuple[Array, float]:
        """Linear parameters K cos, K sin, F_C, sigma_2 and a constant force, all over the mass, and the remaining share
        of the acceleration's mean square, of a candidate, point (2,)."""
        wavenumber, displacement = self.values(point)
        columns = np.column_stack([*self._waves(wavenumber, displacement), self.rest])
        moment = columns.T @ self.acceleration
        solution = np.linalg.lstsq(columns.T @ columns, moment, rcond=1e-12)[0]
        return solution, max(self.total - float(solution @ moment), 0.0) / self.total

    def cost(self, population: Array) -> Array:
        """Remaining shares (C,) of candidates, population (C, 2)."""
        return np.array([self.solved(point)[1] for point in np.atleast_2d(population)])

    def _waves(self, wavenumber: float, displacement: float) -> tuple[Array, Array]:
        outer = np.exp(1j * wavenumber * self.y)
        step = np.exp(1j * displacement)
        first, second, third = self.currents
        wave = outer * (first / step + second + third * step)
        return wave.imag, wave.real


def decoded(balance: ForceBalance, point: Array, mass: float) -> dict[str, float]:
    """Parameters (SI, electrical) of a sine motor and friction at speed, those of a candidate, its linear ones solved
    for. point: (2,) search coordinates; mass: kg."""
    linear, _ = balance.solved(point)
    wavenumber, displacement = balance.values(point)
    return {
        "force_constant": math.hypot(linear[0], linear[1]) * mass,
        "electrical_wavenumber": wavenumber,
        "winding_displacement": displacement,
        "commutation_offset": math.atan2(linear[1], linear[0]),
        "coulomb_force": abs(float(linear[2])) * mass,
        "viscous_friction": abs(float(linear[3])) * mass,
    }
