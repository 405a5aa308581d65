"""Selection: base and effects are identified together, as many effects as pay, each judged with all others there.

Forward steps on the fitted rows only propose: they add what lessens the criterion most, until nothing does. The tests
stand at the end, on held-out rows: each effect is taken out, the others are fitted again, and what then comes back must
be beyond doubt and a share of what no effect here explains. What fails goes, the weakest first.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from linid.diagnosis.base import Base
from linid.diagnosis.joint import QUICK, SETTLING, THOROUGH, Fitted, JointFit
from linid.diagnosis.judge import Evidence, Judge, compare
from linid.diagnosis.screen import Screened, Screening
from linid.diagnosis.side_by_side import side_by_side
from linid.physics.effects.registry import EFFECTS, find_effect
from linid.physics.model import Model

# What a forward step asks for, on the fitted rows: certainty and gain in log power per row.
PROPOSED_CERTAINTY, PROPOSED_GAIN, CLEAR_GAIN = 2.5, 0.004, 0.1
_SHARED = 4.0  # rows that say about as much as one
LARGEST = 10  # effects in one model
CONTENDERS, CONTENDING = 3, 0.5  # candidates fitted per step, and the share of the best's screening that they need
# A push must explain so many times as much as pushes at other moments do.
LEAST_LEAD = 4.0
MOMENTS_GAIN = 0.006  # of the log power, by regression: of thousands of moments one always explains something
# A look-alike must keep this share of an effect's gain to be as good, and explain this one by regression to be fitted.
ALIKE, ALIKE_SCREENED = 0.7, 0.5
# The tests on held-out rows.
# An effect must be the surer the less it closes: where it closes nearly all, blocks that differ in size are no doubt.
CERTAINTY, LEAST_CERTAINTY = 3.0, 1.0
LEAST_GAIN = 0.01
LEAST_CLOSED, MOST_OF_POWER = 0.15, 0.5
# Effects of single recordings fit themselves to much: of what they leave they must close more.
LEAST_CLOSED_ALONE = 0.4
LEAST_POWER_ALONE = 0.3  # floors in the power of the judged rows: a recording without a gap has nothing unlogged in it


@dataclass(frozen=True)
class Part:
    """An effect of the final model with what its absence costs; without: the model fitted again without it."""

    name: str
    evidence: Evidence
    without: Fitted


@dataclass(frozen=True)
class Selection:
    """base: the model without effects; best: with all that stood the tests; parts: these, the largest gain first;
    screened: effects with the share of the base's log power that each explains alone, best first; dropped: proposed
    effects that failed the tests, with their evidence; rivals: per effect of `best` those that would do as well, with
    the model that has them instead."""

    base: Fitted
    best: Fitted
    parts: tuple[Part, ...]
    screened: tuple[Screened, ...]
    dropped: tuple[Part, ...]
    rivals: dict[str, tuple[tuple[str, Fitted], ...]]


Watch = Callable[[str, int, int], None]


def with_effect(model: Model, name: str) -> Model:
    """The model with one effect more, or the same if it is there."""
    return model if name in model.effects else Model(model.kind, (*model.effects, name))


def structural_of(model: Model, values: Mapping[str, float]) -> dict[str, float]:
    """What of a model's effects is not searched, given their values."""
    out: dict[str, float] = {}
    for name in model.effects:
        out |= find_effect(name).held(dict(values))
    return out


def extended(fits: JointFit, screening: Screening, item: tuple[Fitted, Screened], jobs: int) -> Fitted:
    """A model with one effect more, identified together."""
    del jobs
    step, found = item
    model = with_effect(step.model, found.name)
    values = {**step.values, **found.trial.values, **found.trial.amplitudes}
    structural = structural_of(model, {**step.structural, **values})
    recordings = screening.to_fit(step, found.name, {**step.structural, **values})
    return fits.fit(model, values, structural, recordings, QUICK, fits.slopes(step))


def without_effect(fits: JointFit, full: Fitted, name: str) -> Fitted:
    """The model without one of its effects, fitted again to the same recordings."""
    model = Model(full.model.kind, tuple(e for e in full.model.effects if e != name))
    own = {p.name for p in model.parameters}
    values = {k: x for k, x in full.values.items() if k in own}
    structural = {k: x for k, x in full.structural.items() if k in own}
    return fits.fit(model, values, structural, full.recordings, SETTLING, fits.slopes(full))


def select(base: Base, screening: Screening, watch: Watch) -> Selection:
    """As many effects as pay, added to the base one at a time and tested together at the end."""
    full, screened = forward(base, screening, watch)
    return backward(base.judge, screening, base.fitted, full, screened)


