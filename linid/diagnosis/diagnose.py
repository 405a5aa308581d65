"""The diagnosis of a campaign: base model, residual, where, which, how far."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from linid.arrays import Array
from linid.diagnosis.balance import Memory
from linid.diagnosis.base import Base, fit_base_model, numbered
from linid.diagnosis.combinations import base_combinations, effect_combinations
from linid.diagnosis.experiments import experiments, range_of
from linid.diagnosis.forecast import together, with_forecasts
from linid.diagnosis.gap import Trace
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge
from linid.diagnosis.locate import Coordinate, ceiling, coordinates, locate, recording_masses
from linid.diagnosis.measures import measure_gaps
from linid.diagnosis.next_experiment import prospects
from linid.diagnosis.pairs import locate_pairs
from linid.diagnosis.parallel_tasks import Workers, in_parallel
from linid.diagnosis.report_data import (
    MEASURES,
    Budget,
    Change,
    Diagnosis,
    Entry,
    RecordingChange,
    ResidualTrace,
    Tried,
)
from linid.diagnosis.screen import Screening
from linid.diagnosis.select import Selection, fit_effects, select
from linid.diagnosis.shares import Shares, judged_rows, shares_of
from linid.diagnosis.verdict import SURE, TELLING, advice, decide
from linid.errors import UsageError
from linid.identification.fit import refine
from linid.identification.model_file import model_from_text, model_to_text
from linid.identification.result import FitResult, ModelKind
from linid.identification.settings import FitSettings, SearchSettings
from linid.identification.uncertainty.estimates import plain_estimates
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.recording.checks import checks_of
from linid.recording.recording import Recording

Progress = Callable[[str, int, int], None]
# The models start from where the force balance has brought them.
_STEPS, _PRECISION = 10, 0.1


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
    base = fit_base_model(recordings, kind, known, jobs, seed, assumptions, watch, memory)
    judge = base.judge
    screening = Screening(judge.fits, base.fitted, jobs, workers)
    if effects:
        extended = fit_effects(base, screening, tuple(effects))
        if extended is None:
            raise UsageError(
                "--effect",
                f"one of {', '.join(effects)} makes no sense with the {kind} model and these recordings",
                "See what each needs: linid effects",
            )
        base = replace(base, fitted=extended, rivals=())
    found = select(base, screening, watch)
    watch("where", 0, 1)
    seen = _Seen(judge, found, kind, recordings, seed)
    watch("where", 1, 1)
    before, after = _models(found, fitted, jobs, workers, seed, judge.balance.memory, watch)
    changes, traces_before, traces_after = _changes(recordings, before, after, jobs, workers, seed, watch)
    shares = shares_of(judge, found.base, found.best, seed)
    known_mass = "mass" in known or "mass" not in base.held
    scale = "" if known_mass else "kg m^2" if recordings[0].axis == "rotary" else "kg"
    measures = together(changes, traces_after, seed)
    budget = seen.budget(shares, _entries(found, shares, after, recordings, measures, seed))
    checks = checks_of(recordings)
    screened = [(s.name, s.trial.explained) for s in found.screened]
    verdict = decide(budget, seen.where, screened, seen.motion, checks)
    words = _waves(found.best, recordings[0].axis, seen.field)
    verdict = replace(
        verdict,
        sentence=verdict.sentence + words,
        next_experiment=_next_experiment(verdict.next_experiment, budget, found, judge, base, seen.field),
    )
    diagnosis = Diagnosis(
        name=name,
        model=kind,
        axis=recordings[0].axis,
        base_effects=tuple(effects),
        assumptions=tuple(assumptions),
        verdict=verdict,
        budget=budget,
        tried=_tried(found),
        where=seen.where,
        pairs=seen.pairs,
        measures=measures,
        recordings=changes,
        traces=_traces(judge, found.base, found.best, seen.masses),
        checks=checks,
        force_scale=scale,
        field_wavenumber=seen.field,
        seed=seed,
        combinations=base_combinations(after, known_mass),
        warnings=tuple(before.warnings),
    )
    return Found(diagnosis, before, after, traces_before, traces_after)


class _Seen:
    """Where the gap lies, before and after, as the judge sees it."""

    def __init__(self, judge: Judge, found: Selection, kind: str, recordings: Sequence[Recording], seed: int) -> None:
        self.judge, self.found = judge, found
        balance = judge.balance
        self.field = _field_wavenumber(kind, found.base.values)
        self.masses = recording_masses(recordings, found.base.values["mass"])
        self.axes: tuple[Coordinate, ...] = coordinates(balance, recordings[0].axis, self.field)
        base, best = found.base.residual, found.best.residual
        self.where = locate(balance, base, judge.scale, self.masses, self.axes, seed)
        self.pairs = locate_pairs(balance, base, judge.scale, self.masses, self.axes, seed)
        self.later = self.where if best is base else locate(balance, best, judge.scale, self.masses, self.axes, seed)
        noise = judge.noise.deviation(balance.rows)
        self.ceiling = ceiling(balance, best, judge.scale, self.axes, noise)
        held = balance.split
        whole = max(float(np.mean(judge.power(balance.rows.a)[held])), 1e-300)
        missed = float(np.mean(judge.power(best)[held])) / whole
        self.motion = 1.0 - missed

    def budget(self, shares: Shares, entries: tuple[Entry, ...]) -> Budget:
        """The budget of a selection's entries."""
        judge, found = self.judge, self.found
        rows = judged_rows(judge, found.best)
        force = self.masses[judge.balance.rows.recording[rows]]
        noise = (judge.noise.encoder + judge.noise.inputs)[judge.balance.rows.bin[rows]]

        def rms(x: Array) -> float:
            return float(np.sqrt(np.mean(x)))

        telling = [s.label for s in self.later if s.share > TELLING and s.p_value < SURE and entries]
        closed, low, high = shares.closed if entries else (0.0, 0.0, 0.0)
        rest = shares.unexplained if entries else (1.0, 1.0, 1.0)
        return Budget(
            before=rms((force * found.base.residual[rows]) ** 2),
            after=rms((force * found.best.residual[rows]) ** 2),
            floor=rms(force**2 * noise),
            excess_before=judge.excess(found.base.residual, rows),
            excess_after=judge.excess(found.best.residual, rows),
            closed=closed,
            closed_low=low,
            closed_high=high,
            unexplained=rest[0],
            unexplained_low=rest[1],
            unexplained_high=rest[2],
            entries=entries,
            ceiling=self.ceiling,
            depends_on=tuple(telling[:3]),
            level_before=judge.fits.level(found.base.residual, found.base.floor, rows),
            level_after=judge.fits.level(found.best.residual, found.best.floor, rows),
        )


