"""How strong a hidden effect is, computed on the campaign itself.

Strength 1 is a clearly visible effect: over the recordings in which it can act, what the model without effects
misses amounts to `VISIBLE` = 10 % of the total force:

    strength = RMS(m (a - a_base)) / RMS(F_total) / 0.1

a is the acceleration that the encoder shows, a_base the acceleration that the base model with its true parameters
gives along the very motion of the hidden plant under the currents that the sensors show (its bristle integrated along
that motion); m the moving mass the base model assumes. F_total is the motor force, on free wheels the inertial force
m a. Both are smoothed by the same bump kernel (half-width `HALF_WIDTH` ms), whose second derivative makes an
acceleration of the encoder's reading error; so one definition serves forces, delays, reading errors and payloads.
RMS over all samples of those recordings together. In a pair each strength is that of the effect alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from linid.arrays import Array
from linid.challenge.catalogue import ENTRIES
from linid.challenge.entries import AxisSizes, HiddenEffect
from linid.challenge.hidden_axis import HiddenAxis
from linid.challenge.plant import HiddenRun, acts, simulate
from linid.stand.mode_descriptions import FreeWheel, Mode
from linid.stand.modes import Command, command

VISIBLE = 0.1
HALF_WIDTH = 8  # samples at 1 kHz
COARSE = 1  # integration steps per drive loop period while an amplitude is sought
_TOLERANCE = 0.03
_ROUNDS = 7


class Shares(NamedTuple):
    """Mean squares over samples: missing and total force in N^2, and the number of samples."""

    missing: float
    total: float
    samples: int


class OutOfStrokeError(Exception):
    """The motion of some recordings leaves the stroke or does not stay finite; their indices."""

    def __init__(self, indices: tuple[int, ...]) -> None:
        self.indices = indices
        super().__init__(str(indices))


def bump(half_width: int, step: float) -> tuple[Array, Array]:
    """A smoothing kernel (n,) of n = 2 half_width - 1 weights with sum 1, and its second derivative (n,) per s^2.

    exp(-1/(1 - u^2)) sampled step s apart; the second derivative is scaled to give exactly 1 on t^2/2 and to ignore
    constants.
    """
    u = np.arange(1 - half_width, half_width) / half_width
    room = 1 - u * u
    shape = np.exp(-1 / room)
    curve = shape * (4 * u * u / room**4 - 2 / room**2 - 8 * u * u / room**3)
    curve -= curve.mean()
    t = step * half_width * u
    return shape / shape.sum(), curve / float(curve @ (t * t / 2))


def half_width(period: float) -> int:
    """Samples of the bump at a sampling period in s: as long as at 1 kHz, but never too few to be a bump."""
    return max(4, round(HALF_WIDTH * 1e-3 / period))


def missing_and_total(run: HiddenRun, free: bool) -> Shares:
    """What the base model misses in one recording, as in this module's definition."""
    period = float(run.t[1] - run.t[0])
    smooth, curve = bump(half_width(period), period)
    error = np.convolve(run.reading - run.y, curve, "valid")
    missing = run.mass * (np.convolve(run.acceleration - run.base_acceleration, smooth, "valid") + error)
    total = np.convolve(run.mass * run.acceleration if free else run.thrust, smooth, "valid")
    return Shares(float(np.mean(missing**2)), float(np.mean(total**2)), missing.size)


def strength(runs: Sequence[HiddenRun], modes: Sequence[Mode]) -> float:
    """Strength of the effects present in the runs, over these recordings together."""
    shares = [missing_and_total(run, isinstance(mode, FreeWheel)) for run, mode in zip(runs, modes, strict=True)]
    missing = sum(s.missing * s.samples for s in shares)
    total = sum(s.total * s.samples for s in shares)
    return math.sqrt(missing / total) / VISIBLE if total > 0 else 0.0


def run_all(
    description: HiddenAxis,
    effects: Sequence[HiddenEffect],
    *,
    only: Sequence[int] | None = None,
    substeps: int | None = None,
    told: Sequence[Command] | None = None,
    first_index: int = 0,
) -> list[HiddenRun]:
    """Run the recordings of a campaign (those at `only`). Raises OutOfStrokeError for motions that are not plausible.

    told: the commands of all recordings if they are at hand; first_index: see `index` of `plant.simulate`.
    """
    chosen = range(len(description.campaign)) if only is None else only
    told = commands(description) if told is None else told
    runs = [
        simulate(description, description.campaign[i], effects, index=first_index + i, substeps=substeps, told=told[i])
        for i in chosen
    ]
    wrong = tuple(i for i, run in zip(chosen, runs, strict=True) if not plausible(description, run))
    if wrong:
        raise OutOfStrokeError(wrong)
    return runs


def commands(description: HiddenAxis) -> tuple[Command, ...]:
    """The commands of all recordings of a campaign."""
    return tuple(command(mode, description) for mode in description.campaign)


def plausible(description: HiddenAxis, run: HiddenRun) -> bool:
    """Whether a motion stays finite and within the stroke."""
    low, high = run.peak
    inside = description.stroke.lower_m <= low and high <= description.stroke.upper_m
    return inside and bool(np.all(np.isfinite(run.states)))


def scope_of(effect: HiddenEffect, description: HiddenAxis) -> list[int]:
    """Indices of the recordings in which an effect can act."""
    return [
        i for i, mode in enumerate(description.campaign) if acts(effect, mode, powered=not isinstance(mode, FreeWheel))
    ]


def calibrate(
    description: HiddenAxis,
    effect: HiddenEffect,
    wanted: float,
    scales: AxisSizes,
    told: Sequence[Command] | None = None,
) -> tuple[HiddenEffect, float] | None:
    """Scale an effect's amplitude to a wanted strength on this campaign; returns it and the strength reached.

    None when the effect cannot become that strong within plausible amplitudes. Raises OutOfStrokeError.
    """
    limit = ENTRIES[effect.name].limit(scales)
    only = scope_of(effect, description)
    modes = [description.campaign[i] for i in only]
    told = commands(description) if told is None else told
    before: tuple[float, float] | None = None
    power = 1.0  # local exponent of strength over amplitude
    for _ in range(_ROUNDS):
        found = strength(run_all(description, [effect], only=only, substeps=COARSE, told=told), modes)
        if not 0 < found < math.inf:
            return None
        ratio = wanted / found
        if abs(ratio - 1) < _TOLERANCE:
            return effect, found
        size = abs(effect.amplitude)
        if size >= limit and ratio > 1:
            return None
        if before is not None and size != before[0]:
            slope = math.log(found / before[1]) / math.log(size / before[0])
            power = min(max(slope, 0.3), 3.0)
        before = size, found
        new = min(size * min(max(ratio ** (1 / power), 0.02), 20.0), limit)
        effect = replace(effect, amplitude=math.copysign(new, effect.amplitude))
    return None
