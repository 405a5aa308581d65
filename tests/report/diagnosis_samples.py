"""Synthetic diagnoses, one for every verdict, with residuals made from the physics that each names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from linid.diagnosis.report_data import (
    Candidate,
    Change,
    Diagnosis,
    RecordingChange,
    ResidualTrace,
    Share,
    Verdict,
)

from .samples import NAN, estimate

Array = np.ndarray
FIELD = 222.0
DEVIATION = 0.06
Force = Callable[[Array, Array, Array], Array]


def cogging(t: Array, y: Array, v: Array) -> Array:
    """A force of the first and second order of the field's angle, N."""
    return 0.9 * np.sin(FIELD * y + 0.4) + 0.35 * np.sin(2 * FIELD * y)


def cable(t: Array, y: Array, v: Array) -> Array:
    """A linear spring over the stroke, N."""
    return 2.4 * (y - 0.35)


def push(t: Array, y: Array, v: Array) -> Array:
    """A slow wave in time that no effect of the library knows, N."""
    return 0.8 * np.sin(2 * np.pi * 0.31 * t) * np.sin(2 * np.pi * 1.7 * t)


def nothing(t: Array, y: Array, v: Array) -> Array:
    """No force, N."""
    return np.zeros_like(t)


def traces(force: Force, left: Force = nothing, count: int = 6) -> tuple[ResidualTrace, ...]:
    """Moves of different length and speed at 1 kHz."""
    made = []
    for number in range(count):
        rng = np.random.default_rng(number)
        t = np.arange(4000 + 500 * number) * 1e-3
        stroke, rate = 0.12 + 0.05 * number, 0.35 + 0.11 * number
        y = 0.35 + stroke * np.sin(2 * np.pi * rate * t) * np.cos(0.6 * t) + 0.004 * number
        v = np.gradient(y, t)
        kernel = np.ones(9) / 9
        noise = np.convolve(rng.normal(0, 3 * DEVIATION, len(t)), kernel, "same")
        before, after = force(t, y, v) + noise, left(t, y, v) + noise
        split = "held_out" if number % 3 == 2 else "fit"
        name = f"moves_{number + 1}"
        made.append(ResidualTrace(name, "motor", split, t, y, v, before, after, DEVIATION))
    return tuple(made)


def share(all_traces: tuple[ResidualTrace, ...], coordinate: str, label: str, unit: str, values: list[Array]) -> Share:
    """Variance share of bin means of the residual over a coordinate; bins with equal counts."""
    x, force = np.concatenate(values), np.concatenate([t.before for t in all_traces])
    few = np.unique(x)
    edges = np.append(few, few[-1] + 1) if len(few) < 9 else np.quantile(x, np.linspace(0, 1, 31))
    place = np.clip(np.searchsorted(edges, x, "right") - 1, 0, len(edges) - 2)
    count = np.bincount(place, minlength=len(edges) - 1)
    mean = np.bincount(place, force, len(edges) - 1) / count
    rest = force - mean[place]
    spread = np.sqrt(np.bincount(place, rest**2, len(edges) - 1) / count / np.maximum(count / 40, 1))
    explained = float(1 - rest.var() / force.var()) - 0.004
    centres = few.astype(float) if len(few) < 9 else (edges[1:] + edges[:-1]) / 2
    return Share(coordinate, label, unit, explained, 0.0005 if explained > 0.02 else 0.41, centres, mean, spread)


def shares(all_traces: tuple[ResidualTrace, ...], field: float | None) -> tuple[Share, ...]:
    """The usual coordinates."""
    columns: list[tuple[str, str, str, list[Array]]] = [
        ("velocity", "velocity", "m/s", [t.v for t in all_traces]),
        ("position", "position", "m", [t.y for t in all_traces]),
        ("direction", "direction of motion", "1", [np.sign(t.v) for t in all_traces]),
        ("time", "time in the recording", "s", [t.t for t in all_traces]),
        ("recording", "recording", "1", [np.full(len(t.t), i + 1.0) for i, t in enumerate(all_traces)]),
    ]
    if field is not None:
        angle = [np.mod(t.y, 2 * np.pi / field) for t in all_traces]
        columns.append(("pole_pitch", "position within the pole pitch", "m", angle))
    return tuple(share(all_traces, *column) for column in columns)


