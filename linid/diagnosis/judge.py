"""The judge: on which rows models are compared, what the noise floor is there, and what a comparison is worth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array
from linid.diagnosis.balance import Balance, Noise, scale_of
from linid.diagnosis.criterion import certainty_of
from linid.diagnosis.joint import Fitted, JointFit
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model

Chosen = NDArray[np.bool_]

# What nobody knows of the floor (in floors, and in its logarithm): the noise is estimated from the recordings.
FLOOR_DOUBT = 0.02


@dataclass(frozen=True)
class Evidence:
    """What a model gains over a simpler one on the same rows.

    gain: of the log power, per row (0.01: one per cent less power everywhere); certainty: the gain over its deviation
    from block to block; closed: share of the log power above the floor that goes; power: what goes, in floors;
    power_closed: share of the power above the floor that goes.
    """

    gain: float
    certainty: float
    closed: float
    power: float
    power_closed: float


@dataclass(frozen=True)
class Judge:
    """The rows on which models are compared, and the noise that no model can explain.

    noise: of the base model; scale: (R,) m/s^2 per recording; fits: whose criterion the judgement shares; seed: of the
    bootstrap.
    """

    balance: Balance
    fits: JointFit
    noise: Noise
    scale: Array
    seed: int

    def power(self, residual: Array) -> Array:
        """Squared residuals (n,) in units of their recording's scale; residual: (n,) m/s^2."""
        return np.asarray((residual / self.scale[self.balance.rows.recording]) ** 2)

    def floor(self, chosen: Chosen) -> float:
        """What the noise gives in the mean of `power` over the chosen rows."""
        rows = self.balance.rows
        noise = (self.noise.encoder + self.noise.inputs)[rows.bin[chosen]]
        return float(np.mean(noise / self.scale[rows.recording[chosen]] ** 2))

    def excess(self, residual: Array, chosen: Chosen | None = None) -> float:
        """What a residual (n,) has above the floor over the held-out (or the chosen) rows, in floors."""
        rows = self.balance.split if chosen is None else chosen
        return float(np.mean(self.power(residual)[rows])) / self.floor(rows) - 1.0

    def rows(self, effects: Sequence[str], values: Mapping[str, float]) -> Chosen:
        """Held-out rows, and those of recordings in which an effect acts that acts in single ones; values: SI."""
        chosen = self.balance.split.copy()
        for name in effects:
            if find_effect(name).per_recording:
                chosen |= self.rows_of(name, values)
        return chosen

    def rows_of(self, name: str, values: Mapping[str, float]) -> Chosen:
        """Rows of the recordings in which an effect acts; values: SI."""
        effect = find_effect(name)
        hit = np.array([effect.acts_in(dict(values), r.number) for r in self.balance.recordings])
        return np.asarray(hit[self.balance.rows.recording])


def compare(fits: JointFit, before: Fitted, after: Fitted, chosen: Chosen) -> Evidence:
    """The evidence for `after`, which has what `before` lacks."""
    first, noise, counts = fits.bin_powers(before.residual, before.floor, chosen)
    second, floor, _ = fits.bin_powers(after.residual, after.floor, chosen)
    known = counts > 0
    first, second, noise, floor, counts = first[known], second[known], noise[known], floor[known], counts[known]
    levels = counts * np.log((second + floor) / (2.0 * floor))
    gains = counts * np.log((first + noise) / (2.0 * noise)) - levels
    total = float(counts.sum())
    gain = float(gains.sum()) / total
    left = max(float(levels.sum()) / total, 0.0)
    power = float((first - second).sum()) / float(floor.sum())
    excess = max(float(second.sum()) / float(floor.sum()) - 1.0, 0.0)
    positive, went = max(gain, 0.0), max(power, 0.0)
    return Evidence(
        gain=gain,
        certainty=certainty_of(gains, fits.blocks_of(known)),
        closed=positive / (positive + max(left, FLOOR_DOUBT)),
        power=power,
        power_closed=went / (went + max(excess, FLOOR_DOUBT)),
    )


def judge_of(
    balance: Balance,
    model: Model,
    values: Mapping[str, float],
    held: Mapping[str, float],
    limits: Mapping[str, tuple[float, float]],
    seed: int,
    told: Mapping[str, tuple[float, float]] | None = None,
) -> Judge:
    """A judge whose noise is that of the base model; values: SI values of the base; held: what no fit identifies;
    limits: bounds of single parameters in all fits, SI; told: intervals of what is known beforehand of them."""
    noise = balance.noise(model, model.vector(dict(values)))
    scale = scale_of(noise.deviation(balance.rows))
    return Judge(balance, JointFit(balance, scale, noise, held, values, limits, told or {}), noise, scale, seed)
