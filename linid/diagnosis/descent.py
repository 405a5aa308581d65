"""The way down of a joint fit: damped least squares with slopes that are kept up rather than computed anew."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from linid.arrays import Array
from linid.diagnosis.balance import Places
from linid.diagnosis.criterion import Criterion, Posed
from linid.diagnosis.linear_problem import LinearProblem

_DAMPING = 1e-3  # of the first step
_LEAST_GAIN_RATIO = 0.1  # of the promised decrease, for a step to be taken
# Of the promised decrease: where a step keeps less, the next one is to be shorter, where more, it may be longer.
_POOR, _GOOD = 0.25, 0.75
_SHORTER, _SHORT, _LONGER = 0.3, 0.5, 2.0  # times a step's length: after one that fails, a poor one and a good one
_LARGEST_CHANGE = 1.0  # of the logarithm of a scale in one step


@dataclass(frozen=True)
class Effort:
    """How long a fit may take. steps: at most; precision: promised decrease of the criterion per row that ends it;
    renewals: how often the slopes may be computed anew; soft: floors that count as one, in turn, before one does."""

    steps: int
    precision: float
    renewals: int
    soft: tuple[float, ...] = ()


THOROUGH = Effort(60, 1e-5, 4)
SETTLING = Effort(20, 1e-4, 1)
QUICK = Effort(20, 3e-4, 1)
SOFTENED = Effort(10, 1e-3, 1)


@dataclass(frozen=True)
class _Place:
    """Where a descent stands. x: (p,); residual: (n,) m/s^2; vector: SI; floor: (B,); level: of the criterion."""

    x: Array
    residual: Array
    vector: Array
    floor: Array
    level: float


def _next_radius(radius: float, length: float, gain_ratio: float) -> float:
    """How long the next step may be after one of some length that kept a share of its promised decrease; radius: how
    long that one might be, inf at first."""
    if gain_ratio <= _LEAST_GAIN_RATIO:
        return _SHORTER * length
    if gain_ratio < _POOR:
        return _SHORT * length
    if math.isinf(radius):
        return _LONGER * length
    return max(radius, _LONGER * length) if gain_ratio > _GOOD else radius


class Descent:
    """Levenberg and Marquardt's method within a trust region (More 1978, Lect. Notes Math. 630, 105) with slopes kept
    up by Broyden's update (Broyden 1965, Math. Comp. 19, 577), computed anew when a step fails to keep its promise.

    places: of the recordings that count; known: d residual / d unknown (n,) by name near the first values x (p,);
    exact: they are those there.
    """

    def __init__(
        self, criterion: Criterion, posed: Posed, x: Array, places: Places, known: Mapping[str, Array], exact: bool
    ) -> None:
        self.criterion, self.posed, self.places = criterion, posed, places
        rows = self.rows = criterion.rows_of(places)
        coordinates = posed.coordinates
        self.lower, self.upper = (np.array([getattr(c, name) for c in coordinates]) for name in ("lower", "upper"))
        self.furthest = np.array([_LARGEST_CHANGE if c.log else np.inf for c in coordinates])
        self.count = float(np.count_nonzero(rows))
        self._bins = criterion.balance.rows.bin[rows]
        self.slopes = np.empty((x.size, self._bins.size))  # at the rows that count
        self._missing = [k for k, c in enumerate(coordinates) if c.name not in known]
        for k, c in enumerate(coordinates):
            if c.name in known:
                self.slopes[k] = known[c.name][rows]
        # Slopes by forces hardly change on the way: those by all else are computed anew first.
        self._renewable = [[k for k, c in enumerate(coordinates) if not c.force], list(range(x.size))]
        self._stale: list[list[int]] = [] if exact or not known else list(self._renewable)
        self.place = self._at(x, 1.0)

    def _at(self, x: Array, softness: float) -> _Place:
        vector = self.posed.vectors(x)[0]
        residual = self.criterion.residual_at(self.posed, x, vector, self.places)
        floor = self.criterion.floor_of(self.posed.model, vector)
        return _Place(x, residual, vector, floor, self.criterion.level(residual, floor, self.rows, softness))

    def run(self, effort: Effort) -> tuple[Array, Array]:
        """The unknowns (p,) and the residual (n,) at the end, 0 where nothing counts."""
        x, residual = self.place.x, self.place.residual
        if not x.size or not effort.steps:
            return x, residual
        self._compute_slopes(self._missing)
        for softness in (*effort.soft, 1.0):
            self._descend(effort if softness == 1.0 else SOFTENED, softness)
        return self.place.x, self.place.residual

    def _descend(self, effort: Effort, softness: float) -> None:
        start = self.place
        level = self.criterion.level(start.residual, start.floor, self.rows, softness)
        self.place = replace(start, level=level)
        damping, radius, used, renewals = _DAMPING, math.inf, 0, 0
        linear: LinearProblem | None = None
        while used < effort.steps:
            here = self.place
            if linear is None:
                linear = self.linear(softness)
            damping = linear.damping_within(radius, damping)
            room = (np.maximum(self.lower - here.x, -self.furthest), np.minimum(self.upper - here.x, self.furthest))
            move, predicted = linear.step(damping, room)
            gain_ratio = -math.inf
            if predicted <= effort.precision * self.count:
                if not self._stale or renewals >= effort.renewals:
                    break
            else:
                x = np.clip(here.x + move, self.lower, self.upper)
                trial = self._at(x, softness)
                used += 1
                gain_ratio = (here.level - trial.level) * self.count / predicted
            if gain_ratio > _LEAST_GAIN_RATIO:
                radius = _next_radius(radius, linear.length(damping), gain_ratio)
                missed = (trial.residual - here.residual)[self.rows] - (x - here.x) @ self.slopes
                self._update_slopes(linear, x - here.x, missed)
                self.place, linear = trial, None
                self._stale = list(self._renewable)
            elif self._stale and renewals < effort.renewals:
                self._compute_slopes(self._stale.pop(0))
                renewals += 1
                linear = None
            else:
                radius = _next_radius(radius, linear.length(damping), gain_ratio)

    def linear(self, softness: float) -> LinearProblem:
        """The problem of the next step, with the slopes as they are."""
        here, rows, criterion = self.place, self.rows, self.criterion
        weights = criterion.weights(here.residual, here.floor, rows, softness)
        answers = criterion.answers(here.residual, here.floor, rows)[0][self._bins]
        pull = criterion.pull(self.posed, here.residual, here.vector, rows, softness)
        return LinearProblem(self.slopes, here.residual[rows], weights[rows], answers, pull)

    def _compute_slopes(self, wanted: Sequence[int]) -> None:
        """Compute the slopes by the wanted unknowns anew where the descent stands."""
        here = self.place
        found = self.criterion.differences(self.posed, here.x, here.residual, wanted, self.places)
        self.slopes[wanted] = found[:, self.rows]

    def _update_slopes(self, linear: LinearProblem, move: Array, missed: Array) -> None:
        """Broyden's update by what a step (p,) missed at the rows that count."""
        norms = linear.lengths
        scaled = move * norms
        size = float(scaled @ scaled)
        if size > 0.0:
            self.slopes += np.outer(scaled * norms / size, missed)
