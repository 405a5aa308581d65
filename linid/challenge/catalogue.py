"""The hidden effects: what each is called, where it acts, how large it may get, and how its shape is drawn.

The listed ones carry the effect library's names. The `OUTSIDE` ones are in no library; a diagnosis that is honest
calls them unknown. No listed effect has their dependence: a force periodic in time or one that wanders at random, a
reading error that beats with the clock and grows with speed, friction that walks at random, thrust that falls with
speed, friction that grows with acceleration, cogging whose phase turns with speed, a force that goes with the square
of the current. (A resonance of the machine base is not among them: seen from the forcer it is the transfer function
of a flexible load.)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from linid.challenge.hidden_axis import AXES, AxisKind
from linid.challenge.kernel import layout

Scope = Literal["all", "driven", "chosen"]
Random = np.random.Generator
TURN = 2 * math.pi


@dataclass(frozen=True)
class AxisSizes:
    """Round numbers of an axis from which shapes and first amplitudes are drawn, SI: mass, coulomb force, thrust per
    ampere of q-current, typical and limiting q-current, stroke, reach (half the travel of driven recordings), radius
    of rotary axes."""

    mass: float
    coulomb: float
    thrust: float
    current: float
    limit: float
    stroke: float
    reach: float
    radius: float = 1.0


@dataclass(frozen=True)
class HiddenEffect:
    """One withheld effect. amplitude: what strength scales; shape: its other numbers, SI; recordings: names of those
    it acts in where it acts in chosen ones only (else empty); pushes: where there are several, (recording, size in
    amplitudes, start in s, length in s)."""

    name: str
    amplitude: float
    shape: dict[str, float] = field(default_factory=dict)
    recordings: tuple[str, ...] = ()
    pushes: tuple[tuple[str, float, float, float], ...] = ()


@dataclass(frozen=True)
class Entry:
    """row: its row in the kernel's table, None where it changes masses, field or sensors only; scope: in which
    recordings it acts; first: a small amplitude to start from; limit: largest magnitude that stays plausible; signs:
    signs its amplitude may have; most: greatest strength that may be asked of it; axes: on which it can be; shape:
    draws the other numbers, in the kernel's order."""

    row: int | None
    scope: Scope
    first: Callable[[AxisSizes], float]
    limit: Callable[[AxisSizes], float]
    shape: Callable[[Random, AxisSizes], dict[str, float]]
    signs: tuple[int, ...] = (1,)
    most: float = math.inf
    axes: tuple[AxisKind, ...] = AXES


def _log(random: Random, low: float, high: float) -> float:
    return float(np.exp(random.uniform(math.log(low), math.log(high))))


def _even(random: Random, low: float, high: float) -> float:
    return float(random.uniform(low, high))


def _phase(random: Random) -> float:
    return _even(random, 0, TURN)


def _nothing(random: Random, scales: AxisSizes) -> dict[str, float]:
    return {}


def _cogging(r: Random, s: AxisSizes) -> dict[str, float]:
    return {
        "swell": _even(r, 0.1, 0.4),
        "swell_length": _even(r, 0.15, 0.4),
        "phase": _phase(r),
        "second": _even(r, 0.0, 0.4),
        "second_phase": _phase(r),
    }


def _ripple(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"seventh": _even(r, 0.2, 0.8), "fifth_phase": _phase(r), "seventh_phase": _phase(r)}


def _gains(r: Random, s: AxisSizes) -> dict[str, float]:
    values = r.normal(size=3)
    values -= values.mean()
    values /= np.abs(values).max()
    return dict(zip("uvw", map(float, values), strict=True))


def _offsets(r: Random, s: AxisSizes) -> dict[str, float]:
    values = r.uniform(-1, 1, size=3)
    while np.ptp(values) < np.abs(values).max():  # a common offset of all three phases pushes nowhere
        values = r.uniform(-1, 1, size=3)
    return dict(zip("uvw", map(float, values / np.abs(values).max()), strict=True))


