"""Selection: base and effects are identified together, as many effects as pay, each judged with all others there.

Forward steps on the fitted rows only propose what lessens the criterion most. The tests stand at the end, on held-out
rows: each effect is taken out, the others are fitted again, and what then comes back must be beyond doubt and a share
of what no effect here explains. What fails goes, the weakest first.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from linid.diagnosis.base import Base
from linid.diagnosis.descent import THOROUGH
from linid.diagnosis.foretold import idle
from linid.diagnosis.held_out_tests import CERTAINTY, LEAST_CERTAINTY, LEAST_GAIN, Part, is_trifle, stands
from linid.diagnosis.joint import Fitted, JointFit
from linid.diagnosis.judge import Evidence, Judge, compare
from linid.diagnosis.look_alikes import look_alike, simpler_than
from linid.diagnosis.marks import elsewhere, in_all
from linid.diagnosis.screen import LEAST_CONTRAST, Screened, Screening
from linid.diagnosis.shares import shares_of
from linid.diagnosis.steps_of_selection import again, extended, foretold_without, settled, without_effect
from linid.parallel_tasks import in_parallel
from linid.physics.effects.registry import find_effect

# What a forward step asks for, on the fitted rows: certainty and gain in log power per row.
PROPOSED_CERTAINTY, PROPOSED_GAIN, CLEAR_GAIN = 2.5, 0.004, 0.1
_SHARED = 4.0  # rows that say about as much as one
LARGEST = 10  # effects in one model
RENEWALS = 4  # times that all effects are found anew
REVIVALS = 2  # times that all effects are tried again, once what hid them is gone
# Candidates fitted per step, and the share of the best's screening that they need: so many the first time, and so many
# more each time that none of them was any good. Last of all what regressions promise little of is tried too.
CONTENDERS, CONTENDING = 3, (0.5, 0.3, 0.05)
# A push must explain so many times as much as pushes at other moments do.
LEAST_LEAD = 4.0
MOMENTS_GAIN = 0.006  # of the log power, by regression, of a push that does not stand out where it is
# A look-alike must keep this share of an effect's gain to be as good, and explain this one by regression to be fitted.
ALIKE, ALIKE_SCREENED = 0.7, 0.3
RENEWED = 0.7  # of an effect's gain: what a regression must promise elsewhere in its shape, to try it there


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
    steps = [step, *(fits.at(step.model, values, {}, step.recordings) for values in base.rivals)]
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
    fits: JointFit,
    screening: Screening,
    screened: Sequence[tuple[Fitted, Sequence[Screened]]],
    watch: Watch,
    number: int,
) -> Fitted | None:
    """The first step's model with the effect that lessens the criterion most, None if none does beyond doubt.

    screened: steps to start from, each with what was found there.
    """
    before = screened[0][0]
    tried: set[str] = set()
    for number_of, share in enumerate(CONTENDING, 1):
        items = [
            (step, one)
            for step, found in screened
            for one in contenders(found, share, number_of * CONTENDERS)
            if one.name not in tried
        ]
        best = _best_of(fits, screening, before, items, watch, number)
        if best is not None:
            return best
        tried |= {one.name for _, one in items}
    return None


def _best_of(
    fits: JointFit,
    screening: Screening,
    before: Fitted,
    items: Sequence[tuple[Fitted, Screened]],
    watch: Watch,
    number: int,
) -> Fitted | None:
    """The model of the candidates that lessens the criterion most, None if none does beyond doubt."""
    able: list[tuple[Evidence, Fitted]] = []
    models = in_parallel(partial(extended, fits, screening), items, screening.jobs, screening.workers)
    for number_fitted, ((_, item), one) in enumerate(models, 1):
        evidence = gained(fits, before, one)
        # A moment has no other blocks that could vouch for it: its lead over other moments did.
        moment = find_effect(item.name).acts == "one"
        if evidence.gain >= _least(item, PROPOSED_GAIN) and (moment or worth_proposing(evidence)):
            able.append((evidence, one))
        watch(f"fit effect {number + 1}", number_fitted, len(items))
    if not able:
        return None
    best = max(able, key=lambda pair: pair[0].gain - price(fits, pair[1]))[1]
    return settled(fits, best)


def price(fits: JointFit, one: Fitted) -> float:
    """What the parameters of a model cost in log power per row (Schwarz 1978, Ann. Stat. 6, 461): of two effects that
    explain as much, the simpler one goes first. Neighbouring rows share their samples."""
    count = max(float(np.count_nonzero(fits.rows_of(one.recordings))) / _SHARED, 2.0)
    return len(fits.unknowns(one)) * math.log(count) / count


def worth_proposing(evidence: Evidence) -> bool:
    """Whether a gain on fitted rows is sure enough, or so large that few blocks of unlike size are no doubt."""
    clear = evidence.gain >= CLEAR_GAIN and evidence.certainty >= LEAST_CERTAINTY
    return clear or evidence.certainty >= PROPOSED_CERTAINTY


def contenders(found: Sequence[Screened], share: float, most: int = CONTENDERS) -> list[Screened]:
    """The screened effects that are worth a fit: at most so many, which explain that share of the best one at least."""
    able = [s for s in found if s.trial.explained > _promised(s) and s.trial.lead >= LEAST_LEAD]
    if not able:
        return []
    return [s for s in able if s.gain >= share * able[0].gain][:most]


def _promised(one: Screened) -> float:
    """Share of the log power that a regression must promise: of thousands of moments one always explains something."""
    return _least(one, MOMENTS_GAIN if find_effect(one.name).acts == "one" else 0.5 * PROPOSED_GAIN)


def _least(one: Screened, otherwise: float) -> float:
    """Log power per row that an effect must take: none where it is a push that stands out where it is, which takes the
    less of a campaign the longer that is."""
    return 0.0 if one.trial.contrast >= LEAST_CONTRAST else otherwise


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
        step = settled(fits, step)
    return again(fits, step, screening.to_fit(step), THOROUGH) if effects else step


def gained(fits: JointFit, step: Fitted, one: Fitted) -> Evidence:
    """What a model gains over the step before, on the rows that it is fitted to."""
    return compare(fits, step, one, fits.rows_of(one.recordings))


def backward(
    judge: Judge, screening: Screening, base: Fitted, full: Fitted, screened: tuple[Screened, ...]
) -> Selection:
    """The effects beyond the base's that stand the tests with all others there; what fails goes, the weakest first."""
    fits = judge.fits
    dropped: dict[str, Part] = {}
    revivals = renewals = 0
    anew: frozenset[str] = frozenset()  # effects that were last found anew
    again_found: set[str] = set()  # effects that were found anew before they went
    failed: set[tuple[frozenset[str], str]] = set()  # effects of a model, and which of them failed there
    while True:
        full = again(fits, full, screening.to_fit(full), THOROUGH)
        fits.slopes(full)  # once, before the threads that start from them
        added = [name for name in full.model.effects if name not in base.model.effects]
        weakest = _weak(judge, base, full, added, screening.jobs)
        if weakest is not None:
            better = None
            if weakest.name not in again_found:
                again_found.add(weakest.name)
                better = renewed(fits, screening, full, [weakest])
            if better is None:
                dropped[weakest.name] = weakest
                failed.add((frozenset(full.model.effects), weakest.name))
            full = weakest.without if better is None else better
            continue
        parts = [p for _, p in in_parallel(partial(part_of, judge, base, full), added, screening.jobs)]
        # What was found beside effects that have gone since is found once more beside those that stay.
        due = renewals < RENEWALS or (frozenset(added) != anew and all(stands(part) for part in parts))
        better = renewed(fits, screening, full, parts) if due else None
        renewals, anew = renewals + 1, frozenset(added) if due else anew
        if better is not None:
            full = better
            continue
        failing = [p for p in parts if not stands(p)] or trifling(judge, base, full, parts) or idle(judge, full, parts)
        if failing:
            weakest = min(failing, key=lambda p: p.evidence.closed)
            dropped[weakest.name] = weakest
            failed.add((frozenset(full.model.effects), weakest.name))
            full = weakest.without
            continue
        full, rivals, changed = contested(judge, screening, full, parts)
        if changed:
            continue
        back = revived(judge, screening, full, failed) if revivals < REVIVALS else None
        revivals += 1
        if back is None:
            ordered = tuple(sorted(parts, key=lambda p: -p.evidence.gain))
            left = tuple(part for name, part in dropped.items() if name not in full.model.effects)
            return Selection(base, full if ordered else base, ordered, screened, left, rivals)
        full = back


