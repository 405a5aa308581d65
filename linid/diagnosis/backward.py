"""Backward selection: effects are tested with all others there, and what fails goes, the weakest first."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from linid.diagnosis.descent import THOROUGH
from linid.diagnosis.foretold import idle
from linid.diagnosis.forward import CONTENDERS, CONTENDING, LEAST_LEAD, PROPOSED_GAIN, contenders, gained
from linid.diagnosis.held_out_tests import CERTAINTY, LEAST_GAIN, Part, stands
from linid.diagnosis.joint import FAR, Fitted, JointFit
from linid.diagnosis.judge import Judge, compare
from linid.diagnosis.look_alikes import look_alike, simpler_than
from linid.diagnosis.marks import elsewhere, in_all, in_place
from linid.diagnosis.parts import judged, part_of, trifling, weakest
from linid.diagnosis.screen import Screened, Screening
from linid.diagnosis.steps_of_selection import annealed, extended, further, nearly_without, settled
from linid.parallel_tasks import in_parallel
from linid.physics.effects.registry import find_effect

RENEWALS = 4  # times that all effects are found anew while that betters the same ones
REVIVALS = 2  # times that all effects are tried again, once what hid them is gone
# A look-alike must keep this share of an effect's gain to be as good, and explain this one by regression to be fitted.
ALIKE, ALIKE_SCREENED = 0.7, 0.3
RENEWED = 0.7  # of an effect's gain: what a regression must promise elsewhere in its shape, to try it there


@dataclass(frozen=True)
class Standing:
    """A model whose effects all stand their tests. parts: these; rivals: per effect those that would do as well, with
    the model that has them instead."""

    full: Fitted
    parts: tuple[Part, ...]
    rivals: dict[str, tuple[tuple[str, Fitted], ...]]


class Backward:
    """What a backward selection has tried. base: the model without effects; dropped: effects that failed their tests,
    with their evidence."""

    def __init__(self, judge: Judge, screening: Screening, base: Fitted) -> None:
        self.judge, self.screening, self.base = judge, screening, base
        self.dropped: dict[str, Part] = {}
        self._failed: set[tuple[frozenset[str], str]] = set()  # effects of a model, and which of them failed there
        self._saved: set[str] = set()  # effects that were found anew before they went
        self._in_place: frozenset[str] = frozenset()  # effects that do no better elsewhere
        self._renewals = 0

    def run(self, full: Fitted) -> Standing:
        """The effects of a model that stand the tests with all others there, and what only shows beside these."""
        standing = self._stand(full, None)
        for _ in range(REVIVALS):
            back = revived(self.judge, self.screening, standing.full, self._failed)
            if back is None:
                break
            standing = self._stand(back, standing)
        return standing

    def _stand(self, full: Fitted, before: Standing | None) -> Standing:
        """The effects of a model that stand the tests; before: those that did without its last one."""
        judge, screening, fits = self.judge, self.screening, self.judge.fits
        softened: frozenset[str] = frozenset()
        while True:
            full = further(fits, full, screening.to_fit(full), THOROUGH)
            fits.slopes(full)  # once, before the threads that start from them
            added = [name for name in full.model.effects if name not in self.base.model.effects]
            names = frozenset(added)
            if before is not None and names == {part.name for part in before.parts}:
                return before
            weak = weakest(judge, self.base, full, added, screening.jobs)
            if weak is not None:
                full = self._saved_or_gone(full, weak)
                continue
            if full.level > FAR and names != softened:
                full, softened = annealed(fits, full, THOROUGH), names
                continue
            better = self._elsewhere(full, added)
            if better is not None:
                full = better
                continue
            parts = [p for _, p in in_parallel(partial(part_of, judge, self.base, full), added, screening.jobs)]
            failing = [p for p in parts if not stands(p)]
            failing = failing or trifling(judge, self.base, full, parts) or idle(judge, full, parts)
            if failing:
                full = self._gone(full, min(failing, key=lambda p: p.without.level))
                continue
            full, rivals, changed = contested(judge, screening, full, parts)
            if not changed:
                return Standing(full, tuple(parts), rivals)
            self._in_place = frozenset(full.model.effects) - frozenset(self.base.model.effects)

    def _gone(self, full: Fitted, weak: Part) -> Fitted:
        """The model without an effect that has failed its tests."""
        self.dropped[weak.name] = weak
        self._failed.add((frozenset(full.model.effects), weak.name))
        return weak.without

    def _saved_or_gone(self, full: Fitted, weak: Part) -> Fitted:
        """The model with an effect that is weak found anew, once, where that is better, or without it."""
        better = None
        if weak.name not in self._saved:
            self._saved.add(weak.name)
            better = renewed(self.judge.fits, self.screening, full, {weak.name: weak.without})
        return self._gone(full, weak) if better is None else better

    def _elsewhere(self, full: Fitted, added: Sequence[str]) -> Fitted | None:
        """The model with an effect where it does better; None if none does: what was found beside effects that have
        gone since is found once more beside those that stay."""
        if self._in_place == frozenset(added):
            return None
        fits = self.judge.fits
        without = dict(in_parallel(lambda name, _: nearly_without(fits, full, name), added, self.screening.jobs))
        better = renewed(fits, self.screening, full, without)
        self._renewals += 1
        if better is None or self._renewals >= RENEWALS:
            self._in_place = frozenset(added)
        return better


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
        # What gains nothing where it is fitted has moved what these rows do not tell.
        told = gained(judge.fits, full, more).gain >= PROPOSED_GAIN
        if told and stands(part) and not idle(judge, more, [part]):
            found.append((evidence.gain, more))
    return max(found, key=lambda pair: pair[0])[1] if found else None


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
    able = in_parallel(lambda part, _: _stand_ins(screening, full, part, caught), parts, screening.jobs)
    items = [(part, item) for part, found in able for item in found]
    rows = judge.rows(full.model.effects, {**full.values, **full.preset})
    for (part, item), instead in in_parallel(partial(_instead, fits, screening), items, screening.jobs):
        worse = compare(fits, instead, full, rows)
        simpler = item.name in simpler_than(part.name, bool(fits.coordinates.told))
        as_good = worse.certainty < CERTAINTY and worse.gain < (1.0 - ALIKE) * part.evidence.gain
        if (worse.certainty <= -CERTAINTY and worse.gain <= -LEAST_GAIN) or (as_good and simpler):
            return instead, {}, True
        if as_good and look_alike(part.name, item.name):
            rivals[part.name] = (*rivals.get(part.name, ()), (item.name, instead))
    return full, rivals, False


def _stand_ins(screening: Screening, full: Fitted, part: Part, caught: bool) -> list[Screened]:
    """What could stand in for an effect of a model, by regression: simpler forms first; caught: only what is a force
    could."""
    gain = part.without.level - full.level
    simpler = simpler_than(part.name, bool(screening.fits.coordinates.told))
    found = [
        s
        for s in screening.screen(part.without)
        if s.name not in full.model.effects
        and (not caught or find_effect(s.name).force is not None)
        and (s.name in simpler or (s.gain >= ALIKE_SCREENED * gain and s.trial.lead >= LEAST_LEAD))
    ]
    return sorted(found, key=lambda s: (s.name not in simpler, -s.gain))[: len(simpler) + CONTENDERS]


def _instead(fits: JointFit, screening: Screening, item: tuple[Part, Screened], jobs: int) -> Fitted:
    part, other = item
    return settled(fits, extended(fits, screening, (part.without, other), jobs))


def renewed(fits: JointFit, screening: Screening, full: Fitted, without: Mapping[str, Fitted]) -> Fitted | None:
    """The model with one of its effects found anew, with all others there, where that is better; None if none is.

    An effect that came while others were missing may sit in a wrong valley of its shape or in wrong recordings.
    without: the model fitted again without each effect, by name.
    """
    grids = {name: screening.grid(find_effect(name)) for name in without if find_effect(name).acts != "one"}
    shaped = [name for name, grid in grids.items() if any(grid)]  # all others have no place but their own
    items = []
    screened = in_parallel(lambda name, _: screening.screen(without[name], only=[name]), shaped, screening.jobs)
    for name, own in screened:
        rest = without[name]
        gain = rest.level - full.level
        away = [s for s in own if not in_place(full, s, grids[name])]
        items += [(rest, s) for s in away if s.gain >= RENEWED * gain or elsewhere(full, s)]
        everywhere = in_all(full, name, screening.recordings) if fits.coordinates.told else ()
        items += [(rest, s) for s in everywhere]
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
