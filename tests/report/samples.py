"""Synthetic fit results, gaps and traces for the report's tests."""

from __future__ import annotations

from typing import Any

import numpy as np

from linid.diagnosis.gap import AheadPieces, RecordingGap, Trace
from linid.identification.result import Estimate, FitResult, Generation

NAN = float("nan")


def estimate(name: str, symbol: str, unit: str, value: float, std: float, **more: Any) -> Estimate:
    """An estimate with a symmetric 95 % interval."""
    return Estimate(name, symbol, unit, value, std, value - 1.96 * std, value + 1.96 * std, **more)


ESTIMATES = (
    estimate("coulomb_force", "F_C", "N", 1.7204, 0.0213),
    estimate("static_force", "F_S", "N", 3.1982, 0.412),
    estimate("stribeck_velocity", "v_s", "m/s", 0.0215, 0.0064),
    estimate("stribeck_exponent", "alpha", "1", 2.0, NAN, status="fixed", note="held at its default"),
    estimate(
        "bristle_stiffness",
        "sigma_0",
        "N/m",
        31234.0,
        NAN,
        status="not_identifiable",
        note="no pre-sliding in the recordings; add a slow ramp below the breakaway force",
    ),
    estimate("bristle_damping", "sigma_1", "N s/m", 250.0, NAN, status="at_bound", note="at its upper bound"),
    estimate("viscous_friction", "sigma_2", "N s/m", 6.5312, 0.0312),
    estimate("mass", "m", "kg", 2.34567, 0.00321),
    estimate("force_constant", "K_f", "N/A", 38.21, 0.0421),
    estimate("electrical_wavenumber", "omega_g", "1/m", 222.013, 0.0135),
    estimate("winding_displacement", "alpha_p", "1", 2.0944, 0.0007),
    estimate("commutation_offset", "alpha_S", "1", -0.4011, 0.0021),
    estimate("constant_force", "F_0", "N", 0.003, 0.02),
)
FITTED = tuple(e.name for e in ESTIMATES if e.status == "fitted")


def history() -> tuple[Generation, ...]:
    """A genetic search and its least squares."""
    genetic = [Generation("genetic", i, 120 * (i + 1), 20 * 0.93**i + 1, 60 * 0.94**i + 1.2) for i in range(90)]
    cma = [Generation("cma", i, 10800 + 40 * (i + 1), 1.03 * 0.999**i, 1.4 * 0.99**i + 0.05) for i in range(60)]
    levenberg_marquardt = [
        Generation("least_squares", i, 13200 + 14 * (i + 1), 0.96 - 0.001 * i, 0.96 - 0.001 * i) for i in range(8)
    ]
    return (*genetic, *cma, *levenberg_marquardt)


def fit_result(**changes: Any) -> FitResult:
    """A fit of the sine model with every status among its parameters."""
    stds = np.array([e.std for e in ESTIMATES if e.status == "fitted"])
    rng = np.random.default_rng(3)
    p = len(FITTED)
    factor = rng.normal(size=(p, 3)) * 0.7
    matrix = factor @ factor.T + np.eye(p)
    matrix[p - 1, 0] = matrix[0, p - 1] = 0.999 * np.sqrt(matrix[0, 0] * matrix[p - 1, p - 1]) * 0.5
    scale = 1 / np.sqrt(np.diag(matrix))
    correlation = matrix * np.outer(scale, scale)
    values: dict[str, Any] = {
        "model": "sine",
        "axis": "linear",
        "effects": ("constant_force",),
        "estimates": ESTIMATES,
        "fitted": FITTED,
        "correlation": correlation,
        "condition_number": 3.2e4,
        "pairs": (("force_constant", "winding_displacement", -0.994, "Fix alpha_p, or unbalance the currents."),),
        "starts": {},
        "objectives": {},
        "residual_rms": {},
        "history": history(),
        "stop_reasons": ("least squares: 60 steps used",),
        "converged": True,
        "seed": 1,
        "evaluations": 13312,
        "substeps": 2,
        "step_error": 1e-9,
        "covariance": correlation * np.outer(stds, stds),
        "derived": (estimate("pole_pitch", "chi", "m", 0.0141505, 0.0000009, note="pi / omega_g"),),
    }
    return FitResult(**{**values, **changes})


