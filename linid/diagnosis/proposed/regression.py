"""Penalised regression of what is left on a family, beside all that the base can do; judged where it is not fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from linid.arrays import Array, Integers
from linid.diagnosis.proposed.family import Family
from linid.diagnosis.proposed.problem import Problem

# Penalties that are tried, in parts of the mean square of the columns: from hardly bent to free.
PENALTIES = tuple(10.0**k for k in range(-4, 4))
FOLDS = 5
_LEAST_RIDGE = 1e-9  # of normal equations
_JUDGE = -2  # fold of the rows that judge


@dataclass(frozen=True)
class Split:
    """Rows in groups that are left out in turn. fold: (n,) of each row; order: (n,) that sorts them by it; selecting,
    judging: folds whose gain selects, and whose gain judges; apart: whether the judging rows are fitted to never."""

    fold: Integers
    order: Integers
    selecting: tuple[int, ...]
    judging: tuple[int, ...]
    apart: bool

    def fitted(self, fold: int) -> bool:
        """Whether a fold's rows are fitted to at all."""
        return not (self.apart and fold in self.judging)

    def fitted_sum(self, parts: Mapping[int, Array]) -> Array:
        """Sum (r, c) of parts (r, c) of the folds that may be fitted to."""
        return np.asarray(np.sum([part for fold, part in parts.items() if self.fitted(fold)], axis=0))

    def elsewhere(self, fold: int, whole: Array, parts: Mapping[int, Array]) -> Array:
        """A `fitted_sum`, whole (r, c), without what one fold has in it, (r, c); parts: (r, c) of each fold."""
        return whole - parts[fold] if self.fitted(fold) else whole

    def slices(self) -> dict[int, slice]:
        """Where each fold's rows lie once they are sorted."""
        numbers, starts = np.unique(self.fold[self.order], return_index=True)
        ends = [*starts[1:], self.order.size]
        return {int(k): slice(int(a), int(b)) for k, a, b in zip(numbers, starts, ends, strict=True)}


def split_of(problem: Problem, local: float) -> Split:
    """The groups for families with common coefficients (fitted recordings in turn; the held-out ones judge), or for
    those with coefficients per recording (local, s: pieces of that length in turn, everywhere)."""
    rows, held = problem.rows, problem.held
    if local:
        piece = (rows.t / local).astype(np.int64) + rows.recording
        fold = piece % FOLDS + np.where(held, FOLDS, 0)
        groups = range(FOLDS), range(FOLDS, 2 * FOLDS)
    else:
        fitted = np.unique(rows.recording[~held])
        rank = np.searchsorted(fitted, rows.recording)
        if fitted.size < FOLDS:  # each of so few may be all that tells something: their parts in turn
            ends = np.zeros(int(rows.recording.max()) + 1)
            np.maximum.at(ends, rows.recording, rows.t)
            rank = rank + (FOLDS * rows.t / (1.001 * ends[rows.recording])).astype(np.int64)
        fold = np.where(held, _JUDGE, rank % FOLDS)
        groups = range(FOLDS), range(_JUDGE, _JUDGE + 1)
    there = set(fold.tolist())  # a short recording has rows in few pieces
    selecting, judging = (tuple(number for number in group if number in there) for group in groups)
    return Split(fold, np.argsort(fold, kind="stable"), selecting, judging, not local)


class Sums:
    """The base's normal equations by fold, which all families of one split share."""

    def __init__(self, problem: Problem, local: float) -> None:
        self.problem = problem
        self.split = split_of(problem, local)
        self.slices = self.split.slices()
        self.base = problem.base[self.split.order]
        self.weights = problem.weights[self.split.order]
        self.rest = problem.rest[self.split.order]
        self.normals = {k: self.base[s].T @ self.base[s] for k, s in self.slices.items()}
        self.prior = np.diag(problem.ridge**2)

    @cached_property
    def moments(self) -> dict[int, Array]:
        """Products (r, 1) of the base's columns with what is left, per fold."""
        return {k: self.base[s].T @ self.rest[s, None] for k, s in self.slices.items()}

    @cached_property
    def squares(self) -> dict[int, Array]:
        """Squares (1,) of what is left, per fold."""
        return {k: np.sum(self.rest[s, None] ** 2, axis=0) for k, s in self.slices.items()}

    @cached_property
    def left(self) -> float:
        """Squares that the base alone, fitted elsewhere, leaves of the rows that select."""
        total, moment = self.split.fitted_sum(self.normals) + self.prior, self.split.fitted_sum(self.moments)
        left = 0.0
        for k in self.split.selecting:
            system = self.split.elsewhere(k, total, self.normals) + _LEAST_RIDGE * np.eye(len(total))
            solution = np.linalg.solve(system, self.split.elsewhere(k, moment, self.moments))
            left += float(_squares_left(self.squares[k], np.asarray(solution), self.moments[k], self.normals[k])[0])
        return left


