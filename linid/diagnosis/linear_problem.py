"""The linear least-squares problem of one step of a fit, with damping, bounds and an active set."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array

_PRIOR = 1e-6  # of a bin's weight: holds what no row tells where it is


class LinearProblem:
    """The least-squares problem of a fit's steps about one place, in scaled unknowns.

    slopes: (p, n) of residual (n,); weights: (n,) of both; answers: (n,) by how much the criterion answers a square
    there, where a step counts it in full; pull: (p,) half the slope of what else is to be lessened.
    """

    def __init__(self, slopes: Array, residual: Array, weights: Array, answers: Array, pull: Array) -> None:
        self.columns = slopes * weights
        self._by_residual = weights * answers
        normal = self.columns @ self.columns.T
        norms = np.sqrt(np.diag(normal))
        # What no row tells stays where it is.
        norms[norms < 1e-12 * max(float(np.max(norms, initial=0.0)), 1e-300)] = np.inf
        self.norms = norms
        self.normal = normal / norms / norms[:, None]
        self.half_slope = self._half_slope(residual) + pull

    def _half_slope(self, residual: Array) -> Array:
        return np.asarray(self.columns @ (self._by_residual * residual))

    def step(self, damping: float, room: tuple[Array, Array], missed: Array | None = None) -> tuple[Array, float]:
        """The damped Gauss-Newton step (p,) within the room, and the decrease that it promises of the sum of squares.

        missed: (n,) of the residual, what a straight step left out.
        """
        norms, normal = self.norms, self.normal
        moment = (self.half_slope if missed is None else self.half_slope + self._half_slope(missed)) / norms
        told = np.isfinite(norms)
        lower, upper = (np.where(told, edge * np.where(told, norms, 0.0), 0.0) for edge in room)
        system = normal + (damping + _PRIOR) * np.eye(norms.size)
        move = np.linalg.solve(system, -moment)
        free = np.ones(norms.size, dtype=np.bool_)
        for _ in range(norms.size):  # an active set: what leaves its room stays at the edge
            outside = free & ((move < lower) | (move > upper))
            if not np.any(outside):
                break
            free &= ~outside
            move = np.where(free, move, np.clip(move, lower, upper))
            if np.any(free):
                rest = -moment[free] - system[np.ix_(free, ~free)] @ move[~free]
                move[free] = np.linalg.solve(system[np.ix_(free, free)], rest)
        predicted = -float(2.0 * moment @ move + move @ normal @ move)
        return np.asarray(np.where(told, move / norms, 0.0)), predicted
