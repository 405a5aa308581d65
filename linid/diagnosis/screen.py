"""Screening: how much of a model's residual each effect could explain, by regression along the motion.

Rows, weights and criterion are those of the joint fit, so that what is screened, fitted and judged is the same gap.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array
from linid.diagnosis.criterion import certainty_of
from linid.diagnosis.held_sizes import HeldSizes
from linid.diagnosis.joint import Fitted, JointFit
from linid.diagnosis.weighted_step import WeightedStep
from linid.identification.guess.effect_values import EffectColumns, Trial, amplitude_sizes, best_trial
from linid.identification.guess.scales import amplitude_range, look_out
from linid.identification.objectives.acceleration import Acceleration
from linid.parallel_tasks import Workers, in_parallel
from linid.physics.effects.effect import Effect, Outlook, Values
from linid.physics.effects.registry import EFFECTS, find_effect
from linid.physics.effects.shapes import MOST_MARKED
from linid.physics.model import Model
from linid.physics.own_terms.own_term import is_own

Moments = dict[int, tuple[list[Values], NDArray[np.float32]]]

_TOLD = 0.1  # of all that recordings tell of an effect's size: with more of it the fitted ones will do
_LIKE = 0.5  # of the largest amplitude: what a recording must show to be counted in
_LEADERS = 3  # recordings that are tried as the one with the largest amplitude
# Of how strongly an effect shows in the typical recording: a mass in a creeping axis could be anything that resists it.
_FAINT = 0.1
_CLEAR = 1e-3  # of a column's power: what the base must leave of it
_PAUSE = 0.05  # s, between a push and another one
# A push is weighed against what pushes at other moments could explain: these quantiles leave room for further ones.
_OTHER_RECORDINGS, _OTHER_MOMENTS = 0.75, 0.9
# Power per row under a push, of that beside it, from which on it stands out, however little of the campaign it takes.
# `python -m tests.benchmarks.pushes --seed 22914` shows it with pushes, other effects and none.
LEAST_CONTRAST = 10.0
_UNDER = 0.1  # of a push's largest acceleration: rows with less of it are beside it


@dataclass(frozen=True)
class Screened:
    """An effect with the entry of its grid that explains most, as first values of a joint fit."""

    name: str
    trial: Trial

    @property
    def gain(self) -> float:
        """What the regression promises in log power."""
        return -math.log(max(1.0 - self.trial.explained, 1e-9))


class StepRegression(WeightedStep):
    """A fitted model's residual and slopes at some rows: what an effect's columns add to them.

    effects: columns at these rows; level: of the criterion after the linear step of the model's own parameters; all
    else as in `WeightedStep`. What it offers is that of `effect_guess.Regressed`.
    """

    def __init__(self, fits: JointFit, step: Fitted, rows: NDArray[np.bool_], effects: EffectColumns) -> None:
        super().__init__(fits, step, rows)
        self.kind = step.model.kind
        self.recordings = fits.balance.recordings
        self.values = step.values
        self.effects = effects
        self.part = fits.balance.part(step.model).of_rows(rows)
        left, sizes, _ = np.linalg.svd(self.columns, full_matrices=False)
        self._span = left[:, sizes > 1e-9 * np.max(sizes, initial=0.0)]
        self._rest = self.residual - self._span @ (self._span.T @ self.residual)
        self._before, self._blocks = self.logs(self._rest), fits.blocks_of(self.known)
        self.level = self.level_of(self._rest)

    def span(self) -> Array:
        """Orthonormal columns (N + p, r) of what the model's own parameters can do."""
        return np.asarray(self._span)

    def rest(self) -> Array:
        """What of the weighted residual (N + p,) is left after they had their say."""
        return np.asarray(self._rest)

    def effect_columns(self, effect: Effect, entries: Sequence[Values], sizes: Values) -> Array:
        """Derivatives by each amplitude at each entry of the grid, (N + p, entries * amplitudes), weighted."""
        return self.weighted(self.effects.of(effect, entries, sizes))

    def weighted(self, columns: NDArray[Any]) -> Array:
        """Columns (N, k) of acceleration in m/s^2 as the regression takes them, (N + p, k)."""
        return np.vstack([columns * self.weights[:, None], np.zeros((self.p, columns.shape[1]))])

    def trials(self, effect: Effect, grid: Sequence[Values], sizes: Values) -> list[Trial]:
        """A trial for each entry of the grid; sizes: upper ends of the ranges of its amplitudes, by name."""
        names = list(sizes)
        out = []
        columns = self.effect_columns(effect, grid, sizes)
        columns -= self._span @ (self._span.T @ columns)
        for k, entry in enumerate(grid):
            solution, explained, certainty = self.explained(columns[:, k * len(names) : (k + 1) * len(names)])
            amplitudes = dict(zip(names, solution.tolist(), strict=True))
            out.append(Trial(dict(entry), amplitudes, explained, certainty=certainty))
        return out

    def explained(self, columns: Array) -> tuple[Array, float, float]:
        """Amplitudes (a,) of projected columns (N + p, a), the share of the geometric mean power that they take away,
        and how sure that is."""
        norms = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        scaled = columns / norms
        solution = np.linalg.lstsq(scaled.T @ scaled, scaled.T @ self._rest, rcond=1e-9)[0]
        taken = self._before - self.logs(self._rest - scaled @ solution)
        share = 1.0 - math.exp(-float(np.sum(taken)) / float(self.counts.sum()))
        return solution / norms, share if math.isfinite(share) else -1.0, certainty_of(taken, self._blocks)

    def gains(self, rows: NDArray[np.int64], parts: Array) -> Array:
        """What the criterion loses (k,) when each of parts (m, k) is taken from the weighted residual of rows (m,)."""
        places, bins = np.unique(self.bin[rows], return_inverse=True)
        counts, floor = self.counts[places], self.floor[places]
        sums = np.zeros((places.size, parts.shape[1]))
        np.add.at(sums, bins, (self._rest[rows, None] - parts) ** 2)
        before = np.bincount(bins, self._rest[rows] ** 2)
        levels = np.log(before / counts + floor)[:, None] - np.log(sums / counts[:, None] + floor[:, None])
        return np.asarray(counts @ levels)

    def contrasts(self, rows: NDArray[np.int64], parts: Array) -> Array:
        """Power per row, in floors, that each of parts (m, k) takes where it acts when it is taken from the weighted
        residual of rows (m,), over that of the rows on which it does not act, at least one floor, (k,)."""
        floor, rest = self.floor[self.bin[rows]], self._rest[rows]
        under = np.abs(parts) > _UNDER * np.max(np.abs(parts), axis=0)
        count = np.maximum(np.count_nonzero(under, axis=0), 1)
        acting, power = np.where(under, parts, 0.0), rest**2 / floor
        taken = ((2.0 * rest / floor) @ acting - (1.0 / floor) @ acting**2) / count
        beside = (np.sum(power) - power @ under) / np.maximum(rows.size - count, 1)
        return np.asarray(taken / np.maximum(beside, 1.0))


