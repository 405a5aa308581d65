"""The models before and after as `fit-motor` identifies them, and the measures of every recording by both."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from linid.diagnosis.balance import Memory
from linid.diagnosis.forecast import with_forecasts
from linid.diagnosis.gap import RecordingGap, Trace
from linid.diagnosis.joint import Fitted
from linid.diagnosis.means import Means
from linid.diagnosis.measures import measure_gaps
from linid.diagnosis.report_data import Change, RecordingChange
from linid.diagnosis.select import Selection
from linid.identification.fit import Refined, refine, refined_values
from linid.identification.model_file import model_from_text, model_to_text
from linid.identification.result import FitResult
from linid.identification.settings import Ending, FitSettings, SearchSettings
from linid.identification.signals.motion import input_jumps
from linid.identification.space.search_space import SearchSpace
from linid.parallel_tasks import in_parallel
from linid.recording.recording import Recording

# The models start from where the force balance has brought them.
_USUAL = Ending(10, 0.1)
_FINER = Ending(10, 3e-3)  # of what did not come to its end so: mass and all forces may creep together


class Refining:
    """The models before and after identified as `fit-motor` does it, from where the force balance has brought them.

    That before may begin while effects are still selected, and one with a term beside that after, each in a thread of
    its own. To be closed by `with`. fitted: the recordings to fit; since: a given model before, which is as it stands.
    """

    def __init__(self, fitted: Sequence[Recording], means: Means, since: FitResult | None) -> None:
        self._fitted, self._means, self._since = tuple(fitted), means, since
        self._pool = ThreadPoolExecutor(2, "refining")
        self._begun: dict[str, Future[str]] = {}

    def __enter__(self) -> Refining:
        return self

    def __exit__(self, stopped: type[BaseException] | None, *_: object) -> None:
        # Whoever stops does not wait for what nobody will ask for.
        self._pool.shutdown(wait=stopped is None, cancel_futures=True)

    def begin(self, one: Fitted, memory: Memory) -> None:
        """Begin with a model that will probably be asked for, where there are threads to spare."""
        key, means = _key(one), self._means
        if self._since is None and self._beside and key not in self._begun and key not in memory:
            self._begun[key] = self._pool.submit(_refined, self._fitted, means.seed, means.jobs, (key, one), 1)

    def attempt(self, one: Fitted, memory: Memory) -> Callable[[], Attempt]:
        """An attempt at a model, begun at once where there are threads to spare, else when it is asked for."""
        made = partial(Attempt, one, self._fitted, self._means, memory)
        return self._pool.submit(made).result if self._beside else made

    @property
    def _beside(self) -> bool:
        """Whether there are threads for what is asked for later."""
        return self._means.jobs > 1 and self._means.workers is None

    def models(self, found: Selection, memory: Memory) -> tuple[FitResult, FitResult]:
        """Both models of a selection; that after a given one has its base as the force balance has moved it."""
        means, since = self._means, self._since
        if since is not None:
            if not found.parts:
                return since, since
            return since, refined_model(with_base_held(found.best, found.base), self._fitted, means, memory)
        wanted = {_key(model): model for model in (found.base, found.best)}
        missing = [(key, model) for key, model in wanted.items() if key not in memory]
        means.watch("models", 0, 2)
        begun = {key: self._begun[key] for key, _ in missing if key in self._begun}
        # All threads for both: the one with effects takes longer, and then has them for itself.
        refined = partial(_refined, self._fitted, means.seed, 1 if means.workers else means.jobs)
        others = [item for item in missing if item[0] not in begun]
        for (key, _), text in in_parallel(refined, others, means.jobs, means.workers):
            memory[key] = text
        for key, future in begun.items():
            memory[key] = future.result()
        means.watch("models", 2, 2)
        models = [model_from_text(memory[key], "checkpoint") for key in wanted]
        return models[0], models[-1]


def with_base_held(one: Fitted, base: Fitted) -> Fitted:
    """A model of which all that the base has stays where it is."""
    return replace(one, held=one.held | {name: one.values[name] for name in base.values})


def _key(one: Fitted) -> str:
    """Under which the balance's memory keeps the refined model."""
    return f"refined {one.model.effects} {one.key}"


def refined_model(one: Fitted, fitted: Sequence[Recording], means: Means, memory: Memory) -> FitResult:
    """A model identified as `fit-motor` does it, from where the force balance has brought it."""
    key = _key(one)
    if key not in memory:
        memory[key] = _refined(tuple(fitted), means.seed, means.jobs, (key, one), means.jobs)
    return model_from_text(memory[key], "checkpoint")