def recordings(all_traces: tuple[ResidualTrace, ...]) -> tuple[RecordingChange, ...]:
    """Measures of each recording; the positions follow the forces."""
    made = []
    for t in all_traces:
        before, after = float(np.sqrt(np.mean(t.before**2))), float(np.sqrt(np.mean(t.after**2)))
        changes = {
            "free_run": Change(0.031 * before, 0.031 * after, 0.025 * t.deviation),
            "ahead": Change(4.8e-5 * before, 4.8e-5 * after, 3.6e-5 * t.deviation),
            "force": Change(before, after, 0.9 * t.deviation),
        }
        made.append(RecordingChange(t.recording, t.kind, t.split, changes))
    return tuple(made)


def measures(closed: float) -> dict[str, Change]:
    """Held-out measures of a candidate that closes a share of the excess."""

    def change(before: float, floor: float) -> Change:
        after = np.sqrt(max(before**2 - closed * (before**2 - floor**2), 0.0))
        return Change(before, float(after), floor, float(0.82 * after), float(1.31 * after))

    return {"free_run": change(0.0213, 0.0009), "ahead": change(3.4e-5, 2.2e-6), "force": change(0.69, 0.057)}


def candidate(effects: str, explained: float, closed: float = NAN, half: float = 0.04, **more: Any) -> Candidate:
    """A candidate, confirmed if it has a closure."""
    held_out = measures(closed) if np.isfinite(closed) else {}
    low, high = closed - half, min(closed + half, 1.0)
    return Candidate(tuple(effects.split(" + ")), explained, closed, low, high, held_out, **more)


COGGING = (
    estimate("cogging_wavenumber", "k_c", "1/m", 222.0134, 0.031),
    estimate("cogging_sine_1", "C_s1", "N", 0.8283, 0.0113),
    estimate("cogging_cosine_1", "C_c1", "N", 0.3511, 0.0121),
    estimate("cogging_sine_2", "C_s2", "N", 0.3482, 0.0098),
    estimate("cogging_cosine_2", "C_c2", "N", 0.0021, 0.0101),
    estimate("cogging_sine_4", "C_s4", "N", 0.0, NAN, status="not_identifiable", note="the speed never stays low"),
)
RIVALS = (
    candidate("current_offset", 0.31, 0.29, 0.06),
    candidate("force_ripple", 0.22, 0.18, 0.07, note="the gain comes from one recording"),
    candidate("encoder_periodic_error", 0.21, -0.08, 0.11),
    candidate("position_dependent_friction", 0.06),
    candidate("end_effect", 0.03),
    candidate("quadratic_drag", 0.004),
    candidate("payload_change", NAN, note="all recordings carry the same mass"),
)


def together(rows: tuple[RecordingChange, ...]) -> dict[str, Change]:
    """Root mean square over the held-out recordings, with an interval for a new one."""
    found = {}
    for measure in ("free_run", "ahead", "force"):
        some = [r.changes[measure] for r in rows if r.split == "held_out"]
        before, after, floor = (
            float(np.sqrt(np.mean([getattr(c, end) ** 2 for c in some]))) for end in ("before", "after", "floor")
        )
        found[measure] = Change(before, after, floor, 0.82 * after, 1.31 * after)
    return found


def identified(**changes: Any) -> Diagnosis:
    """One effect: cogging."""
    made = traces(cogging)
    values: dict[str, Any] = {
        "name": "axis_01", "model": "sine", "axis": "linear", "base_effects": (),
        "assumptions": (
            "The added masses in the campaign are exact.",
            "Friction is the same in all recordings.",
            "Current and position are sampled at the same instants.",
        ),
        "verdict": Verdict(
            "identified", ("cogging",), (),
            "Cogging explains the gap: it closes 94 % of the held-out excess over the floor, the next candidate 29 %.",
            "Record slow steady moves (about 20 mm/s) over the whole stroke in both directions: they would show the "
            "6th order of the cogging, which these fast moves blur.",
        ),
        "candidates": (*RIVALS[:2], candidate("cogging", 0.88, 0.94, 0.025, parameters=COGGING), *RIVALS[2:]),
        "where": shares(made, FIELD), "ceiling": 0.95, "ceiling_coordinates": "position, velocity and current",
        "excess_before": 0.21, "excess_after": 0.013, "floor": 0.0008, "recordings": recordings(made), "traces": made,
        "field_wavenumber": FIELD, "seed": 1,
    }  # fmt: skip
    made_of = Diagnosis(**{**values, **changes})
    cause = made_of.verdict.effects
    return replace(
        made_of,
        candidates=tuple(
            replace(c, held_out=together(made_of.recordings)) if c.effects == cause else c for c in made_of.candidates
        ),
    )