class Regression:
    """One family beside the base: normal equations per fold, from which all penalties and draws follow."""

    def __init__(self, sums: Sums, family: Family) -> None:
        self.sums, self.family = sums, family
        columns = family.columns[sums.split.order] * sums.weights[:, None]
        size = float(np.sqrt(np.mean(columns**2)))
        self.size = size if size > 0.0 else 1.0
        self.columns = columns / self.size
        r, k = sums.base.shape[1], columns.shape[1]
        self.r = r
        self.normals: dict[int, Array] = {}
        for fold, rows in sums.slices.items():
            out = np.empty((r + k, r + k))
            out[:r, :r] = sums.normals[fold]
            out[:r, r:] = sums.base[rows].T @ self.columns[rows]
            out[r:, :r] = out[:r, r:].T
            out[r:, r:] = self.columns[rows].T @ self.columns[rows]
            self.normals[fold] = out
        self.total = sums.split.fitted_sum(self.normals)
        self.total[:r, :r] += sums.prior
        rows_in_all = sums.weights.size
        trace = max(float(np.trace(family.roughness)) / k, 1e-12)
        self.rough = np.zeros_like(self.total)
        self.rough[r:, r:] = rows_in_all / k * (family.roughness / trace + 1e-6 * np.eye(k))

    def moments(self, draws: Array) -> dict[int, Array]:
        """Products (r + k, D) of all columns with draws (n, D) of what is left, per fold; draws: in sorted order."""
        out = {}
        for fold, rows in self.sums.slices.items():
            out[fold] = np.vstack([self.sums.base[rows].T @ draws[rows], self.columns[rows].T @ draws[rows]])
        return out

    @cached_property
    def own_moments(self) -> dict[int, Array]:
        """Products (r + k, 1) of all columns with what is left, per fold."""
        rest = self.sums.rest[:, None]
        return {
            fold: np.vstack([self.sums.moments[fold], self.columns[rows].T @ rest[rows]])
            for fold, rows in self.sums.slices.items()
        }

    def gains(self, draws: Array, penalty: float) -> Array:
        """Shares (D,) of the squares of draws (n, D) that the family takes away of the rows that select, where it is
        not fitted to them.

        draws: in sorted order; penalty: in parts of the columns' mean square.
        """
        moments = self.moments(draws)
        squares = {fold: np.sum(draws[rows] ** 2, axis=0) for fold, rows in self.sums.slices.items()}
        before, left = (self._left(moments, squares, penalty, size) for size in (self.r, self.total.shape[0]))
        return np.asarray(1.0 - left / np.maximum(before, 1e-300))

    def _left(self, moments: dict[int, Array], squares: dict[int, Array], penalty: float, size: int) -> Array:
        """Squares (D,) that the first columns, so many, fitted elsewhere, leave of the rows that select; squares: (D,)
        of each fold's rows."""
        split, whole = self.sums.split, self.sums.split.fitted_sum(moments)
        out = np.zeros(whole.shape[1])
        for fold in split.selecting:
            system = self.system(split.elsewhere(fold, self.total, self.normals), penalty)[:size, :size]
            solution = np.asarray(np.linalg.solve(system, split.elsewhere(fold, whole, moments)[:size]))
            out += _squares_left(squares[fold], solution, moments[fold][:size], self.normals[fold][:size, :size])
        return out

    @cached_property
    def best(self) -> tuple[float, float]:
        """The penalty that predicts best, and its gain on the rows that select."""
        split, whole = self.sums.split, self.sums.split.fitted_sum(self.own_moments)
        penalised = np.array(PENALTIES)[:, None, None] * self.rough + _LEAST_RIDGE * np.eye(len(self.rough))
        left = np.zeros(len(PENALTIES))
        for fold in split.selecting:
            systems = split.elsewhere(fold, self.total, self.normals) + penalised
            moment = split.elsewhere(fold, whole, self.own_moments)
            solutions = np.asarray(np.linalg.solve(systems, moment[None])[:, :, 0].T, dtype=np.float64)
            left += _squares_left(self.sums.squares[fold], solutions, self.own_moments[fold], self.normals[fold])
        gains = 1.0 - left / max(self.sums.left, 1e-300)
        place = int(np.argmax(gains))
        return PENALTIES[place], float(gains[place])

    def solution(self, penalty: float | None = None) -> tuple[Array, Array]:
        """Coefficients (k,) in N and steps (r,) of the base's unknowns, by all rows that may be fitted; penalty: in
        place of the one that predicts best."""
        moment = self.sums.split.fitted_sum(self.own_moments)
        x = np.linalg.solve(self.system(self.total, penalty), moment)[:, 0]
        coefficients, steps = (np.asarray(part, dtype=np.float64) for part in (x[self.r :] / self.size, x[: self.r]))
        return coefficients, steps

    @property
    def fitted_rows(self) -> Integers:
        """Places (m,) in sorted order of all rows that may be fitted."""
        slices = self.sums.slices.items()
        return np.concatenate([np.arange(s.start, s.stop) for fold, s in slices if self.sums.split.fitted(fold)])

    def block_squares(self, folds: tuple[int, ...], penalty: float | None = None) -> tuple[Array, Array]:
        """Squares (b,) per block that the base alone and the family leave of some folds, fitted elsewhere."""
        split, moments = self.sums.split, self.own_moments
        whole = split.fitted_sum(moments)
        squares: list[list[Array]] = [[], []]
        owner = []
        for fold in folds:
            rows = self.sums.slices[fold]
            normal, moment = split.elsewhere(fold, self.total, self.normals), split.elsewhere(fold, whole, moments)
            matrix = np.hstack([self.sums.base[rows], self.columns[rows]])
            for place, size in enumerate((self.r, matrix.shape[1])):
                x = np.linalg.solve(self.system(normal, penalty)[:size, :size], moment[:size])[:, 0]
                squares[place].append((self.sums.rest[rows] - matrix[:, :size] @ x) ** 2)
            owner.append(self.sums.problem.rows.block[split.order][rows])
        numbers = np.unique(np.concatenate(owner), return_inverse=True)[1]
        before, after = (np.bincount(numbers, np.concatenate(part)) for part in squares)
        return before.astype(np.float64), after.astype(np.float64)

    def closed(self, penalty: float | None = None) -> float:
        """Share of the excess over the floor that the family closes on the judging rows."""
        return closed_share(self.sums.problem, *self.block_squares(self.sums.split.judging, penalty))

    def closed_draws(self, count: int) -> Array:
        """The same of `count` resamples of the judging rows' blocks, (count,)."""
        return closed_draws(self.sums.problem, *self.block_squares(self.sums.split.judging), count)

    def system(self, normal: Array, penalty: float | None = None) -> Array:
        """Normal equations (r + k, r + k) with a penalty, the one that predicts best where none is given. normal:
        (r + k, r + k) without it.
        """
        penalty = self.best[0] if penalty is None else penalty
        return np.asarray(normal + penalty * self.rough + _LEAST_RIDGE * np.eye(normal.shape[0]))


