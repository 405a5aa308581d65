"""The hidden effects: what each is called, where it acts, how large it may get, and how its shape is drawn.

The listed ones carry the effect library's names; those of `linid.challenge.outside` are in no library.
"""

from __future__ import annotations

import numpy as np

from linid.challenge.entries import (
    BOTH,
    AxisSizes,
    Entry,
    HiddenEffect,
    Random,
    constant,
    coulombs,
    even,
    log_even,
    nothing,
    phase,
)
from linid.challenge.hidden_axis import AxisKind
from linid.challenge.kernel import layout
from linid.challenge.outside import OUTSIDE


def _cogging(r: Random, s: AxisSizes) -> dict[str, float]:
    return {
        "swell": even(r, 0.1, 0.4),
        "swell_length": even(r, 0.15, 0.4),
        "phase": phase(r),
        "second": even(r, 0.0, 0.4),
        "second_phase": phase(r),
    }


def _ripple(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"seventh": even(r, 0.2, 0.8), "fifth_phase": phase(r), "seventh_phase": phase(r)}


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
    return {"static_share": even(r, -0.5, 1.5)}


def _cable(r: Random, s: AxisSizes) -> dict[str, float]:
    return {
        "neutral": s.stroke * even(r, 0.35, 0.65),
        "length": s.stroke * even(r, 0.1, 0.3),
        "hysteresis": even(r, 0.2, 0.5),
        "turning_length": even(r, 4e-3, 15e-3),
    }


def _bump(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"centre": s.stroke / 2 + s.reach * even(r, -0.6, 0.6), "width": s.stroke * even(r, 0.04, 0.15)}


def _drag(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"exponent": even(r, 1.8, 2.2)}


def _delay(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"lag_share": even(r, 0.1, 0.4)}


def _thermal(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"fast": even(r, 0.4, 1.5), "slow": even(r, 4.0, 15.0), "fast_share": even(r, 0.4, 0.7)}


def _end(r: Random, s: AxisSizes) -> dict[str, float]:
    edge = s.reach * even(r, 0.3, 0.6)
    return {"low": s.stroke / 2 - edge, "high": s.stroke / 2 + edge, "width": s.stroke * even(r, 0.03, 0.08)}


def _load(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"frequency": log_even(r, 12, 60), "damping": even(r, 0.01, 0.06)}


def _encoder(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"period": log_even(r, 1e-3, 5e-3), "phase": phase(r), "skew": even(r, 0.1, 0.3)}


def _push(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"start": even(r, 0.8, 2.2), "length": even(r, 0.08, 0.4)}


def _drift(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"time_constant": even(r, 1.0, 5.0)}


def _eddy(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"critical_speed": log_even(r, 0.15, 0.6)}


def _dwell(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"growth_time": log_even(r, 0.1, 0.6), "wear_length": log_even(r, 2e-4, 1e-3)}


def _pitch(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"length": s.stroke * even(r, 0.7, 1.3), "phase": phase(r)}


def _gear(r: Random, s: AxisSizes) -> dict[str, float]:
    return {
        "half_play": log_even(r, 3e-5, 2e-4),
        "contact_frequency": log_even(r, 60, 140),
        "damping": even(r, 0.1, 0.3),
    }


def _gravity(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"turns_per_metre": 1 / s.radius, "phase": phase(r), "second": even(r, 0.0, 0.1), "second_phase": phase(r)}


PHASE: tuple[AxisKind, ...] = ("phase",)
LISTED: dict[str, Entry] = {
    "cogging": Entry(layout.COGGING, "all", coulombs(0.2), coulombs(4), _cogging),
    "force_ripple": Entry(None, "driven", constant(0.03), constant(0.5), _ripple),
    "phase_gain_imbalance": Entry(None, "driven", constant(0.05), constant(0.5), _gains, axes=PHASE),
    "current_offset": Entry(
        None, "driven", lambda s: 0.1 * s.coulomb / s.thrust, lambda s: s.limit, _offsets, axes=PHASE
    ),
    "asymmetric_friction": Entry(layout.ASYMMETRY, "all", constant(0.1), constant(0.7), _asymmetry, BOTH),
    "constant_force": Entry(layout.CONSTANT, "all", coulombs(0.15), coulombs(0.75), nothing, BOTH),
    "cable_force": Entry(layout.CABLE_FORCE, "all", coulombs(0.15), coulombs(1), _cable),
    "position_dependent_friction": Entry(layout.BUMP, "all", constant(0.3), constant(8.0), _bump),
    "quadratic_drag": Entry(layout.DRAG, "all", coulombs(0.2), coulombs(20), _drag),
    "input_delay": Entry(layout.DELAY, "driven", constant(4e-4), constant(3e-3), _delay),
    "force_saturation": Entry(layout.SATURATION, "driven", lambda s: 0.3 / s.current, lambda s: 5 / s.current, nothing),
    "thermal_derating": Entry(
        layout.THERMAL, "driven", lambda s: 0.1 / s.current**2, lambda s: 20 / s.current**2, _thermal
    ),
    "end_effect": Entry(layout.END, "driven", constant(0.15), constant(0.9), _end),
    "flexible_load": Entry(layout.LOAD_SPRING, "all", constant(0.05), constant(0.6), _load),
    "encoder_periodic_error": Entry(layout.ENCODER, "all", constant(2e-6), constant(3e-4), _encoder),
    "external_disturbance": Entry(layout.DISTURBANCE, "chosen", coulombs(1), coulombs(50), _push, BOTH),
    "friction_drift": Entry(layout.DRIFT, "all", constant(0.15), constant(0.85), _drift, (-1, -1, 1)),
    "payload_change": Entry(None, "chosen", lambda s: 0.05 * s.mass, lambda s: 2 * s.mass, nothing),
    "backlash": Entry(layout.PLAY, "all", constant(1e-5), constant(5e-4), nothing, most=0.5),
    "eddy_current_drag": Entry(layout.EDDY, "all", coulombs(0.2), coulombs(8), _eddy),
    "dwell_stiction": Entry(layout.DWELL, "all", constant(0.2), constant(4.0), _dwell, most=0.25),
    "pole_pitch_error": Entry(layout.PITCH, "driven", constant(1e-3), constant(5e-3), _pitch, axes=PHASE),
    "gravity": Entry(layout.GRAVITY, "all", coulombs(0.15), coulombs(0.75), _gravity, BOTH, axes=("q_rotary",)),
    "load_dependent_friction": Entry(layout.THRUST_FRICTION, "driven", constant(0.05), constant(0.8), nothing),
    "drive_train_backlash": Entry(layout.GEAR_PLAY, "all", constant(0.05), constant(0.6), _gear, most=0.35),
    "friction_level_change": Entry(layout.LEVEL, "chosen", constant(0.1), constant(0.6), nothing, BOTH),
}
# Those that single effects and pairs are drawn from unless others are asked for: campaigns of older seeds stay.
FIRST = tuple(LISTED)[:18]
ENTRIES = LISTED | OUTSIDE


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
        size = float(random.choice(BOTH)) * even(random, 0.5, 1.0)
        out.append((str(name), size, drawn["start"], drawn["length"]))
    return tuple(sorted(out, key=lambda push: (push[0], push[2])))
