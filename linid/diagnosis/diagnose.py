"""The diagnosis of a campaign: base model, residual, where, which, how far."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from linid.diagnosis.base import Base, fit_base_model, numbered, on_comparable_masses
from linid.diagnosis.beside_term import with_hidden_effects
from linid.diagnosis.combinations import base_combinations
from linid.diagnosis.commissioned import (
    commissioned_base,
    comparable_recordings,
    has_a_gap,
    of_one_curve,
    parameter_changes,
)
from linid.diagnosis.entries import entries_of, tried_effects
from linid.diagnosis.experiments import experiments, range_of
from linid.diagnosis.forecast import together
from linid.diagnosis.gap import Trace
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge
from linid.diagnosis.lacking import Models, Sought, lacking_term, sought_term
from linid.diagnosis.law_of_base import base_with_law, law_finding, select_under_law, untold
from linid.diagnosis.lead import Lead, lead_of, with_effects_of
from linid.diagnosis.means import Means
from linid.diagnosis.next_experiment import prospects
from linid.diagnosis.refined_models import Refining, changes_of
from linid.diagnosis.report_data import Budget, Change, Diagnosis, LawFinding, ProposedTerm, RecordingChange, Verdict
from linid.diagnosis.screen import Screening
from linid.diagnosis.seen import Seen, residual_traces
from linid.diagnosis.select import Selection, fit_effects, select
from linid.diagnosis.shares import Shares, shares_of
from linid.diagnosis.verdict import advice, decide, so_far
from linid.errors import UsageError
from linid.identification.result import FitResult, ModelKind
from linid.physics.effects.registry import canonical, find_effect
from linid.physics.own_terms.own_term import is_own
from linid.recording.check_findings import RecordingChecks
from linid.recording.checks import checks_of
from linid.recording.recording import Recording


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
    without: Sequence[str] = (),
    known: dict[str, float] | None = None,
    since: FitResult | None = None,
    means: Means | None = None,
) -> Found:
    """Find the effects that a base model lacks on some recordings; held-out ones judge.

    name: of the campaign; kind: force, sine, theta or friction; effects: already in the base; without: effects left out
    of consideration; known: SI values that are not identified; since: a model that is the base as it is, beside which
    changes of its parameters are candidates too. Raises UsageError where there is nothing to fit or nothing to judge
    by, or where an effect makes no sense; DataError for unfit recordings.
    """
    known, effects, means = dict(known or {}), _of_base(effects, without), means or Means()
    recordings, fitted = _numbered(name, _comparable(since, kind, recordings, known))
    assumptions = [f"left out of consideration: {one.replace('_', ' ')}" for one in without]
    with Refining(fitted, means, since) as refining:
        base, found, law = _begun(recordings, (kind, effects, without), since, known, means, assumptions, refining)
        found, shares, sought, compared = _borne_out(base, found, recordings, means, without, refining)
        seen = Seen(base.judge, found, kind, recordings, means.seed)
        means.watch("where", 1, 1)
        lines = entries_of(found, shares, compared.after, recordings, compared.measures, means)
        lines, other_values = of_one_curve(lines, parameter_changes(since, compared.after, recordings))
        budget = seen.budget(shares, lines)
        models = Models(compared.after, found.best, compared.changes, compared.traces_after)
        term, models = (None, models) if sought is None else lacking_term(sought, models, recordings, means)
    known_mass = _mass_is_known(base, known, since)
    same, checks = models.result is compared.after, checks_of(recordings)
    measures = compared.measures if same else together(models.changes, models.traces, means.seed)
    diagnosis = Diagnosis(
        name=name,
        model=kind,
        axis=recordings[0].axis,
        base_effects=effects,
        assumptions=tuple(assumptions),
        verdict=_with_law(_verdict(budget, seen, found, base, checks, term), law),
        budget=budget,
        tried=tried_effects(found),
        where=seen.where,
        pairs=seen.pairs,
        measures=measures,
        recordings=models.changes,
        traces=residual_traces(base.judge, found.base, models.fitted, seen.masses),
        checks=checks,
        force_scale="" if known_mass else "kg m^2" if recordings[0].axis == "rotary" else "kg",
        field_wavenumber=seen.field,
        seed=means.seed,
        combinations=base_combinations(models.result, known_mass),
        warnings=tuple(compared.before.warnings),
        friction_law=law,
        proposal=term,
        given=since is not None,
        changes=other_values,
    )
    return Found(diagnosis, compared.before, models.result, compared.traces_before, models.traces)


@dataclass(frozen=True)
class _Compared:
    """The models before and after, the measures and traces of every recording by both, those of all held-out ones."""

    before: FitResult
    after: FitResult
    changes: tuple[RecordingChange, ...]
    traces_before: tuple[Trace, ...]
    traces_after: tuple[Trace, ...]
    measures: dict[str, Change]


def _compared(
    base: Base, found: Selection, recordings: Sequence[Recording], means: Means, refining: Refining
) -> _Compared:
    before, after = refining.models(found, base.judge.balance.memory)
    changes, traces_before, traces_after = changes_of(recordings, before, after, means)
    measures = together(changes, traces_after, means.seed)
    return _Compared(before, after, changes, traces_before, traces_after, measures)


def _borne_out(
    base: Base,
    found: Selection,
    recordings: Sequence[Recording],
    means: Means,
    without: Sequence[str],
    refining: Refining,
) -> tuple[Selection, Shares, Sought | None, _Compared]:
    """The selection as `_led` leaves it, with what shows only beside its term, and what its models measure; without
    effects, where these bear them out nowhere. without: effects left out of consideration."""

    def sought(found: Selection, lead: Lead | None) -> Sought | None:
        return None if lead is None else sought_term(base.judge, found, lead, means, refining)

    refining.begin(found.best, base.judge.balance.memory)  # mostly the model after, whatever is found beside it
    found, shares, lead = _led(base, found, means)
    if lead is not None:
        screening = Screening(base.judge.fits, base.fitted, means.jobs, means.workers, without)
        more, lead = with_hidden_effects(base, screening, found, lead, shares.unexplained[0])
        if more is not found:
            found, shares = more, shares_of(base.judge, more.base, more.best, means.seed)
    term = sought(found, lead)
    compared = _compared(base, found, recordings, means, refining)
    if found.parts and worse_throughout(compared.measures):
        found, shares, lead = _led(base, with_effects_of(found, found.base), means)
        term = sought(found, lead)
        compared = _compared(base, found, recordings, means, refining)
    return found, shares, term, compared


def worse_throughout(measures: Mapping[str, Change]) -> bool:
    """Whether held-out recordings are predicted worse by every measure with the effects found than without: then these
    are none, whatever the balance of forces says of them. measures: over all held-out recordings."""
    return all(one.after > one.before for one in measures.values())


def _comparable(
    since: FitResult | None, kind: ModelKind, recordings: Sequence[Recording], known: dict[str, float]
) -> tuple[Recording, ...]:
    """The recordings with masses that can be compared: by a given model, else by what the fitted ones tell."""
    if since is None:
        return on_comparable_masses(kind, recordings, known)
    return comparable_recordings(since, recordings)


def _numbered(name: str, recordings: Sequence[Recording]) -> tuple[tuple[Recording, ...], list[Recording]]:
    """All recordings, numbered, and those to fit; raises UsageError where there are none, or none to judge by."""
    recordings = numbered(recordings)
    fitted = [r for r in recordings if r.split == "fit"]
    if not fitted or len(fitted) == len(recordings):
        raise UsageError(
            name,
            "has no held-out recordings" if fitted else "has no recordings to fit",
            "Mark some recordings `split: held_out` in the campaign, others `split: fit`",
        )
    return recordings, fitted


def _begun(
    recordings: Sequence[Recording],
    choices: tuple[str, Sequence[str], Sequence[str]],
    since: FitResult | None,
    known: dict[str, float],
    means: Means,
    assumptions: list[str],
    refining: Refining,
) -> tuple[Base, Selection, LawFinding | None]:
    """The base, identified or given, the effects beside it, and what is said of the law. choices: as in `_decided`."""
    if since is not None:
        return *_changed(since, recordings, choices[2], means, assumptions), None
    plain = fit_base_model(recordings, choices[0], known, means, assumptions)
    if not choices[1]:  # under LuGre and with nothing beside it, it mostly stays the model before
        refining.begin(plain.fitted, plain.judge.balance.memory)
    return _decided(plain, choices, known, means, assumptions)


def _mass_is_known(base: Base, known: dict[str, float], since: FitResult | None) -> bool:
    return "mass" in known or "mass" not in base.held if since is None else not since.per_mass


def _of_base(effects: Sequence[str], without: Sequence[str]) -> tuple[str, ...]:
    """The effects of the base; raises UsageError for names to be left out that the library lacks or the base has."""
    effects = canonical(effects)
    for name in without:
        if is_own(name):
            raise UsageError("--without", f"{name.partition(':')[0]} is a term of your own", "None but yours is tried.")
        find_effect(name, "--without")
        if name in effects:
            raise UsageError("--without", f"{name} is in the base by --effect", "Name it in one of them.")
    return effects


def _decided(
    plain: Base,
    choices: tuple[str, Sequence[str], Sequence[str]],
    known: dict[str, float],
    means: Means,
    assumptions: list[str],
) -> tuple[Base, Selection, LawFinding | None]:
    """The base with its friction law, the effects beside it, and what is said of the law. plain: the base under LuGre;
    choices: kind of the model, effects of the base, effects left out of consideration; assumptions: gains what these
    recordings do not tell of the law.
    """
    kind, effects, without = choices
    first, choice = base_with_law(plain, known)

    def selected(start: Base) -> Selection:
        screening = Screening(start.judge.fits, start.fitted, means.jobs, means.workers, without)
        return select(_with_effects(start, screening, kind, effects), screening, means.watch)

    base, found, choice = select_under_law(plain, first, choice, selected)
    if choice is not None and untold(choice):
        assumptions.append(untold(choice))
    return base, found, law_finding(base.judge, choice)


def _changed(
    since: FitResult, recordings: Sequence[Recording], without: Sequence[str], means: Means, assumptions: list[str]
) -> tuple[Base, Selection]:
    """A given model as the base, and the effects and changed parameters beside it."""
    base = commissioned_base(since, recordings, means, assumptions)
    screening = Screening(base.judge.fits, base.fitted, means.jobs, means.workers, without)
    found = select(base, screening, means.watch)
    return base, found if has_a_gap(base.judge, found) else with_effects_of(found, found.base)


def _with_effects(base: Base, screening: Screening, kind: str, effects: Sequence[str]) -> Base:
    """The base with effects that are known to be there; raises UsageError where one of them makes no sense."""
    if not effects:
        return base
    extended = fit_effects(base, screening, tuple(effects))
    if extended is None:
        raise UsageError(
            "--effect",
            f"one of {', '.join(effects)} makes no sense with the {kind} model and these recordings",
            "See what each needs: linid effects",
        )
    return replace(base, fitted=extended, rivals=())


def _led(base: Base, found: Selection, means: Means) -> tuple[Selection, Shares, Lead | None]:
    """The selection with its shares and, where a gap stays, the term that the recordings ask for; without the effects
    in whose stead the term acts."""
    shares = shares_of(base.judge, found.base, found.best, means.seed)
    means.tell(so_far({name: one.share for name, one in shares.portions.items()}, shares.unexplained[0]))
    lead = lead_of(base, found, shares.unexplained[0], means)
    if lead is not None and lead.start is not found.best:
        found = with_effects_of(found, lead.start)
        shares = shares_of(base.judge, found.base, found.best, means.seed)
    return found, shares, lead


def _verdict(
    budget: Budget,
    seen: Seen,
    found: Selection,
    base: Base,
    checks: Sequence[RecordingChecks],
    term: ProposedTerm | None,
) -> Verdict:
    """The verdict, with the waves of a periodic effect and the recording to make next."""
    screened = [(s.name, s.trial.explained) for s in found.screened]
    axis = base.judge.balance.recordings[0].axis
    verdict = decide(budget, seen.where, screened, seen.motion, checks, axis, term)
    words = _waves(found.best, axis, seen.field)
    following = _next_experiment(verdict.next_experiment, budget, found, base.judge, base, seen.field)
    return replace(verdict, sentence=verdict.sentence + words, next_experiment=following)


def _with_law(verdict: Verdict, law: LawFinding | None) -> Verdict:
    """The verdict with what is said of the friction law before the rest."""
    if law is None or not law.sentence:
        return verdict
    return replace(verdict, sentence=f"{law.sentence} {verdict.sentence}")


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
    best = replace(found.best, model=found.best.model.with_effects(order))
    ranking = prospects(
        best,
        rival,
        [balance.recordings[k] for k in fitted],
        judge.scale[fitted],
        experiments(base.fitted.model.with_effects(()), base.fitted.vector, span, driven[0]),
        balance.jobs,
    )
    noise = float(np.median(judge.noise.deviation(rows)))
    return advice(budget, ranking[0], noise, balance.recordings[0].axis)
