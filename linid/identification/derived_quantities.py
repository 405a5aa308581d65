"""What the motor parameters mean: pole pitch, field shape k, coil length, phase spacing, and sine or theta."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from linid.identification.result import Estimate, FitResult, Status
from linid.physics.field.guideway import k_of
from linid.physics.field.sine_scope import NEGLIGIBLE
from linid.physics.motors.motor import Derived, Motor
from linid.physics.motors.registry import MOTORS
from linid.physics.wording import scaled_unit
from linid.recording.recording import Recording
from linid.statistics import NORMAL_97_5

# Minimum over k of the harmonics' share: (a_1 - 1)^2 + a_3^2 + ... with a_n = 2 sqrt(pi) k exp(-n^2 k^2 pi^2/4).
SINE_LIMIT_K = 0.46223
_FUNDAMENTAL = "fundamental_force_constant"
SINE_COST = "sine_force_error"
_ROTARY = {"m": "rad", "N/A": "N m/A"}  # units of a rotary axis


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
    """Geometry that follows from the parameters of a motor with phases, with 95 % intervals; empty for other models.

    recordings: those that were fitted, over which the harmonics of a field's shape are weighed against a sine.
    """
    motor = MOTORS[result.model]
    if not motor.phases:
        return ()
    unsure = {e.name for e in result.estimates if e.status == "not_identifiable"}
    shapes = shapes_not_told(result)
    out = []
    for row in (*_of_every_motor(motor), *motor.derived, *_of_the_shape(motor), *_of_the_windings(result)):
        # The fundamental is told whatever the field's shape, so shapes that nothing tells are held.
        whole = row.name == _FUNDAMENTAL
        value, std = _propagate(result, row.quantity, row.of, shapes if whole else set())
        lost = set() if whole else unsure & set(row.of)
        low, high = value - NORMAL_97_5 * std, value + NORMAL_97_5 * std
        if row.name == "pole_pitch" and "electrical_wavenumber" in result.fitted:  # its interval need not be symmetric
            source = next(e for e in result.estimates if e.name == "electrical_wavenumber")
            low, high = sorted((float(row.quantity(source.low)), float(row.quantity(source.high))))
        status: Status = "not_identifiable" if lost else "fitted"
        note = f"hangs on {', '.join(sorted(lost))}" if lost else ""
        unit = _ROTARY.get(row.unit, row.unit) if result.axis == "rotary" else row.unit
        unit = scaled_unit(unit, result.axis, "kg" if result.per_mass else "")
        out.append(Estimate(row.name, row.symbol, unit, value, std, low, high, status, note))
    if motor.shape and motor.periodic:
        out.append(_sine_cost(result, recordings, bool(shapes)))
    return tuple(out)


def _of_every_motor(motor: Motor) -> tuple[Derived, ...]:
    turns = motor.turns
    return (
        Derived("pole_pitch", "chi", "m", lambda d: math.pi / (turns * d), ("electrical_wavenumber",)),
        Derived("phase_spacing", "y_p", "m", lambda p, d: p / d, ("winding_displacement", "electrical_wavenumber")),
    )


def _of_the_shape(motor: Motor) -> tuple[Derived, ...]:
    if motor.harmonic is None:
        return ()
    names = tuple(name for name, _ in motor.shape)
    return (Derived(_FUNDAMENTAL, "K_f", "N/A", motor.harmonic, ("force_constant", *names)),)


def _of_the_windings(result: FitResult) -> tuple[Derived, ...]:
    if not result.winding:
        return ()
    constant = "K_V'" if MOTORS[result.model].shape else "K_V"
    return (
        Derived(
            "back_emf_over_inductance", constant, "A/m", lambda k, x: k / x, ("force_constant", "phase_inductance")
        ),
        Derived("electrical_time_constant", "K_e", "s", lambda x, r: x / r, ("phase_inductance", "phase_resistance")),
    )


def _sine_cost(result: FitResult, recordings: Sequence[Recording], unsure: bool) -> Estimate:
    """RMS force that the best sine of the same fundamental misses, as a share of the RMS force, over the data."""
    motor, values = MOTORS[result.model], {e.name: e.value for e in result.estimates}
    turns, wavenumber = motor.turns, values["electrical_wavenumber"]
    displacement, offset = values["winding_displacement"], values["commutation_offset"]
    lost = total = 0.0
    amplitudes = motor.spectrum(values)
    for recording in recordings:
        currents = recording.phase_currents
        if currents is None or recording.kind == "free_wheel":
            continue
        force = {n: np.zeros(recording.y.size) for n in amplitudes}
        for j in (1, 2, 3):
            z = wavenumber * recording.y + displacement * (j - 2) + offset
            for n, amplitude in amplitudes.items():
                if abs(amplitude) > 1e-14:
                    force[n] += amplitude * np.sin(turns * n * z) * currents[j - 1]
        higher = sum((force[n] for n in amplitudes if n > 1), np.zeros(recording.y.size))
        lost += float(higher @ higher)
        total += float((higher + force[1]) @ (higher + force[1]))
    # Two digits: a share of force to judge by, not to compute with.
    share = float(f"{math.sqrt(lost / total):.2g}") if total > 0.0 else 0.0
    note = sine_note(result, share, unsure)
    return Estimate(SINE_COST, "e_sine", "1", share, math.nan, math.nan, math.nan, "fixed", note)


def sine_note(result: FitResult, share: float, unsure: bool) -> str:
    """What a share of the RMS force that a sine misses means for the choice of the motor's model.

    unsure: the recordings do not tell the shape of the field.
    """
    pays, motor = share >= NEGLIGIBLE, MOTORS[result.model]
    note = f"{result.model} pays at these currents" if pays else "sine would do at these currents"
    if unsure and not pays:
        return "the recordings do not tell the field shape: sine does as well on them"
    if unsure:
        names = " and ".join(name.replace("_", " ") for name, _ in reversed(motor.shape))
        return f"{note}, which tell {names} only together"
    if "nome" not in {e.name for e in result.estimates}:
        return note
    return f"k is {k_of(result.value('nome')) - SINE_LIMIT_K:+.3f} from {SINE_LIMIT_K}: {note}"


def shapes_not_told(result: FitResult) -> set[str]:
    """Parameters of the field's shape that the recordings do not tell."""
    unsure = {e.name for e in result.estimates if e.status == "not_identifiable"}
    return unsure & {name for name, _ in MOTORS[result.model].shape}
