"""The diagnosis of a campaign: base model, residual, where, which, how far."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from linid.diagnosis.alone import PER_RECORDING
from linid.diagnosis.balance import Balance
from linid.diagnosis.confirm import Fitted, Judge, fit_base, judge_of
from linid.diagnosis.gap import Trace
from linid.diagnosis.locate import ceiling, coordinates, locate, recording_masses
from linid.diagnosis.measures import measure_gaps
from linid.diagnosis.report_data import (
    Candidate,
    Change,
    Diagnosis,
    RecordingChange,
    ResidualTrace,
)
from linid.diagnosis.select import LARGEST, Confirmed, judged, pays, rivals, screen_and_confirm, worth_adding
from linid.diagnosis.verdict import decide
from linid.errors import UsageError
from linid.identification.first_values import first_values
from linid.identification.fit import fit, refine
from linid.identification.genetic import SearchSettings
from linid.identification.result import FitResult, ModelKind
from linid.identification.settings import FitSettings
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.recording.recording import Recording

Array = NDArray[np.float64]
Progress = Callable[[str, int, int], None]
# Base, friction and Stribeck parameters come from the free wheels; a short search is enough to start from.
_FRICTION_SEARCH = SearchSettings(population=32, generations=12, patience=4)


@dataclass(frozen=True)
class Found:
    """A diagnosis, the models before and after as fits write them, and their traces of all recordings."""

    diagnosis: Diagnosis
    before: FitResult
    after: FitResult
    traces_before: tuple[Trace, ...]
    traces_after: tuple[Trace, ...]


def diagnose(
    name: str,
    recordings: Sequence[Recording],
    kind: ModelKind,
    *,
    known: dict[str, float] | None = None,
    jobs: int = 1,
    seed: int = 1,
    progress: Progress | None = None,
) -> Found:
    """Find the effects that a base model lacks on some recordings; held-out ones judge.

    name: of the campaign; kind: force, sine, theta or friction; known: SI values that are not identified.
    Raises UsageError where there is nothing to fit or nothing to judge by, DataError for unfit recordings.
    """
    known = dict(known or {})
    watch = progress or (lambda stage, done, total: None)
    recordings = tuple(_numbered(recordings))
    fitted = [r for r in recordings if r.split == "fit"]
    if not fitted or len(fitted) == len(recordings):
        raise UsageError(
            name,
            "has no held-out recordings" if fitted else "has no recordings to fit",
            "Mark some recordings `split: held_out` in the campaign, others `split: fit`",
        )
    assumptions: list[str] = []
    base, judge = _base(recordings, kind, known, jobs, seed, assumptions, watch)
    balance = judge.balance
    held = balance.split
    floor = judge.floor(held)
    excess = float(np.mean(judge.power(base.residual)[held])) / floor - 1.0
    masses = recording_masses(recordings, base.values["mass"])
    field = _field_wavenumber(kind, base.values)
    axes = coordinates(balance, recordings[0].axis, field)
    watch("where", 0, 1)
    where = locate(balance, base.residual, judge.scale, masses, axes, seed)
    most = ceiling(balance, base.residual, judge.scale, axes, judge.noise)
    watch("where", 1, 1)
    chosen, groups, singles, screened = _select(judge, base, known, recordings, jobs, watch)
    verdict = decide(chosen, groups, excess, where, most, screened)
    best = chosen.fitted if chosen is not None and verdict.status in ("identified", "ambiguous") else base
    before, after = _models(base, best, fitted, jobs, seed, watch)
    changes, traces_before, traces_after = _changes(recordings, before, after, jobs, seed, watch)
    explained = dict(screened)
    diagnosis = Diagnosis(
        name=name,
        model=kind,
        axis=recordings[0].axis,
        base_effects=(),
        assumptions=tuple(assumptions),
        verdict=verdict,
        candidates=_candidates(singles, chosen, explained, changes, after, verdict.status),
        where=where,
        ceiling=most,
        ceiling_coordinates="pairs of time, position, velocity, direction, acceleration and current",
        excess_before=excess * floor,
        excess_after=float(np.mean(judge.power(best.residual)[held])) - floor,
        floor=floor,
        recordings=changes,
        traces=_traces(judge, base, best, masses),
        field_wavenumber=field,
        seed=seed,
        warnings=tuple(before.warnings),
    )
    return Found(diagnosis, before, after, traces_before, traces_after)


def _numbered(recordings: Sequence[Recording]) -> list[Recording]:
    """Recordings that know their number (bare files have none)."""
    if all(r.number for r in recordings):
        return list(recordings)
    return [replace(r, number=k) for k, r in enumerate(recordings, 1)]


def _base(
    recordings: Sequence[Recording], kind: ModelKind, known: dict[str, float], jobs: int, seed: int,
    assumptions: list[str], watch: Progress,
) -> tuple[Fitted, Judge]:  # fmt: skip
    """The base model by the force balance of the fitted recordings, started from friction of the free wheels."""
    fitted = [r for r in recordings if r.split == "fit"]
    wheels = [r for r in fitted if r.kind == "free_wheel"]
    model = Model(kind)
    settings = FitSettings(search=replace(_FRICTION_SEARCH, seed=seed), jobs=jobs)
    start: FitResult | None = None
    fixed = dict(known)
    watch("base", 0, 2)
    if wheels:
        names = {p.name for p in Model("friction").parameters}
        start = fit("friction", wheels, settings=settings, known={k: x for k, x in known.items() if k in names})
        assumptions.append(f"friction starts from {len(wheels)} free wheels")
    elif kind == "force":
        start = fit("force", fitted, settings=replace(settings, objective="acceleration"), known=known)
        assumptions.append("no free wheels: friction comes from the driven recordings")
    watch("base", 1, 2)
    masses = {r.added_mass for r in fitted}
    if "mass" not in fixed and len(masses) < 2 and not (kind == "force" and "force_constant" in fixed):
        fixed["mass"] = 1.0 if start is None else start.value("mass")
        assumptions.append("no recording tells the mass: forces are those of the friction result, or per kilogram")
    first, _ = first_values(model, fitted, fixed, start)
    balance = Balance(model, recordings, jobs, seed)
    base = fit_base(balance, model, first, fixed, fitted, jobs)
    watch("base", 2, 2)
    return base, judge_of(balance, model, base.vector, seed)


def _select(
    judge: Judge, base: Fitted, known: dict[str, float], recordings: Sequence[Recording], jobs: int, watch: Progress
) -> tuple[Confirmed | None, list[tuple[str, ...]], tuple[Confirmed, ...], list[tuple[str, float]]]:
    """Forward selection. Returns the chosen effects, rivals per effect, the single candidates, the screened shares."""
    chosen: Confirmed | None = None
    groups: list[tuple[str, ...]] = []
    singles: tuple[Confirmed, ...] = ()
    shares: list[tuple[str, float]] = []
    step = base
    for number in range(LARGEST):

        def told(stage: str, done: int, total: int, number: int = number) -> None:
            watch(f"{stage} effect {number + 1}", done, total)

        screened, found = screen_and_confirm(judge, step, base, known, recordings, jobs, told)
        if number == 0:
            singles, shares = found, [(s.name, s.trial.explained) for s in screened]
        # What counts is what a candidate adds to the step before.
        over = sorted((judged(judge, step, c.fitted, c.explained) for c in found), key=lambda c: -c.closure)
        better = [c for c in over if pays(c)]
        if chosen is not None:
            better = [c for c in better if worth_adding(c, 1.0 - chosen.closure)]
        if not better:
            break
        best = better[0]
        groups.append(rivals(judge, best, better[1:]))
        chosen, step = judged(judge, base, best.fitted, best.explained), best.fitted
    return chosen, groups, singles, shares


def _field_wavenumber(kind: str, values: dict[str, float]) -> float | None:
    if kind not in ("sine", "theta"):
        return None
    return values["guideway_density"] * (2.0 if kind == "theta" else 1.0)


def _models(
    base: Fitted, best: Fitted, fitted: Sequence[Recording], jobs: int, seed: int, watch: Progress
) -> tuple[FitResult, FitResult]:
    """Both models identified as `fit-motor` does it, from where the force balance has brought them."""
    settings = FitSettings(search=SearchSettings(seed=seed), jobs=jobs)
    watch("models", 0, 2)
    before = refine(base.space, base.genes, fitted, settings=settings)
    watch("models", 1, 2)
    after = before if best is base else refine(best.space, best.genes, fitted, settings=settings)
    watch("models", 2, 2)
    return before, after


def _changes(
    recordings: Sequence[Recording], before: FitResult, after: FitResult, jobs: int, seed: int, watch: Progress
) -> tuple[tuple[RecordingChange, ...], tuple[Trace, ...], tuple[Trace, ...]]:
    """The measures of every recording before and after, and the traces behind them."""
    out, traces_before, traces_after = [], [], []
    for done, recording in enumerate(recordings, 1):
        (first,), (trace,) = measure_gaps(before, [recording], jobs=jobs, seed=seed, among=recordings)
        second, later = first, trace
        if after is not before:
            (second,), (later,) = measure_gaps(after, [recording], jobs=jobs, seed=seed, among=recordings)
        changes = {
            "free_run": Change(first.free_run, second.free_run, second.free_run_floor),
            "ahead": Change(first.ahead, second.ahead, second.ahead_floor),
            "force": Change(first.force, second.force, second.force_floor),
        }
        out.append(RecordingChange(recording.name, recording.kind, recording.split, changes))
        traces_before.append(trace)
        traces_after.append(later)
        watch("measures", done, len(recordings))
    return tuple(out), tuple(traces_before), tuple(traces_after)


def _together(changes: Sequence[RecordingChange]) -> dict[str, Change]:
    """The measures over all held-out recordings: RMS over the recordings, with intervals from their scatter."""
    held = [c for c in changes if c.split == "held_out"]
    out = {}
    for measure in ("free_run", "ahead", "force"):
        rows = np.array([[getattr(c.changes[measure], k) for k in ("before", "after", "floor")] for c in held])
        rms = np.sqrt(np.mean(np.nan_to_num(rows, nan=1e3) ** 2, axis=0))
        out[measure] = Change(float(rms[0]), float(rms[1]), float(rms[2]))
    return out


def _candidates(
    singles: Sequence[Confirmed], chosen: Confirmed | None, explained: dict[str, float],
    changes: Sequence[RecordingChange], after: FitResult, status: str,
) -> tuple[Candidate, ...]:  # fmt: skip
    """The ranking: what was chosen first, then the confirmed ones by closure, then the screened ones."""
    rows: list[Candidate] = []
    named = chosen if status in ("identified", "ambiguous") else None
    if named is not None:
        own = {p.name for effect in named.effects for p in find_effect(effect).parameters}
        parameters = tuple(e for e in after.estimates if e.name in own)
        first = Candidate(
            named.effects, explained.get(named.effects[0], float("nan")), named.closure, named.low, named.high,
            _together(changes), parameters,
        )  # fmt: skip
        rows.append(first)
    for single in singles:
        if named is not None and single.effects == named.effects:
            continue
        note = "judged inside its recordings" if single.effects[-1] in PER_RECORDING else ""
        rows.append(Candidate(single.effects, single.explained, single.closure, single.low, single.high, note=note))
    confirmed = {s.effects for s in singles}
    rows += [
        Candidate((name,), share, note="screened only") for name, share in explained.items() if (name,) not in confirmed
    ]
    return tuple(rows)


def _traces(judge: Judge, base: Fitted, best: Fitted, masses: Array) -> tuple[ResidualTrace, ...]:
    rows = judge.balance.rows
    out = []
    for index, recording in enumerate(judge.balance.recordings):
        mine = rows.recording == index
        out.append(
            ResidualTrace(
                recording=recording.name,
                kind=recording.kind,
                split=recording.split,
                t=rows.t[mine],
                y=rows.y[mine],
                v=rows.v[mine],
                before=masses[index] * base.residual[mine],
                after=masses[index] * best.residual[mine],
                deviation=float(masses[index] * judge.noise[index]),
            )
        )
    return tuple(out)
