"""The joint fit: base model and effects identified together by the force balance, under one criterion."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array
from linid.diagnosis.balance import Balance, Noise, Places
from linid.diagnosis.criterion import Criterion, Posed, Straight
from linid.diagnosis.descent import Descent, Effort
from linid.diagnosis.unknowns import Coordinate, Coordinates, FieldPhase, encoded
from linid.identification.space.bounds import build_space
from linid.identification.space.proportions import UNSHAPED, Proportions
from linid.identification.space.search_space import SearchSpace
from linid.physics.laws.registry import LUGRE
from linid.physics.model import Model
from linid.recording.recording import Recording

Columns = dict[str, Array]
SOFTNESS = (1e4, 1e2)  # floors that count as one, in turn, where a fit is far above it
FAR = 0.3  # level from which on a fit may have ended in a wrong valley
Chosen = NDArray[np.bool_]


@dataclass(frozen=True)
class Fitted:
    """A model fitted by the force balance. values: SI by name; vector: (VECTOR_SIZE,) SI; residual: (n,) m/s^2 of all
    rows of the balance; preset: SI values that say where its effects act; held: SI values that were not
    identified; level: criterion per fitted row; floor: (B,) mean squares of what noise gives its residuals, in the
    fit's scale; recordings: places of those it is fitted to; key: under which the balance's memory keeps it; shape: of
    a term of which only the size was identified."""

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
    shape: Proportions = UNSHAPED

    def space(self, recordings: Sequence[Recording]) -> tuple[SearchSpace, Array]:
        """The search box of a fit around the values, and their search coordinates (p,)."""
        density = self.values.get("electrical_wavenumber")
        densities = () if density is None else (density,)
        held, bounds = self.held | self.preset | self.shape.values, self.shape.bounds
        space = build_space(self.model, recordings, self.values, held, bounds, False, densities, True)
        space = replace(space, ties=self.shape.ties)
        return space, space.encode(self.values)


class JointFit(Criterion):
    """Fits of any set of effects beside one base model on the rows of a balance, all under the same criterion.

    scale: (R,) m/s^2 in which residuals are counted; noise: in them; held: SI values that no fit identifies;
    reference: SI values of the base, from which bounds and scales are taken; limits: bounds of single parameters, SI;
    told: intervals of what is known beforehand of them, SI, or ratios where ratios are searched.
    """

    def __init__(
        self,
        balance: Balance,
        scale: Array,
        noise: Noise,
        held: Mapping[str, float],
        reference: Mapping[str, float],
        limits: Mapping[str, tuple[float, float]],
        told: Mapping[str, tuple[float, float]],
    ) -> None:
        super().__init__(balance, scale, noise)
        self.held = dict(held)
        self.coordinates = Coordinates(balance, reference, limits, told)
        self._slopes: dict[str, Columns] = {}

    def fit(
        self,
        model: Model,
        values: Mapping[str, float],
        preset: Mapping[str, float],
        recordings: Iterable[int],
        effort: Effort,
        slopes: Mapping[str, Array] | None = None,
        exact: bool = False,
        shape: Proportions = UNSHAPED,
    ) -> Fitted:
        """Identify a model on some recordings (places), from first values in SI; slopes: d residual / d unknown (n,)
        near there, where they are known; exact: they are those at the first values; shape: of a term of which only the
        size is identified."""
        chosen = tuple(sorted(recordings))
        held = self._held(model, preset)
        posed, x = self._posed(model, values, held, shape)
        key = _key(model, {**held, **shape.values, "phase": posed.phase.value}, chosen, x, effort)
        memory = self.balance.memory
        if key in memory:
            x = np.array(memory[key])
            residual = self.residuals(posed, x[None, :])[0]
        else:
            x, residual = Descent(self, posed, x, chosen, slopes or {}, exact).run(effort)
            others = tuple(k for k in range(len(self.balance.recordings)) if k not in chosen)
            if others:
                residual = residual + self.residuals(posed, x[None, :], others)[0]
            memory[key] = x.tolist()
        return self._fitted(posed, x, residual, preset, chosen, key, shape)

    def along_slopes(
        self, full: Fitted, model: Model, values: Mapping[str, float], preset: Mapping[str, float], effort: Effort
    ) -> Fitted:
        """`fit` without its simulations: what it would find if the residual were straight in all unknowns, as that of
        a fuller model near by is. It is one to compare with others, not to go on from."""
        chosen, slopes = full.recordings, self.slopes(full)
        held = self._held(model, preset)
        posed, x = self._posed(model, values, held, UNSHAPED)
        residual = self.residuals(posed, x[None, :])[0]
        straight = Straight(self, x, residual, np.array([slopes[c.name] for c in posed.coordinates]))
        found, _ = Descent(straight, posed, x, chosen, slopes, True).run(effort)
        residual = straight.residuals(posed, found[None, :])[0]
        key = "along slopes " + _key(model, {**held, "phase": posed.phase.value}, chosen, x, effort)
        return self._fitted(posed, found, residual, preset, chosen, key, UNSHAPED)

    def _fitted(
        self,
        posed: Posed,
        x: Array,
        residual: Array,
        preset: Mapping[str, float],
        chosen: Places,
        key: str,
        shape: Proportions,
    ) -> Fitted:
        """What a fit has found. x: (p,); residual: (n,) m/s^2; all else as in `Fitted`."""
        model, vector = posed.model, posed.vectors(x)[0]
        found = {p.name: float(vector[model.slot(p.name)]) for p in model.parameters}
        floor = self.floor_of(model, vector)
        level = self.level(residual, floor, self.rows_of(chosen))
        held = {k: found[k] for k in posed.held if k not in preset}
        return Fitted(model, found, vector, residual, dict(preset), held, level, floor, chosen, key, shape)

    def annealed(self, one: Fitted, effort: Effort) -> Fitted:
        """The fit of a model taken further by way of softer criteria, if that ends lower; else as it was.

        Far above the floor the criterion has many valleys, one for each bin that some values happen to suit. Floors
        that count as many times as large join them (graduated non-convexity: Blake and Zisserman 1987).
        """
        step = self.fit(
            one.model,
            one.values,
            one.preset,
            one.recordings,
            replace(effort, soft=SOFTNESS),
            self.slopes(one),
            exact=True,
            shape=one.shape,
        )
        return step if step.level < one.level else one

    def unfitted(
        self, model: Model, values: Mapping[str, float], preset: Mapping[str, float], places: Places | None = None
    ) -> tuple[Array, Array]:
        """Residual (n,) in m/s^2 and floor (B,) that a model has at first values in SI, before any fit; places: of the
        recordings that are asked for (None: all)."""
        posed, x = self._posed(model, values, self._held(model, preset), UNSHAPED)
        vector = posed.vectors(x)
        return self.balance.residuals(model, vector, places)[0], self.floor_of(model, vector[0])

    def has_room(self, model: Model, values: Mapping[str, float], preset: Mapping[str, float]) -> bool:
        """Whether first values in SI lie within what is searched, to rounding."""
        posed, x = self._posed(model, values, self._held(model, preset), UNSHAPED)
        vector = posed.vectors(x)[0]
        there = np.array([vector[model.slot(c.name)] for c in posed.coordinates if c.name in values])
        wanted = np.array([values[c.name] for c in posed.coordinates if c.name in values])
        return bool(np.allclose(there, wanted, rtol=1e-9, atol=0.0))

    def level_at(
        self, model: Model, values: Mapping[str, float], preset: Mapping[str, float], recordings: Iterable[int]
    ) -> float:
        """The criterion per row that a model has at first values in SI, before any fit."""
        chosen = tuple(sorted(recordings))
        return self.level(*self.unfitted(model, values, preset, chosen), self.rows_of(chosen))

    def at(
        self, model: Model, values: Mapping[str, float], preset: Mapping[str, float], recordings: Iterable[int]
    ) -> Fitted:
        """A model at given values, as if it had been fitted to some recordings (places)."""
        return self.fit(model, values, preset, recordings, Effort(0, 0.0, 0))

    def slopes(self, fitted: Fitted) -> Columns:
        """d residual / d unknown (n,) of a fitted model, by name."""
        if fitted.key not in self._slopes:
            self._slopes[fitted.key] = self.slopes_by(fitted, [c.name for c in self.unknowns(fitted)])
        return self._slopes[fitted.key]

    def slopes_by(self, fitted: Fitted, names: Iterable[str], recordings: Places | None = None) -> Columns:
        """d residual / d unknown (n,) of a fitted model by some of its unknowns, by name; recordings: places of those
        that are asked for (None: all)."""
        posed, x = self._as_posed(fitted)
        places = {c.name: k for k, c in enumerate(posed.coordinates)}
        wanted = [name for name in names if name in places]
        rows = self.differences(posed, x, fitted.residual, [places[name] for name in wanted], recordings)
        return dict(zip(wanted, rows, strict=True))

    def unknowns(self, fitted: Fitted) -> tuple[Coordinate, ...]:
        """What was searched in a fit."""
        return self._as_posed(fitted)[0].coordinates

    def room(self, fitted: Fitted) -> Array:
        """How far each unknown of a fit may still go, down and up (k, 2): of those that are told, to the ends of their
        intervals; of all others without end."""
        posed, x = self._as_posed(fitted)
        told = self.coordinates.told
        free = (-np.inf, np.inf)
        ends = np.array([(c.lower, c.upper) if c.name in told else free for c in posed.coordinates])
        return np.asarray(ends - x[:, None])

    def _as_posed(self, fitted: Fitted) -> tuple[Posed, Array]:
        """A fit as it was posed, and its unknowns (p,)."""
        return self._posed(fitted.model, fitted.values, fitted.held | fitted.preset, fitted.shape)

    def _held(self, model: Model, preset: Mapping[str, float]) -> dict[str, float]:
        """What a fit of a model does not identify, SI."""
        names = {p.name for p in model.parameters}
        held = {k: x for k, x in self.held.items() if k in names} | dict(preset)
        if "stribeck_exponent" in names:
            held.setdefault("stribeck_exponent", 2.0)
        return held

    def _posed(
        self, model: Model, values: Mapping[str, float], held: Mapping[str, float], shape: Proportions
    ) -> tuple[Posed, Array]:
        """What is searched about some values, and these as unknowns (p,)."""
        whole = {**values, **held}
        coordinates = self.coordinates.of(model, {**held, **shape.values}, values, shape.bounds)
        y = self.coordinates.middle if "electrical_wavenumber" in whole else 0.0
        phase = whole.get("commutation_offset", 0.0) + y * whole.get("electrical_wavenumber", 0.0)
        posed = Posed(model, coordinates, held, FieldPhase(float(phase), y), shape.ties)
        return posed, encoded(coordinates, model, whole)


def _key(model: Model, held: Mapping[str, float], recordings: tuple[int, ...], x: Array, effort: Effort) -> str:
    """What decides the result of a fit, as a hash."""
    law = () if model.law == LUGRE else (model.law,)
    parts = (model.kind, *law, model.effects, sorted(held.items()), recordings, x.tolist(), effort)
    return hashlib.sha256(repr(parts).encode()).hexdigest()