def pair() -> Diagnosis:
    """Two effects: cogging and a cable, both confirmed alone and together."""
    made = traces(lambda t, y, v: cogging(t, y, v) + cable(t, y, v))
    parameters = (*COGGING[:4], estimate("cable_stiffness", "k_cable", "N/m", 2.412, 0.051))
    both = candidate("cogging + cable_force", 0.93, 0.96, 0.02, parameters=parameters)
    verdict = Verdict(
        "identified", ("cogging", "cable_force"), (),
        "Two effects explain the gap: cogging (78 % of the held-out excess) and, with it, the cable's force (96 %).",
        "Record one slow move over the full stroke with the cable chain detached.",
    )  # fmt: skip
    candidates = (candidate("cogging", 0.74, 0.78), candidate("cable_force", 0.19, 0.2), both, *RIVALS)
    return identified(
        verdict=verdict, candidates=candidates, traces=made, recordings=recordings(made), where=shares(made, FIELD)
    )


def at_floor() -> Diagnosis:
    """No gap: nothing was confirmed."""
    made = traces(nothing)
    verdict = Verdict(
        "none", (), (), "The model is at the floor: what remains on the held-out recordings is measurement noise.", ""
    )
    candidates = tuple(replace(c, explained=0.01, closure=NAN, low=NAN, high=NAN, held_out={}) for c in RIVALS[:5])
    return identified(
        verdict=verdict, candidates=candidates, traces=made, recordings=recordings(made), where=shares(made, FIELD),
        ceiling=NAN, ceiling_coordinates="", excess_before=0.0, excess_after=0.0,
    )  # fmt: skip


def ambiguous() -> Diagnosis:
    """Cogging of the first order and a current offset look alike while the motor drives."""
    made = traces(lambda t, y, v: 0.9 * np.sin(FIELD * y))
    verdict = Verdict(
        "ambiguous", ("cogging",), ("current_offset",),
        "Cogging or an offset of the current sensors explains the gap (91 % and 90 %); these recordings cannot tell "
        "them apart.",
        "Record three free wheels at 0.1 to 0.3 m/s with the drive switched off: only cogging acts without current.",
    )  # fmt: skip
    candidates = (
        candidate("cogging", 0.86, 0.91, parameters=COGGING[:3]), candidate("current_offset", 0.85, 0.90), *RIVALS[1:],
    )  # fmt: skip
    warnings = ("Only driven recordings: effects that need zero current cannot be separated.",)
    return identified(
        verdict=verdict, candidates=candidates, traces=made, recordings=recordings(made), where=shares(made, FIELD),
        warnings=warnings,
    )  # fmt: skip


def unknown(force: Force = push) -> Diagnosis:
    """A gap that no effect explains, without field wavenumber; nothing was added to the model."""
    made = traces(force, force)
    verdict = Verdict(
        "unknown", (), (),
        "There is a gap that no effect of the library explains; it depends on the time in the recording.",
        "Repeat one move five times at fixed intervals: if the residual repeats with the clock, look for a "
        "neighbouring drive or a pump.",
    )  # fmt: skip
    return identified(
        model="force", verdict=verdict, candidates=RIVALS, traces=made, recordings=recordings(made),
        where=shares(made, None), ceiling=0.61, field_wavenumber=None, warnings=("Only two recordings are held out.",),
    )  # fmt: skip


def rotary() -> Diagnosis:
    """A rotary axis in rad and N m with its own scale and without field wavenumber."""
    base = identified()
    made = tuple(
        replace(t, y=40 * t.y, v=40 * t.v, before=0.02 * t.before, after=0.02 * t.after, deviation=0.02 * t.deviation)
        for t in base.traces
    )
    units = {"m": "rad", "m/s": "rad/s"}
    where = tuple(
        replace(s, unit=units.get(s.unit, s.unit), x=40 * s.x if s.unit in units else s.x, mean=0.02 * s.mean,
                spread=0.02 * s.spread)
        for s in base.where if s.coordinate != "pole_pitch"
    )  # fmt: skip
    parameters = tuple(replace(e, unit="N m" if e.unit == "N" else "1/rad") for e in COGGING[:3])
    rows = recordings(made)
    cause = replace(candidate("cogging", 0.88, 0.94, parameters=parameters), held_out=together(rows))
    return replace(
        base, name="mn4004", axis="rotary", model="force", traces=made, where=where, field_wavenumber=None,
        candidates=(cause, *RIVALS), recordings=rows,
    )  # fmt: skip


SAMPLES: dict[str, Callable[[], Diagnosis]] = {
    "identified": identified, "pair": pair, "none": at_floor, "ambiguous": ambiguous, "unknown": unknown,
    "rotary": rotary,
}  # fmt: skip
