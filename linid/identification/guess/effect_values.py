"""First values of effects: every entry of their grid is tried by linear regression along the measured motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array
from linid.errors import UsageError
from linid.identification.guess.reading_periods import peaking_periods
from linid.identification.guess.scales import effect_range, force_scale, look_out
from linid.identification.objectives.acceleration import Acceleration
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.least_squares import levenberg_marquardt
from linid.identification.settings import Ending
from linid.identification.space.search_space import SearchSpace
from linid.physics.effects.effect import Effect, Outlook, Values
from linid.physics.effects.registry import find_effect
from linid.physics.laws.registry import LUGRE
from linid.physics.model import Model
from linid.physics.parameter import is_force
from linid.physics.wording import fitting_words
from linid.recording.motion import plays_told
from linid.recording.recording import Recording

_STRIDE = 5
_CHUNK = 48  # candidates per batch
_COORDINATE_STEP = 1e-4
_FLOOR = 1e-5  # of a recording's mean square residual: what is below it does not count
_SMALL = 0.02  # of an amplitude's range, the step of its column
_Step = tuple[Values, str, float]  # an entry of a grid, an amplitude, and how much of it


@dataclass(frozen=True)
class Trial:
    """One entry of an effect's grid: its values, the amplitudes that the regression gives, and what they explain.

    explained: share of the base model's squared residual, after the base parameters had their say; of several
    recordings the geometric mean of what is left counts, since each has a noise of its own. lead: for an effect at one
    moment, the factor by which it explains more than the best such effect at any other moment; contrast: the
    factor by which the power that it takes there per row exceeds that of the rest of its recording, 0: lasting effect;
    held_first: whether all else is to be found beside these amplitudes before they are free; certainty: ratio of
    what they explain to its deviation from block to block (inf: not told).
    """

    values: Values
    amplitudes: Values
    explained: float
    lead: float = math.inf
    contrast: float = 0.0
    held_first: bool = False
    certainty: float = math.inf


class EffectColumns:
    """Derivatives of the acceleration along the measured motion by the amplitudes of effects, at one set of values.

    They depend on the motion far more than on the other parameters, so they are computed once and kept.
    kind: of the base model; values: SI values of its parameters by name; rows: where the columns are wanted (default:
    every `_STRIDE`-th sample of the recordings).
    """

    def __init__(
        self,
        kind: str,
        values: Values,
        recordings: Sequence[Recording],
        jobs: int,
        rows: Acceleration | None = None,
        law: str = LUGRE,
    ) -> None:
        self.kind = kind
        self.law = law
        self.values = values
        self.recordings = tuple(recordings)
        self.jobs = jobs
        self.rows = rows
        self._parts: dict[str, tuple[Acceleration, Array]] = {}
        self._kept: dict[tuple[object, ...], NDArray[np.float32]] = {}

    def of(self, effect: Effect, entries: Sequence[Values], sizes: Values) -> NDArray[np.float32]:
        """Columns (N, entries * amplitudes) in m/s^2 per unit; sizes: upper ends of the amplitudes' ranges."""
        # Sizes give but the step of a difference: the columns of the first ones serve them all.
        key = (effect.name, tuple(sizes), tuple(tuple(entry.items()) for entry in entries))
        if key not in self._kept:
            self._kept[key] = self._computed(effect, entries, sizes)
        return self._kept[key]

    def _computed(self, effect: Effect, entries: Sequence[Values], sizes: Values) -> NDArray[np.float32]:
        model = Model(self.kind, (effect.name,), law=self.law)
        if effect.name not in self._parts:
            part = self._part(model)
            self._parts[effect.name] = part, part.model_acceleration(model.vector(self.values)[None, :])[0]
        part, plain = self._parts[effect.name]
        each = [(entry, name, _SMALL * size) for entry in entries for name, size in sizes.items()]
        if set(effect.terms) == {"sensor"}:  # the motion is as it is: no need to follow it
            return self._by_differences(model, part.reading_acceleration, np.zeros(plain.size), each)
        return self._by_differences(model, part.model_acceleration, plain, each)

    def _by_differences(
        self, model: Model, acceleration: Callable[[Array], Array], plain: Array, each: Sequence[_Step]
    ) -> NDArray[np.float32]:
        """Columns (N, k) in m/s^2 per unit, each at an entry by an amplitude's step; plain: (N,) without any.

        By batches: all at once would take GB of long recordings.
        """
        out = np.empty((plain.size, len(each)), dtype=np.float32)
        for first in range(0, len(each), _CHUNK):
            batch = each[first : first + _CHUNK]
            vectors = np.array([model.vector(self.values | entry | {name: step}) for entry, name, step in batch])
            rows = acceleration(vectors)
            rows -= plain
            out[:, first : first + len(batch)] = (rows / np.array([step for *_, step in batch])[:, None]).T
        return out

    def in_recording(
        self,
        effect: Effect,
        recording: Recording,
        half_width: int,
        entries: Sequence[Values],
        amplitude: str,
        size: float,
    ) -> NDArray[np.float32]:
        """Columns (N, entries) of one recording, m/s^2 per unit of the amplitude; size: upper end of its range, SI;
        half_width: of the bump in samples.
        """
        model = Model(self.kind, (effect.name,), law=self.law)
        part = Acceleration(model, (recording,), self.jobs, half_widths=(half_width,))
        plain = part.model_acceleration(model.vector(self.values)[None, :])[0]
        each = [(entry, amplitude, _SMALL * size) for entry in entries]
        return self._by_differences(model, part.model_acceleration, plain, each)

    def _part(self, model: Model) -> Acceleration:
        if self.rows is not None:
            return self.rows.with_model(model)
        return Acceleration(model, self.recordings, self.jobs, stride=_STRIDE)


