"""Shares of the gap: what each effect causes, whatever the order in which the effects are added.

The gap is the mean square of the acceleration that the base misses, in units of the noise, above its floor. A set of
effects closes of it what is gone once the base has been fitted again beside them; an effect's share is the mean of what
it closes over all orders in which the effects can be added (Shapley 1953, Contributions to the Theory of Games 2, 307).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model

Array = NDArray[np.float64]

_EXACT = 6  # effects up to which all subsets are taken; of more, sampled orders
_ORDERS = 40
_RESAMPLES = 1000
# Of a share, by which a form that is not the library's may put it wrong for each share that stays unexplained.
_FORM = 1.0
_LEAST_GAP = 0.1  # of the floor, below which a gap has no shares to speak of


@dataclass(frozen=True)
class Portion:
    """Share of the gap with its 95 % interval, and what the effect closes first and last."""

    share: float
    low: float
    high: float
    first_in: float
    last_in: float


@dataclass(frozen=True)
class Shares:
    """rows: judged; before, after: excess over the floor in floors; closed and unexplained shares with 95 % intervals;
    portions: by effect."""

    rows: NDArray[np.bool_]
    before: float
    after: float
    closed: tuple[float, float, float]
    unexplained: tuple[float, float, float]
    portions: dict[str, Portion]


def shares_of(judge: Judge, base: Fitted, best: Fitted, seed: int) -> Shares:
    """The budget's shares for the effects that a model has beyond the base's, over held-out rows and those of
    single-recording effects."""
    effects = tuple(name for name in best.model.effects if name not in base.model.effects)
    rows = judged_rows(judge, best)
    game = _Game(judge, best, effects, rows)
    values = {frozenset(subset): game.power(subset) for subset in _subsets(effects, seed)}
    nothing, everything = values[frozenset()], values[frozenset(effects)]
    shapley = _shapley(effects, values, seed)
    blocks = game.floor.size
    generator = np.random.default_rng(seed)
    draws = np.vstack([np.ones(blocks), generator.multinomial(blocks, np.full(blocks, 1.0 / blocks), _RESAMPLES)])
    gap = draws @ (nothing - game.floor)
    # A gap that is hardly one has no shares to speak of: the floor itself is known to some per cent only.
    least = _LEAST_GAP * (draws @ game.floor)
    gap = np.maximum(gap, least)

    def interval(parts: Array, doubt: float) -> tuple[float, float, float]:
        ratio = (draws @ parts) / gap
        low, high = np.quantile(ratio[1:], [0.025, 0.975]).tolist()
        value = float(ratio[0])
        return value, value - math.hypot(value - low, doubt), value + math.hypot(high - value, doubt)

    rest = interval(everything - game.floor, 0.0)
    closed = interval(nothing - everything, 0.0)
    portions = {}
    for name in effects:
        size = float(draws[0] @ shapley[name]) / float(gap[0])
        # What a cause of another form leaves is as likely to belong to a large share as it is large.
        doubt = _FORM * max(rest[0], 0.0) * math.sqrt(min(max(size, 0.0), 1.0))
        value, low, high = interval(shapley[name], doubt)
        others = frozenset(effects) - {name}
        first = float(draws[0] @ (nothing - values[frozenset({name})])) / float(gap[0])
        last = float(draws[0] @ (values[others] - everything)) / float(gap[0])
        portions[name] = Portion(value, low, high, first, last)
    floor = float(game.floor.sum())
    before, after = (float(x.sum()) / floor - 1.0 for x in (nothing, everything))
    return Shares(rows, before, after, closed, rest, portions)


def judged_rows(judge: Judge, best: Fitted) -> NDArray[np.bool_]:
    """Held-out rows, and those of the recordings of an effect that acts in no held-out one."""
    values = {**best.values, **best.structural}
    rows = judge.balance.split.copy()
    for name in best.model.effects:
        own = judge.rows_of(name, values) if find_effect(name).per_recording else rows
        if not np.any(own & judge.balance.split):
            rows |= own
    return rows


class _Game:
    """What any subset of a model's effects leaves: squares in units of the noise per block of the judged rows."""

    def __init__(self, judge: Judge, best: Fitted, effects: tuple[str, ...], rows: NDArray[np.bool_]) -> None:
        self.judge = judge
        self.best = best
        self.effects = effects
        balance = judge.balance
        self.inverse = judge.fits.inverse
        owner = balance.rows.block
        self.places = np.unique(owner[rows])
        self.rows = rows
        self.block = np.searchsorted(self.places, owner[rows])
        self.floor = self._sums(judge.fits.reference[owner])
        self.fitted = judge.fits.rows_of(best.recordings)
        slopes = judge.fits.slopes(best)
        self.unknowns = judge.fits.unknowns(best)
        self.columns = np.array([slopes[c.name] * self.inverse for c in self.unknowns])
        level = math.sqrt(float(np.mean(judge.fits.reference[owner])))
        self.ridge = np.array([level / c.scale if c.log else 0.0 for c in self.unknowns])

    def _sums(self, x: Array) -> Array:
        return np.asarray(np.bincount(self.block, x[self.rows], minlength=self.places.size), dtype=np.float64)

    def power(self, subset: Sequence[str]) -> Array:
        """What is left per block with these effects alone, the rest of the model fitted again by least squares."""
        model = self.best.model
        absent = [name for name in self.effects if name not in subset]
        vector = self.best.vector.copy()
        gone: set[str] = set()
        for name in absent:
            effect = find_effect(name)
            gone |= {p.name for p in effect.parameters}
            vector[[model.slot(amplitude) for amplitude in effect.amplitudes]] = 0.0
        kept = Model(model.kind, tuple(name for name in model.effects if name not in absent))
        residual = self.judge.balance.residual(kept, vector) if absent else self.best.residual
        residual = residual * self.inverse
        free = [k for k, c in enumerate(self.unknowns) if c.name not in gone]
        columns = self.columns[free]
        matrix = columns[:, self.fitted]
        ridge = self.ridge[free]
        norms = np.sqrt(np.einsum("ij,ij->i", matrix, matrix) + ridge**2) + 1e-300
        scaled = matrix / norms[:, None]
        normal = scaled @ scaled.T + np.diag((ridge / norms) ** 2)
        step = -np.linalg.lstsq(normal, scaled @ residual[self.fitted], rcond=1e-9)[0] / norms
        return self._sums((residual + step @ columns) ** 2)