class Screening:
    """All effects of the library tried on a campaign, at each step of the selection.

    base: the model without effects, whose outlook and effect columns all steps share; workers: who fits the candidates
    (None: threads here); without: names of effects that are left out of consideration.
    """

    def __init__(
        self, fits: JointFit, base: Fitted, jobs: int, workers: Workers | None = None, without: Iterable[str] = ()
    ) -> None:
        self.fits = fits
        self.jobs = jobs
        self.workers = workers
        self.without = frozenset(without)
        balance = fits.balance
        self.recordings = balance.recordings
        self.fitted = tuple(k for k, r in enumerate(self.recordings) if r.split == "fit")
        fitted = tuple(self.recordings[k] for k in self.fitted)
        part = balance.part(base.model)
        some = Acceleration(base.model, fitted, jobs, half_widths=tuple(part.half_widths[k] for k in self.fitted))
        self.effects = EffectColumns(base.model.kind, base.values, fitted, jobs, some, base.model.law)
        self.effects_everywhere = EffectColumns(
            base.model.kind, base.values, self.recordings, jobs, part, base.model.law
        )
        self.outlook = look_out(base.model, fitted, base.values)
        self.whole = look_out(base.model, self.recordings, base.values)
        self.held = HeldSizes(fits, self.fitted, self.outlook.period, jobs)
        self._pushes: dict[str, Moments] = {}

    def __getstate__(self) -> dict[str, Any]:
        # On its way to a worker, which only fits: what was screened, and who else works, stay here.
        return {**self.__dict__, "workers": None, "_pushes": {}, "jobs": 1, "held": replace(self.held, jobs=1)}

    def to_fit(self, step: Fitted | None, name: str = "", values: Values | None = None) -> tuple[int, ...]:
        """Places of recordings to which a model is fitted: the fitted ones, and those held out in which an effect of
        single recordings acts, where the fitted ones tell little of its size."""
        chosen = set(self.fitted)
        effects = [(e, {**step.values, **step.preset}) for e in step.model.effects] if step is not None else []
        effects += [(name, dict(values or {}))] if name else []
        for effect_name, at in effects:
            effect = find_effect(effect_name)
            if not effect.per_recording:
                continue
            marked = {k for k, r in enumerate(self.recordings) if effect.acts_in(at, r.number)}
            told = self._told(effect, at) if effect.acts == "some" else np.zeros(len(self.recordings))
            if sum(told[k] for k in marked & chosen) <= _TOLD * sum(told[k] for k in marked):
                chosen.update(marked)
        return tuple(sorted(chosen))

    def _told(self, effect: Effect, values: Values) -> Array:
        """What each recording (R,) tells of the size of an effect that acts in some: its column's power over the
        floor's."""
        (amplitude,) = (p for p in effect.parameters if p.name in effect.amplitudes)
        fits, mass = self.fits, self.effects.values["mass"]
        size = amplitude_range(amplitude, self.whole, fits.coordinates.force_scale, mass)[1]
        columns = self.effects_everywhere.of(effect, [{effect.mark: values[effect.mark]}], {amplitude.name: size})
        rows = fits.balance.rows
        power = (columns[:, 0] * fits.inverse) ** 2 / fits.reference[rows.bin]
        return np.asarray(np.bincount(rows.recording, power, minlength=len(self.recordings)), dtype=np.float64)

    def screen(
        self, step: Fitted, watch: Callable[[int, int], None] | None = None, *, only: Iterable[str] = ()
    ) -> tuple[Screened, ...]:
        """All effects that make sense here and are not in `step` yet, those that explain most of its residual first.

        only: names of effects (empty: all).
        """
        tried = self._tried(step, tuple(only))
        over = {marked: self._regression(step, marked) for marked in {e.per_recording for e in tried}}
        out = []
        found = in_parallel(lambda effect, _: self._trial(step, over[effect.per_recording], effect), tried, self.jobs)
        for number, (effect, trial) in enumerate(found, 1):
            if watch is not None:
                watch(number, len(tried))
            out.append(Screened(effect.name, trial))
        return tuple(sorted(out, key=lambda s: -s.trial.explained))

    def _tried(self, step: Fitted, wanted: Sequence[str]) -> list[Effect]:
        """The effects that make sense here and are not in `step` yet; wanted: their names (empty: all)."""

        def makes_sense(effect: Effect) -> bool:
            if effect.name in self.without or (wanted and effect.name not in wanted):
                return False
            if effect.of_given_models and not self.fits.coordinates.told:
                return False
            present = effect.name in step.model.effects
            if present and not (effect.parts > 1 and effect.free_part(step.preset)):
                return False
            return effect.applies(step.model.kind, self._outlook_of(effect))

        return [e for e in (*EFFECTS, *(find_effect(name) for name in wanted if is_own(name))) if makes_sense(e)]

    def _outlook_of(self, effect: Effect) -> Outlook:
        return self.whole if effect.per_recording else self.outlook

    def grid(self, effect: Effect) -> tuple[Values, ...]:
        """The shapes of an effect that are tried here, SI values by name."""
        return effect.grid(self._outlook_of(effect))

    def _regression(self, step: Fitted, everywhere: bool) -> StepRegression:
        """A step's residual over the rows of all recordings, or of the fitted ones."""
        recordings = range(len(self.recordings)) if everywhere else self.fitted
        effects = self.effects_everywhere if everywhere else self.effects
        return StepRegression(self.fits, step, self.fits.rows_of(recordings), effects)

    def _trial(self, step: Fitted, regression: StepRegression, effect: Effect) -> Trial:
        """The entry of an effect's grid that explains most."""
        if effect.acts == "one":
            return self._best_moment(regression, effect, step)
        if effect.acts == "some":
            return self._best_recordings(regression, effect)
        sizes = amplitude_sizes(regression, effect, self.outlook)
        trial = best_trial(regression, effect, self.outlook, self.fits.held, sizes)
        held = self.held.trials(effect, step, regression.level)
        return max((trial, *held), key=lambda one: one.explained)

    def beside(self, step: Fitted, found: Screened) -> Values:
        """SI values of a step's parameters beside an effect whose amplitudes are held as the regression has them."""
        return self.held.beside(step, find_effect(found.name), found.trial.amplitudes)

    def _best_recordings(self, regression: StepRegression, effect: Effect) -> Trial:
        """The set of recordings and the amplitude that explain most: those that each show half the largest one."""
        (amplitude,) = effect.amplitudes
        size = amplitude_sizes(regression, effect, self.whole)[amplitude]
        able = [k for k, r in enumerate(self.recordings) if 1 <= r.number <= MOST_MARKED]
        bits = {k: 2.0 ** (self.recordings[k].number - 1) for k in able}
        entry = {effect.mark: float(sum(bits.values()))}
        columns = self.effects_everywhere.of(effect, [entry], {amplitude: size})
        whole = regression.weighted(columns)[:, 0]
        owner = np.concatenate([regression.part.classes, np.full(regression.p, -1)])
        span, rest = regression.span(), regression.rest()
        squares = np.bincount(regression.part.classes, columns[:, 0] ** 2, minlength=len(self.recordings))
        shown = np.sqrt(squares / np.maximum(np.bincount(regression.part.classes, minlength=squares.size), 1))
        found: list[tuple[int, float, float]] = []  # recording, amplitude, gain
        for k in (k for k in able if shown[k] >= _FAINT * float(np.median(shown[able]))):
            column = np.where(owner == k, whole, 0.0)
            length = float(column @ column)
            moment = float(column @ rest)
            clear = length - float(np.sum((span.T @ column) ** 2))
            if length > 0.0 and clear > 1e-9 * length:
                found.append((k, moment / clear, moment**2 / clear))
        found.sort(key=lambda item: -item[2])
        best = Trial({effect.mark: 0.0}, {amplitude: 0.0}, -1.0)
        lower = next(p.lower for p in effect.parameters if p.name == amplitude)
        # What all recordings have is the base's, unless that is known.
        whole_told = bool(self.fits.coordinates.told)
        for leader in found[:_LEADERS]:
            chosen = [item[0] for item in found if item[1] / leader[1] > _LIKE]
            for group in ([leader[0]], chosen, *([able] if whole_told else [])):
                if len(group) == len(able) and not whole_told:
                    continue
                column = np.where(np.isin(owner, group), whole, 0.0)
                column -= span @ (span.T @ column)
                (value,), explained, certainty = regression.explained(column[:, None])
                if explained > best.explained:
                    held = float(np.clip(value, max(lower, -size), size))
                    mark = float(sum(bits[k] for k in group))
                    best = Trial({effect.mark: mark}, {amplitude: held}, explained, certainty=certainty)
        return best

    def _best_moment(self, regression: StepRegression, effect: Effect, step: Fitted) -> Trial:
        """The push that explains most, of all moments and lengths in all recordings, with its lead over others."""
        (amplitude,) = effect.amplitudes_of_part(1)
        size = amplitude_sizes(regression, effect, self.whole)[amplitude]
        classes, weights = regression.part.classes, regression.weights
        span, rest = regression.span(), regression.rest()
        found: dict[int, tuple[Array, Array, list[Values], Array]] = {}  # gains, contrasts, entries, columns
        for index, (entries, kept) in self._moments(effect, amplitude, size).items():
            mine = np.flatnonzero(classes == index)
            columns = kept * weights[mine, None]
            whole = np.einsum("ij,ij->j", columns, columns)
            clear = whole - np.sum((span[mine].T @ columns) ** 2, axis=0)
            clear = np.where(clear > _CLEAR * whole, clear, np.inf)
            forces = columns.T @ rest[mine] / clear
            parts = columns * forces
            found[index] = regression.gains(mine, parts), regression.contrasts(mine, parts), entries, columns
        if not found:
            return Trial({}, {}, -1.0)
        # What a resting bristle begins with, which nobody knows, explains much too, but stands out nowhere.
        clearly = any(np.max(one[1]) >= LEAST_CONTRAST for one in found.values())
        least = LEAST_CONTRAST if clearly else -np.inf
        able = {index: np.where(one[1] >= least, one[0], -np.inf) for index, one in found.items()}
        where = max(able, key=lambda index: float(np.max(able[index])))
        gains, contrasts, entries, columns = found[where]
        best = int(np.argmax(able[where]))
        elsewhere = [float(np.max(one[0])) for index, one in found.items() if index != where]
        beside = [gain for gain, e in zip(gains.tolist(), entries, strict=True) if _apart(effect, entries[best], e)]
        rival = max(
            float(np.quantile(elsewhere, _OTHER_RECORDINGS)) if elsewhere else 0.0,
            float(np.quantile(beside, _OTHER_MOMENTS)) if beside else 0.0,
        )
        column = np.zeros(rest.size)
        column[np.flatnonzero(classes == where)] = columns[:, best]
        column -= span @ (span.T @ column)
        (value,), explained, _ = regression.explained(column[:, None])  # of one moment, no other vouches for it
        part = effect.free_part(step.preset) if effect.name in step.model.effects else 1
        held = {amplitude: float(np.clip(value, -size, size))}
        lead = float(gains[best]) / max(rival, 1e-300)
        contrast = float(contrasts[best])
        return Trial(effect.moved(entries[best], part), effect.moved(held, part), explained, lead, contrast)

    def _moments(self, effect: Effect, amplitude: str, size: float) -> Moments:
        """Per recording (place): all moments of the effect's grid, and their columns (rows, entries)."""
        if effect.name not in self._pushes:
            kept = {}
            grid = effect.grid(self.whole)
            for index, recording in enumerate(self.recordings):
                entries = [e for e in grid if e[effect.mark] == float(recording.number)]
                if entries:
                    half_width = self.fits.balance.part(Model(self.effects.kind)).half_widths[index]
                    columns = self.effects.in_recording(effect, recording, half_width, entries, amplitude, size)
                    kept[index] = entries, columns
            self._pushes[effect.name] = kept
        return self._pushes[effect.name]


def _apart(effect: Effect, one: Values, other: Values) -> bool:
    """Whether two pushes in the same recording leave time between them."""
    start, length = (next(n for n in one if key in n) for key in ("start", "duration"))
    first, second = sorted((one, other), key=lambda e: e[start])
    return first[start] + first[length] + _PAUSE < second[start]