class Regressed(Protocol):
    """A residual along the measured motion with the columns of a model's own parameters: what effects are tried on.

    weights: (N,) per m/s^2. M, below: the N rows and those that hold the parameters, if any.
    """

    recordings: tuple[Recording, ...]
    values: Values
    weights: Array
    part: Acceleration

    @property
    def kind(self) -> str:
        """Of the base model."""
        ...

    def trials(self, effect: Effect, grid: Sequence[Values], sizes: Values) -> list[Trial]:
        """A trial for each entry of the grid."""
        ...

    def span(self) -> Array:
        """Orthonormal columns (M, r) of what the model's own parameters can do, dimensionless."""
        ...

    def rest(self) -> Array:
        """What of the weighted residual (M,), a number per row, is left after they had their say."""
        ...

    def effect_columns(self, effect: Effect, entries: Sequence[Values], sizes: Values) -> Array:
        """Derivatives by each amplitude, in its SI unit, at each entry of the grid, (M, entries * amplitudes),
        weighted.
        """
        ...


class Regression:
    """Weighted residual of a base model along the measured motion and its columns, base parameters first.

    scales: (R,) m/s^2 in which the recordings' residuals are counted (default: their own RMS); effects: columns kept
    from an earlier regression on the same recordings (default: at the base's own values).
    """

    def __init__(
        self,
        base: SearchSpace,
        point: Array,
        recordings: Sequence[Recording],
        jobs: int,
        scales: Array | None = None,
        effects: EffectColumns | None = None,
    ) -> None:
        self.recordings = tuple(recordings)
        self.jobs = jobs
        self.base = base
        part = Acceleration(base.model, self.recordings, jobs, stride=_STRIDE)
        p = point.size
        steps = np.where(point + _COORDINATE_STEP > 1.0, -_COORDINATE_STEP, _COORDINATE_STEP)
        rows = part.model_acceleration(base.vectors(np.vstack([point, point + np.diag(steps)])))
        residual = part.target - rows[0]
        rms = np.sqrt(np.bincount(part.classes, residual**2) / np.maximum(np.bincount(part.classes), 1))
        self.part = part
        self.classes = part.classes
        self.stride = _STRIDE
        self.half_widths = part.half_widths
        self.weights = 1.0 / np.maximum((rms if scales is None else scales)[part.classes], 1e-12)
        self.residual = residual * self.weights
        self.columns = ((rows[1 : 1 + p] - rows[0]) / steps[:, None] * self.weights).T
        self._span: Array | None = None
        self.values = {q.name: float(x) for q, x in zip(base.model.parameters, _values(base, point), strict=True)}
        self.effects = effects or EffectColumns(base.model.kind, self.values, self.recordings, jobs, law=base.model.law)

    @property
    def kind(self) -> str:
        """Of the base model."""
        return self.base.model.kind

    def trials(self, effect: Effect, grid: Sequence[Values], sizes: Values) -> list[Trial]:
        """A trial for each entry of the grid; sizes: upper ends of the ranges of its amplitudes, by name."""
        names = list(sizes)
        span, rest = self.span(), self.rest()
        sizes_of = np.bincount(self.classes)
        before = np.bincount(self.classes, rest**2)
        floor = _FLOOR * sizes_of + 1e-300
        out: list[Trial] = []
        per_batch = max(1, _CHUNK // len(names))
        for first in range(0, len(grid), per_batch):
            entries = grid[first : first + per_batch]
            block = self.effect_columns(effect, entries, sizes)
            for k, entry in enumerate(entries):
                columns = block[:, k * len(names) : (k + 1) * len(names)]
                columns = columns - span @ (span.T @ columns)
                norms = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
                solution = np.linalg.lstsq(columns / norms, rest, rcond=1e-6)[0]
                left = rest - (columns / norms) @ solution
                ratio = (np.bincount(self.classes, left**2) + floor) / (before + floor)
                explained = 1.0 - float(np.exp(np.sum(sizes_of * np.log(ratio)) / np.sum(sizes_of)))
                amplitudes = {name: float(x) for name, x in zip(names, solution / norms, strict=True)}
                out.append(Trial(dict(entry), amplitudes, explained if np.isfinite(explained) else -1.0))
        return out

    def span(self) -> Array:
        """Orthonormal columns (N, r) of what the base parameters (and the effects added so far) can do."""
        if self._span is None:
            basis = np.linalg.svd(_scaled(self.columns), full_matrices=False)
            self._span = basis[0][:, basis[1] > 1e-9 * np.max(basis[1], initial=0.0)]
        return self._span

    def rest(self) -> Array:
        """What of the weighted residual (N,) is left after the base parameters had their say."""
        span = self.span()
        return np.asarray(self.residual - span @ (span.T @ self.residual))

    def effect_columns(self, effect: Effect, entries: Sequence[Values], sizes: Values) -> Array:
        """Derivatives by each amplitude at each entry of the grid, (N, entries * amplitudes), weighted."""
        return self.effects.of(effect, entries, sizes) * self.weights[:, None]

    def add(self, effect: Effect, trial: Trial, sizes: Values) -> None:
        """From now on the amplitudes of this effect are free too."""
        self._span = None
        self.columns = np.hstack([self.columns, self.effect_columns(effect, [trial.values], sizes)])


def _values(space: SearchSpace, point: Array) -> Array:
    vector = space.vectors(point)[0]
    return np.array([vector[space.model.slot(q.name)] for q in space.model.parameters])


def _scaled(columns: Array) -> Array:
    return np.asarray(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300))


