"""Synthetic diagnoses, one for every verdict, with residuals made from the physics that each names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from linid.diagnosis.report_data import Budget, Change, Diagnosis, Tried, Verdict

from .diagnosis_parts import (
    FIELD,
    Array,
    Force,
    budget_of,
    cable,
    checks,
    cogging,
    drag,
    entry,
    nothing,
    pairs,
    push,
    recordings,
    shares,
    together,
    traces,
)
from .samples import NAN, estimate

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
        "free_run": Change(0.0058, 0.0075, 0.0009),
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
        "none", (), (), "The residual force of the held-out recordings is at the noise floor: no effect is missing.", ""
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