def gap(name: str = "moves_3", **changes: Any) -> RecordingGap:
    """Gap measures of one held-out recording."""
    values: dict[str, Any] = {
        "recording": name,
        "kind": "motor",
        "split": "held_out",
        "free_run": 0.00523,
        "free_run_floor": 1.2e-6,
        "ahead": 12.3e-6,
        "ahead_floor": 0.4e-6,
        "force": 0.1123,
        "force_share": 0.0213,
        "force_floor": 0.0512,
    }
    return RecordingGap(**{**values, **changes})


def trace(name: str, t: np.ndarray, y: np.ndarray, simulated: np.ndarray, **changes: Any) -> Trace:
    """A trace whose velocities are differences of its positions."""
    values: dict[str, Any] = {
        "recording": name,
        "kind": "motor",
        "split": "held_out",
        "axis": "linear",
        "added_mass": 0.0,
        "t": t,
        "y_measured": y,
        "y_simulated": simulated,
        "velocity_measured": np.gradient(y, t),
        "velocity_simulated": np.gradient(simulated, t),
        "force_t": t,
        "force_residual": np.zeros_like(t),
    }
    return Trace(**{**values, **changes})


def coast(name: str = "freewheel_1", v0: float = 0.4, mass: float = 0.0, direction: int = 1, n: int = 1500) -> Trace:
    """A coast-down under Coulomb and viscous friction; the model brakes one per cent too little."""
    t = np.arange(n) * 1e-3

    def run(force: float) -> np.ndarray:
        m, viscous = 2.3 + mass, 6.5
        v = np.maximum((v0 + force / viscous) * np.exp(-viscous * t / m) - force / viscous, 0.0)
        return 0.39 + direction * np.concatenate(([0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * 1e-3)))

    noise = np.random.default_rng(len(name) + int(100 * v0)).normal(0, 3e-7, n)
    return trace(name, t, run(1.72) + noise, run(1.70), kind="free_wheel", split="fit", added_mass=mass)


def move(name: str = "moves_3", n: int = 4500, **changes: Any) -> Trace:
    """A 0.4 m move there and back; the simulation drifts by some tenths of a millimetre."""
    t = np.arange(n) * 1e-3
    y = 0.39 + 0.2 * (1 - np.cos(2 * np.pi * t / t[-1]))
    simulated = y + 2e-4 * np.sin(2 * np.pi * 1.5 * t / t[-1]) * t / t[-1]
    noise = np.random.default_rng(5).normal(0, 3e-7, n)
    phase = 222.0 * y
    currents = np.array([1.2 * np.cos(2 * np.pi * t / t[-1]) * np.sin(phase + s * 2.094) for s in (-1, 0, 1)])
    return trace(name, t, y + noise, simulated, **{"phase_currents": currents, **changes})


def pieces(one: Trace, length: int = 100, drift: float = 5e-5) -> AheadPieces:
    """Predictions that leave the measured motion quadratically, by `drift` at the horizon; windows overlap by half."""
    starts = range(0, len(one.t) - length, length // 2)
    rows = np.array([np.arange(k, k + length + 1) for k in starts])
    error = np.broadcast_to(drift * np.linspace(0.0, 1.0, length + 1) ** 2, rows.shape)
    drawn = [one.t[rows], one.y_measured[rows] + error, one.velocity_measured[rows], error]
    stitched = [np.pad(part[::2], ((0, 0), (0, 1)), constant_values=np.nan).ravel()[:-1] for part in drawn]
    return AheadPieces(length * 1e-3, *stitched, end_t=one.t[rows][:, -1], end_error=error[:, -1])
