"""The weighted linear problem of a fitted model's next step: what its own parameters still take of the residual."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array
from linid.diagnosis.joint import Fitted, JointFit


class WeightedStep:
    """Weighted residual (N + p,) of a fitted model at some rows, and its columns (N + p, p) by the p unknowns.

    rows: (n,) of the balance, N of them chosen; slopes: d residual / d unknown (n,) by name, where they are known.
    Behind the rows stand those of a prior, which keeps the linear steps of parameters that are searched by their
    logarithm within reach (ridge regression).
    """

    def __init__(
        self, fits: JointFit, step: Fitted, rows: NDArray[np.bool_], slopes: Mapping[str, Array] | None = None
    ) -> None:
        self.weights = fits.weights(step.residual, step.floor, rows)[rows]
        self.bin = fits.balance.rows.bin[rows]
        slopes = fits.slopes(step) if slopes is None else slopes
        coordinates = fits.unknowns(step)
        self.p = len(coordinates)
        columns = np.empty((self.p, self.weights.size + self.p))  # one after the other, as linear algebra takes them
        for k, c in enumerate(coordinates):
            np.multiply(slopes[c.name][rows], -self.weights, out=columns[k, : self.weights.size])
        columns[:, self.weights.size :] = np.diag([c.stiffness for c in coordinates])
        columns /= np.maximum(np.linalg.norm(columns, axis=1), 1e-300)[:, None]
        self.columns = columns.T
        self.residual = np.concatenate([step.residual[rows] * self.weights, np.zeros(self.p)])
        power, floor, counts = fits.bin_powers(step.residual, step.floor, rows)
        self.counts, self.known = counts, counts > 0
        self.floor = np.where(self.known, floor / np.maximum(power + floor, 1e-300), 1.0)
        self._level = fits.level(step.residual, step.floor, rows)

    def logs(self, rest: Array) -> Array:
        """Log of what is left of each bin that has some, beside its floor, times its rows, (k,). rest: (N + p,)."""
        power = np.bincount(self.bin, rest[: self.bin.size] ** 2, minlength=self.counts.size)[self.known]
        return np.asarray(self.counts[self.known] * np.log(power / self.counts[self.known] + self.floor[self.known]))

    def level_of(self, rest: Array) -> float:
        """The criterion with what is left of the residual. rest: (N + p,)."""
        return self._level + float(np.sum(self.logs(rest))) / float(self.counts.sum())

    def level_after(self) -> float:
        """The criterion after the linear step."""
        normal = self.columns.T @ self.columns
        step = np.linalg.lstsq(normal, self.columns.T @ self.residual, rcond=1e-12)[0]
        return self.level_of(self.residual - self.columns @ step)
