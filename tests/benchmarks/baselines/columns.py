"""What a capable user has without linid: a base by least squares along the smoothed motion, and columns of candidates.

Mass, Coulomb and viscous friction come from the free wheels with their known masses, pole pitch, phase and force
constant from a scan on the driven recordings, all on the fitted ones. Rows that creep (bristles) are left out. A column
is what a candidate of unit size would add to the force; nonlinear numbers of candidates get a small grid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import minimum_filter1d
from scipy.signal import savgol_filter

from linid.api import read
from linid.recording.recording import Recording

Array = np.ndarray
WINDOW, ORDER = 21, 3  # of the smoothing, in samples at 1 kHz
EVERY = 12  # rows kept: the smoothing makes neighbours alike
SLIDING = 0.03  # m/s: below it the bristles rule
STEP = 0.15  # of the largest current, from one sample to the next
SPREAD = np.linspace(-1.0, 1.0, 17)
PITCHES = (7e-3, 32e-3)  # m, between which the pole pitch is sought
PHASES = 2 * np.pi / 3 * np.array([-1.0, 0.0, 1.0])


@dataclass(frozen=True)
class Rows:
    """Rows of a campaign, (n,) each: recording, held-out or not, t in s, y in m, v, a in SI, currents (3, n) in A,
    added: known mass in kg, travel since the last reversal in m, heat: filtered square of the currents, started:
    running time of the campaign in s."""

    recording: Array
    held_out: Array
    driven: Array
    t: Array
    started: Array
    y: Array
    v: Array
    a: Array
    currents: Array
    added: Array
    travel: Array
    heat: Array

    def __len__(self) -> int:
        return int(self.t.size)


@dataclass(frozen=True)
class Base:
    """The base of a campaign: mass in kg, thrust and its quadrature (n,) in N, electrical angle (n,) in rad, columns of
    the base (k, n), target (n,): what of mass times acceleration the first base leaves, N."""

    mass: float
    thrust: Array
    quadrature: Array
    angle: Array
    columns: Array
    target: Array


def rows_of(path: Path) -> Rows:
    """Rows of a campaign file."""
    parts: dict[str, list[Array]] = {name: [] for name in Rows.__dataclass_fields__}
    started = 0.0
    for number, recording in enumerate(read(path).recordings):
        for name, values in _one(recording, number, started).items():
            parts[name].append(values)
        started += float(recording.t[-1])
    return Rows(**{name: np.concatenate(values, axis=-1) for name, values in parts.items()})


def _one(recording: Recording, number: int, started: float) -> dict[str, Array]:
    t, dt = recording.t, float(recording.t[1] - recording.t[0])

    def smooth(x: Array, derivative: int = 0) -> Array:
        return np.asarray(savgol_filter(x, WINDOW, ORDER, deriv=derivative, delta=dt, axis=-1))

    currents = recording.phase_currents
    raw = np.zeros((3, t.size)) if currents is None else currents
    y, v, a = (smooth(recording.y, k) for k in range(3))
    square = (raw**2).sum(axis=0)
    heat = np.zeros(t.size)
    for k in range(1, t.size):
        heat[k] = heat[k - 1] + dt / 3.0 * (square[k - 1] - heat[k - 1])
    turned = np.flatnonzero(np.diff(np.sign(v)) != 0) + 1
    last = np.zeros(t.size, dtype=int)
    last[turned] = turned
    travel = np.abs(y - y[np.maximum.accumulate(last)])
    # Nothing smooth follows a step of the current: rows that touch one are left out.
    steps = np.abs(np.diff(raw, axis=1, prepend=raw[:, :1])).max(axis=0) > STEP * np.abs(raw).max() + 1e-9
    touched = np.convolve(steps, np.ones(WINDOW + 4), "same") > 0
    keep = np.arange(WINDOW, t.size - WINDOW, EVERY)
    # Where the window sees a reversal, friction has a step, and the bristles their way.
    slowest = minimum_filter1d(np.abs(v), WINDOW + 4)
    keep = keep[(slowest[keep] > SLIDING) & ~touched[keep]]
    one = np.ones(keep.size)
    return {
        "recording": number * one,
        "held_out": one * (recording.split == "held_out"),
        "driven": one * (recording.kind != "free_wheel"),
        "t": t[keep],
        "started": started + t[keep],
        "y": y[keep],
        "v": v[keep],
        "a": a[keep],
        # Not smoothed: at speed they turn faster than the window lets pass.
        "currents": raw[:, keep],
        "added": one * (recording.added_mass or 0.0),
        "travel": travel[keep],
        "heat": heat[keep],
    }


def solve(design: Array, target: Array) -> tuple[Array, float]:
    """Least squares of target (n,) on design (k, n): coefficients (k,), residual sum of squares."""
    norms = np.linalg.norm(design, axis=1)
    used = norms > 1e-9 * norms.max()
    found = np.zeros(design.shape[0])
    scaled = design[used] / norms[used, None]
    found[used] = np.linalg.lstsq(scaled.T, target, rcond=1e-6)[0] / norms[used]
    return found, float(np.sum((target - found @ design) ** 2))


def base_of(rows: Rows) -> Base:
    """The base of a campaign by least squares on its fitted recordings."""
    fit, side = rows.held_out == 0, np.sign(rows.v)
    friction = np.stack([side, rows.v, side * np.exp(-np.abs(rows.v) / 0.05)])
    wheels = fit & (rows.driven == 0)
    # Free wheels: the known mass times acceleration is minus friction, minus the unknown mass times acceleration.
    found, _ = solve(-np.stack([rows.a, side, rows.v])[:, wheels], rows.added[wheels] * rows.a[wheels])
    mass = max(float(found[0]), 1e-2)
    inertia = (mass + rows.added) * rows.a
    driven = fit & (rows.driven == 1)
    wavenumber, _ = _pitch(rows, driven)

    def price(turn: float) -> float:
        return solve(np.vstack([_waves(rows, wavenumber, turn)[1], -friction])[:, driven], inertia[driven])[1]

    # Windings need not be 120 degrees apart.
    turn = min((sense * (1 + 0.06 * part) for sense in (1, -1) for part in SPREAD), key=price)
    angle, waves = _waves(rows, wavenumber, turn)
    design = np.vstack([waves, -friction])
    found, _ = solve(design[:, fit], inertia[fit])
    thrust = found[:2] @ waves
    quadrature = found[0] * waves[1] - found[1] * waves[0]
    columns = np.vstack([thrust, quadrature, friction])
    return Base(mass, thrust, quadrature, angle + math.atan2(found[1], found[0]), columns, inertia - found @ design)


def _waves(rows: Rows, wavenumber: float, turn: float) -> tuple[Array, Array]:
    """Electrical angle (n,) and the two thrusts per N/A (2, n) of a field; turn: its sense, and times 120 degrees the
    phases' distance."""
    angle = wavenumber * rows.y
    phases = angle + turn * PHASES[:, None]
    return angle, np.stack([(np.sin(phases) * rows.currents).sum(0), (np.cos(phases) * rows.currents).sum(0)])


