"""The local polish: bounded least squares on genes and start offsets, with the class noise re-estimated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linid.identification.free_run import FreeRun
from linid.identification.problem import Cost, Problem
from linid.identification.result import Generation

Array = NDArray[np.float64]
_GENE_STEP = 1e-5
_OFFSET_STEP = 0.3
_SETTLED = 3e-4  # relative change of the cost between rounds of re-estimated weights
POLISH_TOLERANCE = 1e-6
_OUTLIER = 9.0  # times the median power: groups beyond it are bursts or unstable breakaways


@dataclass(frozen=True)
class PolishResult:
    """genes (p,), offsets (k,), cost, whether it converged and why, history, and the final linearisation.

    residuals: (N,) weighted; jacobian: (N, p + k) of the weighted residuals; sigma: class RMS per part.
    """

    genes: Array
    offsets: Array
    cost: float
    converged: bool
    reason: str
    history: tuple[Generation, ...]
    evaluations: int
    residuals: Array
    jacobian: Array


class Linearisation:
    """Weighted residuals and their Jacobian, each by one batch of simulations."""

    def __init__(self, problem: Problem, cost: Cost) -> None:
        self.problem = problem
        self.cost = cost
        self.p = len(problem.space.genes)
        self.k = problem.nuisances
        self.weights = [np.ones(part.classes.size) for part in problem.parts]

    def reweight(self, x: Array) -> float:
        """Set the weights from the class RMS at x; returns the cost there."""
        rows = self._rows(x)
        for index, rms in enumerate(self.cost.class_rms(rows)):
            part = self.problem.parts[index]
            sizes = np.maximum(np.bincount(part.classes, minlength=rms.shape[1]), 1)
            scale = np.sqrt(self.cost.counts[index] / sizes) / rms[0]
            self.weights[index] = scale[part.classes]
            if part.robust:
                self.weights[index] *= _group_weights(rows[index][0] / rms[0][part.classes], part.groups)
        return float(self.cost.of_residuals(rows)[0])

    def _rows(self, x: Array) -> list[Array]:
        self.cost.evaluations += 1
        return self.problem.residuals(x[None, : self.p], x[None, self.p :])

    def residuals(self, x: Array) -> Array:
        """Weighted residuals (N,) at x = genes and offsets; a failed simulation gives large ones."""
        rows = self._rows(x)
        joined = np.concatenate([row[0] * weight for row, weight in zip(rows, self.weights, strict=True)])
        return np.asarray(np.nan_to_num(joined, nan=1e3, posinf=1e3, neginf=-1e3))

    def length(self, x: Array) -> Array:
        """The weighted residuals (p + k + 1,) in axes whose first one points along them: their length, then zeros."""
        out = np.zeros(self.p + self.k + 1)
        out[0] = np.linalg.norm(self.residuals(x))
        return out

    def rotated_jacobian(self, x: Array) -> Array:
        """(p + k + 1, p + k) in the axes of `length`: all that least squares needs to know of the long Jacobian."""
        base, jacobian = self._differences(x)
        triangle: Array = np.asarray(np.linalg.qr(np.column_stack([base, jacobian]), mode="r"))
        return triangle[:, 1:] * (1.0 if triangle[0, 0] >= 0.0 else -1.0)

    def jacobian(self, x: Array, *, central: bool = False) -> Array:
        """(N, p + k) of the weighted residuals."""
        return self._differences(x, central=central)[1]

    def _differences(self, x: Array, *, central: bool = False) -> tuple[Array, Array]:
        """Weighted residuals (N,) and their Jacobian by finite differences in one batch.

        Offsets of all recordings are shifted together.
        """
        p, k = self.p, self.k
        steps = np.full(p, _GENE_STEP)
        if not central:
            steps[x[:p] + _GENE_STEP > 1.0] *= -1.0
        kinds = 2 if k else 0
        rows = [x]
        rows += [x + np.concatenate([row, np.zeros(k)]) for row in np.diag(steps)]
        for kind in range(kinds):
            shift = np.zeros(p + k)
            shift[p + kind :: 2] = _OFFSET_STEP
            rows.append(x + shift)
        if central:
            rows += [x - np.concatenate([row, np.zeros(k)]) for row in np.diag(steps)]
        batch = np.array(rows)
        values = self.batch(batch)
        base = values[0]
        out = np.zeros((base.size, p + k))
        if central:
            for column in range(p):
                out[:, column] = (values[1 + column] - values[1 + p + kinds + column]) / (2.0 * steps[column])
        else:
            for column in range(p):
                out[:, column] = (values[1 + column] - base) / steps[column]
        owner = self._nuisance_owner()
        for kind in range(kinds):
            change = (values[1 + p + kind] - base) / _OFFSET_STEP
            for recording in range(k // 2):
                mask = owner == recording
                out[mask, p + 2 * recording + kind] = change[mask]
        base = np.nan_to_num(base, nan=1e3, posinf=1e3, neginf=-1e3)
        return base, np.nan_to_num(out, nan=0.0, posinf=0.0, neginf=0.0)

    def batch(self, batch: Array) -> Array:
        """Weighted residuals (C, N) of rows (C, p + k) of genes and offsets."""
        self.cost.evaluations += batch.shape[0]
        parts = self.problem.residuals(batch[:, : self.p], batch[:, self.p :])
        return np.concatenate([part * weight for part, weight in zip(parts, self.weights, strict=True)], axis=1)

    def _nuisance_owner(self) -> NDArray[np.int64]:
        """Per residual: index of the recording whose start offsets act on it, -1 if none."""
        owners, base = [], 0
        for part in self.problem.parts:
            if part.nuisances:
                owners.append(part.group_recording[part.groups] + base)
                base += part.nuisances // 2
            else:
                owners.append(np.full(part.classes.size, -1, dtype=np.int64))
        return np.concatenate(owners)


def _group_weights(relative: Array, groups: NDArray[np.int64]) -> Array:
    """Weights of residuals (N,) by Huber's rule on whole groups: 1 up to `_OUTLIER` times the median power.

    relative: residuals over their class RMS. One step of the usual iteratively reweighted least squares.
    """
    power = np.bincount(groups, np.nan_to_num(relative, nan=1e3) ** 2) / np.maximum(np.bincount(groups), 1)
    limit = _OUTLIER * max(float(np.median(power)), 1e-300)
    return np.asarray(np.sqrt(np.minimum(1.0, limit / np.maximum(power, 1e-300)))[groups])


def polish(
    problem: Problem,
    cost: Cost,
    genes: Array,
    offsets: Array | None = None,
    *,
    rounds: int = 6,
    max_evaluations: int = 15,
    tolerance: float = POLISH_TOLERANCE,
    final: bool = True,
    watch: Callable[[int, float], None] | None = None,
) -> PolishResult:
    """Refine genes (p,) with scipy's bounded trust-region least squares.

    offsets: start offsets (k,) to begin with; tolerance: relative change of cost or genes that ends a round; final:
    also return the linearisation at the end.
    Each round re-estimates the noise of the residual classes; rounds end when the cost has settled.
    """
    from scipy.optimize import least_squares

    line = Linearisation(problem, cost)
    p, k = line.p, line.k
    x = np.concatenate([np.clip(genes, 1e-9, 1.0 - 1e-9), np.zeros(k) if offsets is None else offsets])
    lower = np.concatenate([np.zeros(p), np.full(k, -1e4)])
    upper = np.concatenate([np.ones(p), np.full(k, 1e4)])
    best = line.reweight(x)
    history = []
    converged, reason = False, f"polish: {rounds} rounds used"
    settled = max(_SETTLED, tolerance)
    for number in range(rounds):
        solution = least_squares(
            line.length,
            x,
            jac=line.rotated_jacobian,
            bounds=(lower, upper),
            x_scale="jac",
            max_nfev=max_evaluations,
            ftol=tolerance,
            xtol=tolerance,
            gtol=1e-12,
        )
        x = np.asarray(solution.x)
        current = line.reweight(x)
        history.append(Generation("polish", number + 1, cost.evaluations, min(current, best), current))
        if watch is not None:
            watch(number + 1, current)
        gain = (best - current) / best
        best = min(best, current)
        if number > 0 and abs(gain) < settled and solution.status > 0:
            converged, reason = True, f"polish: relative gain {abs(gain):.1e} below {settled:g} ({solution.message})"
            break
    central = final and bool(np.all((x[:p] > 1e-4) & (x[:p] < 1.0 - 1e-4)))
    return PolishResult(
        x[:p],
        x[p:],
        best,
        converged,
        reason,
        tuple(history),
        cost.evaluations,
        line.residuals(x),
        line.jacobian(x, central=central) if final else np.zeros((0, 0)),
    )


def polish_starts(part: FreeRun, vector: Array, rounds: int = 3) -> Array:
    """Start offsets (1, 2 R) that bring free runs with given parameters (1, VECTOR_SIZE) nearest to the data."""
    offsets = np.zeros((1, part.nuisances))
    edges = part.simulator.inputs.sample_offsets
    for _ in range(rounds):
        shifted = np.repeat(offsets, 3, axis=0)
        shifted[1, 0::2] += _OFFSET_STEP
        shifted[2, 1::2] += _OFFSET_STEP
        rows = part.residuals(np.repeat(vector, 3, axis=0), shifted)
        if not np.all(np.isfinite(rows)):
            break
        for index in range(len(part.recordings)):
            a, b = edges[index], edges[index + 1]
            columns = (rows[1:, a:b] - rows[0, a:b]).T / _OFFSET_STEP
            offsets[0, 2 * index : 2 * index + 2] -= np.linalg.lstsq(columns, rows[0, a:b], rcond=None)[0]
    return offsets