def _asymmetry(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"static_share": _even(r, -0.5, 1.5)}


def _cable(r: Random, s: AxisSizes) -> dict[str, float]:
    return {
        "neutral": s.stroke * _even(r, 0.35, 0.65),
        "length": s.stroke * _even(r, 0.1, 0.3),
        "hysteresis": _even(r, 0.2, 0.5),
        "turning_length": _even(r, 4e-3, 15e-3),
    }


def _bump(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"centre": s.stroke / 2 + s.reach * _even(r, -0.6, 0.6), "width": s.stroke * _even(r, 0.04, 0.15)}


def _drag(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"exponent": _even(r, 1.8, 2.2)}


def _delay(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"lag_share": _even(r, 0.1, 0.4)}


def _thermal(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"fast": _even(r, 0.4, 1.5), "slow": _even(r, 4.0, 15.0), "fast_share": _even(r, 0.4, 0.7)}


def _end(r: Random, s: AxisSizes) -> dict[str, float]:
    edge = s.reach * _even(r, 0.3, 0.6)
    return {"low": s.stroke / 2 - edge, "high": s.stroke / 2 + edge, "width": s.stroke * _even(r, 0.03, 0.08)}


def _load(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"frequency": _log(r, 12, 60), "damping": _even(r, 0.01, 0.06)}


def _encoder(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"period": _log(r, 1e-3, 5e-3), "phase": _phase(r), "skew": _even(r, 0.1, 0.3)}


def _push(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"start": _even(r, 0.8, 2.2), "length": _even(r, 0.08, 0.4)}


def _drift(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"time_constant": _even(r, 1.0, 5.0)}


def _vibration(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"frequency": _log(r, 7, 25), "phase": _phase(r)}


def _walk(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"memory": _even(r, 0.15, 0.4), "seed": float(r.integers(2**31))}


def _felt(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"half_acceleration": _even(r, 1.0, 4.0), "lag": 1.5e-3}


def _speed_cogging(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"turning_speed": _even(r, 0.3, 0.6), "phase": _phase(r)}


def _phase_only(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"phase": _phase(r)}


def _beat(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"frequency": _log(r, 8, 25), "phase": _phase(r)}


def _eddy(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"critical_speed": _log(r, 0.15, 0.6)}


def _dwell(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"growth_time": _log(r, 0.1, 0.6), "wear_length": _log(r, 2e-4, 1e-3)}


def _pitch(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"length": s.stroke * _even(r, 0.7, 1.3), "phase": _phase(r)}


def _gear(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"half_play": _log(r, 3e-5, 2e-4), "contact_frequency": _log(r, 60, 140), "damping": _even(r, 0.1, 0.3)}


def _gravity(r: Random, s: AxisSizes) -> dict[str, float]:
    return {
        "turns_per_metre": 1 / s.radius,
        "phase": _phase(r),
        "second": _even(r, 0.0, 0.1),
        "second_phase": _phase(r),
    }


def _constant(value: float) -> Callable[[AxisSizes], float]:
    return lambda s: value


