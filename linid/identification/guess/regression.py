"""First guesses and search bounds from linear regression of acceleration along the measured motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array
from linid.identification.signals.motion import Motion, measure_motion
from linid.recording.local_polynomial import local_derivative
from linid.recording.recording import Recording

_MOST_WAVES = 120  # in a regression beside a periodic force


@dataclass(frozen=True)
class Rows:
    """Samples in clear motion. a, v, y: (n,) acceleration, speed and position in m/s^2, m/s and m; inputs: (3, n) phase
    currents in A, or one input in its unit; added_mass: (n,) kg; recording: (n,) its number."""

    a: Array
    v: Array
    y: Array
    inputs: Array
    added_mass: Array
    recording: NDArray[np.int64]


def moving_rows(recordings: Sequence[Recording], motion: Motion, decimate: int = 3) -> Rows:
    """The samples of recordings in clear motion, every `decimate`-th; motion: of these recordings."""
    pieces: list[tuple[Array, Array, Array, Array, Array]] = []
    owners: list[int] = []
    at = 0
    top = float(np.max(np.abs(motion.v))) if motion.v.size else 0.0
    for number, recording in enumerate(recordings):
        n = recording.y.size
        v = motion.v[at : at + n]
        y = motion.y[at : at + n]
        at += n
        dt = recording.duration / (n - 1)
        width = min(21, (n - 1) // 2 * 2 - 1)
        if width < 5:
            continue
        a = local_derivative(recording.y, width, 3, 2, dt)
        channels = _channels(recording)  # not smoothed: commutated currents turn faster than the window
        rows = np.arange(width, n - width, decimate)
        rows = rows[np.abs(v[rows]) > 0.02 * top]
        pieces.append((a[rows], v[rows], y[rows], channels[:, rows], np.full(rows.size, recording.added_mass)))
        owners += [number] * rows.size
    if not pieces:
        empty = np.zeros(0)
        return Rows(empty, empty, empty, np.zeros((3, 0)), empty, np.zeros(0, dtype=np.int64))
    return Rows(
        np.concatenate([p[0] for p in pieces]),
        np.concatenate([p[1] for p in pieces]),
        np.concatenate([p[2] for p in pieces]),
        np.concatenate([p[3] for p in pieces], axis=1),
        np.concatenate([p[4] for p in pieces]),
        np.array(owners, dtype=np.int64),
    )


def _channels(recording: Recording) -> Array:
    if recording.phase_currents is not None:
        return recording.phase_currents
    out = np.zeros((3, recording.y.size))
    if recording.drive_input is not None:
        out[0] = recording.drive_input
    return out


def _friction_columns(v: Array) -> Array:
    return np.column_stack([-np.sign(v), -v])


def free_wheel_guess(recordings: Sequence[Recording], mass: float | None) -> dict[str, float]:
    """Coulomb force, viscous friction and (with several added masses) the mass from coast-downs.

    m a + added a = -F_C sign(v) - sigma_2 v is linear in m, F_C, sigma_2. mass: kg if known.
    """
    rows = moving_rows(recordings, measure_motion(recordings))
    if rows.a.size < 10:
        return {"coulomb_force": 1.0, "viscous_friction": 0.1, "mass": mass or 1.0}
    friction = _friction_columns(rows.v)
    if mass is None and np.ptp(rows.added_mass) > 0.0:
        columns = np.column_stack([-rows.a, friction])
        solution = np.linalg.lstsq(columns, rows.added_mass * rows.a, rcond=None)[0]
        guess = float(solution[0])
        if guess > 0.0:
            return {"mass": guess, "coulomb_force": float(solution[1]), "viscous_friction": float(solution[2])}
    known = mass if mass is not None else 1.0
    solution = np.linalg.lstsq(friction, (known + rows.added_mass) * rows.a, rcond=None)[0]
    return {"mass": known, "coulomb_force": float(solution[0]), "viscous_friction": float(solution[1])}


def force_guess(
    recordings: Sequence[Recording], constant: float | None, mass: float | None, *, waves: bool = False
) -> dict[str, float]:
    """Force constant or mass, friction and constant force, SI, of a driven axis with one input.

    constant: N per unit of the input, mass: kg, where they are given; waves: beside a force that is periodic in
    position, as free as the rows allow. Where a loop's input cancels such a force, a regression without it takes the
    input for something that pushes nowhere (closed-loop bias).
    """
    rows = moving_rows(recordings, measure_motion(recordings), 1 if waves else 3)
    columns = np.column_stack([rows.inputs[0], _friction_columns(rows.v), np.ones(rows.v.size)])
    weights = np.ones(rows.v.size)
    if waves:
        columns = np.column_stack([columns, _waves(rows.y, recordings[0].axis)])
        # Each recording has its own noise: one that shakes must not drown the others.
        for recording in np.unique(rows.recording):
            mine = rows.recording == recording
            weights[mine] = 1.0 / max(float(np.std(rows.a[mine])), 1e-300)
    solution = np.linalg.lstsq(columns * weights[:, None], rows.a * weights, rcond=1e-10)[0]
    gain, coulomb, viscous, offset = (float(x) for x in solution[:4])
    if constant is not None:
        mass = constant / gain if mass is None and gain != 0.0 else mass
    known = mass if mass is not None else 1.0
    return {
        "force_constant": constant if constant is not None else gain * known,
        "mass": known,
        "coulomb_force": coulomb * known,
        "viscous_friction": viscous * known,
        "constant_force": offset * known,
    }


def _waves(y: Array, axis: str) -> Array:
    """Sines and cosines (n, 2 k) of the position: whole waves per revolution, or per stroke of a linear axis."""
    length = 2.0 * math.pi if axis == "rotary" else 1.25 * float(np.ptp(y))
    most = min(_MOST_WAVES, y.size // (40 * 2))
    angles = (2.0 * math.pi / length) * np.outer(y, np.arange(1, most + 1))
    return np.concatenate([np.sin(angles), np.cos(angles)], axis=1)


def _sequences(inputs: Array) -> tuple[Array, Array]:
    """Space vector of the phase currents: real and imaginary part of sum I_j exp(i 2 pi (j - 2)/3)."""
    third = 2.0 * math.pi / 3.0
    real = inputs[1] + math.cos(third) * (inputs[0] + inputs[2])
    imaginary = math.sin(third) * (inputs[2] - inputs[0])
    return real, imaginary


def _scan(rows: Rows, densities: Array) -> tuple[Array, Array]:
    """Residual sum of squares and regression coefficients for each electrical wavenumber."""
    real, imaginary = _sequences(rows.inputs)
    rest = np.column_stack([_friction_columns(rows.v), np.ones(rows.v.size)])
    costs = np.empty(densities.size)
    coefficients = np.empty((densities.size, 7))
    total = float(rows.a @ rows.a)
    for k, density in enumerate(densities):
        sine, cosine = np.sin(density * rows.y), np.cos(density * rows.y)
        columns = np.column_stack([sine * real, cosine * real, sine * imaginary, cosine * imaginary, rest])
        gram = columns.T @ columns
        moment = columns.T @ rows.a
        solution = np.linalg.lstsq(gram, moment, rcond=None)[0]
        coefficients[k] = solution
        costs[k] = total - float(solution @ moment)
    return costs, coefficients


def phase_guess(
    recordings: Sequence[Recording], mass: float, lower: float, upper: float, known: float | None = None
) -> tuple[dict[str, float], tuple[float, ...]]:
    """Force constant, electrical wavenumber, winding displacement and shift of a sine motor, and rival densities.

    A scan over the density with everything else linear: with the currents' space vector s,

    F = K_f/3 Im(exp(i (omega_g y + alpha_S)) (D(alpha_p - 2 pi/3) s + D(alpha_p + 2 pi/3) s*)), D(x) = 1 + 2 cos x.

    mass: kg; lower, upper: bounds of the density in 1/m; known: the density in 1/m if given. Returns SI values by name
    and the densities in 1/m.
    """
    rows = moving_rows(recordings, measure_motion(recordings))
    if rows.a.size > 8000:
        rows = _thin(rows, rows.a.size // 8000 + 1)
    reach = max(float(np.ptp(rows.y)), 1e-9)
    step = 0.8 / reach
    grid = np.arange(lower, upper, step) if known is None else np.array([known])
    if grid.size > 3000:
        grid = np.geomspace(lower, upper, 3000)
    costs, _ = _scan(_thin(rows, 4) if known is None else rows, grid)
    best = float(grid[int(np.argmin(costs))])
    for _ in range(0 if known is not None else 3):
        fine = np.linspace(max(best - step, lower), min(best + step, upper), 21)
        costs_fine, _ = _scan(rows, fine)
        best = float(fine[int(np.argmin(costs_fine))])
        step /= 8.0
    coefficient = _scan(rows, np.array([best]))[1][0]
    # F/m = Im(e^{i w y} (P s + N s*)): match sin/cos times real/imaginary part.
    a_sr, a_cr, a_si, a_ci = (float(c) for c in coefficient[:4])
    plus = 0.5 * complex(a_sr + a_ci, a_cr - a_si)
    minus = 0.5 * complex(a_sr - a_ci, a_cr + a_si)
    ratio = float(np.real(minus * np.conj(plus))) / max(abs(plus) ** 2, 1e-300)
    ratio = min(max(ratio, -3.0), 3.0)
    displacement = 2.0 * math.atan2(math.sqrt(3.0) * (1.0 + ratio), 1.0 - ratio)
    if displacement <= 0.0:
        displacement += 2.0 * math.pi
    total = (plus + minus) * 3.0 / (2.0 * (1.0 - math.cos(displacement)))
    order = np.argsort(costs)
    rivals: list[float] = []
    for index in order:
        density = float(grid[index])
        if all(abs(density - other) > 3.0 / reach for other in [best, *rivals]):
            rivals.append(density)
        if len(rivals) == 2:
            break
    values = {
        "force_constant": abs(total) * mass,
        "electrical_wavenumber": best,
        "winding_displacement": displacement,
        "commutation_offset": math.atan2(total.imag, total.real),
        "coulomb_force": float(coefficient[4]) * mass,
        "viscous_friction": float(coefficient[5]) * mass,
        "constant_force": float(coefficient[6]) * mass,
    }
    return values, (best, *rivals)


def _thin(rows: Rows, every: int) -> Rows:
    return Rows(
        rows.a[::every],
        rows.v[::every],
        rows.y[::every],
        rows.inputs[:, ::every],
        rows.added_mass[::every],
        rows.recording[::every],
    )
