"""Effects tried at sizes that are held while the rest moves: delays, and play between motor and reading."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from linid.arrays import Array
from linid.diagnosis.descent import QUICK
from linid.diagnosis.joint import Fitted, JointFit
from linid.diagnosis.unknowns import ACROSS
from linid.diagnosis.weighted_step import WeightedStep
from linid.identification.guess.effect_values import Trial
from linid.parallel_tasks import in_parallel
from linid.physics.effects.effect import Effect, Values

if TYPE_CHECKING:
    from linid.diagnosis.screen import Screening, StepRegression

_DELAYS, _LATER = (-1.0, 1.0), (3.0, 8.0)  # sampling periods
_OF_PLAYS = (0.25, 0.5, 0.75)  # quantiles of what turns tell of play, each by itself
# Deviations of the noise: where the median turn tells of less play, noise about a turn looks like it.
# `python -m tests.benchmarks.plays --seed 22931` tells what turns with play, with other effects and with none tell.
VISIBLE_PLAY = 50.0


def held_trials(screening: Screening, regression: StepRegression, effect: Effect, step: Fitted) -> list[Trial]:
    """What an effect explains at sizes that are held; none of effects whose size is told by a column alone.

    Commutated inputs that come late look like a wrong phase, and a base at a wrong phase sees nothing of a delay: both
    move together, and their product is beyond a linear step. So is what play makes of a turn.
    """
    if effect.delay is not None:
        period = screening.outlook.period
        near = _trials(screening, regression, effect, step, [k * period for k in _DELAYS])
        if near[-1].explained > 0.0:  # whatever comes later still betters that already
            near += _trials(screening, regression, effect, step, [k * period for k in _LATER])
        return near
    if effect.play:
        motions = [screening.recordings[k].motion for k in screening.fitted]
        told = [play for motion in motions for play in motion.plays]
        if told and np.median(told) > VISIBLE_PLAY * max(motion.position_noise for motion in motions):
            return _trials(screening, regression, effect, step, [float(x) for x in np.quantile(told, _OF_PLAYS)])
    return []


def _trials(
    screening: Screening, regression: StepRegression, effect: Effect, step: Fitted, sizes: Sequence[float]
) -> list[Trial]:
    """A trial for each size, at which the thrust's size and phase are found anew."""
    (amplitude,) = (p for p in effect.parameters if p.name in effect.amplitudes)
    fits = screening.fits
    rows = fits.rows_of(screening.fitted)

    def at(size: float, jobs: int) -> Trial:
        del jobs
        held = {amplitude.name: min(max(size, amplitude.lower), amplitude.upper)}
        there, slopes = _held(fits, step, effect, held)
        level = WeightedStep(fits, there, rows, slopes).level_after()
        explained = 1.0 - math.exp(level - regression.level)
        return Trial({}, held, explained, held_first=explained > 0.0)

    return [found for _, found in in_parallel(at, sizes, screening.jobs)]


def beside_held(fits: JointFit, step: Fitted, effect: Effect, held: Values) -> Values:
    """SI values of a step's parameters beside an effect whose amplitudes are held."""
    there, slopes = _held(fits, step, effect, held)
    preset = {**step.preset, **held}
    moved = fits.fit(there.model, step.values, preset, step.recordings, QUICK, slopes, exact=True)
    return {k: x for k, x in moved.values.items() if k not in held and k not in step.preset}


def _held(fits: JointFit, step: Fitted, effect: Effect, held: Values) -> tuple[Fitted, Mapping[str, Array]]:
    """A step's model with an effect of some size, all else as it is, and its slopes: what inputs do has them anew."""
    model = step.model.with_effects((*step.model.effects, effect.name))
    there = fits.at(model, {**step.values, **held}, step.preset, step.recordings)
    names = ("force_constant", ACROSS, *held)
    return there, {**fits.slopes(step), **fits.slopes_by(there, names, step.recordings)}
