"""Selection: base and effects are identified together, as many effects as pay, each judged with all others there.

Forward steps on the fitted rows only propose what lessens the criterion most. The tests stand at the end, on held-out
rows: each effect is taken out, the others are fitted again, and what then comes back must be beyond doubt and a share
of what no effect here explains. What fails goes, the weakest first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from linid.diagnosis.backward import Backward
from linid.diagnosis.base import Base
from linid.diagnosis.descent import THOROUGH
from linid.diagnosis.forward import Watch, forward
from linid.diagnosis.held_out_tests import Part
from linid.diagnosis.joint import Fitted
from linid.diagnosis.screen import Screened, Screening
from linid.diagnosis.steps_of_selection import again, extended, settled


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


def select(base: Base, screening: Screening, watch: Watch) -> Selection:
    """As many effects as pay, added to the base one at a time and tested together at the end."""
    full, screened = forward(base, screening, watch)
    backward = Backward(base.judge, screening, base.fitted)
    last = backward.run(full)
    ordered = tuple(sorted(last.parts, key=lambda p: -p.evidence.gain))
    left = tuple(part for name, part in backward.dropped.items() if name not in last.full.model.effects)
    return Selection(base.fitted, last.full if ordered else base.fitted, ordered, screened, left, last.rivals)


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
