"""Synthetic diagnoses, one for every verdict, with residuals made from the physics that each names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from linid.diagnosis.report_data import (
    MEASURES,
    Budget,
    Change,
    Diagnosis,
    Entry,
    PairShare,
    RecordingChange,
    ResidualTrace,
    Share,
    Tried,
    Verdict,
)
from linid.recording import Reading, Recording, RecordingChecks, checks_of

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


def drag(t: Array, y: Array, v: Array) -> Array:
    """Friction that is stronger forwards, and drag with the square of the speed, N."""
    return -0.3 * np.sign(v) * (v > 0) - 0.9 * v * np.abs(v)


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
        columns.append(("pole_phase", "position within two pole pitches", "m", angle))
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


def pair_share(
    all_traces: tuple[ResidualTrace, ...],
    x: tuple[str, str, str, list[Array]],
    y: tuple[str, str, str, list[Array]],
    form: Any,
    share: float,
) -> PairShare:
    """Cell means of the residual over two coordinates (name, label, unit, values)."""
    values, force = [np.concatenate(c[3]) for c in (x, y)], np.concatenate([t.before for t in all_traces])
    edges = [np.linspace(one.min(), one.max(), count + 1) for one, count in zip(values, (24, 8), strict=True)]
    rows, *_ = np.histogram2d(values[1], values[0], bins=edges[::-1])
    total, *_ = np.histogram2d(values[1], values[0], bins=edges[::-1], weights=force)
    mean = np.where(rows >= 5, total / np.maximum(rows, 1), NAN)
    p_value = 0.001 if share > 0.02 else 0.4
    return PairShare(
        x[0], y[0], x[1], y[1], x[2], y[2], form, share, p_value, edges[0], edges[1], mean, rows.astype(np.int64)
    )


def pairs(all_traces: tuple[ResidualTrace, ...]) -> tuple[PairShare, ...]:
    """A table, a proportion, one that overlaps with the first, one by chance."""
    position = ("position", "position", "m", [t.y for t in all_traces])
    velocity = ("velocity", "velocity", "m/s", [t.v for t in all_traces])
    time = ("time", "time in the recording", "s", [t.t for t in all_traces])
    current = ("current", "current", "A", [np.gradient(t.v, t.t) for t in all_traces])
    direction = ("direction", "direction of motion", "1", [np.sign(t.v) for t in all_traces])
    return (
        pair_share(all_traces, position, velocity, "table", 0.12),
        pair_share(all_traces, time, current, "proportional", 0.06),
        pair_share(all_traces, position, current, "proportional", 0.04),
        pair_share(all_traces, time, direction, "table", 0.001),
    )


def checks(all_traces: tuple[ResidualTrace, ...], axis: Any = "linear") -> tuple[RecordingChecks, ...]:
    """The checks of the recordings behind the traces; the second one has gaps."""
    made = []
    for place, t in enumerate(all_traces):
        rng = np.random.default_rng(place)
        y = np.round((t.y + 2e-7 * rng.normal(size=t.y.size)) / 1e-7) * 1e-7
        made.append(
            Recording(
                t.recording,
                t.t.copy(),
                y,
                drive_input=np.gradient(t.v, t.t),
                axis=axis,
                split=t.split,  # type: ignore[arg-type]
                reading=Reading(0.0, gaps=2, missing=170, longest_gap=0.11) if place == 1 else None,
            )
        )
    return checks_of(made)


def together(rows: tuple[RecordingChange, ...]) -> dict[str, Change]:
    """Root mean square over the held-out recordings, with an interval for a new one."""
    found = {}
    for measure in MEASURES:
        some = [r.changes[measure] for r in rows if r.split == "held_out"]
        before, after, floor = (
            float(np.sqrt(np.mean([getattr(c, end) ** 2 for c in some]))) for end in ("before", "after", "floor")
        )
        found[measure] = Change(before, after, floor, 0.82 * after, 1.31 * after)
    return found


def entry(effect: str, share: float, half: float = 0.04, rivals: tuple[str, ...] = (), **more: Any) -> Entry:
    """An entry whose measures shrink by its share."""

    def change(after: float, floor: float) -> Change:
        return Change(after * float(np.sqrt(1.0 + 3.0 * share)), after, floor)

    measures = {"free_run": change(0.006, 0.0009), "ahead": change(9e-6, 2.2e-6), "force": change(0.21, 0.057)}
    values: dict[str, Any] = {
        "first_in": share + 0.03,
        "last_in": share - 0.02,
        "certainty": 60 * share,
        "measures": measures,
    }
    return Entry(effect, rivals, share, share - half, share + half, **{**values, **more})


def budget_of(*entries: Entry, measures: dict[str, Change], **more: Any) -> Budget:
    """The budget of some entries: what they leave is unexplained."""
    before, floor = measures["force"].before, measures["force"].floor
    closed = sum(e.share for e in entries)
    after = float(np.sqrt(before**2 - closed * (before**2 - floor**2)))
    excess = (before**2 - floor**2) / floor**2
    values: dict[str, Any] = {"ceiling": 0.4, "depends_on": ("time in the recording",)}
    return Budget(
        before,
        after,
        floor,
        excess,
        (1 - closed) * excess,
        closed,
        closed - 0.02,
        min(closed + 0.02, 1.0),
        1 - closed,
        max(1 - closed - 0.02, 0.0),
        min(1 - closed + 0.02, 1.0),
        entries,
        **{**values, **more},
    )


COGGING = (
    estimate("cogging_wavenumber", "k_c", "1/m", 222.0134, 0.031),
    estimate("cogging_sine_1", "C_s1", "N", 0.8283, 0.0113),
    estimate("cogging_cosine_1", "C_c1", "N", 0.3511, 0.0121),
    estimate("cogging_sine_2", "C_s2", "N", 0.3482, 0.0098),
    estimate("cogging_cosine_2", "C_c2", "N", 0.0021, 0.0101),
    estimate("cogging_sine_4", "C_s4", "N", 0.0, NAN, status="not_identifiable", note="the speed never stays low"),
)
CABLE = (estimate("cable_stiffness", "k_cable", "N/m", 2.412, 0.051),)
FRICTION = (
    estimate("friction_asymmetry", "a", "1", 0.112, 0.021),
    estimate("viscous_asymmetry", "b", "N s/m", 0.4, 0.31),
)
TRIED = (
    Tried("cogging", 0.71, "named", 38.0, 0.94),
    Tried("current_offset", 0.31, "screened"),
    Tried("force_ripple", 0.22, "dropped", 1.1, -0.03),
    Tried("encoder_periodic_error", 0.21, "screened"),
    Tried("position_dependent_friction", 0.06, "dropped", 0.4, 0.004),
    Tried("end_effect", 0.03, "screened"),
    Tried("payload_change", NAN, "screened"),
)


def explained(**changes: Any) -> Diagnosis:
    """One effect: cogging."""
    made = traces(cogging, lambda t, y, v: 0.24 * cogging(t, y, v))
    rows = recordings(made)
    values: dict[str, Any] = {
        "name": "axis_01",
        "model": "sine",
        "axis": "linear",
        "base_effects": (),
        "assumptions": (
            "The added masses in the campaign are exact.",
            "Friction is the same in all recordings.",
            "Current and position are sampled at the same instants.",
        ),
        "verdict": Verdict(
            "explained",
            ("cogging",),
            (),
            "The gap depends on the position within two pole pitches; cogging explains it: 94 % of it closes.",
            "Record slow steady moves (about 20 mm/s) over the whole stroke in both directions: they would show the "
            "6th order of the cogging, which these fast moves blur.",
        ),
        "budget": budget_of(
            entry("cogging", 0.94, 0.025, parameters=COGGING, measures=together(rows)), measures=together(rows)
        ),
        "tried": TRIED,
        "where": shares(made, FIELD),
        "pairs": pairs(made),
        "measures": together(rows),
        "recordings": rows,
        "traces": made,
        "checks": checks(made),
        "force_scale": "",
        "field_wavenumber": FIELD,
        "seed": 1,
    }
    return Diagnosis(**{**values, **changes})


def partly() -> Diagnosis:
    """Four effects, one of them with a rival, one that worsens a measure, and a remainder."""

    def left(t: Array, y: Array, v: Array) -> Array:
        return 1.6 * push(t, y, v)

    made = traces(lambda t, y, v: cogging(t, y, v) + cable(t, y, v) + drag(t, y, v) + left(t, y, v), left)
    worse = {
        "free_run": Change(0.0058, 0.006, 0.0009),
        "ahead": Change(9.4e-6, 9e-6, 2.2e-6),
        "force": Change(0.24, 0.21, 0.057),
    }
    entries = (
        entry("cogging", 0.46, 0.03, parameters=COGGING),
        entry(
            "cable_force",
            0.21,
            0.05,
            rivals=("position_dependent_friction",),
            parameters=CABLE,
            combinations=("cable_stiffness and constant_force: only 2.41 y - 0.83 N is known, to 0.02 N",),
        ),
        entry("asymmetric_friction", 0.09, 0.03, parameters=FRICTION, note="from three of the recordings"),
        entry("quadratic_drag", 0.05, 0.04, measures=worse),
    )
    verdict = Verdict(
        "partly explained",
        tuple(e.effect for e in entries),
        ("position_dependent_friction",),
        "The gap depends on position and velocity. Four effects explain 81 % of it: cogging 46 %, cable_force or "
        "position_dependent_friction 21 %, asymmetric_friction 9 %, quadratic_drag 5 %. 19 % stay unexplained.",
        "To tell cable_force from position_dependent_friction, record slow moves and free wheels over the whole "
        "stroke.",
    )
    tried = (
        *(Tried(e.effect, e.share + 0.1, "named", e.certainty, e.first_in) for e in entries),
        Tried("position_dependent_friction", 0.3, "rival", 12.0, 0.2),
        *(t for t in TRIED[1:] if t.effect != "position_dependent_friction"),
    )
    rows = recordings(made)
    return explained(
        name="axis_07",
        verdict=verdict,
        budget=budget_of(*entries, measures=together(rows)),
        tried=tried,
        traces=made,
        recordings=rows,
        measures=together(rows),
        where=shares(made, FIELD),
        pairs=pairs(made),
        checks=checks(made),
        combinations=("coulomb_force and mass: only their ratio 0.73 m/s^2 is known, to 0.4 %",),
        warnings=("Only two recordings are held out.",),
    )


def at_floor() -> Diagnosis:
    """No gap: nothing is missing."""
    made = traces(nothing)
    verdict = Verdict(
        "none", (), (), "The model is at the floor: what remains on the held-out recordings is measurement noise.", ""
    )
    rows = recordings(made)
    nothing_left = Budget(0.058, 0.058, 0.057, 0.03, 0.03, 0.0, NAN, NAN, NAN, NAN, NAN, (), NAN, ())
    return explained(
        verdict=verdict,
        budget=nothing_left,
        tried=tuple(replace(t, outcome="screened", certainty=NAN, closed=NAN) for t in TRIED),
        traces=made,
        recordings=rows,
        measures=together(rows),
        where=shares(made, FIELD),
        pairs=(),
        checks=checks(made),
    )


def unknown(force: Force = push) -> Diagnosis:
    """A gap that no effect explains, without field wavenumber; nothing was added to the model."""
    made = traces(force, force)
    verdict = Verdict(
        "unknown",
        (),
        (),
        "There is a gap that no effect of the library explains; it depends on the time in the recording.",
        "Repeat one move five times at fixed intervals: if the residual repeats with the clock, look for a "
        "neighbouring drive or a pump.",
    )
    rows = recordings(made)
    return explained(
        model="force",
        verdict=verdict,
        budget=budget_of(measures=together(rows), ceiling=0.61),
        tried=TRIED[1:],
        recordings=rows,
        measures=together(rows),
        where=shares(made, None),
        field_wavenumber=None,
        traces=made,
        pairs=pairs(made)[1:],
        checks=checks(made),
        warnings=("Only two recordings are held out.",),
    )


def rotary() -> Diagnosis:
    """A rotary axis with one input, without field wavenumber, whose inertia no recording tells."""
    base = explained()
    made = tuple(
        replace(t, y=40 * t.y, v=40 * t.v, before=0.02 * t.before, after=0.02 * t.after, deviation=0.02 * t.deviation)
        for t in base.traces
    )
    units = {"m": "rad", "m/s": "rad/s"}
    where = tuple(
        replace(
            s,
            unit=units.get(s.unit, s.unit),
            x=40 * s.x if s.unit in units else s.x,
            mean=0.02 * s.mean,
            spread=0.02 * s.spread,
        )
        for s in base.where
        if s.coordinate != "pole_phase"
    )
    both = tuple(
        replace(
            p,
            x_unit=units.get(p.x_unit, p.x_unit),
            y_unit=units.get(p.y_unit, p.y_unit),
            mean=0.02 * p.mean,
            x_edges=40 * p.x_edges if p.x_unit in units else p.x_edges,
            y_edges=40 * p.y_edges if p.y_unit in units else p.y_edges,
        )
        for p in base.pairs
    )
    parameters = tuple(replace(e, unit="N m" if e.unit == "N" else "1/rad") for e in COGGING[:3])
    parameters += (
        estimate(
            "force_constant",
            "K_f",
            "N m/A",
            0.1,
            NAN,
            status="not_identifiable",
            note="these recordings do not tell it: feed one phase alone, so that the currents do not sum to zero",
        ),
    )
    rows = recordings(made)
    verdict = Verdict(
        "explained",
        ("cogging",),
        (),
        "The gap depends on the position; cogging explains it: 94 % of it closes.",
        "Record slow steady moves over several pole pitches, then free wheels over the whole stroke.",
    )
    cause = entry("cogging", 0.94, 0.025, parameters=parameters, measures=together(rows))
    return replace(
        base,
        name="mn4004",
        axis="rotary",
        model="force",
        traces=made,
        where=where,
        field_wavenumber=None,
        pairs=both,
        budget=budget_of(cause, measures=together(rows)),
        recordings=rows,
        measures=together(rows),
        checks=checks(made, "rotary"),
        force_scale="kg m^2",
        verdict=verdict,
        assumptions=("The added masses in the campaign are exact.",),
    )


SAMPLES: dict[str, Callable[[], Diagnosis]] = {
    "none": at_floor,
    "explained": explained,
    "partly": partly,
    "unknown": unknown,
    "rotary": rotary,
}