def _weak(judge: Judge, base: Fitted, full: Fitted, added: Sequence[str], jobs: int) -> Part | None:
    """The weakest effect of a model of those that fail the tests even by what slopes foretell, if it does fail."""
    foretold = in_parallel(lambda name, _: foretold_without(judge.fits, full, name), added, jobs)
    parts = [_part(judge, base, full, name, without) for name, without in foretold]
    for weak in sorted((p for p in parts if not stands(p)), key=lambda p: p.evidence.closed):
        part = part_of(judge, base, full, weak.name, 1)
        if not stands(part):
            return part
    return None


def trifling(judge: Judge, base: Fitted, full: Fitted, parts: Sequence[Part]) -> list[Part]:
    """The effects of a model that stand the tests and take next to nothing of the gap."""
    if len(parts) < 2:  # alone, it is all there is
        return []
    portions = shares_of(judge, base, full, judge.seed).portions
    return [part for part in parts if is_trifle(part, portions[part.name].share)]


def revived(
    judge: Judge, screening: Screening, full: Fitted, failed: Container[tuple[frozenset[str], str]] = ()
) -> Fitted | None:
    """The model with one more effect that stands the tests, now that what hid it is gone; None if there is none.
    failed: effects of a model, and which of them failed there, to be tried no more."""
    found: list[tuple[float, Fitted]] = []
    # A single moment had its say in the forward steps, where its lead over others was told before much was fitted.
    lasting = [s for s in screening.screen(full) if find_effect(s.name).acts != "one"]
    others = full.model.effects
    untried = [s for s in contenders(lasting, CONTENDING[1]) if (frozenset((*others, s.name)), s.name) not in failed]
    items = [(full, item) for item in untried]
    more_of = in_parallel(partial(extended, judge.fits, screening), items, screening.jobs, screening.workers)
    fitted = [(item.name, one) for (_, item), one in more_of]
    for (name, _), more in in_parallel(lambda pair, _: settled(judge.fits, pair[1]), fitted, screening.jobs):
        evidence = compare(judge.fits, full, more, judged(judge, more, name))
        part = Part(name, evidence, full)
        if stands(part) and not idle(judge, more, [part]):
            found.append((evidence.gain, more))
    return max(found, key=lambda pair: pair[0])[1] if found else None