def _squares_left(squares: Array, solution: Array, moment: Array, normal: Array) -> Array:
    """Squares (D,) that are left of squares (D,) of some rows by coefficients (s, D); moment (s, D), normal (s, s): of
    these rows."""
    left = squares - 2.0 * np.sum(solution * moment, axis=0)
    return np.asarray(left + np.sum(solution * (normal @ solution), axis=0))


def held_squares(problem: Problem, residual: Array) -> Array:
    """Weighted squares (b,) of a model's residual (n,) in m/s^2 per block of the judging rows."""
    mine = problem.held
    block = np.unique(problem.rows.block[mine], return_inverse=True)[1]
    return np.asarray(np.bincount(block, (residual * problem.weights)[mine] ** 2), dtype=np.float64)


def closed_share(problem: Problem, had: Array, left: Array) -> float:
    """Share of the excess over the floor that is closed. had, left: squares (b,) per block of judging rows, before and
    after."""
    return float((had - left).sum()) / max(float(had.sum()), 1e-300) / _above(problem)


def closed_draws(problem: Problem, had: Array, left: Array, count: int) -> Array:
    """The same of `count` resamples of the blocks, (count,). had, left: (b,) as in `closed_share`."""
    generator = np.random.default_rng(problem.seed)
    draws = generator.multinomial(had.size, np.full(had.size, 1.0 / had.size), count)
    return np.asarray(draws @ (had - left) / np.maximum(draws @ had, 1e-300) / _above(problem))


def _above(problem: Problem) -> float:
    """Share of what is left on the judging rows that is above the floor."""
    return max(1.0 - problem.floor, 1e-9)
