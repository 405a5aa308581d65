"""Synthetic diagnoses that propose a term: a curve, a surface, friction by direction, per recording, a rotary axis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from linid.diagnosis.report_data import (
    Change,
    Diagnosis,
    ProposedTerm,
    Resemblance,
    ShortFormula,
    TermAxis,
    TermCurve,
    Verdict,
)

from .diagnosis_parts import Array, recordings, shares, together, traces
from .diagnosis_samples import partly, rotary, unknown
from .samples import NAN

MEASURES = {
    "free_run": Change(0.0061, 0.0032, 0.0009, 0.0026, 0.0041),
    "ahead": Change(9.4e-6, 4.1e-6, NAN, 3.4e-6, 5.2e-6),
    "force": Change(0.24, 0.11, 0.057, 0.09, 0.14),
}


def banded(axes: tuple[TermAxis, ...], value: Array, half: Array | float, factor: str = "", unit: str = "N") -> Any:
    """A curve or surface with a band of +- half around it."""
    return TermCurve(axes, factor, unit, value, value - half, value + half)


def ripple_curve() -> TermCurve:
    """A ripple of friction that dies away, with a wide band at both ends, and a place without data."""
    x = np.linspace(-0.05, 0.62, 160)
    value = 0.18 * np.sin(2 * np.pi * x / 0.071) * np.exp(-x / 0.5) + 0.06
    value[100:108] = np.nan
    half = 0.02 + 0.25 * np.exp(-(x + 0.05) / 0.015) + 0.2 * np.exp((x - 0.62) / 0.012)
    return banded((TermAxis("position", "position", "m", x),), value, half, "direction")  # type: ignore[no-any-return]


def surface_curve() -> TermCurve:
    """A part of the motor force that falls with the speed; no data at high speed and force."""
    v, force = np.linspace(-0.9, 0.9, 61), np.linspace(-14.0, 14.0, 41)
    value = 0.06 * force[:, None] * (1.0 - np.tanh(2.5 * np.abs(v))[None, :]) - 0.12 * np.tanh(6 * v)[None, :]
    value = np.where(np.hypot(v[None, :] / 0.9, force[:, None] / 14.0) < 1.05, value, np.nan)
    axes = (TermAxis("velocity", "velocity", "m/s", v), TermAxis("motor_force", "motor force", "N", force))
    return banded(axes, value, 0.03 + 0.02 * np.abs(v)[None, :])  # type: ignore[no-any-return]


def term(curve: TermCurve | None, arguments: tuple[str, ...], **changes: Any) -> ProposedTerm:
    """A term that closes most of the rest, kept in the model."""
    words = " and ".join(name.replace("_", " ") for name in arguments)
    values: dict[str, Any] = {
        "arguments": arguments,
        "not_on": ("time in the recording", "acceleration"),
        "closed": 0.83,
        "low": 0.77,
        "high": 0.88,
        "p_value": 0.002,
        "curve": curve,
        "short": ShortFormula("0.31 · exp(−|v|/200 mm/s) · |F| · sign(v)", 0.81, 2),
        "resembles": (
            Resemblance(
                "load_dependent_friction",
                0.64,
                "load dependent friction depends on motor force and direction; the term also on velocity",
            ),
            Resemblance("force_ripple", 0.22, "force ripple depends on position too; the term does not"),
        ),
        "refines": (),
        "effect": "learned: spline2(v, -0.9, 0.9, 7, F, -14, 14, 7)",
        "kept": True,
        "measures": MEASURES,
        "sentence": f"What is left depends on {words}, not on time in the recording (p ≤ 0.01); a term of "
        "these closes 83 % [77, 88] of it.",
        "next_experiment": "To test it, record moves at 0.1, 0.4 and 0.8 m/s over the whole stroke with 5 kg more: "
        "the term then predicts 0.4 N more at 0.1 m/s, and the load-dependent friction 0.9 N at all of them.",
    }
    return ProposedTerm(**{**values, **changes})


def of_position() -> Diagnosis:
    """Named effects, and a ripple of friction over position that is kept in the model."""
    short = ShortFormula("(0.06 N + 0.18 N · sin(2π y/71 mm)) · sign(v)", 0.79, 3)
    effect = "learned: -spline(y, -0.05, 0.62, 14)*sign(v)"
    return replace(
        partly(), proposal=term(ripple_curve(), ("position", "direction"), short=short, effect=effect, not_on=())
    )


def of_velocity_and_force() -> Diagnosis:
    """No effect of the library, and a surface that is kept in the model."""
    base = unknown()
    made = traces(lambda t, y, v: 0.9 * np.tanh(6 * v), lambda t, y, v: 0.2 * np.tanh(6 * v))
    rows = recordings(made)
    verdict = Verdict(
        "unknown", (), (), "There is a gap that no effect of the library explains.", base.verdict.next_experiment
    )
    return replace(
        base,
        verdict=verdict,
        traces=made,
        recordings=rows,
        measures=together(rows),
        where=shares(made, None),
        proposal=term(surface_curve(), ("velocity", "motor_force")),
    )


def of_direction() -> Diagnosis:
    """A force that differs by direction, in few places; it makes the prediction worse and is left out."""
    axis = TermAxis("direction", "direction of motion", "1", np.array([-1.0, 1.0]))
    curve = banded((axis,), np.array([-0.034, 0.052]), np.array([0.006, 0.008]))
    worse = {**MEASURES, "ahead": Change(9.4e-6, 9.9e-6, 2.2e-6)}
    changes: dict[str, Any] = {"short": None, "resembles": (), "kept": False, "measures": worse, "p_value": 0.0}
    return replace(unknown(), proposal=term(curve, ("direction",), **changes))


def of_position_by_direction() -> Diagnosis:
    """A force over position that differs by direction: lines, no map."""
    x = np.linspace(0.0, 0.6, 90)
    value = np.array([0.3 * np.sin(9 * x), 0.5 * np.sin(9 * x + 0.6) + 0.1])
    axes = (
        TermAxis("position", "position", "m", x),
        TermAxis("direction", "direction of motion", "1", np.array([-1.0, 1.0])),
    )
    return replace(unknown(), proposal=term(banded(axes, value, 0.05), ("position", "direction"), short=None))


def per_recording() -> Diagnosis:
    """A wave in time whose coefficients are those of each recording: no curve, no simulation."""
    changes: dict[str, Any] = {"short": None, "effect": "", "kept": False, "measures": {}, "not_on": (), "low": NAN}
    made = term(None, ("time", "recording"), **changes)
    return replace(partly(), proposal=replace(made, resembles=made.resembles[:1]))


def rotary_factor() -> Diagnosis:
    """A rotary axis whose inertia no recording tells: a part of the motor torque over the angle."""
    x = np.linspace(-20.0, 30.0, 120)
    curve = banded((TermAxis("position", "position", "rad", x),), 0.031 * np.sin(x / 4.0), 0.006, "motor_force", "1")
    short = ShortFormula("0.031 sin(0.25 y) F", 0.8, 2)
    made = term(curve, ("position", "motor_force"), short=short, effect="learned: F*spline(y, -20, 30, 14)")
    verdict = replace(rotary().verdict, status="partly explained")
    return replace(rotary(), proposal=made, verdict=verdict)


def rotary_surface() -> Diagnosis:
    """A rotary axis whose inertia is known: a torque over the angle and the motor torque."""
    x, torque = np.linspace(0.0, 6.2, 50), np.linspace(-0.08, 0.08, 31)
    axes = (TermAxis("position", "position", "rad", x), TermAxis("motor_force", "motor force", "N m", torque))
    curve = banded(axes, 0.2 * torque[:, None] * np.sin(3 * x)[None, :], 0.002, unit="N m")
    verdict = replace(rotary().verdict, status="partly explained")
    effect = "learned: spline2(y, 0, 6.2, 7, F, -0.08, 0.08, 7)"
    made = term(curve, ("position", "motor_force"), short=None, effect=effect)
    return replace(rotary(), proposal=made, force_scale="", verdict=verdict)


PROPOSED: dict[str, Callable[[], Diagnosis]] = {
    "curve": of_position,
    "surface": of_velocity_and_force,
    "direction": of_direction,
    "by direction": of_position_by_direction,
    "per recording": per_recording,
    "rotary factor": rotary_factor,
    "rotary surface": rotary_surface,
}
