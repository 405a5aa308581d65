"""Effects tried at sizes that are held while the rest moves: delays, and play between motor and reading."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.diagnosis.descent import QUICK
from linid.diagnosis.joint import Fitted, JointFit
from linid.diagnosis.unknowns import ACROSS
from linid.diagnosis.weighted_step import WeightedStep
from linid.identification.guess.effect_values import Trial
from linid.parallel_tasks import in_parallel
from linid.physics.effects.effect import Effect, Values
from linid.recording.motion import plays_told

_DELAYS, _LATER = (-1.0, 1.0), (3.0, 8.0)  # sampling periods
_OF_PLAYS = (0.25, 0.5, 0.75)  # quantiles of what turns tell of play, each by itself


@dataclass(frozen=True)
class HeldSizes:
    """Which sizes are tried. fits: whose recordings; fitted: places of those to fit; period: of sampling, s; jobs:
    threads."""

    fits: JointFit
    fitted: tuple[int, ...]
    period: float
    jobs: int

    def trials(self, effect: Effect, step: Fitted, level: float) -> list[Trial]:
        """What an effect explains beside a model at sizes that are held; none of effects whose size a column tells.
        level: of the criterion without it.

        Commutated inputs that come late look like a wrong phase, and a base at a wrong phase sees nothing of a delay:
        both move together, and their product is beyond a linear step. So is what play makes of a turn.
        """
        if effect.delay is not None:
            near = self._trials(effect, step, level, [k * self.period for k in _DELAYS])
            if near[-1].explained > 0.0:  # whatever comes later still betters that already
                near += self._trials(effect, step, level, [k * self.period for k in _LATER])
            return near
        if effect.play:
            told = plays_told([self.fits.balance.recordings[k].motion for k in self.fitted])
            sizes = [float(x) for x in np.quantile(told, _OF_PLAYS)] if told else []
            return self._trials(effect, step, level, sizes)
        return []

    def _trials(self, effect: Effect, step: Fitted, level: float, sizes: Sequence[float]) -> list[Trial]:
        """A trial for each size, at which the thrust's size and phase are found anew."""
        (amplitude,) = (p for p in effect.parameters if p.name in effect.amplitudes)
        rows = self.fits.rows_of(self.fitted)

        def at(size: float, jobs: int) -> Trial:
            del jobs
            held = {amplitude.name: min(max(size, amplitude.lower), amplitude.upper)}
            there, slopes = self._held(step, effect, held)
            after = WeightedStep(self.fits, there, rows, slopes).level_after()
            explained = 1.0 - math.exp(after - level)
            return Trial({}, held, explained, held_first=explained > 0.0)

        return [found for _, found in in_parallel(at, sizes, self.jobs)]

    def beside(self, step: Fitted, effect: Effect, held: Values) -> Values:
        """SI values of a model's parameters beside an effect whose amplitudes are held."""
        there, slopes = self._held(step, effect, held)
        preset = {**step.preset, **held}
        moved = self.fits.fit(there.model, step.values, preset, step.recordings, QUICK, slopes, exact=True)
        return {k: x for k, x in moved.values.items() if k not in held and k not in step.preset}

    def _held(self, step: Fitted, effect: Effect, held: Values) -> tuple[Fitted, Mapping[str, Array]]:
        """A model with an effect of some size, all else as it is, and its slopes: what inputs do has them anew."""
        model = step.model.with_effects((*step.model.effects, effect.name))
        there = self.fits.at(model, {**step.values, **held}, step.preset, step.recordings)
        names = ("force_constant", ACROSS, *held)
        return there, {**self.fits.slopes(step), **self.fits.slopes_by(there, names, step.recordings)}