def _entries(
    found: Selection,
    shares: Shares,
    after: FitResult,
    recordings: Sequence[Recording],
    changes: Mapping[str, Change],
    seed: int,
) -> tuple[Entry, ...]:
    """The budget's lines, the largest share first; changes: of the measures by all effects together."""
    held = [r for r in recordings if r.split == "held_out"]
    best = measured(after, found.best, held, seed, recordings) if len(found.parts) > 1 else {}
    out = []
    for part in found.parts:
        portion = shares.portions[part.name]
        own = {p.name for p in find_effect(part.name).parameters}
        parameters = tuple(e for e in after.estimates if e.name in own)
        if len(found.parts) == 1:  # what it does is what all do
            measures = dict(changes)
        else:
            without = measured(after, part.without, held, seed, recordings)
            measures = {name: Change(without[name], best[name], changes[name].floor) for name in MEASURES}
        out.append(
            Entry(
                effect=part.name,
                rivals=tuple(name for name, _ in found.rivals.get(part.name, ())),
                share=portion.share,
                low=portion.low,
                high=portion.high,
                first_in=portion.first_in,
                last_in=portion.last_in,
                certainty=part.evidence.certainty,
                parameters=parameters,
                combinations=effect_combinations(after, part.name),
                measures=measures,
            )
        )
    return tuple(sorted(out, key=lambda entry: -entry.share))


def measured(
    after: FitResult, fitted: Fitted, held: Sequence[Recording], seed: int, among: Sequence[Recording]
) -> dict[str, float]:
    """The three measures over held-out recordings, RMS over them, of a model as the force balance has it."""
    result = replace(after, effects=fitted.model.effects, estimates=plain_estimates(fitted.model, fitted.values))
    gaps, _ = measure_gaps(result, held, seed=seed, among=among, floors=False)
    out = {}
    for name in MEASURES:
        values = np.nan_to_num([getattr(gap, name) for gap in gaps], nan=np.inf)
        out[name] = float(np.sqrt(np.mean(np.square(values))))
    return out


def _tried(found: Selection) -> tuple[Tried, ...]:
    """All effects that make sense here, with what became of them."""
    named = {part.name: part for part in found.parts}
    dropped = {part.name: part for part in found.dropped}
    rivals = {name for group in found.rivals.values() for name, _ in group}
    explained = {s.name: max(s.trial.explained, 0.0) for s in found.screened}
    out = []
    for name in dict.fromkeys((*named, *dropped, *explained)):
        part = named.get(name) or dropped.get(name)
        outcome = "named" if name in named else "rival" if name in rivals else "dropped" if part else "screened"
        evidence = (part.evidence.certainty, part.evidence.closed) if part else (math.nan, math.nan)
        out.append(Tried(name, explained.get(name, math.nan), outcome, *evidence))  # type: ignore[arg-type]
    return tuple(out)


