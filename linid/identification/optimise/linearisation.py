"""Weighted residuals of a fitting problem and their derivatives by search coordinates and start offsets."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array, Flags, joined
from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.objective import counts_samples
from linid.identification.objectives.problem import COORDINATE_STEP, OFFSET_STEP, Cost, Problem
from linid.identification.optimise.tangent import Block, Tangent, finite

_OFFSET_LIMIT = 1e4
_OUTLIER = 9.0  # times the median power: groups beyond it are bursts or unstable breakaways


class Told(NamedTuple):
    """What the simulation tells without weights. x: (p + k,); parts: of each, residuals (N,) there and slopes (N, p + 2
    or fewer)."""

    x: Array
    parts: list[tuple[Array, Array]]


class Linearisation:
    """Weighted residuals and their Jacobian, each by one batch of simulations.

    x: (p + k,) search coordinates, then offsets; the Jacobian is by them. weights: (N,) of each part's residuals (none:
    all count alike); told: what is known already; wanted: (p,) search coordinates by which it is wanted (None: all),
    where it is not by differences; by_groups: in the weights each group of a free run counts, never each sample.
    """

    def __init__(
        self,
        problem: Problem,
        cost: Cost,
        *,
        weights: Sequence[Array] = (),
        told: Told | None = None,
        wanted: Flags | None = None,
        by_groups: bool = False,
    ) -> None:
        self.problem = problem
        self.cost = cost
        self.told, self._wanted = told, wanted
        self.by_groups, self.samples_count = by_groups, False
        self.p = len(problem.space.parameters)
        self.k = problem.nuisances
        self.jobs = max(getattr(part, "jobs", 1) for part in problem.parts)
        self.weights = list(weights) or [np.ones(part.classes.size) for part in problem.parts]
        self._latest: tuple[Array, list[Array]] | None = None
        self._carried_at: tuple[Array, list[Array], Tangent] | None = None

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Least and greatest search coordinates and offsets, (p + k,) each."""
        offsets = np.full(self.k, _OFFSET_LIMIT)
        return np.concatenate([np.zeros(self.p), -offsets]), np.concatenate([np.ones(self.p), offsets])

    def reweight(self, x: Array) -> float:
        """Set the weights from the class RMS at x and from how many residuals are independent, by the slopes that were
        last told; returns the cost there."""
        self._carried_at = None
        if self.problem.carries_slopes and self.told is None:
            self._tell(x)
        rows = self.rows(x)
        found = self.cost.class_rms(rows)
        self.samples_count = False
        for index, rms in enumerate(found):
            part = self.problem.parts[index]
            sizes = np.maximum(np.bincount(part.classes, minlength=rms.shape[1]), 1)
            counts = self.cost.counts[index]
            if counts_samples(part) and not self.by_groups:  # noise of the encoder alone makes every sample count
                slopes = None if self.told is None else self.told.parts[index][1]
                counts = np.maximum(counts, part.independent(rows[index][0], slopes))
                self.samples_count |= bool(np.any(counts > self.cost.counts[index]))
            scale = np.sqrt(counts / sizes) / rms[0]
            self.weights[index] = scale[part.classes]
            trust = part.trust[part.groups] if isinstance(part, Ahead) and part.trust is not None else 1.0
            self.weights[index] *= trust
            if part.robust:
                relative = rows[index][0] / rms[0][part.classes]
                self.weights[index] *= _group_weights(relative * trust, part.groups)
        return float(self.cost.of_class_rms(found)[0])

    def rows(self, x: Array) -> list[Array]:
        """Residuals (1, N) of each part at x = search coordinates and offsets, without weights."""
        if self._latest is None or not np.array_equal(self._latest[0], x):
            self.cost.evaluations += 1
            self._latest = x.copy(), self.problem.residuals(x[None, : self.p], x[None, self.p :])
        return self._latest[1]

    def residuals(self, x: Array) -> Array:
        """Weighted residuals (N,) at x = search coordinates and offsets; a failed simulation gives large ones."""
        rows = self.rows(x)
        joined = np.concatenate([row[0] * weight for row, weight in zip(rows, self.weights, strict=True)])
        return finite(joined)

    def length(self, x: Array) -> Array:
        """The weighted residuals (p + k + 1,) in axes whose first one points along them: their length, then zeros."""
        out = np.zeros(self.p + self.k + 1)
        out[0] = np.linalg.norm(self.residuals(x))
        return out

    def rotated_jacobian(self, x: Array) -> Array:
        """(p + k + 1, p + k) in the axes of `length`."""
        residual, jacobian = self.tangent(x).rotated
        return jacobian * (1.0 if residual[0] >= 0.0 else -1.0)

    def jacobian(self, x: Array, *, central: bool = False) -> Array:
        """(N, p + k) of the weighted residuals; central: where it is by differences, these are to both sides."""
        return self.tangent(x, central=central).dense[1]

    def tangent(self, x: Array, *, central: bool = False) -> Tangent:
        """Weighted residuals and their Jacobian: as the simulation carries it along, or by finite differences in one
        batch; central: differences to both sides."""
        if not self.problem.carries_slopes:
            return self._differences(x, central)
        kept = self._carried_at
        if kept is None or kept[1] is not self.weights or not np.array_equal(kept[0], x):
            kept = self._carried_at = x.copy(), self.weights, self._carried(x)
        return kept[2]

    def _differences(self, x: Array, central: bool) -> Tangent:
        """By finite differences. Offsets of all recordings are shifted together."""
        p, k = self.p, self.k
        steps = np.full(p, COORDINATE_STEP)
        if not central:
            steps[x[:p] + COORDINATE_STEP > 1.0] *= -1.0
        kinds = 2 if k else 0
        rows = [x]
        rows += [x + np.concatenate([row, np.zeros(k)]) for row in np.diag(steps)]
        for kind in range(kinds):
            shift = np.zeros(p + k)
            shift[p + kind :: 2] = OFFSET_STEP
            rows.append(x + shift)
        if central:
            rows += [x - np.concatenate([row, np.zeros(k)]) for row in np.diag(steps)]
        values = self.batch(np.array(rows))
        base = values[0]
        slopes = np.empty((base.size, p + kinds))
        for column in range(p):
            before, width = (values[1 + p + kinds + column], 2.0) if central else (base, 1.0)
            slopes[:, column] = (values[1 + column] - before) / (width * steps[column])
        for kind in range(kinds):
            slopes[:, p + kind] = (values[1 + p + kind] - base) / OFFSET_STEP
        sizes = [part.classes.size for part in self.problem.parts]
        edges = np.cumsum([0, *sizes])
        found = [(base[a:b], slopes[a:b]) for a, b in pairwise(edges)]
        return self._of_parts(found, [np.ones(size) for size in sizes])

    def _carried(self, x: Array) -> Tangent:
        """With exact derivatives."""
        return self._of_parts(self._tell(x).parts, self.weights)

    def _tell(self, x: Array) -> Told:
        """What the simulation tells at x, with exact derivatives; each counts as an evaluation."""
        p, k = self.p, self.k
        if self.told is None or not np.array_equal(self.told.x, x):
            shifts = np.array([np.arange(k) % 2 == kind for kind in range(2)], dtype=float)[: 2 if k else 0]
            self.cost.evaluations += 1 + p + len(shifts)
            self.told = Told(x.copy(), self.problem.slopes(x[:p], x[p:], shifts, self._wanted))
        return self.told

    def _of_parts(self, found: Sequence[tuple[Array, Array]], weights: Sequence[Array]) -> Tangent:
        """A tangent of each part's residuals (n,) and slopes (n, p) or, where it has offsets, (n, p + 2), by shifting
        the start positions and the start speeds of all recordings together."""
        blocks, at, coordinates = [], self.p, np.arange(self.p)
        for part, (row, slopes), weight in zip(self.problem.parts, found, weights, strict=True):
            residuals = finite(row * weight)
            if not part.nuisances:
                blocks.append(Block(residuals, slopes[:, : self.p], weight, coordinates))
                continue
            owner = part.group_recording[part.groups]
            edges = np.concatenate([[0], np.flatnonzero(np.diff(owner)) + 1, [owner.size]])
            for a, b in pairwise(edges):
                columns = np.concatenate([coordinates, at + 2 * owner[a] + np.arange(2)])
                blocks.append(Block(residuals[a:b], slopes[a:b], weight[a:b], columns))
            at += part.nuisances
        return Tangent(tuple(blocks), self.p + self.k, self.jobs)

    def batch(self, batch: Array) -> Array:
        """Weighted residuals (C, N) of a batch (C, p + k) of search coordinates and offsets."""
        self.cost.evaluations += batch.shape[0]
        parts = self.problem.residuals(batch[:, : self.p], batch[:, self.p :])
        weighted = [part * weight for part, weight in zip(parts, self.weights, strict=True)]
        return joined(weighted, 1)


def _group_weights(relative: Array, groups: NDArray[np.int64]) -> Array:
    """Weights of residuals (N,) by Huber's rule on whole groups: 1 up to `_OUTLIER` times the median power.

    relative: residuals over their class RMS. One step of the usual iteratively reweighted least squares.
    """
    power = np.bincount(groups, np.nan_to_num(relative, nan=1e3) ** 2) / np.maximum(np.bincount(groups), 1)
    limit = _OUTLIER * max(float(np.median(power)), 1e-300)
    return np.asarray(np.sqrt(np.minimum(1.0, limit / np.maximum(power, 1e-300)))[groups])