def effect_guess(
    base: SearchSpace,
    effects: Sequence[str],
    recordings: Sequence[Recording],
    first: dict[str, float],
    known: dict[str, float],
    jobs: int = 1,
) -> tuple[tuple[Values, ...], Values]:
    """Rival first values of all parameters, and those of effects that are preset (never searched).

    The rivals, since a force balance hardly tells the scale of all forces, nor effects of a few samples: in the scale
    that suits the recordings' added masses best, in that of `first`, and there without the effects.

    base: search space of the model without effects; first: its first values; known: SI values that are given. The
    effects are taken one after the other, each with the entry of its grid that explains most. Raises UsageError for an
    effect that makes no sense with this motor or these recordings.
    """
    # The effect is still missing: a free mass would shrink to hide it, and all forces with it.
    held = base.holding({"mass": known.get("mass", first["mass"])})
    balance = Problem(held, (Acceleration(base.model, tuple(recordings), jobs, stride=2 * _STRIDE),))
    point = levenberg_marquardt(
        balance, Cost(balance), held.encode(first), ending=Ending(10, 0.3), final=False, bend=False
    ).point
    values = dict(zip((p.name for p in base.model.parameters), _values(held, point).tolist(), strict=True))
    regression = Regression(base, base.encode(values), recordings, jobs)
    outlook = look_out(base.model, recordings, regression.values)
    found: dict[str, float] = {}
    preset: dict[str, float] = {}
    for name in effects:
        effect = find_effect(name)
        if not effect.applies(base.model.kind, outlook):
            raise UsageError(
                "--effect",
                f"{name} makes no sense with the {base.model.kind} model and these recordings",
                f"It is shown by: {fitting_words(effect.exposed_by, outlook.axis, base.model.kind)}",
            )
        sizes = amplitude_sizes(regression, effect, outlook)
        best = best_trial(regression, effect, outlook, known, sizes)
        told = plays_told([recording.motion for recording in recordings]) if effect.play else []
        if told:  # better than by a column, which knows the reading as it is without play
            best = replace(best, amplitudes={effect.play: float(np.median(told))})
        regression.add(effect, best, sizes)
        found |= best.values | best.amplitudes
        preset |= effect.held({**best.values, **known})
    model = base.model.with_effects(effects)
    plain = {**first, **regression.values, **found, **known}
    without = {name: 0.0 for effect in effects for name in find_effect(effect).amplitudes}
    return (scaled_to_masses(model, recordings, plain, known, jobs), plain, {**plain, **without, **known}), preset


