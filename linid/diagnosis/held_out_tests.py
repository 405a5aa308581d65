"""The tests that a proposed effect must stand on held-out rows."""

from __future__ import annotations

from dataclasses import dataclass

from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Evidence
from linid.physics.effects.registry import find_effect

# An effect must be the surer the less it closes: where it closes nearly all, blocks that differ in size are no doubt.
CERTAINTY, LEAST_CERTAINTY = 3.0, 1.0
LEAST_GAIN = 0.01
LEAST_SHARE = 0.002  # of the gap's power: what large effects leave of their own form is no further cause
# What takes that little of the gap must bring the model to the floor: else it mends the form of what takes the rest.
# A share of the power is that of the recording with the largest gap: what takes that much of the log power is a cause
# of the gap in most recordings.
LEAST_PORTION, TO_THE_FLOOR, LEAST_LOG_SHARE = 0.01, 0.9, 0.1
LIKELY = 0.5  # of what it leaves: an effect that closes that much is not told from another of the same arguments
LEAST_CLOSED, MOST_OF_POWER = 0.15, 0.5
# What closes less, as on machines whose floor no model reaches, must be beyond doubt and no trifle, neither in the
# logarithm nor in the power: what is in no library is sure to lend others a little of either.
SURE, SURE_ALONE, NO_TRIFLE = 4.0, 5.5, 0.05
# Effects of single recordings fit themselves to much: of what they leave they must close more.
LEAST_CLOSED_ALONE = 0.4
LEAST_POWER_ALONE = 0.3  # floors in the power of the judged rows: a recording without a gap has nothing unlogged in it


@dataclass(frozen=True)
class Part:
    """An effect of the final model with what its absence costs; without: the model fitted again without it; share: of
    the power that all effects together take from the base, what comes back without it; log_share: the same of the log
    power."""

    name: str
    evidence: Evidence
    without: Fitted
    share: float = 1.0
    log_share: float = 0.0


def stands(part: Part) -> bool:
    """Whether an effect stands the tests on held-out rows."""
    e = part.evidence
    # A single moment has no other blocks that could vouch for it: its lead over other moments did.
    effect = find_effect(part.name)
    if abs(part.share) < LEAST_SHARE:
        return False
    # What lowers the logarithm and adds to the power has moved the model from one half of the rows to the other.
    if e.power < 0.0 and e.certainty < SURE:
        return False
    # Which recordings an effect acts in was chosen by what it explains there; few blocks judge a single one.
    alone = CERTAINTY + (SURE - CERTAINTY) * (1.0 - e.closed)
    least = alone if effect.per_recording else max(LEAST_CERTAINTY, CERTAINTY * (1.0 - e.closed))
    sure = e.certainty >= least or effect.acts == "one"
    # Where the floor is far below what any model reaches, the logarithm is large for ever: then the power speaks.
    most = e.power_closed >= MOST_OF_POWER and e.certainty >= max(CERTAINTY, least)
    closed = LEAST_CLOSED_ALONE if effect.per_recording else LEAST_CLOSED
    there = not effect.per_recording or e.power >= LEAST_POWER_ALONE
    wanted = SURE_ALONE if effect.per_recording else SURE
    beyond_doubt = e.certainty >= wanted and min(e.gain, e.power_closed) >= NO_TRIFLE
    return there and e.gain >= LEAST_GAIN and (most or beyond_doubt or (sure and e.closed >= closed))


def stands_clearly(part: Part) -> bool:
    """Whether an effect stands the tests beside a term: that has many numbers, so it must be beyond doubt, and close
    enough to be no trace of what the term leaves."""
    return stands(part) and part.evidence.certainty >= SURE and part.evidence.closed >= LEAST_CLOSED


def is_trifle(part: Part, share: float) -> bool:
    """Whether an effect that stands the tests is no cause of the gap all the same. share: of the gap, by the budget."""
    little = share < LEAST_PORTION and part.log_share < LEAST_LOG_SHARE
    return little and part.evidence.closed < TO_THE_FLOOR


def is_likely(part: Part) -> bool:
    """Whether an effect that failed the tests for the little that it takes may be there all the same."""
    return part.evidence.certainty >= CERTAINTY and part.evidence.closed >= LIKELY
