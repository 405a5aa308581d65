"""Confirmation: base model and effects identified together on the fitted recordings, judged on held-out ones."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linid.diagnosis.alone import MOST_BITS, PER_RECORDING, acts_in
from linid.diagnosis.balance import Balance, scale_of
from linid.identification.acceleration import Acceleration
from linid.identification.effect_guess import Trial
from linid.identification.genes import SearchSpace
from linid.identification.problem import Cost, Problem
from linid.identification.rounds import polish_in_rounds
from linid.identification.space import build_space
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.recording.recording import Recording

Array = NDArray[np.float64]

_RESAMPLES = 2000
# A payload is in a recording if its gain there is so many deviations, and this share of the residual's power.
_CLEAR = 2.0
_WORTH = 0.05
_BETTER = 0.01  # of the base's mean square: less is no reason to fit it again
# Rounds, evaluations per round, and relative change that ends a round. The base must be right, for all is judged by
# it, and commutated currents leave a flat valley; a candidate starts from there. What is chosen is settled before more
# is added to it, or the next candidates would get the credit for what was left to gain.
_THOROUGH = (6, 30, 1e-7)
_SETTLING = (3, 15, 1e-5)
_QUICK = (3, 10, 1e-3)


@dataclass(frozen=True)
class Fitted:
    """A model fitted by the force balance. genes: (p,) in its search space; values: SI by name; vector: (VECTOR_SIZE,)
    SI; residual: (n,) m/s^2 of all rows of the balance; structural: SI values that say where its effects act; key:
    under which the balance's memory keeps the genes."""

    space: SearchSpace
    genes: Array
    values: dict[str, float]
    vector: Array
    residual: Array
    structural: dict[str, float]
    key: str

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

    def excess(self, residual: Array) -> float:
        """What a residual (n,) has above the floor over the held-out rows, in floors."""
        held = self.balance.split
        return float(np.mean(self.power(residual)[held])) / self.floor(held) - 1.0

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
    return _fit(balance, model, first, fixed, {}, recordings, jobs, _THOROUGH)


def better_base(balance: Balance, base: Fitted, others: Sequence[Fitted], recordings: Sequence[Recording],
                fixed: dict[str, float], jobs: int) -> Fitted:  # fmt: skip
    """The base refitted from the values that it has in another model, where these alone beat it; else the base.

    A base caught in a poor minimum makes every effect look good. recordings: those that the base is fitted to.
    """
    rows = ~balance.split
    scale = np.maximum(rms_per_recording(balance, base.residual), 1e-300)[balance.rows.recording]

    def size(residual: Array) -> float:
        return float(np.mean((residual / scale)[rows] ** 2))

    best, least = None, (1.0 - _BETTER) * size(base.residual)
    for other in others:
        values = {name: other.values[name] for name in base.values}
        now = size(balance.residual(base.model, base.model.vector(values)))
        if now < least:
            best, least = values, now
    if best is None:
        return base
    return _fit(balance, base.model, best, fixed, base.structural, recordings, jobs, _THOROUGH)


def rms_per_recording(balance: Balance, residual: Array) -> Array:
    """RMS (R,) of a residual (n,) per recording."""
    owner = balance.rows.recording
    return np.asarray(np.sqrt(np.bincount(owner, residual**2) / np.maximum(np.bincount(owner), 1)))


def fit_together(
    balance: Balance, base: Fitted, added: Sequence[tuple[str, Trial]], fixed: dict[str, float],
    recordings: Sequence[Recording], jobs: int,
) -> Fitted:  # fmt: skip
    """Identify base model and added effects together; added: effects with their first values; fixed: SI values that
    are not identified."""
    values, structural = dict(base.values), dict(base.structural)
    for name, trial in added:
        values |= trial.values | trial.amplitudes
        structural |= find_effect(name).held(trial.values)
    model = Model(base.model.kind, base.model.effects + tuple(name for name, _ in added))
    found = _fit(balance, model, values, fixed, structural, recordings, jobs)
    if any(name == "payload_change" for name, _ in added):
        mark = marked_by_payload(balance, found)
        if mark not in (0.0, structural["payload_recordings"]):
            structural["payload_recordings"] = mark
            return _fit(balance, model, found.values | structural, fixed, structural, recordings, jobs)
    return found


def settle(
    balance: Balance, found: Fitted, fixed: dict[str, float], recordings: Sequence[Recording], jobs: int
) -> Fitted:
    """A candidate's fit brought to its minimum."""
    values = found.values | found.structural
    return _fit(balance, found.model, values, fixed, found.structural, recordings, jobs, _SETTLING)


def marked_by_payload(balance: Balance, fitted: Fitted) -> float:
    """Mark (sum of 2^(number - 1)) of the recordings in which the fitted payload clearly lessens the residual.

    The regression that chose them saw parameters that made up for the payload in other recordings.
    """
    slot = fitted.model.slot("payload_recordings")
    able = [k for k, r in enumerate(balance.recordings) if 1 <= r.number <= MOST_BITS]
    residuals = []
    for mark in (0.0, float(sum(2.0 ** (balance.recordings[k].number - 1) for k in able))):
        vector = fitted.vector.copy()
        vector[slot] = mark
        residuals.append(balance.residual(fitted.model, vector))
    gain = residuals[0] ** 2 - residuals[1] ** 2
    mark = 0.0
    for k in able:
        mine = balance.rows.recording == k
        sums = np.bincount(np.unique(balance.rows.block[mine], return_inverse=True)[1], gain[mine])
        total = float(sums.sum())
        clear = total > _CLEAR * float(np.sqrt(np.sum(sums**2)))
        if clear and total > _WORTH * float(np.sum(residuals[0][mine] ** 2)):
            mark += 2.0 ** (balance.recordings[k].number - 1)
    return mark


def _fit(
    balance: Balance, model: Model, first: dict[str, float], fixed: dict[str, float], structural: dict[str, float],
    recordings: Sequence[Recording], jobs: int, effort: tuple[int, int, float] = _QUICK,
) -> Fitted:  # fmt: skip
    names = {p.name for p in model.parameters}
    held = {k: x for k, x in fixed.items() if k in names} | structural
    space = _space(model, recordings, first, held)
    problem = Problem(space, (Acceleration(model, tuple(recordings), jobs),))
    start = space.encode(first)
    rounds, evaluations, tolerance = effort
    key = _key(model, held, recordings, start, effort)
    if key in balance.memory:
        genes = np.array(balance.memory[key])
    else:
        genes = polish_in_rounds(Cost(problem), start, rounds=rounds, evaluations=evaluations, tolerance=tolerance)
        balance.memory[key] = genes.tolist()
    vector = space.vectors(genes)[0]
    values = {p.name: float(vector[model.slot(p.name)]) for p in model.parameters}
    return Fitted(space, genes, values, vector, balance.residual(model, vector), structural, key)


def _key(
    model: Model, held: dict[str, float], recordings: Sequence[Recording], start: Array, effort: tuple[int, int, float]
) -> str:
    """What decides the result of a fit, as a hash."""
    parts = (model.kind, model.effects, sorted(held.items()), [r.name for r in recordings], start.tolist(), effort)
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def _space(
    model: Model, recordings: Sequence[Recording], values: dict[str, float], held: dict[str, float]
) -> SearchSpace:
    """The search box around known values."""
    density = values.get("guideway_density")
    densities = () if density is None else (density,)
    return build_space(model, recordings, values, held, {}, False, densities, True)
