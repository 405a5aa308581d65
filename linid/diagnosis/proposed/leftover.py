"""What base and further columns leave of the fitted rows."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array
from linid.diagnosis.proposed.problem import Problem

_RELATIVE = 1e-9  # of the largest: a direction of the base that is smaller is rounding
_RIDGE = 1e-9  # of a column's squares, so that columns alike can be fitted together


class Leftover:
    """The fitted rows beside the base with its prior, whose span is projected out once.

    mine: (m,) places of the fitted rows; rest: (m + r,) of what is left by the base alone, weighted, the prior's rows
    last.
    """

    def __init__(self, problem: Problem) -> None:
        self.mine = np.flatnonzero(~problem.held)
        self._weights = problem.weights[self.mine, None]
        self._prior_rows = problem.ridge.size
        self._count = problem.rest.size
        base = np.vstack([problem.base[self.mine], np.diag(problem.ridge)])
        norms = np.maximum(np.linalg.norm(base, axis=0), 1e-300)
        left, sizes, _ = np.linalg.svd(base / norms, full_matrices=False)
        self._span = left[:, sizes > _RELATIVE * sizes[0]]
        self.rest = self._cleared(np.concatenate([problem.rest[self.mine], np.zeros(self._prior_rows)]))

    def beside(self, columns: Array) -> Array:
        """What base and columns (n, k) in m/s^2 leave, (m + r,) as `rest`."""
        own = columns[self.mine] * self._weights
        own = self._cleared(np.vstack([own, np.zeros((self._prior_rows, own.shape[1]))]))
        norms = np.linalg.norm(own, axis=0)
        scaled = own / np.where(norms > 0.0, norms, 1.0)
        normal = scaled.T @ scaled + _RIDGE * np.eye(scaled.shape[1])
        return np.asarray(self.rest - scaled @ np.linalg.solve(normal, scaled.T @ self.rest))

    def of_rows(self, columns: Array) -> Array:
        """The same in all rows, (n,), of columns (n, k) in m/s^2; 0 in those that are not fitted."""
        out = np.zeros(self._count)
        out[self.mine] = self.beside(columns)[: self.mine.size]
        return out

    def _cleared(self, x: Array) -> Array:
        return np.asarray(x - self._span @ (self._span.T @ x))