class Attempt:
    """A model that is kept only if it predicts: refined as `fit-motor` does it, its intervals found once it is kept.

    one: from where the force balance has brought it; fitted: the recordings to fit; result: as far as the values;
    ended: whether more steps would change nothing.
    """

    def __init__(self, one: Fitted, fitted: Sequence[Recording], means: Means, memory: Memory) -> None:
        self._one, self._fitted, self._means, self._memory = one, tuple(fitted), means, memory
        self._refined: Refined | None = None
        self._begin(_key(one), one.values, _USUAL)

    def go_on(self) -> None:
        """Take it on from where it stopped, to a finer end."""
        self._begin(f"{_key(self._one)} further", {e.name: e.value for e in self.result.estimates}, _FINER)

    def kept(self) -> FitResult:
        """The model with its intervals."""
        if self._key not in self._memory:
            self._memory[self._key] = model_to_text((self._refined or self._refine()).with_intervals())
            self._refined = None  # of long recordings, its problem holds hundreds of MB
        return model_from_text(self._memory[self._key], "checkpoint")

    def _begin(self, key: str, start: dict[str, float], end: Ending) -> None:
        self._key, self._start, self._end = key, start, end
        self._refined = None
        values = f"{key} values"
        if values not in self._memory:
            self._refined = self._refine()
            self._memory[values] = [model_to_text(self._refined.bare), self._refined.ended]
        text, self.ended = self._memory[values]
        self.result = model_from_text(text, "checkpoint")

    def _refine(self) -> Refined:
        space, _ = self._one.space(self._fitted)
        settings = _settings(space, self._means.seed, self._means.jobs, self._end)
        return refined_values(space, space.encode(self._start), self._fitted, settings)


def measured_beside(
    recordings: tuple[Recording, ...],
    known: tuple[RecordingChange, ...],
    model: FitResult,
    seed: int,
    index: int,
    jobs: int,
) -> tuple[RecordingChange, Trace]:
    """The measures of one recording under one more model, and the trace behind them; before it, and their floors, as
    known of the recordings. At the top of the module, since it also runs on workers."""
    recording, changes = recordings[index], known[index].changes
    anew = not all(math.isfinite(one.floor) for one in changes.values())
    (gap,), (trace,) = measure_gaps(model, [recording], jobs=jobs, seed=seed, among=recordings, floors=anew)
    after = _of_gap(gap)
    changes = {k: Change(one.after, after[k][0], after[k][1] if anew else one.floor) for k, one in changes.items()}
    return replace(known[index], changes=changes), trace


def _refined(fitted: tuple[Recording, ...], seed: int, least: int, item: tuple[str, Fitted], jobs: int) -> str:
    """A model as `fit-motor` finds it, as text, by `least` threads or more. At the top of the module, since it also
    runs on workers."""
    space, point = item[1].space(fitted)
    return model_to_text(refine(space, point, fitted, settings=_settings(space, seed, max(jobs, least), _USUAL)))


def _settings(space: SearchSpace, seed: int, jobs: int, end: Ending) -> FitSettings:
    settings = FitSettings(
        search=SearchSettings(seed=seed),
        jobs=jobs,
        least_squares_steps=end.steps,
        least_squares_precision=end.precision,
    )
    if not {p.name for p in space.model.with_effects(()).parameters} & set(space.names):
        # A free run adds up all that a held base is off by, and whatever is not held would have to answer for it.
        settings = replace(settings, objective="ahead")
    return settings


def changes_of(
    recordings: Sequence[Recording], before: FitResult, after: FitResult, means: Means
) -> tuple[tuple[RecordingChange, ...], tuple[Trace, ...], tuple[Trace, ...]]:
    """The measures of every recording before and after, and the traces behind them."""
    measured = partial(_measured, tuple(recordings), before, after if after is not before else None, means.seed)
    found = []
    for _, one in in_parallel(measured, range(len(recordings)), means.jobs, means.workers):
        found.append(one)
        means.watch("measures", len(found), len(recordings))
    changes, traces_before, traces_after = zip(*found, strict=True)
    return with_forecasts(changes), traces_before, traces_after


def _measured(
    recordings: tuple[Recording, ...], before: FitResult, after: FitResult | None, seed: int, index: int, jobs: int
) -> tuple[RecordingChange, Trace, Trace]:
    """The measures of one recording and the traces behind them; after: None where nothing was added."""
    recording = recordings[index]
    (first,), (trace,) = measure_gaps(before, [recording], jobs=jobs, seed=seed, among=recordings, floors=after is None)
    second, later = first, trace
    if after is not None:
        (second,), (later,) = measure_gaps(after, [recording], jobs=jobs, seed=seed, among=recordings)
    both = zip(_of_gap(first).items(), _of_gap(second).values(), strict=True)
    changes = {name: Change(before, *with_floor) for (name, (before, _)), with_floor in both}
    return RecordingChange(recording.name, recording.kind, recording.split, changes, jumps_in(recording)), trace, later


def _of_gap(gap: RecordingGap) -> dict[str, tuple[float, float]]:
    """Each measure of a gap and its floor, by name."""
    return {
        "free_run": (gap.free_run, gap.free_run_floor),
        "ahead": (gap.ahead, gap.ahead_floor),
        "force": (gap.force, gap.force_floor),
    }


def jumps_in(recording: Recording) -> bool:
    """Whether an input of a driven recording jumps within a sampling interval: its samples do not tell when."""
    return recording.kind != "free_wheel" and bool(np.any(input_jumps(recording)))
