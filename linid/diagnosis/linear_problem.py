"""The linear least-squares problem of one step of a fit, with damping, bounds and an active set."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from linid.arrays import Array

_DAMPINGS = 10.0 ** np.arange(-9.0, 6.01, 0.25)
_PRIOR = 1e-6  # of a bin's weight: holds what no row tells where it is


class LinearProblem:
    """The least-squares problem of a fit's steps about one place, in scaled unknowns.

    slopes: (p, n) of residual (n,); weights: (n,) of both; answers: (n,) by how much the criterion answers a square
    there, where a step counts it in full; pull: (p,) half the slope of what else is to be lessened. `lengths`: (p,) of
    the weighted slopes; `norms`: the same, infinite where no row tells.
    """

    def __init__(self, slopes: Array, residual: Array, weights: Array, answers: Array, pull: Array) -> None:
        columns = slopes * weights
        normal = columns @ columns.T
        self.lengths = norms = np.sqrt(np.diag(normal))
        # What no row tells stays where it is.
        told = norms >= 1e-12 * max(float(np.max(norms, initial=0.0)), 1e-300)
        self.norms = norms = np.where(told, norms, np.inf)
        self.normal = normal / norms / norms[:, None]
        self.half_slope = columns @ (weights * answers * residual) + pull

    @cached_property
    def _spectrum(self) -> tuple[Array, Array]:
        """Eigenvalues (p,) of the scaled problem, and squares of what asks for a step along its eigenvectors."""
        values, vectors = np.linalg.eigh(self.normal)
        return np.maximum(values, 0.0) + _PRIOR, (vectors.T @ (self.half_slope / self.norms)) ** 2

    def length(self, damping: float) -> float:
        """Length of the step in scaled unknowns, if nothing bounds it."""
        values, squares = self._spectrum
        return math.sqrt(float(np.sum(squares / (values + damping) ** 2)))

    def damping_within(self, radius: float, otherwise: float) -> float:
        """The least damping whose step is no longer than the radius, if nothing bounds it; otherwise: for any length.

        Where a damping is small beside all that rows tell, ten times as much leaves the step as it was.
        """
        if math.isinf(radius):
            return otherwise
        values, squares = self._spectrum
        fits = np.sum(squares / (values + _DAMPINGS[:, None]) ** 2, axis=1) <= radius**2
        return float(_DAMPINGS[np.argmax(fits) if np.any(fits) else -1])

    def step(self, damping: float, room: tuple[Array, Array]) -> tuple[Array, float]:
        """The damped Gauss-Newton step (p,) within the room, and the decrease that it promises of the sum of
        squares."""
        norms, normal = self.norms, self.normal
        moment = self.half_slope / norms
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
