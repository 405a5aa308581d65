"""Confirmation: base model and effects identified together on the fitted recordings, judged on held-out ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linid.diagnosis.alone import PER_RECORDING, acts_in
from linid.diagnosis.balance import Balance, scale_of
from linid.identification.acceleration import Acceleration
from linid.identification.effect_guess import Trial
from linid.identification.genes import SearchSpace
from linid.identification.polish import polish
from linid.identification.problem import Cost, Problem
from linid.identification.space import build_space
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.recording.recording import Recording

Array = NDArray[np.float64]

_RESAMPLES = 2000
_ROUNDS = 3
_TOLERANCE = 1e-4


@dataclass(frozen=True)
class Fitted:
    """A model fitted by the force balance. genes: (p,) in its search space; values: SI by name; vector: (VECTOR_SIZE,)
    SI; residual: (n,) m/s^2 of all rows of the balance; structural: SI values that say where its effects act."""

    space: SearchSpace
    genes: Array
    values: dict[str, float]
    vector: Array
    residual: Array
    structural: dict[str, float]

    @property
    def model(self) -> Model:
        """Motor and effects."""
        return self.space.model


@dataclass(frozen=True)
class Judge:
    """The rows on which models are compared, and the noise that no model can explain.

    noise, scale: (R,) m/s^2 per recording; seed: of the bootstrap.
    """

    balance: Balance
    noise: Array
    scale: Array
    seed: int

    def power(self, residual: Array) -> Array:
        """Squared residuals (n,) in units of their recording's scale."""
        return np.asarray((residual / self.scale[self.balance.rows.recording]) ** 2)

    def floor(self, chosen: NDArray[np.bool_]) -> float:
        """What the noise gives in the mean of `power` over the chosen rows."""
        return float(np.mean((self.noise / self.scale)[self.balance.rows.recording[chosen]] ** 2))

    def closure(self, before: Array, after: Array, chosen: NDArray[np.bool_]) -> tuple[float, ...]:
        """Closure over the chosen rows, its 95 % block-bootstrap interval, the share of resamples that gain nothing,
        and the gain over its standard deviation."""
        first, second = self.power(before)[chosen], self.power(after)[chosen]
        floor = self.floor(chosen)
        blocks = np.unique(self.balance.rows.block[chosen], return_inverse=True)[1]
        counts = np.bincount(blocks)
        gains = np.bincount(blocks, first - second)
        excess = np.bincount(blocks, first) - floor * counts
        generator = np.random.default_rng(self.seed)
        picks = generator.integers(0, counts.size, (_RESAMPLES, counts.size))
        drawn = gains[picks].sum(axis=1)
        below = excess[picks].sum(axis=1)
        least = 0.02 * floor * float(counts.sum())
        ratio = drawn / np.maximum(below, least)
        low, high = np.quantile(ratio, [0.025, 0.975])
        doubt = float(np.mean(drawn <= 0.0))
        value = float(gains.sum()) / max(float(excess.sum()), least)
        return value, float(low), float(high), doubt, float(gains.sum()) / max(float(np.std(drawn)), 1e-300)


def judge_of(balance: Balance, model: Model, vector: Array, seed: int) -> Judge:
    """A judge whose noise is that of the base model."""
    noise = balance.noise(model, vector)
    return Judge(balance, noise, scale_of(noise), seed)


def rows_to_judge(balance: Balance, effects: Sequence[str], structural: dict[str, float]) -> NDArray[np.bool_]:
    """Held-out rows, and for effects that live in single recordings the rows of those."""
    chosen = balance.split.copy()
    for name in effects:
        if name in PER_RECORDING:
            chosen |= affected_rows(balance, name, structural)
    return chosen


def affected_rows(balance: Balance, name: str, structural: dict[str, float]) -> NDArray[np.bool_]:
    """Rows of the recordings that a per-recording effect acts in."""
    hit = [acts_in(name, structural, recording) for recording in balance.recordings]
    return np.asarray(np.array(hit)[balance.rows.recording])


def fit_base(
    balance: Balance, model: Model, first: dict[str, float], fixed: dict[str, float], recordings: Sequence[Recording],
    jobs: int,
) -> Fitted:  # fmt: skip
    """Identify a model without effects by the force balance; first: SI values to start from."""
    return _fit(balance, model, first, fixed, {}, recordings, jobs)


def fit_together(
    balance: Balance, base: Fitted, added: Sequence[tuple[str, Trial]], fixed: dict[str, float],
    recordings: Sequence[Recording], jobs: int,
) -> Fitted:  # fmt: skip
    """Identify base model and added effects together; added: effects with their first values; fixed: SI values that
    are not identified."""
    values, structural = dict(base.values), dict(base.structural)
    for name, trial in added:
        values |= trial.values | trial.amplitudes
        structural |= {key: x for key, x in trial.values.items() if key in find_effect(name).structural}
    model = Model(base.model.kind, base.model.effects + tuple(name for name, _ in added))
    return _fit(balance, model, values, fixed, structural, recordings, jobs)


def _fit(
    balance: Balance, model: Model, first: dict[str, float], fixed: dict[str, float], structural: dict[str, float],
    recordings: Sequence[Recording], jobs: int,
) -> Fitted:  # fmt: skip
    names = {p.name for p in model.parameters}
    held = {k: x for k, x in fixed.items() if k in names} | structural
    space = _space(model, recordings, first, held)
    problem = Problem(space, (Acceleration(model, tuple(recordings), jobs),))
    start = space.encode(first)
    polished = polish(
        problem, Cost(problem), start, rounds=_ROUNDS, max_evaluations=10, tolerance=_TOLERANCE, final=False
    )
    vector = space.vectors(polished.genes)[0]
    values = {p.name: float(vector[model.slot(p.name)]) for p in model.parameters}
    return Fitted(space, polished.genes, values, vector, balance.residual(model, vector), structural)


def _space(
    model: Model, recordings: Sequence[Recording], values: dict[str, float], held: dict[str, float]
) -> SearchSpace:
    """The search box around known values."""
    density = values.get("guideway_density")
    densities = () if density is None else (density,)
    return build_space(model, recordings, values, held, {}, False, densities, True)