def forward(base: Base, screening: Screening, watch: Watch) -> tuple[Fitted, tuple[Screened, ...]]:
    """The model with all effects that the fitted rows propose, and what the first step screened."""
    fits = base.judge.fits
    step = base.fitted
    # A base that is caught in a wrong place, as where a loop's input cancels what is missing, shows little of it: the
    # first step also starts from where a regression beside a free periodic force puts the base.
    steps = [step, *(fits.at(step.model, values, step.recordings) for values in base.rivals)]
    first: tuple[Screened, ...] = ()
    for number in range(LARGEST):
        told = partial(watch, f"screen effect {number + 1}")
        screened = [screening.screen(one, told) for one in steps]
        first = first or screened[0]
        if number == 0 and fits.coordinates.limits:
            # What a loop has cancelled is a force; an effect that takes the input's thrust away would only hide it.
            screened = [tuple(s for s in found if find_effect(s.name).force is not None) for found in screened]
        best = proposed(fits, screening, list(zip(steps, screened, strict=True)), watch, number)
        if best is None:
            break
        steps = [best]
        step = best
    return step, first


def proposed(
    fits: JointFit, screening: Screening, screened: Sequence[tuple[Fitted, Sequence[Screened]]], watch: Watch,
    number: int,
) -> Fitted | None:  # fmt: skip
    """The first step's model with the effect that lessens the criterion most, None if none does beyond doubt.

    screened: steps to start from, each with what was found there.
    """
    items = [(step, one) for step, found in screened for one in contenders(found)]
    if not items:
        return None
    before = screened[0][0]
    fitted: list[tuple[Evidence, Fitted, bool]] = []
    for (_, item), one in side_by_side(partial(extended, fits, screening), items, screening.jobs, screening.workers):
        # A moment has no other blocks that could vouch for it: its lead over other moments did.
        fitted.append((gained(fits, before, one), one, find_effect(item.name).acts == "one"))
        watch(f"fit effect {number + 1}", len(fitted), len(items))
    able = [(evidence, one) for evidence, one, moment in fitted if moment or worth_proposing(evidence)]
    able = [pair for pair in able if pair[0].gain >= PROPOSED_GAIN]
    return max(able, key=lambda pair: pair[0].gain - price(fits, pair[1]))[1] if able else None


def price(fits: JointFit, one: Fitted) -> float:
    """What the parameters of a model cost in log power per row (Schwarz 1978, Ann. Stat. 6, 461): of two effects that
    explain as much, the simpler one goes first. Neighbouring rows share their samples."""
    count = max(float(np.count_nonzero(fits.rows_of(one.recordings))) / _SHARED, 2.0)
    return len(fits.unknowns(one)) * math.log(count) / count


def worth_proposing(evidence: Evidence) -> bool:
    """Whether a gain on fitted rows is sure enough, or so large that few blocks of unlike size are no doubt."""
    clear = evidence.gain >= CLEAR_GAIN and evidence.certainty >= LEAST_CERTAINTY
    return clear or evidence.certainty >= PROPOSED_CERTAINTY


def contenders(found: Sequence[Screened]) -> list[Screened]:
    """The screened effects that are worth a fit: those that explain nearly as much as the best one."""
    able = [
        s for s in found
        if s.trial.explained > (MOMENTS_GAIN if find_effect(s.name).acts == "one" else 0.5 * PROPOSED_GAIN)
        and s.trial.lead >= LEAST_LEAD
    ]  # fmt: skip
    if not able:
        return []
    return [s for s in able if s.gain >= CONTENDING * able[0].gain][:CONTENDERS]


def fit_effects(base: Base, screening: Screening, effects: Sequence[str]) -> Fitted | None:
    """The base with exactly these effects; None if one makes no sense here.

    One after the other, each started where it explains most of what the others have left, the strongest first.
    """
    fits, step = base.judge.fits, base.fitted
    while missing := [name for name in effects if name not in step.model.effects]:
        found = screening.screen(step, only=missing)
        if {s.name for s in found} != set(missing):
            return None
        step = extended(fits, screening, (step, found[0]), screening.jobs)
        step = fits.fit(step.model, step.values, step.structural, step.recordings, SETTLING)
    return fits.fit(step.model, step.values, step.structural, screening.to_fit(step), THOROUGH) if effects else step


def gained(fits: JointFit, step: Fitted, one: Fitted) -> Evidence:
    """What a model gains over the step before, on the rows that it is fitted to."""
    return compare(fits, step, one, fits.rows_of(one.recordings))


