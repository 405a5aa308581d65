"""The joint fit: base model and effects identified together by the force balance, under one criterion.

The criterion is the log power per bin of `BIN` seconds, L = sum over bins of n log((sum p + sum f)/(2 sum f)),
with p the squared residual and f the noise in it: what a fit lessens, a judgement weighs. A bin that no model here
can follow has its say once, however large its residual is; one at the floor asks for nothing.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array
from linid.diagnosis.balance import Balance, Noise, gain_of
from linid.diagnosis.linear_problem import LinearProblem
from linid.diagnosis.unknowns import Coordinate, Coordinates, encoded, vectors_of
from linid.identification.space.bounds import build_space
from linid.identification.space.search_space import SearchSpace
from linid.physics.model import Model
from linid.recording.recording import Recording

Columns = dict[str, Array]
Chosen = NDArray[np.bool_]

_STEP = 1e-4  # of a parameter's own scale, for differences
_DAMPING, _LEAST_DAMPING, _LARGEST_DAMPING = 1e-3, 1e-9, 1e6
_LEAST_GAIN_RATIO = 0.1  # of the promised decrease, for a step to be taken
_LARGEST_CHANGE = 1.0  # of the logarithm of a scale in one step
_LEAST_NOISE = 1e-4  # of the scale's square: recordings without noise count no more than that
_LEAST_LEFT = 0.1  # of a bin's squares, whatever noise is taken off


@dataclass(frozen=True)
class Effort:
    """How long a fit may take. steps: at most; precision: promised decrease of the criterion per row that ends it;
    renewals: how often the slopes may be computed anew."""

    steps: int
    precision: float
    renewals: int


THOROUGH = Effort(60, 1e-5, 4)
SETTLING = Effort(20, 1e-4, 1)
QUICK = Effort(20, 3e-4, 1)
SOFTENED = Effort(10, 1e-3, 1)
SOFTNESS = (1e4, 1e2)  # floors that count as one, in turn, where a fit is far above it
FAR = 0.3  # level from which on a fit may have ended in a wrong valley


@dataclass(frozen=True)
class Fitted:
    """A model fitted by the force balance. values: SI by name; vector: (VECTOR_SIZE,) SI; residual: (n,) m/s^2 of all
    rows of the balance; preset: SI values that say where its effects act; held: SI values that were not
    identified; level: criterion per fitted row; floor: (B,) mean squares of what noise gives its residuals, in the
    fit's scale; recordings: places of those it is fitted to; key: under which the balance's memory keeps it."""

    model: Model
    values: dict[str, float]
    vector: Array
    residual: Array
    preset: dict[str, float]
    held: dict[str, float]
    level: float
    floor: Array = field(repr=False)
    recordings: tuple[int, ...] = field(repr=False)
    key: str

    def space(self, recordings: Sequence[Recording]) -> tuple[SearchSpace, Array]:
        """The search box of a fit around the values, and their search coordinates (p,)."""
        density = self.values.get("electrical_wavenumber")
        densities = () if density is None else (density,)
        space = build_space(self.model, recordings, self.values, self.held | self.preset, {}, False, densities, True)
        return space, space.encode(self.values)


class JointFit:
    """Fits of any set of effects beside one base model on the rows of a balance, all under the same criterion.

    scale: (R,) m/s^2 in which residuals are counted; noise: in them; held: SI values that no fit identifies;
    reference: SI values of the base, from which bounds and scales are taken; limits: bounds of single parameters, SI.
    """

    def __init__(
        self,
        balance: Balance,
        scale: Array,
        noise: Noise,
        held: Mapping[str, float],
        reference: Mapping[str, float],
        limits: Mapping[str, tuple[float, float]],
    ) -> None:
        self.balance = balance
        self.held = dict(held)
        self.scale = scale
        self.noise = noise
        self.coordinates = Coordinates(balance, reference, limits)
        rows = balance.rows
        self.inverse = 1.0 / scale[rows.recording]
        self.bins = int(rows.bin.max(initial=-1)) + 1
        self.squared = np.zeros(self.bins)
        self.squared[rows.bin] = self.inverse**2
        self.reference = np.maximum(noise.power(noise.gain) * self.squared, _LEAST_NOISE)
        self._slopes: dict[str, Columns] = {}

    def rows_of(self, recordings: Iterable[int]) -> Chosen:
        """Rows (n,) that belong to recordings given by their places."""
        chosen = np.zeros(len(self.balance.recordings), dtype=np.bool_)
        chosen[list(recordings)] = True
        return np.asarray(chosen[self.balance.rows.recording])

    def floor_of(self, model: Model, vector: Array) -> Array:
        """Mean squares (B,) in the fit's scale that the noise gives the residuals of each bin under a model."""
        return np.asarray(np.maximum(self.noise.power(gain_of(model, vector)) * self.squared, _LEAST_NOISE))

    def bin_powers(
        self, residual: Array, floor: Array, rows: Chosen, softness: float = 1.0
    ) -> tuple[Array, Array, Array]:
        """Per bin: sum of the squared residuals, of the base's floor, and the number of rows, over the chosen rows.

        floor: (B,) under the residual's own model; what it has more noise than the base is taken off the squares
        (corrected least squares: Fuller 1987), or a fit would do best with inputs that push less than they do.
        softness: floors that count as one.
        """
        place = self.balance.rows.bin[rows]
        power = np.bincount(place, (residual[rows] * self.inverse[rows]) ** 2, minlength=self.bins)
        counts = np.bincount(place, minlength=self.bins).astype(np.float64)
        # No further than to the base's floor, or thrust that an effect takes away again would pay.
        least = np.minimum(power, np.maximum(counts * self.reference, _LEAST_LEFT * power))
        corrected = np.maximum(power - counts * (floor - self.reference), least)
        return corrected, softness * self.reference * counts, counts

    def level(self, residual: Array, floor: Array, rows: Chosen, softness: float = 1.0) -> float:
        """The criterion per row: mean log of power and floor over twice the floor, 0 at the floor."""
        power, noise, counts = self.bin_powers(residual, floor, rows, softness)
        known = counts > 0
        return float(counts[known] @ np.log((power + noise)[known] / (2.0 * noise[known]))) / float(counts.sum())

    def weights(self, residual: Array, floor: Array, rows: Chosen, softness: float = 1.0) -> Array:
        """Square roots of the weights (n,) in s^2/m of a step of the fit; zero outside the chosen rows."""
        power, noise, counts = self.bin_powers(residual, floor, rows, softness)
        per_bin = np.sqrt(counts / np.maximum(power + noise, 1e-300))
        return np.asarray(np.where(rows, per_bin[self.balance.rows.bin] * self.inverse, 0.0))

    def _pull(
        self,
        coordinates: Sequence[Coordinate],
        residual: Array,
        vector: Array,
        model: Model,
        rows: Chosen,
        softness: float,
    ) -> Array:
        """Half the slopes (p,) of the criterion (times rows) that the floor alone has: by force constant and mass."""
        out = np.zeros(len(coordinates))
        if self.noise.gain == 0.0:
            return out
        gain = gain_of(model, vector)
        power, noise, counts = self.bin_powers(residual, self.floor_of(model, vector), rows, softness)
        inputs = counts * self.noise.inputs * self.squared * (gain / self.noise.gain) ** 2
        known = counts > 0
        # d/d log gain of n log(p + f), halved
        slope = -float(np.sum((counts * inputs)[known] / (power + noise)[known]))
        for k, c in enumerate(coordinates):
            if c.name == "force_constant":
                out[k] = slope / float(vector[model.slot("force_constant")])
            elif c.name == "mass":
                out[k] = -slope
        return out

    def fit(
        self,
        model: Model,
        values: Mapping[str, float],
        preset: Mapping[str, float],
        recordings: Iterable[int],
        effort: Effort,
        slopes: Mapping[str, Array] | None = None,
        exact: bool = False,
        soft: Sequence[float] = (),
    ) -> Fitted:
        """Identify a model on some recordings (places), from first values in SI; slopes: d residual / d unknown (n,)
        near there, where they are known; exact: they are those at the first values; soft: floors that count as one,
        in turn, before one does."""
        chosen = tuple(sorted(recordings))
        names = {p.name for p in model.parameters}
        held = {k: x for k, x in self.held.items() if k in names} | dict(preset)
        held.setdefault("stribeck_exponent", 2.0)
        coordinates = self.coordinates.of(model, held, values)
        x = encoded(coordinates, model, {**values, **held})
        phase = float({**values, **held}.get("commutation_offset", 0.0))
        key = _key(model, {**held, "phase": phase}, chosen, x, effort, soft)
        memory = self.balance.memory
        if key in memory:
            x = np.array(memory[key])
            residual = self._residuals(model, coordinates, held, x[None, :], phase)[0]
        else:
            x, residual = self._descend(
                model, coordinates, held, x, phase, self.rows_of(chosen), effort, dict(slopes or {}), exact, soft
            )
            memory[key] = x.tolist()
        vector = vectors_of(coordinates, model, held, x, phase)[0]
        found = {p.name: float(vector[model.slot(p.name)]) for p in model.parameters}
        floor = self.floor_of(model, vector)
        level = self.level(residual, floor, self.rows_of(chosen))
        own_held = {k: found[k] for k in held if k not in preset}
        return Fitted(model, found, vector, residual, dict(preset), own_held, level, floor, chosen, key)

    def annealed(self, one: Fitted, effort: Effort) -> Fitted:
        """The fit of a model taken further by way of softer criteria, if that ends lower; else as it was.

        Far above the floor the criterion has many valleys, one for each bin that some values happen to suit. Floors
        that count as many times as large join them (graduated non-convexity: Blake and Zisserman 1987).
        """
        step = self.fit(
            one.model, one.values, one.preset, one.recordings, effort, self.slopes(one), exact=True, soft=SOFTNESS
        )
        return step if step.level < one.level else one

    def level_at(
        self, model: Model, values: Mapping[str, float], preset: Mapping[str, float], recordings: Iterable[int]
    ) -> float:
        """The criterion per row that a model has at first values in SI, before any fit."""
        names = {p.name for p in model.parameters}
        held = {k: x for k, x in self.held.items() if k in names} | dict(preset)
        held.setdefault("stribeck_exponent", 2.0)
        coordinates = self.coordinates.of(model, held, values)
        x = encoded(coordinates, model, {**values, **held})
        vector = vectors_of(coordinates, model, held, x, float({**values, **held}.get("commutation_offset", 0.0)))
        residual = self.balance.residuals(model, vector)[0]
        return self.level(residual, self.floor_of(model, vector[0]), self.rows_of(recordings))

    def at(self, model: Model, values: Mapping[str, float], recordings: Iterable[int]) -> Fitted:
        """A model without effects at given values, as if it had been fitted to some recordings (places)."""
        return self.fit(model, values, {}, recordings, Effort(0, 0.0, 0))

    def slopes(self, fitted: Fitted) -> Columns:
        """d residual / d unknown (n,) of a fitted model, by name."""
        if fitted.key not in self._slopes:
            coordinates, held, x = self._searched(fitted)
            phase = fitted.values.get("commutation_offset", 0.0)
            wanted = range(len(coordinates))
            rows = self._differences(fitted.model, coordinates, held, x, phase, fitted.residual, wanted)
            self._slopes[fitted.key] = {c.name: row for c, row in zip(coordinates, rows, strict=True)}
        return self._slopes[fitted.key]

    def unknowns(self, fitted: Fitted) -> tuple[Coordinate, ...]:
        """What was searched in a fit."""
        return self._searched(fitted)[0]

    def _searched(self, fitted: Fitted) -> tuple[tuple[Coordinate, ...], dict[str, float], Array]:
        held = fitted.held | fitted.preset
        coordinates = self.coordinates.of(fitted.model, held, fitted.values)
        return coordinates, held, encoded(coordinates, fitted.model, fitted.values)

    def _residuals(
        self, model: Model, coordinates: Sequence[Coordinate], held: Mapping[str, float], searched: Array, phase: float
    ) -> Array:
        return self.balance.residuals(model, vectors_of(coordinates, model, held, searched, phase))

    def _differences(
        self,
        model: Model,
        coordinates: Sequence[Coordinate],
        held: Mapping[str, float],
        x: Array,
        phase: float,
        residual: Array,
        wanted: Iterable[int],
    ) -> Array:
        """d residual / d unknown (k, n) of the wanted unknowns."""
        wanted = list(wanted)
        if not wanted:
            return np.empty((0, residual.size))
        steps = []
        for k in wanted:
            c = coordinates[k]
            step = _STEP * (c.scale if c.log else max(0.1 * c.scale, min(abs(x[k]), c.scale)))
            steps.append(-step if x[k] + step > c.upper else step)
        moved = np.repeat(x[None, :], len(wanted), axis=0)
        moved[np.arange(len(wanted)), wanted] += steps
        rows = self._residuals(model, coordinates, held, moved, phase)
        return np.asarray((rows - residual) / np.array(steps)[:, None])

    def _descend(
        self,
        model: Model,
        coordinates: Sequence[Coordinate],
        held: Mapping[str, float],
        x: Array,
        phase: float,
        rows: Chosen,
        effort: Effort,
        known: Mapping[str, Array],
        exact: bool,
        soft: Sequence[float],
    ) -> tuple[Array, Array]:
        """Levenberg and Marquardt's method with slopes kept up by Broyden's update (Broyden 1965, Math. Comp. 19,
        577), computed anew when a step fails to keep its promise. Returns the unknowns (p,) and the residual (n,)."""
        lower, upper = (np.array([getattr(c, name) for c in coordinates]) for name in ("lower", "upper"))
        reach = np.array([_LARGEST_CHANGE if c.log else np.inf for c in coordinates])
        residual = self._residuals(model, coordinates, held, x[None, :], phase)[0]
        slopes = np.empty((x.size, residual.size))
        missing = [k for k, c in enumerate(coordinates) if c.name not in known]
        for k, c in enumerate(coordinates):
            if c.name in known:
                slopes[k] = known[c.name]
        slopes[missing] = self._differences(model, coordinates, held, x, phase, residual, missing)
        shapes = [k for k, c in enumerate(coordinates) if not c.force]
        # Slopes by forces hardly change on the way: those by all else are computed anew first.
        stale: list[list[int]] = [] if exact or not known else [shapes, list(range(x.size))]
        vector = vectors_of(coordinates, model, held, x, phase)[0]
        floor = self.floor_of(model, vector)
        count = float(np.count_nonzero(rows))
        for softness in (*soft, 1.0):
            own = effort if softness == 1.0 else SOFTENED
            level = self.level(residual, floor, rows, softness)
            damping, failed, used, renewals = _DAMPING, False, 0, 0
            linear: LinearProblem | None = None
            while used < own.steps:
                if linear is None:
                    weights = self.weights(residual, floor, rows, softness)[rows]
                    pull = self._pull(coordinates, residual, vector, model, rows, softness)
                    linear = LinearProblem(slopes[:, rows] * weights, residual[rows] * weights, pull)
                room = np.maximum(lower - x, -reach), np.minimum(upper - x, reach)
                move, predicted = linear.step(damping, room)
                gain_ratio = -math.inf
                if predicted <= own.precision * count:
                    if not stale or renewals >= own.renewals:
                        break
                else:
                    for bent in (False, True):
                        trial = np.clip(x + move, lower, upper)
                        later = self._residuals(model, coordinates, held, trial[None, :], phase)[0]
                        used += 1
                        there = vectors_of(coordinates, model, held, trial, phase)[0]
                        floor_there = self.floor_of(model, there)
                        reached = self.level(later, floor_there, rows, softness)
                        gain_ratio = (level - reached) * count / predicted
                        missed = later - residual - (trial - x) @ slopes
                        if gain_ratio > _LEAST_GAIN_RATIO or bent or used >= own.steps:
                            break
                        # A curved valley: what the straight step missed tells how to bend it.
                        move, _ = linear.step(damping, room, missed[rows] * weights)
                if gain_ratio > _LEAST_GAIN_RATIO:
                    norms = np.linalg.norm(linear.columns, axis=1)
                    scaled = (trial - x) * norms
                    size = float(scaled @ scaled)
                    if size > 0.0:
                        slopes += np.outer(scaled * norms / size, missed)
                    x, residual, level, vector, floor = trial, later, reached, there, floor_there
                    damping = max(damping * (0.1 if gain_ratio > 0.5 and not failed else 1.0), _LEAST_DAMPING)
                    failed, linear = False, None
                    stale = [shapes, list(range(x.size))]
                elif stale and renewals < own.renewals:
                    wanted = stale.pop(0)
                    slopes[wanted] = self._differences(model, coordinates, held, x, phase, residual, wanted)
                    renewals += 1
                    linear = None
                else:
                    failed = True
                    damping *= 10.0
                    if damping > _LARGEST_DAMPING:
                        break
        return x, residual


def _key(
    model: Model,
    held: Mapping[str, float],
    recordings: tuple[int, ...],
    x: Array,
    effort: Effort,
    soft: Sequence[float],
) -> str:
    """What decides the result of a fit, as a hash."""
    parts = (model.kind, model.effects, sorted(held.items()), recordings, x.tolist(), effort, tuple(soft))
    return hashlib.sha256(repr(parts).encode()).hexdigest()