BOTH = (1, -1)
PHASE: tuple[AxisKind, ...] = ("phase",)
LISTED: dict[str, Entry] = {
    "cogging": Entry(layout.COGGING, "all", lambda s: 0.2 * s.coulomb, lambda s: 4 * s.coulomb, _cogging),
    "force_ripple": Entry(None, "driven", _constant(0.03), _constant(0.5), _ripple),
    "phase_gain_imbalance": Entry(None, "driven", _constant(0.05), _constant(0.5), _gains, axes=PHASE),
    "current_offset": Entry(
        None, "driven", lambda s: 0.1 * s.coulomb / s.thrust, lambda s: s.limit, _offsets, axes=PHASE
    ),
    "asymmetric_friction": Entry(layout.ASYMMETRY, "all", _constant(0.1), _constant(0.7), _asymmetry, BOTH),
    "constant_force": Entry(
        layout.CONSTANT, "all", lambda s: 0.15 * s.coulomb, lambda s: 0.75 * s.coulomb, _nothing, BOTH
    ),
    "cable_force": Entry(layout.CABLE_FORCE, "all", lambda s: 0.15 * s.coulomb, lambda s: s.coulomb, _cable),
    "position_dependent_friction": Entry(layout.BUMP, "all", _constant(0.3), _constant(8.0), _bump),
    "quadratic_drag": Entry(layout.DRAG, "all", lambda s: 0.2 * s.coulomb, lambda s: 20 * s.coulomb, _drag),
    "input_delay": Entry(layout.DELAY, "driven", _constant(4e-4), _constant(3e-3), _delay),
    "force_saturation": Entry(
        layout.SATURATION, "driven", lambda s: 0.3 / s.current, lambda s: 5 / s.current, _nothing
    ),
    "thermal_derating": Entry(
        layout.THERMAL, "driven", lambda s: 0.1 / s.current**2, lambda s: 20 / s.current**2, _thermal
    ),
    "end_effect": Entry(layout.END, "driven", _constant(0.15), _constant(0.9), _end),
    "flexible_load": Entry(layout.LOAD_SPRING, "all", _constant(0.05), _constant(0.6), _load),
    "encoder_periodic_error": Entry(layout.ENCODER, "all", _constant(2e-6), _constant(3e-4), _encoder),
    "external_disturbance": Entry(
        layout.DISTURBANCE, "chosen", lambda s: s.coulomb, lambda s: 50 * s.coulomb, _push, BOTH
    ),
    "friction_drift": Entry(layout.DRIFT, "all", _constant(0.15), _constant(0.85), _drift, (-1, -1, 1)),
    "payload_change": Entry(None, "chosen", lambda s: 0.05 * s.mass, lambda s: 2 * s.mass, _nothing),
    "backlash": Entry(layout.PLAY, "all", _constant(1e-5), _constant(5e-4), _nothing, most=0.5),
    "eddy_current_drag": Entry(layout.EDDY, "all", lambda s: 0.2 * s.coulomb, lambda s: 8 * s.coulomb, _eddy),
    "dwell_stiction": Entry(layout.DWELL, "all", _constant(0.2), _constant(4.0), _dwell, most=0.25),
    "pole_pitch_error": Entry(layout.PITCH, "driven", _constant(1e-3), _constant(5e-3), _pitch, axes=PHASE),
    "gravity": Entry(
        layout.GRAVITY,
        "all",
        lambda s: 0.15 * s.coulomb,
        lambda s: 0.75 * s.coulomb,
        _gravity,
        BOTH,
        axes=("q_rotary",),
    ),
    "load_dependent_friction": Entry(layout.THRUST_FRICTION, "driven", _constant(0.05), _constant(0.8), _nothing),
    "drive_train_backlash": Entry(layout.GEAR_PLAY, "all", _constant(0.05), _constant(0.6), _gear, most=0.35),
    "friction_level_change": Entry(layout.LEVEL, "chosen", _constant(0.1), _constant(0.6), _nothing, BOTH),
}
# Those that single effects and pairs are drawn from unless others are asked for: campaigns of older seeds stay.
FIRST = tuple(LISTED)[:18]
OUTSIDE: dict[str, Entry] = {
    "floor_vibration": Entry(layout.VIBRATION, "all", lambda s: 0.2 * s.coulomb, lambda s: 4 * s.coulomb, _vibration),
    "clock_beat": Entry(None, "all", _constant(5e-5), _constant(3e-3), _beat),
    "walking_friction": Entry(layout.WALK, "all", _constant(0.1), _constant(0.8), _walk),
    "speed_derating": Entry(layout.SPEED_DERATING, "driven", _constant(0.1), _constant(3.0), _nothing),
    "wandering_force": Entry(layout.WANDER, "all", lambda s: 0.1 * s.coulomb, lambda s: 2 * s.coulomb, _walk),
    "acceleration_dependent_friction": Entry(
        layout.ACCELERATION_FRICTION, "all", _constant(0.2), _constant(6.0), _felt
    ),
    "speed_dependent_cogging": Entry(
        layout.SPEED_COGGING, "all", lambda s: 0.3 * s.coulomb, lambda s: 6 * s.coulomb, _speed_cogging
    ),
    "reluctance_force": Entry(
        layout.RELUCTANCE,
        "driven",
        lambda s: 0.1 * s.thrust / s.current,
        lambda s: 3 * s.thrust / s.current,
        _phase_only,
    ),
}
ENTRIES = LISTED | OUTSIDE
# What the force or reading error of an effect outside the library is a function of, beside the base's own thrust.
ARGUMENTS = ("position", "velocity", "acceleration", "current", "time")
DEPENDS_ON: dict[str, tuple[str, ...]] = {
    "floor_vibration": ("time",),
    "clock_beat": ("time", "velocity"),
    "walking_friction": ("time", "velocity"),
    "speed_derating": ("current", "velocity"),
    "wandering_force": ("time",),
    "acceleration_dependent_friction": ("acceleration", "velocity"),
    "speed_dependent_cogging": ("position", "velocity"),
    "reluctance_force": ("current", "position"),
}