def part_of(judge: Judge, base: Fitted, full: Fitted, name: str, jobs: int) -> Part:
    """An effect of a model with what its absence costs on the rows that can tell."""
    del jobs
    return _part(judge, base, full, name, without_effect(judge.fits, full, name))


def _part(judge: Judge, base: Fitted, full: Fitted, name: str, without: Fitted) -> Part:
    rows = judged(judge, full, name)
    evidence = compare(judge.fits, without, full, rows)
    whole = compare(judge.fits, base, full, rows)
    share = evidence.power / max(whole.power, abs(evidence.power), 1e-300)
    return Part(name, evidence, without, share, evidence.gain / max(whole.gain, abs(evidence.gain), 1e-300))


def judged(judge: Judge, full: Fitted, name: str) -> NDArray[np.bool_]:
    """The rows (n,) on which an effect of a model is tested: a moment shows in its own recordings or nowhere."""
    values = {**full.values, **full.preset}
    if find_effect(name).acts == "one":
        return judge.rows_of(name, values)
    return judge.rows(full.model.effects, values)


def contested(
    judge: Judge, screening: Screening, full: Fitted, parts: Sequence[Part]
) -> tuple[Fitted, dict[str, tuple[tuple[str, Fitted], ...]], bool]:
    """Each effect weighed against those that could stand in for it, with all others there.

    Returns the model, per effect those that would do as well, and whether the model has changed: a simpler
    form that does as well takes the place of a fuller one, and a look-alike that does clearly better that of any.
    """
    fits = judge.fits
    rivals: dict[str, tuple[tuple[str, Fitted], ...]] = {}
    # Without the force that a loop cancels, anything that takes the input's thrust away looks like a cause.
    caught = bool(fits.coordinates.limits) and len(parts) == 1
    for part in parts:
        rows = judge.rows(full.model.effects, {**full.values, **full.preset})
        gain = part.without.level - full.level
        simpler = simpler_than(part.name, bool(fits.coordinates.told))
        found = [
            s
            for s in screening.screen(part.without)
            if s.name not in full.model.effects
            and (not caught or find_effect(s.name).force is not None)
            and (s.name in simpler or (s.gain >= ALIKE_SCREENED * gain and s.trial.lead >= LEAST_LEAD))
        ]
        found = sorted(found, key=lambda s: (s.name not in simpler, -s.gain))[: len(simpler) + CONTENDERS]
        left = []
        items = [(part.without, item) for item in found]
        for (_, item), instead in in_parallel(partial(_instead, fits, screening), items, screening.jobs):
            worse = compare(fits, instead, full, rows)
            if worse.certainty <= -CERTAINTY and worse.gain <= -LEAST_GAIN:
                return instead, {}, True
            if worse.certainty < CERTAINTY and worse.gain < (1.0 - ALIKE) * part.evidence.gain:
                if item.name in simpler:
                    return instead, {}, True
                if look_alike(part.name, item.name):
                    left.append((item.name, instead))
        if left:
            rivals[part.name] = tuple(left)
    return full, rivals, False


