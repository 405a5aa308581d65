"""The diagnosis of a campaign: base model, residual, where, which, how far."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from linid.diagnosis.alone import PER_RECORDING
from linid.diagnosis.balance import Memory
from linid.diagnosis.base import fit_base_model, numbered
from linid.diagnosis.confirm import Fitted, Judge
from linid.diagnosis.experiments import experiments, range_of
from linid.diagnosis.forecast import together, with_forecasts
from linid.diagnosis.gap import Trace
from linid.diagnosis.locate import ceiling, coordinates, locate, recording_masses
from linid.diagnosis.measures import measure_gaps
from linid.diagnosis.next_experiment import prospects
from linid.diagnosis.report_data import (
    Candidate,
    Change,
    Diagnosis,
    RecordingChange,
    ResidualTrace,
    Verdict,
)
from linid.diagnosis.screen import Screening
from linid.diagnosis.select import Confirmed, Selection, fit_effects, forward_selection
from linid.diagnosis.side_by_side import Workers, side_by_side
from linid.diagnosis.verdict import advice, decide
from linid.errors import UsageError
from linid.identification.fit import refine
from linid.identification.genetic import SearchSettings
from linid.identification.model_file import model_from_text, model_to_text
from linid.identification.result import FitResult, ModelKind
from linid.identification.settings import FitSettings
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.recording.recording import Recording

Array = NDArray[np.float64]
Progress = Callable[[str, int, int], None]
# The models start from where the force balance has brought them.
_STEPS, _PRECISION = 20, 0.03


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
    effects: Sequence[str] = (),
    known: dict[str, float] | None = None,
    jobs: int = 1,
    workers: Workers | None = None,
    seed: int = 1,
    memory: Memory | None = None,
    progress: Progress | None = None,
) -> Found:
    """Find the effects that a base model lacks on some recordings; held-out ones judge.

    name: of the campaign; kind: force, sine, theta or friction; effects: already in the base; known: SI values that
    are not identified; workers: who does the fits of a step and the measures instead of threads here;
    memory: fits that an earlier run finished, and where new ones are kept.
    Raises UsageError where there is nothing to fit or nothing to judge by, or where an effect makes no sense;
    DataError for unfit recordings.
    """
    known = dict(known or {})
    watch = progress or (lambda stage, done, total: None)
    recordings = numbered(recordings)
    fitted = [r for r in recordings if r.split == "fit"]
    if not fitted or len(fitted) == len(recordings):
        raise UsageError(
            name,
            "has no held-out recordings" if fitted else "has no recordings to fit",
            "Mark some recordings `split: held_out` in the campaign, others `split: fit`",
        )
    assumptions: list[str] = []
    base, judge = fit_base_model(recordings, kind, known, jobs, seed, assumptions, watch, memory)
    screening = Screening(base, recordings, known, jobs, workers)
    if effects:
        extended = fit_effects(judge, screening, base, tuple(effects))
        if extended is None:
            raise UsageError(
                "--effect", f"one of {', '.join(effects)} makes no sense with the {kind} model and these recordings",
                "See what each needs: linid effects",
            )  # fmt: skip
        base = extended
    found = forward_selection(judge, screening, base, watch)
    base = found.base
    balance = judge.balance
    held = balance.split
    floor = judge.floor(held)
    excess = judge.excess(base.residual)
    masses = recording_masses(recordings, base.values["mass"])
    field = _field_wavenumber(kind, base.values)
    axes = coordinates(balance, recordings[0].axis, field)
    watch("where", 0, 1)
    where = locate(balance, base.residual, judge.scale, masses, axes, seed)
    most = ceiling(balance, base.residual, judge.scale, axes, judge.noise)
    watch("where", 1, 1)
    chosen = found.chosen
    last = base if chosen is None else chosen.fitted
    missed = float(np.mean(judge.power(last.residual)[held]) / np.mean(judge.power(balance.rows.a)[held]))
    verdict = decide(chosen, found.rival_names, excess, where, most, found.screened, 1.0 - missed)
    words = _waves(verdict, chosen, recordings[0].axis, field)
    next_step = _next_experiment(verdict, found, judge, base, field)
    verdict = replace(verdict, sentence=verdict.sentence + words, next_experiment=next_step)
    best = chosen.fitted if chosen is not None and verdict.status in ("identified", "ambiguous") else base
    before, after = _models(base, best, fitted, jobs, workers, seed, judge.balance.memory, watch)
    changes, traces_before, traces_after = _changes(recordings, before, after, jobs, workers, seed, watch)
    diagnosis = Diagnosis(
        name=name,
        model=kind,
        axis=recordings[0].axis,
        base_effects=tuple(effects),
        assumptions=tuple(assumptions),
        verdict=verdict,
        candidates=_candidates(
            found.singles, chosen, dict(found.screened), changes, traces_after, after, verdict.status
        ),
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


def _waves(verdict: Verdict, chosen: Confirmed | None, axis: str, field_wavenumber: float | None) -> str:
    """Which waves a periodic effect is made of, where no field says so; the strongest first."""
    if chosen is None or field_wavenumber is not None or verdict.status not in ("identified", "ambiguous"):
        return ""
    for effect in map(find_effect, verdict.effects):
        if effect.orders:
            values = chosen.fitted.values | chosen.fitted.structural
            pairs = zip(effect.amplitudes[0::2], effect.amplitudes[1::2], strict=True)
            sizes = [math.hypot(values[sine], values[cosine]) for sine, cosine in pairs]
            ranked = sorted(zip(sizes, (values[name] for name in effect.orders), strict=True), reverse=True)
            unit, length = ("N m", "revolution") if axis == "rotary" else ("N", "metre")
            per = 1.0 if axis == "rotary" else values["cogging_wavenumber"] / (2.0 * math.pi)
            named = ", ".join(f"{per * order:.4g} ({size:.2g} {unit})" for size, order in ranked)
            return f" Its waves per {length}, strongest first: {named}."
    return ""


def _next_experiment(
    verdict: Verdict, found: Selection, judge: Judge, base: Fitted, field_wavenumber: float | None
) -> str:
    """The recording to make next in words: of all that this axis can make, the one that tells most."""
    balance = judge.balance
    fitted = [k for k, r in enumerate(balance.recordings) if r.split == "fit"]
    driven = [balance.recordings[k] for k in fitted if balance.recordings[k].kind != "free_wheel"]
    chosen = found.chosen
    if chosen is None or verdict.status not in ("identified", "ambiguous") or not driven:
        return verdict.next_experiment
    if any(name in PER_RECORDING for name in (*verdict.effects, *verdict.equivalent)):
        return verdict.next_experiment
    rows = balance.rows
    span = range_of(balance.recordings, rows.v, rows.a, field_wavenumber)
    rival = next((group[0].fitted for group in found.rivals if group), None)
    ranking = prospects(
        chosen.fitted, rival, [balance.recordings[k] for k in fitted], judge.scale[fitted],
        experiments(Model(base.model.kind), base.vector, span, driven[0]),
    )  # fmt: skip
    return advice(verdict, ranking[0], float(np.median(judge.noise)), balance.recordings[0].axis)


def _field_wavenumber(kind: str, values: dict[str, float]) -> float | None:
    if kind not in ("sine", "theta"):
        return None
    return values["guideway_density"] * (2.0 if kind == "theta" else 1.0)


def _models(
    base: Fitted, best: Fitted, fitted: Sequence[Recording], jobs: int, workers: Workers | None, seed: int,
    memory: Memory, watch: Progress,
) -> tuple[FitResult, FitResult]:  # fmt: skip
    """Both models identified as `fit-motor` does it, from where the force balance has brought them."""
    wanted = {f"refined {model.model.effects} {model.genes.tolist()}": model for model in (base, best)}
    missing = [(key, model) for key, model in wanted.items() if key not in memory]
    watch("models", 0, 2)
    # All threads for both: the one with effects takes longer, and then has them for itself.
    refined = partial(_refined, tuple(fitted), seed, 1 if workers else jobs)
    for (key, _), text in side_by_side(refined, missing, jobs, workers):
        memory[key] = text
    watch("models", 2, 2)
    models = [model_from_text(memory[key], "checkpoint") for key in wanted]
    return models[0], models[-1]


def _refined(fitted: tuple[Recording, ...], seed: int, least: int, item: tuple[str, Fitted], jobs: int) -> str:
    """A model as `fit-motor` finds it, as text, by `least` threads or more. At the top of the module, since it also
    runs on workers."""
    settings = FitSettings(
        search=SearchSettings(seed=seed), jobs=max(jobs, least), polish_steps=_STEPS, polish_precision=_PRECISION
    )
    return model_to_text(refine(item[1].space, item[1].genes, fitted, settings=settings))


def _changes(
    recordings: Sequence[Recording], before: FitResult, after: FitResult, jobs: int, workers: Workers | None,
    seed: int, watch: Progress,
) -> tuple[tuple[RecordingChange, ...], tuple[Trace, ...], tuple[Trace, ...]]:  # fmt: skip
    """The measures of every recording before and after, and the traces behind them."""
    measured = partial(_measured, tuple(recordings), before, after if after is not before else None, seed)
    found = []
    for _, one in side_by_side(measured, range(len(recordings)), jobs, workers):
        found.append(one)
        watch("measures", len(found), len(recordings))
    changes, traces_before, traces_after = zip(*found, strict=True)
    return with_forecasts(changes), traces_before, traces_after


def _measured(
    recordings: tuple[Recording, ...], before: FitResult, after: FitResult | None, seed: int, index: int, jobs: int
) -> tuple[RecordingChange, Trace, Trace]:
    """The measures of one recording and the traces behind them; after: None where nothing was added."""
    recording = recordings[index]
    (first,), (trace,) = measure_gaps(before, [recording], jobs=jobs, seed=seed, among=recordings, floors=after is None)
    second, later = first, trace
    if after is not None:
        (second,), (later,) = measure_gaps(after, [recording], jobs=jobs, seed=seed, among=recordings)
    changes = {
        "free_run": Change(first.free_run, second.free_run, second.free_run_floor),
        "ahead": Change(first.ahead, second.ahead, second.ahead_floor),
        "force": Change(first.force, second.force, second.force_floor),
    }
    return RecordingChange(recording.name, recording.kind, recording.split, changes), trace, later


def _candidates(
    singles: Sequence[Confirmed], chosen: Confirmed | None, explained: dict[str, float],
    changes: Sequence[RecordingChange], traces: Sequence[Trace], after: FitResult, status: str,
) -> tuple[Candidate, ...]:  # fmt: skip
    """The ranking: what was chosen first, then the confirmed ones by closure, then the screened ones."""
    rows: list[Candidate] = []
    named = chosen if status in ("identified", "ambiguous") else None
    if named is not None:
        own = {p.name for effect in named.effects for p in find_effect(effect).parameters}
        parameters = tuple(e for e in after.estimates if e.name in own)
        first = Candidate(
            named.effects, explained.get(named.effects[0], float("nan")), named.closure, named.low, named.high,
            together(changes, traces, after.seed), parameters,
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