def draw_effect(
    name: str, random: Random, scales: AxisSizes, recordings: tuple[tuple[str, str, str], ...], *, several: bool = False
) -> HiddenEffect:
    """An effect with its first, small amplitude and a drawn shape.

    recordings: (name, kind, split) of the campaign; an unlogged payload sits on two fitted recordings and a held-out
    one, another level of friction rules three fitted and two held-out ones, a push meets one driven recording;
    several: two to five pushes meet up to three driven recordings of both splits instead.
    """
    entry = ENTRIES[name]
    sign = int(random.choice(entry.signs))
    shape = entry.shape(random, scales)
    chosen: tuple[str, ...] = ()
    pushes: tuple[tuple[str, float, float, float], ...] = ()
    if entry.scope == "chosen":
        driven = [(n, split) for n, kind, split in recordings if kind == "motor"]
        if name == "payload_change":
            names = _some(driven, 2, 1, random)
        elif name == "friction_level_change":
            driven = [(n, split) for n, _, split in recordings]
            names = _some(driven, 3, 2, random)
        elif several:
            names = _some(driven, int(random.integers(1, 3)), 1, random)
            pushes = _pushes(sorted(names), random, scales)
            shape = {}
        else:
            names = {random.choice([n for n, _ in driven])}
        chosen = tuple(n for n, _ in driven if n in names)
    return HiddenEffect(name, sign * entry.first(scales), shape, chosen, pushes)


def _some(recordings: list[tuple[str, str]], fit: int, held_out: int, random: Random) -> set[str]:
    """Names of so many recordings of each split, or of all that there are."""
    fitted = [n for n, split in recordings if split == "fit"]
    judged = [n for n, split in recordings if split == "held_out"]
    if held_out == 1:
        return {*random.choice(fitted, fit, replace=False), random.choice(judged)}
    fit, held_out = min(fit, len(fitted)), min(held_out, len(judged))
    return {*random.choice(fitted, fit, replace=False), *random.choice(judged, held_out, replace=False)}


def _pushes(names: list[str], random: Random, scales: AxisSizes) -> tuple[tuple[str, float, float, float], ...]:
    """At least one push in each recording, five at most, either way and of different sizes."""
    count = int(random.integers(max(2, len(names)), 6))
    where = names + [str(random.choice(names)) for _ in range(count - len(names))]
    out = []
    for name in where:
        drawn = _push(random, scales)
        size = float(random.choice(BOTH)) * _even(random, 0.5, 1.0)
        out.append((str(name), size, drawn["start"], drawn["length"]))
    return tuple(sorted(out, key=lambda push: (push[0], push[2])))