def _instead(fits: JointFit, screening: Screening, item: tuple[Fitted, Screened], jobs: int) -> Fitted:
    return settled(fits, extended(fits, screening, item, jobs))


def renewed(fits: JointFit, screening: Screening, full: Fitted, parts: Sequence[Part]) -> Fitted | None:
    """The model with one of its effects found anew, with all others there, where that is better; None if none is.

    An effect that came while others were missing may sit in a wrong valley of its shape or in wrong recordings.
    """
    lasting = [part for part in parts if find_effect(part.name).acts != "one"]
    items = []
    for part, own in in_parallel(
        lambda part, _: screening.screen(part.without, only=[part.name]), lasting, screening.jobs
    ):
        gain = part.without.level - full.level
        items += [(part.without, s) for s in own if s.gain >= RENEWED * gain or elsewhere(full, s)]
        everywhere = in_all(full, part.name, screening.recordings) if fits.coordinates.told else ()
        items += [(part.without, s) for s in everywhere]
    found = in_parallel(partial(extended, fits, screening), items, screening.jobs, screening.workers)
    near = [(item.name, one) for (_, item), one in found if one.level < full.level + LEAST_GAIN]
    better: list[tuple[float, Fitted]] = []
    for (name, _), one in in_parallel(lambda pair, _: settled(fits, pair[1]), near, screening.jobs):
        # That an effect acts in a held-out recording too shows there alone.
        some = find_effect(name).acts == "some"
        rows = fits.rows_of(range(len(screening.recordings)) if some else one.recordings)
        better.append((compare(fits, full, one, rows).gain, one))
    gain, one = max(better, key=lambda pair: pair[0], default=(0.0, full))
    return one if gain >= PROPOSED_GAIN else None
