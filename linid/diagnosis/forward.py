"""Forward steps: effects that the fitted rows propose, added to the base one at a time, all identified together."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from linid.diagnosis.base import Base
from linid.diagnosis.held_out_tests import LEAST_CERTAINTY
from linid.diagnosis.joint import Fitted, JointFit
from linid.diagnosis.judge import Evidence, compare
from linid.diagnosis.screen import LEAST_CONTRAST, Screened, Screening
from linid.diagnosis.steps_of_selection import extended, settled
from linid.parallel_tasks import in_parallel
from linid.physics.effects.registry import find_effect

# What a forward step asks for, on the fitted rows: certainty and gain in log power per row.
PROPOSED_CERTAINTY, PROPOSED_GAIN, CLEAR_GAIN = 2.5, 0.004, 0.1
_SHARED = 4.0  # rows that say about as much as one
LARGEST = 10  # effects in one model
# Candidates fitted per step, and the share of the best's screening that they need: so many the first time, and so many
# more each time that none of them was any good. Last of all what regressions promise little of is tried too.
CONTENDERS, CONTENDING = 3, (0.5, 0.3, 0.05)
# A push must explain so many times as much as pushes at other moments do.
LEAST_LEAD = 4.0
MOMENTS_GAIN = 0.006  # of the log power, by regression, of a push that does not stand out where it is

Watch = Callable[[str, int, int], None]


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
        if evidence.gain >= _least(item, PROPOSED_GAIN) and (moment or sure(evidence.gain, evidence.certainty)):
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


def sure(gain: float, certainty: float) -> bool:
    """Whether a gain in log power per row on fitted rows is sure enough, or so large that few blocks of unlike size are
    no doubt; certainty: in deviations from block to block."""
    return certainty >= (LEAST_CERTAINTY if gain >= CLEAR_GAIN else PROPOSED_CERTAINTY)


def contenders(found: Sequence[Screened], share: float, most: int = CONTENDERS) -> list[Screened]:
    """The screened effects that are worth a fit: at most so many, which explain that share of the best one at least,
    and of which the regression is as sure as a fit must be."""
    able = [s for s in found if s.trial.explained > _promised(s) and s.trial.lead >= LEAST_LEAD]
    able = [s for s in able if sure(s.gain, s.trial.certainty)]
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


def gained(fits: JointFit, step: Fitted, one: Fitted) -> Evidence:
    """What a model gains over the step before, on the rows that it is fitted to."""
    return compare(fits, step, one, fits.rows_of(one.recordings))