def _subsets(effects: tuple[str, ...], seed: int) -> list[tuple[str, ...]]:
    """All subsets, or of many effects those along sampled orders, with all that lack one and all of one."""
    if len(effects) <= _EXACT:
        return [subset for size in range(len(effects) + 1) for subset in combinations(effects, size)]
    found = {(), effects, *((name,) for name in effects)}
    found |= {tuple(e for e in effects if e != name) for name in effects}
    for order in _orders(effects, seed):
        found |= {tuple(e for e in effects if e in order[:k]) for k in range(len(order))}
    return sorted(found)


def _orders(effects: tuple[str, ...], seed: int) -> list[tuple[str, ...]]:
    """Sampled orders, each with its reverse, which halves the scatter."""
    generator = np.random.default_rng(seed)
    out = []
    for _ in range(_ORDERS // 2):
        order = tuple(effects[k] for k in generator.permutation(len(effects)))
        out += [order, order[::-1]]
    return out


def _shapley(effects: tuple[str, ...], values: dict[frozenset[str], Array], seed: int) -> dict[str, Array]:
    """Per effect the mean over orders of what it takes away, per block."""
    out = {name: np.zeros_like(values[frozenset()]) for name in effects}
    n = len(effects)
    if n > _EXACT:
        orders = _orders(effects, seed)
        for order in orders:
            for k, name in enumerate(order):
                out[name] += (values[frozenset(order[:k])] - values[frozenset(order[: k + 1])]) / len(orders)
        return out
    for name in effects:
        others = [e for e in effects if e != name]
        for size in range(n):
            weight = math.factorial(size) * math.factorial(n - size - 1) / math.factorial(n)
            for subset in combinations(others, size):
                chosen = frozenset(subset)
                out[name] += weight * (values[chosen] - values[chosen | {name}])
    return out