def backward(
    judge: Judge, screening: Screening, base: Fitted, full: Fitted, screened: tuple[Screened, ...]
) -> Selection:
    """The effects beyond the base's that stand the tests with all others there; what fails goes, the weakest first."""
    fits = judge.fits
    dropped: list[Part] = []
    while full.model.effects != base.model.effects:
        full = fits.fit(full.model, full.values, full.structural, screening.to_fit(full), THOROUGH)
        fits.slopes(full)  # once, before the threads that start from them
        added = [name for name in full.model.effects if name not in base.model.effects]
        parts = [part for _, part in side_by_side(partial(part_of, judge, full), added, screening.jobs)]
        failing = [p for p in parts if not stands(p)]
        if not failing:
            full, rivals, changed = contested(judge, screening, full, parts)
            if changed:
                continue
            ordered = tuple(sorted(parts, key=lambda p: -p.evidence.gain))
            return Selection(base, full, ordered, screened, tuple(dropped), rivals)
        weakest = min(failing, key=lambda p: p.evidence.closed)
        dropped.append(weakest)
        full = weakest.without
    return Selection(base, base, (), screened, tuple(dropped), {})


def part_of(judge: Judge, full: Fitted, name: str, jobs: int) -> Part:
    """An effect of a model with what its absence costs on the rows that can tell."""
    del jobs
    without = without_effect(judge.fits, full, name)
    values = {**full.values, **full.structural}
    rows = judge.rows(full.model.effects, values)
    if find_effect(name).acts == "one":  # a moment shows in its own recordings or nowhere
        rows = judge.rows_of(name, values)
    return Part(name, compare(judge.fits, without, full, rows), without)


def contested(
    judge: Judge, screening: Screening, full: Fitted, parts: Sequence[Part]
) -> tuple[Fitted, dict[str, tuple[tuple[str, Fitted], ...]], bool]:
    """Each effect weighed against those that look alike, with all others there.

    Returns the model, per effect those that would do as well, and whether the model has changed: a simpler
    form that does as well takes the place of a fuller one, and a look-alike that does clearly better that of any.
    """
    fits = judge.fits
    rivals: dict[str, tuple[tuple[str, Fitted], ...]] = {}
    for part in parts:
        alike = look_alikes(part.name, full.model)
        if not alike:
            continue
        rows = judge.rows(full.model.effects, {**full.values, **full.structural})
        gain = part.without.level - full.level
        simpler = find_effect(part.name).includes
        found = [
            s for s in screening.screen(part.without, only=alike)
            if s.name in simpler
            or (s.gain >= ALIKE_SCREENED * gain and s.trial.lead >= LEAST_LEAD)
        ]  # fmt: skip
        left = []
        for item in found:
            instead = extended(fits, screening, (part.without, item), 1)
            instead = fits.fit(instead.model, instead.values, instead.structural, instead.recordings, SETTLING)
            worse = compare(fits, instead, full, rows)
            if worse.certainty <= -CERTAINTY and worse.gain <= -LEAST_GAIN:
                return instead, {}, True
            if worse.certainty < CERTAINTY and worse.gain < (1.0 - ALIKE) * part.evidence.gain:
                if item.name in simpler:
                    return instead, {}, True
                if part.name not in find_effect(item.name).includes:
                    left.append((item.name, instead))
        if left:
            rivals[part.name] = tuple(left)
    return full, rivals, False


def look_alikes(name: str, model: Model) -> tuple[str, ...]:
    """Effects that say they look like this one, or it like them, and are not in the model."""
    own = find_effect(name)
    near = {*own.confused_with, *own.includes}
    near |= {e.name for e in EFFECTS if name in (*e.confused_with, *e.includes)}
    return tuple(e.name for e in EFFECTS if e.name in near and e.name not in model.effects)


def stands(part: Part) -> bool:
    """Whether an effect stands the tests on held-out rows."""
    e = part.evidence
    # A single moment has no other blocks that could vouch for it: its lead over other moments did.
    effect = find_effect(part.name)
    least = max(LEAST_CERTAINTY, CERTAINTY * (1.0 - e.closed))
    sure = e.certainty >= least or effect.acts == "one"
    if effect.per_recording:
        return sure and e.gain >= LEAST_GAIN and e.closed >= LEAST_CLOSED_ALONE and e.power >= LEAST_POWER_ALONE
    # Where the floor is far below what any model reaches, the logarithm is large for ever: then the power speaks.
    most = e.power_closed >= MOST_OF_POWER and e.certainty >= CERTAINTY
    return e.gain >= LEAST_GAIN and (most or (sure and e.closed >= LEAST_CLOSED))