def _waves(best: Fitted, axis: str, field_wavenumber: float | None) -> str:
    """Which waves a periodic effect is made of, where no field says so; the strongest first."""
    if field_wavenumber is not None:
        return ""
    for effect in map(find_effect, best.model.effects):
        if effect.orders:
            values = best.values | best.preset
            pairs = zip(effect.amplitudes[0::2], effect.amplitudes[1::2], strict=True)
            sizes = [math.hypot(values[sine], values[cosine]) for sine, cosine in pairs]
            ranked = sorted(zip(sizes, (values[name] for name in effect.orders), strict=True), reverse=True)
            length = "revolution" if axis == "rotary" else "metre"
            wavenumber = next(p.name for p in effect.parameters if p.name.endswith("wavenumber"))
            per = 1.0 if axis == "rotary" else values[wavenumber] / (2.0 * math.pi)
            whole = max(math.hypot(*sizes), 1e-300)
            named = ", ".join(f"{per * order:.4g} ({100.0 * size / whole:.0f} %)" for size, order in ranked[:5])
            return f" The waves of {effect.name.replace('_', ' ')} per {length}, strongest first: {named}."
    return ""


def _next_experiment(
    plain: str, budget: Budget, found: Selection, judge: Judge, base: Base, field_wavenumber: float | None
) -> str:
    """The recording to make next in words: of all that this axis can make, the one that tells most."""
    balance = judge.balance
    fitted = [k for k, r in enumerate(balance.recordings) if r.split == "fit"]
    driven = [balance.recordings[k] for k in fitted if balance.recordings[k].kind != "free_wheel"]
    if not budget.entries or not driven or any(find_effect(e).per_recording for e in found.best.model.effects):
        return plain
    rows = balance.rows
    span = range_of(balance.recordings, rows.v, rows.a, field_wavenumber)
    unclear = next((entry for entry in budget.entries if entry.rivals), None)
    rival = None if unclear is None else found.rivals[unclear.effect][0][1]
    # What `prospects` asks for is how well the last effect is told.
    last = budget.entries[-1].effect if unclear is None else unclear.effect
    order = (*(e for e in found.best.model.effects if e != last), last)
    best = replace(found.best, model=Model(found.best.model.kind, order))
    ranking = prospects(
        best,
        rival,
        [balance.recordings[k] for k in fitted],
        judge.scale[fitted],
        experiments(Model(base.fitted.model.kind), base.fitted.vector, span, driven[0]),
    )
    noise = float(np.median(judge.noise.deviation(rows)))
    return advice(budget, ranking[0], noise, balance.recordings[0].axis)


def _field_wavenumber(kind: str, values: dict[str, float]) -> float | None:
    model = Model(kind)
    return values["electrical_wavenumber"] * model.turns if model.phases else None


def _models(
    found: Selection,
    fitted: Sequence[Recording],
    jobs: int,
    workers: Workers | None,
    seed: int,
    memory: Memory,
    watch: Progress,
) -> tuple[FitResult, FitResult]:
    """Both models identified as `fit-motor` does it, from where the force balance has brought them."""
    wanted = {f"refined {model.model.effects} {model.key}": model for model in (found.base, found.best)}
    missing = [(key, model) for key, model in wanted.items() if key not in memory]
    watch("models", 0, 2)
    # All threads for both: the one with effects takes longer, and then has them for itself.
    refined = partial(_refined, tuple(fitted), seed, 1 if workers else jobs)
    for (key, _), text in in_parallel(refined, missing, jobs, workers):
        memory[key] = text
    watch("models", 2, 2)
    models = [model_from_text(memory[key], "checkpoint") for key in wanted]
    return models[0], models[-1]


def _refined(fitted: tuple[Recording, ...], seed: int, least: int, item: tuple[str, Fitted], jobs: int) -> str:
    """A model as `fit-motor` finds it, as text, by `least` threads or more. At the top of the module, since it also
    runs on workers."""
    settings = FitSettings(
        search=SearchSettings(seed=seed),
        jobs=max(jobs, least),
        least_squares_steps=_STEPS,
        least_squares_precision=_PRECISION,
    )
    space, point = item[1].space(fitted)
    return model_to_text(refine(space, point, fitted, settings=settings))


def _changes(
    recordings: Sequence[Recording],
    before: FitResult,
    after: FitResult,
    jobs: int,
    workers: Workers | None,
    seed: int,
    watch: Progress,
) -> tuple[tuple[RecordingChange, ...], tuple[Trace, ...], tuple[Trace, ...]]:
    """The measures of every recording before and after, and the traces behind them."""
    measured = partial(_measured, tuple(recordings), before, after if after is not before else None, seed)
    found = []
    for _, one in in_parallel(measured, range(len(recordings)), jobs, workers):
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


def _traces(judge: Judge, base: Fitted, best: Fitted, masses: Array) -> tuple[ResidualTrace, ...]:
    rows = judge.balance.rows
    noise = judge.noise.deviation(rows)
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
                deviation=float(masses[index] * noise[index]),
            )
        )
    return tuple(out)
