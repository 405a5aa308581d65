"""A driven machine with a closed form: it slides in one direction under a q-current, Coulomb and viscous friction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from linid.identification.result import Estimate, FitResult
from linid.recording.recording import Recording

MASS, K, COULOMB, VISCOUS = 2.0, 30.0, 1.5, 8.0  # kg, N/A, N, N s/m
MEAN, SWING, OMEGA = 0.25, 0.08, 6.0  # A, A, rad/s
TAU = MASS / VISCOUS
PERIOD = 1e-3


@dataclass(frozen=True)
class Noise:
    """Standard deviations of encoder (m) and current (A)."""

    encoder: float = 0.0
    current: float = 0.0


def current(t: np.ndarray) -> np.ndarray:
    return np.asarray(MEAN + SWING * np.sin(OMEGA * t))


def position(t: np.ndarray, extra: float = 0.0, v0: float = 0.4, added: float = 0.0) -> np.ndarray:
    """(m + added) v' = K i - F_C - sigma_2 v + extra from y = 0, v = v0, solved by hand (m)."""
    steady = (K * MEAN - COULOMB + extra) / VISCOUS
    mass = MASS + added
    tau = mass / VISCOUS
    # v' + v/tau = (K/m) SWING sin(omega t): particular solution a sin + b cos
    drive = K * SWING / mass
    a = drive / tau / (OMEGA**2 + tau**-2)
    b = -drive * OMEGA / (OMEGA**2 + tau**-2)
    decay = v0 - steady - b
    return np.asarray(
        steady * t
        + a / OMEGA * (1 - np.cos(OMEGA * t))
        + b / OMEGA * np.sin(OMEGA * t)
        + decay * tau * (1 - np.exp(-t / tau))
    )


def drift(t: float | np.ndarray, extra: float) -> np.ndarray:
    """How far a force `extra` that the model lacks takes the axis within t: m e'' = F - sigma_2 e'."""
    return np.asarray(extra / VISCOUS * (t - TAU * (1 - np.exp(-np.asarray(t) / TAU))))


def recording(
    name: str = "run",
    *,
    extra: float = 0.0,
    noise: Noise | None = None,
    seed: int = 0,
    duration: float = 3.0,
    **more: Any,
) -> Recording:
    """A recording of the machine; extra: a constant force that no model here knows, N."""
    noise = noise or Noise()
    t = np.arange(round(duration / PERIOD) + 1) * PERIOD
    generator = np.random.default_rng(seed)
    y = position(t, extra, added=float(more.get("added_mass", 0.0))) + noise.encoder * generator.standard_normal(t.size)
    i = current(t) + noise.current * generator.standard_normal(t.size)
    return Recording(name, t, y, drive_input=i, **more)


def result() -> FitResult:
    """The machine's true parameters as a fitted force model."""
    values = {
        "force_constant": K,
        "coulomb_force": COULOMB,
        "static_force": COULOMB,
        "stribeck_velocity": 0.01,
        "stribeck_exponent": 2.0,
        "bristle_stiffness": 1e5,
        "bristle_damping": 100.0,
        "viscous_friction": VISCOUS,
        "mass": MASS,
    }
    nan = float("nan")
    return FitResult(
        model="force",
        axis="linear",
        effects=(),
        estimates=tuple(Estimate(name, name, "1", value, nan, nan, nan) for name, value in values.items()),
        fitted=(),
        correlation=np.zeros((0, 0)),
        condition_number=1.0,
        pairs=(),
        starts={},
        objectives={},
        residual_rms={},
        history=(),
        stop_reasons=(),
        converged=True,
        seed=1,
        evaluations=0,
        substeps=2,
        step_error=0.0,
    )
