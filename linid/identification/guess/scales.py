"""The scales of the recordings at hand, from which effects take starting values and search ranges."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from linid.identification.signals.motion import measure_motion
from linid.physics.effects.effect import Effect, Outlook
from linid.physics.effects.force_saturation import largest_square
from linid.physics.model import Model
from linid.physics.own_terms.effect import own_range
from linid.physics.parameter import Parameter
from linid.recording.local_polynomial import local_derivative
from linid.recording.recording import Recording

_AMPLITUDE_PER_FORCE = 20.0
_READING_PER_STROKE = 0.01
_BINS, _SHARES = 400, 10  # of the stroke, and of the places visited


def look_out(model: Model, recordings: Sequence[Recording], values: dict[str, float]) -> Outlook:
    """What the recordings look like; values: SI values of the base model, for the wavenumber of its field."""
    density = values.get("electrical_wavenumber") if model.phases else None
    motion = measure_motion(recordings)
    low, high = min(float(np.min(r.y)) for r in recordings), max(float(np.max(r.y)) for r in recordings)
    return Outlook(
        stroke_low=low,
        stroke_high=high,
        field_wavenumber=None if density is None else density * model.turns,
        top_speed=float(np.quantile(np.abs(motion.v), 0.999)),
        top_current=max(_top_current(r) for r in recordings),
        durations=tuple(r.duration for r in recordings),
        records=tuple(r.number for r in recordings),
        period=float(np.median([r.period for r in recordings])),
        campaign_duration=max(r.elapsed + float(r.t[-1]) for r in recordings),
        axis=recordings[0].axis,
        visited=_visited(recordings, low, high),
    )


def _visited(recordings: Sequence[Recording], low: float, high: float) -> tuple[float, ...]:
    """Edges (m) of `_SHARES` equal shares of the places where the axis has been, from the lowest to the highest."""
    edges = np.linspace(low, high, _BINS + 1)
    seen = np.zeros(_BINS)
    for recording in recordings:
        seen += np.histogram(recording.y, edges)[0]
    lengths = np.concatenate([[0.0], np.cumsum((seen > 0.0) * (high - low) / _BINS)])
    # A little of every bin counts, or an edge could lie anywhere in a gap.
    lengths += 1e-6 * (edges - low)
    shares = np.interp(np.linspace(0.0, lengths[-1], _SHARES + 1), lengths, edges)
    return tuple(float(x) for x in shares)


@lru_cache(maxsize=128)  # every search space asks for it
def _top_current(recording: Recording) -> float:
    if recording.phase_currents is not None:
        return float(np.sqrt(largest_square(*np.ascontiguousarray(recording.phase_currents))))
    return 0.0 if recording.drive_input is None else float(np.max(np.abs(recording.drive_input)))


def amplitude_range(parameter: Parameter, outlook: Outlook, force: float, mass: float) -> tuple[float, float]:
    """Search range of an amplitude in its SI unit: its own bounds, narrowed to what an axis of this size can have.

    force: scale of the forces in N; mass: kg.
    """
    top = _AMPLITUDE_PER_FORCE * force
    speed, current = max(outlook.top_speed, 1e-9), max(outlook.top_current, 1e-9)
    largest = {
        "N": top,
        "N/m": top / max(outlook.stroke, 1e-9),
        "N s/m": top / speed,
        "N s^2/m^2": top / speed**2,
        "kg": 4.0 * mass if parameter.lower < 0.0 else 0.9 * mass,
        "m": _READING_PER_STROKE * outlook.stroke,
        "A": 0.5 * current,
        "1/A^2": 3.0 / current**2,
    }.get(parameter.unit, float("inf"))
    if parameter.unit in ("N", "N/m", "N s/m", "N s^2/m^2", "kg", "m"):  # the size of the axis decides, not the bounds
        return (-largest if parameter.lower < 0.0 else 0.0), largest
    return max(parameter.lower, -largest), min(parameter.upper, largest)


def effect_range(
    effect: Effect, parameter: Parameter, outlook: Outlook, force: float, mass: float
) -> tuple[float, float]:
    """Search range of one of an effect's amplitudes in its SI unit; of an own term by what multiplies it.

    force: scale of the forces in N; mass: kg.
    """
    if effect.own is not None:
        return own_range(effect, parameter.name, outlook, force)
    return amplitude_range(parameter, outlook, force, mass)


def force_scale(recordings: Sequence[Recording], values: dict[str, float]) -> float:
    """Scale of the forces on the axis in N: friction, or a tenth of the inertial force if that is more. values: SI, by
    name.
    """
    return max(abs(values.get("coulomb_force", 0.0)), 0.1 * values["mass"] * typical_acceleration(recordings), 1e-15)


def typical_acceleration(recordings: Sequence[Recording]) -> float:
    """Upper decile of the acceleration in m/s^2 (rotary: rad/s^2)."""
    return max(_acceleration(recording) for recording in recordings)


@lru_cache(maxsize=128)  # likewise
def _acceleration(recording: Recording) -> float:
    width = min(41, (recording.y.size - 1) // 2 * 2 - 1)
    dt = recording.duration / (recording.y.size - 1)
    return float(np.quantile(np.abs(local_derivative(recording.y, width, 3, 2, dt)), 0.9))
