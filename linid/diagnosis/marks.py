"""Where an effect acts: in other recordings, or with another shape, than a model has it."""

from __future__ import annotations

from collections.abc import Sequence

from linid.diagnosis.joint import Fitted
from linid.diagnosis.screen import Screened
from linid.identification.guess.effect_values import Trial
from linid.physics.effects.effect import Values
from linid.physics.effects.registry import find_effect
from linid.physics.effects.shapes import MOST_MARKED
from linid.recording.recording import Recording


def elsewhere(full: Fitted, found: Screened) -> bool:
    """Whether an effect of some recordings is found in others than a model has it in."""
    mark = find_effect(found.name).mark
    return bool(mark) and found.trial.values.get(mark) != full.preset.get(mark)


def in_place(full: Fitted, found: Screened, grid: Sequence[Values]) -> bool:
    """Whether a fit of an effect that is found there would begin where a model has it: in the same recordings, and with
    no other entry of its grid between. grid: of its shapes, SI."""
    places = found.trial.values, full.values | full.preset
    for parameter in find_effect(found.name).parameters:
        there, now = (values.get(parameter.name) for values in places)
        if there is None or now is None or there == now:
            continue
        low, high = sorted((there, now))
        if parameter.name in full.preset or (parameter.reach > 1.0 and high > parameter.reach * low):
            return False
        if any(low < entry.get(parameter.name, low) < high for entry in grid):
            return False
    return True


def in_all(full: Fitted, name: str, recordings: Sequence[Recording]) -> tuple[Screened, ...]:
    """A changed parameter as it is in a model, but in all recordings; nothing where it is there, or is none.

    A change since a given model lasts; a regression that is far from where a recording's friction is leaves it out.
    """
    effect = find_effect(name)
    if not effect.changes or effect.acts != "some":
        return ()
    values = {effect.mark: float(sum(2.0 ** (r.number - 1) for r in recordings if 1 <= r.number <= MOST_MARKED))}
    found = Screened(name, Trial(values, {one: full.values[one] for one in effect.amplitudes}, 0.0))
    return (found,) if elsewhere(full, found) else ()