def _pitch(rows: Rows, chosen: Array) -> tuple[float, float]:
    """Wavenumber of the field in rad/m and the sense in which the phases follow each other.

    The drive commutates by its encoder, so the currents' vector turns with the position: the wavenumber at which it
    stands still once that turn is taken off. Thrust alone hardly tells, as its cosine is flat about the optimum.
    """
    low, high = math.pi / PITCHES[1], math.pi / PITCHES[0]
    y, step = rows.y[chosen], 0.3 / float(np.ptp(rows.y[chosen]))
    best = (0.0, low, 1.0)
    for sense in (1.0, -1.0):
        # Squared: a push and a pull have opposite vectors.
        vector = ((np.exp(-1j * sense * PHASES)[:, None] * rows.currents[:, chosen]).sum(axis=0)) ** 2
        grid = np.arange(low, high, step)
        for width in (0.0, step, step / 8, step / 64):
            grid = grid if width == 0.0 else best[1] + width * np.linspace(-1, 1, 17)
            for k in grid if width == 0.0 or best[2] == sense else ():
                # A sine of the angle has vectors that turn forward or back; either sense is tried.
                coherence = max(abs(np.sum(vector * np.exp(turn * 2j * k * y))) for turn in (1, -1))
                best = max(best, (float(coherence), float(k), sense))
    return best[1], best[2]


def candidates(rows: Rows, base: Base) -> dict[str, Array]:
    """Columns (k, n) in N that stand for each effect of the list which sliding rows can show."""
    side, v, y, t, f = np.sign(rows.v), rows.v, rows.y, rows.t, base.thrust
    middle, reach = 0.5 * (y.min() + y.max()), 0.5 * float(np.ptp(y))
    z, speed, push = (y - middle) / reach, np.abs(v), np.abs(f)
    typical = float(np.median(speed))

    def waves(*orders: int) -> list[Array]:
        return [g(k * base.angle) for k in orders for g in (np.sin, np.cos)]

    amps = np.sqrt((rows.currents**2).sum(0))
    table = {
        "cogging": waves(1, 2, 4),
        "force_ripple": [f * w for w in waves(6)] + [base.quadrature * w for w in waves(6)],
        "phase_gain_imbalance": [f * w for w in waves(2)] + [base.quadrature * w for w in waves(2)],
        "current_offset": [w * (rows.driven == 1) for w in waves(1)],
        "asymmetric_friction": [speed, np.exp(-speed / 0.05), np.ones_like(v)],
        "constant_force": [np.ones_like(v)],
        "cable_force": [z, z**3, np.exp(-rows.travel / 0.01) * side],
        "position_dependent_friction": [side * np.exp(-0.5 * ((z - c) / 0.2) ** 2) for c in np.linspace(-1, 1, 9)],
        "quadratic_drag": [v * speed],
        "input_delay": [_rate(rows, f)],
        "force_saturation": [f * amps],
        "thermal_derating": [f * rows.heat],
        "end_effect": [f * np.clip(z - 0.4, 0, None) ** 2, f * np.clip(-z - 0.4, 0, None) ** 2],
        "flexible_load": [_rate(rows, rows.a), _rate(rows, _rate(rows, f))],
        "friction_drift": [side * t, side * (1 - np.exp(-t / 1.5)), side * rows.started],
        "eddy_current_drag": [v * np.exp(-speed / c) for c in (0.15, 0.3, 0.6)],
        "load_dependent_friction": [side * push],
        "pole_pitch_error": [base.quadrature * g(math.pi * z) for g in (np.sin, np.cos)],
        "dwell_stiction": [side * np.exp(-rows.travel / 1e-3) * (speed < typical)],
    }
    return {name: np.stack(group) for name, group in table.items()}


def _rate(rows: Rows, x: Array) -> Array:
    """Rate of change of a quantity (n,) about each row; beside gaps of the rows it is zero."""
    wide = rows.t[2:] - rows.t[:-2]
    same = (rows.recording[2:] == rows.recording[:-2]) & (wide > 0) & (wide < 2.5 * EVERY * 1e-3)
    out = np.zeros_like(x)
    out[1:-1] = np.where(same, (x[2:] - x[:-2]) / np.where(same, wide, 1.0), 0.0)
    return out
