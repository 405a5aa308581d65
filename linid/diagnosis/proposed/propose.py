"""On what a missing force depends: the family that predicts it best where it was not fitted, if any does."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.diagnosis.proposed.arguments import Argument, arguments_of
from linid.diagnosis.proposed.bent import bent
from linid.diagnosis.proposed.family import Family, added_level, families, of_running_time, per_recording
from linid.diagnosis.proposed.leftover import Leftover
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.regression import Regression, Sums
from linid.diagnosis.proposed.wander import LEAST_LEAD, wandering
from linid.diagnosis.proposed.waves import WAVE_PIECE, wave_families
from linid.diagnosis.roll_null import p_value, with_rolled

LEAST_EXCESS = 0.05  # floors: with less, there is nothing to be proposed
AS_GOOD = 0.92  # of the best gain: families with this much predict alike, and the one of fewer arguments is taken
FINER = 0.02  # of the gain: what another form of the same arguments predicts more, to be worth its numbers
WORTH = 0.5  # of the best gain: where the best one does not stand, much less is not the answer
TRIES = 3  # families that are tested by permutation, each at SURE / TRIES
SURE = 0.05
LEAST_CLOSED = 0.05  # of the excess, on the judging rows
LEAST_GAIN = 0.01  # of what is left: a family that predicts less where it selects is none
KEPT = 12  # best families that are kept with their columns: what is not among them gained less than the least
_RESAMPLES = 400


@dataclass(frozen=True)
class Proposal:
    """A term for what no effect explains.

    family; gain: share of the squares of fitted recordings, left out in turn, that it takes away; closed: share of the
    excess over the floor on the judging rows, low: its lower bound (95 %); p_value: by rolled residuals; regression:
    that found it.
    """

    family: Family
    gain: float
    closed: float
    low: float
    p_value: float
    regression: Regression

    @property
    def arguments(self) -> tuple[str, ...]:
        """What the missing force depends on."""
        return self.family.arguments


def propose(problem: Problem, found: Sequence[Regression]) -> Proposal | None:
    """The term that the data ask for, or None where none predicts what it was not fitted to.

    found: `judged_families` of the problem.
    """
    if 1.0 / max(problem.floor, 1e-9) - 1.0 < LEAST_EXCESS:
        return None
    # What does not return on the judging rows was chance, or of those recordings: nothing else is measured by it.
    left = [one for one in found if one.closed() >= LEAST_CLOSED]
    left = [one for one in left if one.best[1] >= WORTH * left[0].best[1]]
    for _ in range(min(TRIES, len(left))):
        regression = candidates(left)[0]
        proposal = tested(problem, regression)
        if proposal is not None:
            return _finer(problem, proposal)
        left.remove(regression)  # and what is as good as the best of the others is another question
    return None


def _finer(problem: Problem, proposal: Proposal) -> Proposal:
    """A proposal with a factor that bends, or with a level that is added to all friction, where that predicts clearly
    more."""
    added = added_level(problem, proposal.family)
    finer = bent(problem, proposal.regression) if added is None else Regression(proposal.regression.sums, added)
    if finer is None or finer.best[1] <= (1.0 + FINER) * proposal.gain or finer.closed() <= proposal.closed:
        return proposal
    return tested(problem, finer) or proposal


def tested(problem: Problem, regression: Regression, tries: int = TRIES) -> Proposal | None:
    """A family as a proposal if it stands: no chance of rolled residuals, and beyond doubt on the judging rows. tries:
    families that are tested, of which this is one."""
    penalty, gain = regression.best
    low = float(np.quantile(regression.closed_draws(_RESAMPLES), 0.025))
    closed = regression.closed()
    if closed < LEAST_CLOSED or low <= 0.0:
        return None
    order = regression.sums.split.order
    rolled = with_rolled(problem.rest, problem.rows.recording, problem.seed)[order].astype(np.float64)
    gains = regression.gains(rolled, penalty)
    chance = p_value(float(gains[0]), gains[1:])
    if chance > SURE / tries:
        return None
    return Proposal(regression.family, gain, min(closed, 1.0), low, chance, regression)


def judged_families(problem: Problem, able: Callable[[Family], bool] = lambda family: True) -> list[Regression]:
    """The best of the families that are able, that with the largest gain first."""
    arguments = arguments_of(problem)
    shared = {0.0: Sums(problem, 0.0), WAVE_PIECE: Sums(problem, WAVE_PIECE)}
    kept: list[Regression] = []
    for family in _all_families(problem, arguments, Leftover(problem).of_rows):
        if not able(family):
            continue
        regression = Regression(shared[family.local], family)
        if regression.best[1] < LEAST_GAIN:
            continue
        kept = sorted([*kept, regression], key=_by_gain)[:KEPT]
    # Arguments are told by straight factors: one that bends about zero is nearly a direction, and imitates friction.
    first = bent(problem, candidates(kept)[0]) if kept else None
    return kept if first is None else sorted([*kept, first], key=_by_gain)[:KEPT]


def _by_gain(one: Regression) -> float:
    return -one.best[1]


def _all_families(problem: Problem, arguments: dict[str, Argument], left: Callable[[Array], Array]) -> Iterator[Family]:
    yield from families(problem, arguments)
    yield from wave_families(problem, arguments, left)
    yield from per_recording(problem, WAVE_PIECE)
    yield from of_running_time(problem, arguments, WAVE_PIECE)
    yield from wandering(problem)


def candidates(found: Sequence[Regression]) -> list[Regression]:
    """The families, that which is tested first before the others: of those as good as the best the one of fewest
    arguments and coefficients, what only passes last, friction before a damping that it equals; then the rest."""
    if not found:
        return []
    aimless = [one for one in found if one.family.wanders]
    found = [one for one in found if not one.family.wanders]
    if aimless and (not found or aimless[0].best[1] > LEAST_LEAD * found[0].best[1]):
        return [*aimless[:1], *found]
    if not found:
        return []
    best = found[0].best[1]
    alike = [one for one in found if one.best[1] >= AS_GOOD * best]

    def order(one: Regression) -> tuple[int, int, int, bool, float]:
        numbers = one.family.columns.shape[1] + one.family.bends
        return one.family.passing, len(one.family.arguments), numbers, one.family.factor == "velocity", -one.best[1]

    return [*sorted(alike, key=order), *(one for one in found if one.best[1] < AS_GOOD * best)]
