"""What the motor parameters mean: pole pitch, field shape k, coil length, phase spacing, and sine or theta."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from linid.identification.result import Estimate, FitResult
from linid.physics.field.guideway import k_of
from linid.physics.field.sine_scope import NEGLIGIBLE
from linid.physics.field.winding import force_harmonics
from linid.physics.motors import MOTORS, fundamental_force_constant
from linid.recording.recording import Recording
from linid.statistics import NORMAL_97_5

# Minimum over k of the harmonics' share: (a_1 - 1)^2 + a_3^2 + ... with a_n = 2 sqrt(pi) k exp(-n^2 k^2 pi^2/4).
SINE_LIMIT_K = 0.46223


def _propagate(
    result: FitResult, function: Callable[..., float], names: tuple[str, ...], held: set[str]
) -> tuple[float, float]:
    """Value and standard deviation of function(*values) by the delta method, given the values of those held."""
    values = [result.value(name) for name in names]
    value = float(function(*values))
    gradient = np.zeros(len(result.fitted))
    for k, name in enumerate(names):
        if name not in result.fitted:
            continue
        step = 1e-6 * max(abs(values[k]), 1e-9)
        moved = list(values)
        moved[k] += step
        gradient[result.fitted.index(name)] = (float(function(*moved)) - value) / step
    covariance = result.covariance
    inside = np.array([name in held for name in result.fitted])
    if np.any(inside):
        cross = covariance[:, inside]
        covariance = covariance - cross @ np.linalg.pinv(covariance[np.ix_(inside, inside)], hermitian=True) @ cross.T
    return value, math.sqrt(max(float(gradient @ covariance @ gradient), 0.0))


def derived_quantities(result: FitResult, recordings: Sequence[Recording]) -> tuple[Estimate, ...]:
    """Geometry that follows from a sine or theta fit, with 95 % intervals; empty for other models."""
    motor = MOTORS[result.model]
    if not motor.phases:
        return ()
    unit = "rad" if result.axis == "rotary" else "m"
    theta = result.model == "theta"
    factor = motor.turns
    unsure = {e.name for e in result.estimates if e.status == "not_identifiable"}
    shapes = unsure & {"nome", "winding_length"}
    rows: list[tuple[str, str, str, Callable[..., float], tuple[str, ...]]] = [
        ("pole_pitch", "chi", unit, lambda d: math.pi / (factor * d), ("electrical_wavenumber",)),
        ("phase_spacing", "y_p", unit, lambda p, d: p / d, ("winding_displacement", "electrical_wavenumber")),
    ]
    if theta:
        rows += [
            ("field_shape", "k", "1", k_of, ("nome",)),
            ("coil_length", "l_y", unit, lambda z, d: 2.0 * z / d, ("winding_length", "electrical_wavenumber")),
            (
                "fundamental_force_constant",
                "K_f",
                "N m/A" if unit == "rad" else "N/A",
                fundamental_force_constant,
                ("force_constant", "winding_length", "nome"),
            ),
        ]
    if result.winding:
        constant = "K_V'" if theta else "K_V"
        rows += [
            ("back_emf_over_inductance", constant, "A/m", lambda k, x: k / x, ("force_constant", "phase_inductance")),
            ("electrical_time_constant", "K_e", "s", lambda x, r: x / r, ("phase_inductance", "phase_resistance")),
        ]
    out = []
    for name, symbol, row_unit, function, names in rows:
        # The fundamental is told whatever the field's shape, so shapes that nothing tells are held.
        value, std = _propagate(result, function, names, shapes if name == "fundamental_force_constant" else set())
        lost = unsure & set(names) if name != "fundamental_force_constant" else set()
        low, high = value - NORMAL_97_5 * std, value + NORMAL_97_5 * std
        if name == "pole_pitch" and "electrical_wavenumber" in result.fitted:  # its interval need not be symmetric
            source = next(e for e in result.estimates if e.name == "electrical_wavenumber")
            low, high = sorted((float(function(source.low)), float(function(source.high))))
        out.append(
            Estimate(
                name,
                symbol,
                row_unit,
                value,
                std,
                low,
                high,
                "not_identifiable" if lost else "fitted",
                f"hangs on {', '.join(sorted(lost))}" if lost else "",
            )
        )
    if theta:
        out.append(_sine_cost(result, recordings, "nome" in unsure or "winding_length" in unsure))
    return tuple(out)


def _sine_cost(result: FitResult, recordings: Sequence[Recording], unsure: bool) -> Estimate:
    """RMS force that the best sine of the same fundamental misses, as a share of the RMS force, over the data."""
    length, nome = result.value("winding_length"), result.value("nome")
    density, displacement = result.value("electrical_wavenumber"), result.value("winding_displacement")
    shift = result.value("commutation_offset")
    lost = total = 0.0
    amplitudes = force_harmonics(nome, length)
    for recording in recordings:
        currents = recording.phase_currents
        if currents is None or recording.kind == "free_wheel":
            continue
        for j in (1, 2, 3):
            if j == 1:
                force = {n: np.zeros(recording.y.size) for n in amplitudes}
            z = density * recording.y + displacement * (j - 2) + shift
            for n, amplitude in amplitudes.items():
                if abs(amplitude) > 1e-14:
                    force[n] += amplitude * np.sin(2 * n * z) * currents[j - 1]
        higher = sum((force[n] for n in amplitudes if n > 1), np.zeros(recording.y.size))
        lost += float(higher @ higher)
        total += float((higher + force[1]) @ (higher + force[1]))
    # Two digits: a share of force to judge by, not to compute with.
    share = float(f"{math.sqrt(lost / total):.2g}") if total > 0.0 else 0.0
    k = k_of(nome)
    pays = share >= NEGLIGIBLE
    verdict = "theta pays" if pays else "sine would do"
    note = f"k is {k - SINE_LIMIT_K:+.3f} from {SINE_LIMIT_K}: {verdict} at these currents"
    if unsure and pays:
        note = "theta pays at these currents, which tell nome and winding length only together"
    elif unsure:
        note = "the recordings do not tell the field shape: sine does as well on them"
    return Estimate("sine_force_error", "e_sine", "1", share, math.nan, math.nan, math.nan, "fixed", note)
