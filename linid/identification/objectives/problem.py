"""A fitting problem: search space, objectives and one cost over all of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array, Flags
from linid.identification.objectives.objective import Directions, Part, carries_slopes, stands_for
from linid.identification.space.search_space import SearchSpace

_CHUNK_FLOATS = 8_000_000  # residuals held at once during a population run, 64 MB
_TANGENT_STEP = 1e-5  # of search coordinates, of which parameters are powers or straight lines
COORDINATE_STEP = 1e-5  # of search coordinates, over which residuals are differenced
OFFSET_STEP = 0.3  # of start offsets, in units of their uncertainty
LOST = 1e6  # cost of a candidate whose simulation failed


@dataclass(frozen=True)
class Problem:
    """Search coordinates (p,) and start offsets -> residuals of all parts.

    The noise of each class of residuals is unknown; eliminating it from the Gaussian likelihood leaves
    sum over classes of n log(RMS). The cost is exp of its mean with the RMS taken relative to the measured
    signal's own: a geometric mean of relative errors, dimensionless.
    """

    space: SearchSpace
    parts: tuple[Part, ...]

    @property
    def nuisances(self) -> int:
        """Number of start-state offsets of all parts."""
        return sum(part.nuisances for part in self.parts)

    def residuals(self, point: Array, offsets: Array) -> list[Array]:
        """Residuals (C, N) of each part for search coordinates, point (C, p), and offsets (C, nuisances)."""
        params = self.space.vectors(point)
        out, at = [], 0
        for part in self.parts:
            out.append(part.residuals(params, offsets[:, at : at + part.nuisances]))
            at += part.nuisances
        return out

    @property
    def carries_slopes(self) -> bool:
        """Whether `slopes` knows the derivatives of some parts, so that it is quicker than differences of all."""
        return any(carries_slopes(part) for part in self.parts)

    def slopes(
        self, point: Array, offsets: Array, shifts: Array, wanted: Flags | None = None
    ) -> list[tuple[Array, Array]]:
        """Residuals (N,) of each part and their derivatives (N, p + S) by the search coordinates, then by shifts (those
        of a part without offsets end before). Parts whose simulation does not carry them along are differenced.

        point: (p,) search coordinates; offsets: (nuisances,) start offsets; shifts: (S, nuisances) directions of these;
        wanted: (p,) of which search coordinates (None: all), those by others are 0 then.
        """
        size = point.size
        steps = _TANGENT_STEP * np.eye(size)
        params = self.space.vectors(np.concatenate([point[None], point + steps, point - steps]))
        tangents = (params[1 : 1 + size] - params[1 + size :]) / (2.0 * _TANGENT_STEP)
        if wanted is not None:
            tangents[~wanted] = 0.0
        out, at = [], 0
        for part in self.parts:
            own, count = slice(at, at + part.nuisances), size + (len(shifts) if part.nuisances else 0)
            directions = Directions(np.zeros((count, params.shape[1])), np.zeros((count, part.nuisances)))
            directions.params[:size] = tangents
            directions.offsets[size:] = shifts[: count - size, own]
            known = part.slopes if carries_slopes(part) else partial(_differences, part, size)
            out.append(known(params[0], offsets[own], directions))
            at += part.nuisances
        return out

    def class_counts(self) -> list[Array]:
        """Per part: number of independent groups in each class of residuals, (classes,), as of all data."""
        counts = []
        for part in self.parts:
            groups = int(part.groups.max(initial=0)) + 1
            held = np.bincount(part.classes * groups + part.groups) > 0  # which class has rows of which group
            number = np.bincount(np.flatnonzero(held) // groups, minlength=int(part.classes.max()) + 1)
            counts.append(stands_for(part) * number.astype(np.float64))
        return counts

    def reference(self) -> list[Array]:
        """Per part and class: RMS of the residuals if nothing moved, (classes,), the scale of the relative errors."""
        still = []
        for part in self.parts:
            still.append(_class_rms(part.signal[None, :], part.classes, part.floor)[0])
        return still


def _differences(part: Part, size: int, params: Array, offsets: Array, directions: Directions) -> tuple[Array, Array]:
    """`Differentiable.slopes` by differences; size: how many of the directions are those of search coordinates."""
    steps = np.where(np.arange(len(directions.params)) < size, COORDINATE_STEP, OFFSET_STEP)[:, None]
    moved = np.vstack([params, params + steps * directions.params])
    shifted = np.vstack([offsets, offsets + steps * directions.offsets])
    rows = part.residuals(moved, shifted)
    return rows[0], (rows[1:] - rows[0]).T / steps.T


def _class_rms(residuals: Array, classes: NDArray[np.int64], floor: float) -> Array:
    """RMS per candidate and class (C, classes), never below the floor; nan where a simulation failed."""
    sizes = np.bincount(classes)
    out = np.ones((residuals.shape[0], sizes.size))
    filled = sizes > 0
    for row in range(residuals.shape[0]):
        sums = np.bincount(classes, residuals[row] ** 2)
        out[row, filled] = np.sqrt(sums[filled] / sizes[filled] + floor**2)
    return out


class Cost:
    """The cost of whole populations; start offsets stay at their measured values."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.counts = problem.class_counts()
        self.references = problem.reference()
        self.size = sum(part.classes.size for part in problem.parts)
        self.evaluations = 0

    @property
    def groups(self) -> float:
        """How many groups of residuals there are, in all classes."""
        return float(sum(counts.sum() for counts in self.counts))

    def __call__(self, population: Array) -> Array:
        """Costs (C,) of search coordinates (C, p); a failed simulation costs LOST."""
        population = np.atleast_2d(population)
        chunk = max(1, _CHUNK_FLOATS // max(self.size, 1))
        pieces = [population[a : a + chunk] for a in range(0, population.shape[0], chunk)]
        self.evaluations += population.shape[0]
        return np.concatenate([self._chunk(piece) for piece in pieces])

    def _chunk(self, population: Array) -> Array:
        offsets = np.zeros((population.shape[0], self.problem.nuisances))
        rows = self.problem.residuals(population, offsets)
        return self.of_residuals(rows)

    def class_rms(self, rows: list[Array]) -> list[Array]:
        """RMS (C, classes) per part; rows: residuals (C, N) of each part."""
        with np.errstate(invalid="ignore", over="ignore"):
            return [
                _class_rms(row, part.classes, part.floor) for row, part in zip(rows, self.problem.parts, strict=True)
            ]

    def of_residuals(self, rows: list[Array]) -> Array:
        """Costs (C,) of residuals per part; rows: residuals (C, N) of each part."""
        return self.of_class_rms(self.class_rms(rows))

    def of_class_rms(self, found: list[Array]) -> Array:
        """Costs (C,) of the RMS by class; found: (C, classes) of each part."""
        total, weight = np.zeros(found[0].shape[0]), 0.0
        for rms, counts, reference in zip(found, self.counts, self.references, strict=True):
            total += np.log(rms / np.maximum(reference, 1e-300)) @ counts
            weight += float(counts.sum())
        cost = np.exp(total / weight)
        return np.where(np.isfinite(cost), np.minimum(cost, LOST), LOST)