def scaled_to_masses(model: Model, recordings: Sequence[Recording], values: Values, known: Values, jobs: int) -> Values:
    """The values with mass and all forces times the factor that suits the recordings' added masses best.

    First values of an axis with an effect may be far off in scale, since accelerations hardly tell it. known: what
    must stay; where it holds a mass or a force the values come back as they are.
    """
    forces = {p.name for p in model.parameters if is_force(p.unit)}
    if forces & known.keys():
        return values
    part = Acceleration(model, tuple(recordings), jobs, stride=2 * _STRIDE)
    trials = [
        {name: value * factor if name in forces else value for name, value in values.items()}
        for factor in np.geomspace(0.04, 25.0, 97).tolist()
    ]
    residuals = part.residuals(np.array([model.vector(trial) for trial in trials]), np.zeros((len(trials), 0)))
    sizes = np.bincount(part.classes)
    costs = [float(sizes @ np.log(np.bincount(part.classes, row**2) / sizes + 1e-300)) for row in residuals]
    return trials[int(np.nanargmin(costs))]


def best_trial(regression: Regressed, effect: Effect, outlook: Outlook, known: Values, sizes: Values) -> Trial:
    """The entry of the effect's grid that explains most with amplitudes inside their ranges."""
    entries = [entry | {k: v for k, v in known.items() if k in entry} for entry in effect.grid(outlook)]
    grid = [dict(x) for x in dict.fromkeys(tuple(sorted(entry.items())) for entry in entries)]
    lower = {p.name: p.lower for p in effect.parameters}
    if effect.orders and outlook.field_wavenumber is None:
        grid = [_orders_pursued(regression, effect, grid, sizes)]
    trials = regression.trials(effect, grid, sizes)
    if effect.period and effect.period not in known:
        rest = regression.rest()[: regression.part.rows.size]
        periods = peaking_periods(regression.part, rest, regression.weights, outlook)
        # Apart from the grid, whose columns are the same at each step of a selection.
        peaks = [{**grid[0], effect.period: period} for period in periods]
        trials += regression.trials(effect, peaks, sizes) if peaks else []
    inside = [t for t in trials if all(value >= lower[name] for name, value in t.amplitudes.items())]
    best = max(inside or trials, key=lambda trial: trial.explained)
    held = {name: min(max(x, lower[name], -sizes[name]), sizes[name]) for name, x in best.amplitudes.items()}
    explained = best.explained if any(held.values()) else 0.0  # a drag that would have to push explains nothing
    return replace(best, amplitudes=held, explained=explained)


def _orders_pursued(regression: Regressed, effect: Effect, grid: Sequence[Values], sizes: Values) -> Values:
    """The orders that explain most, one pair of amplitudes after the other (orthogonal matching pursuit:
    Pati, Rezaiifar and Krishnaprasad 1993, Asilomar Conf. 27, 40); grid: candidates of the first order."""
    first = effect.orders[0]
    pair = {name: sizes[name] for name in effect.amplitudes[:2]}
    span = regression.span()
    columns = regression.effect_columns(effect, grid, pair)
    columns -= span @ (span.T @ columns)
    rest = regression.rest()
    found: list[float] = []
    for _ in effect.orders:
        a, b = columns[:, 0::2], columns[:, 1::2]
        aa, bb, ab = (np.einsum("ij,ij->j", x, y) for x, y in ((a, a), (b, b), (a, b)))
        on_a, on_b = rest @ a, rest @ b
        scale = np.maximum(aa * bb - ab**2, 1e-12 * aa * bb + 1e-300)
        k = int(np.argmax((bb * on_a**2 - 2.0 * ab * on_a * on_b + aa * on_b**2) / scale))
        found.append(grid[k][first])
        basis = np.linalg.qr(columns[:, 2 * k : 2 * k + 2])[0]
        rest = rest - basis @ (basis.T @ rest)
        columns -= basis @ (basis.T @ columns)
        columns[:, 2 * k : 2 * k + 2] = 0.0
    return {**grid[0], **dict(zip(effect.orders, found, strict=True))}


def amplitude_sizes(regression: Regressed, effect: Effect, outlook: Outlook) -> Values:
    """Upper ends of the ranges of the effect's amplitudes, by name; of several parts those of the first."""
    values = regression.values
    force = force_scale(regression.recordings, values)
    return {
        p.name: effect_range(effect, p, outlook, force, values["mass"])[1]
        for p in effect.parameters_of(regression.kind)
        if p.name in effect.amplitudes_of_part(1)
    }
