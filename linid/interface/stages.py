"""What a fit does, stage by stage: friction first, then the motor with it, then the windings."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Literal, Protocol

from linid.errors import UsageError
from linid.interface.friction_law import preferred_law
from linid.physics.laws.names import ASKED_OF_THE_RECORDINGS

if TYPE_CHECKING:
    from linid.identification.result import FitResult, ModelKind
    from linid.identification.settings import FitSettings, Hooks
    from linid.interface.campaign import Campaign
    from linid.interface.settings import Settings
    from linid.recording import Recording

StageName = Literal["friction", "motor", "windings"]


@dataclass(frozen=True)
class FitTask:
    """A fit to be done: known in SI; start: an earlier result for first values; law: of friction, notes: on it."""

    kind: ModelKind
    recordings: tuple[Recording, ...]
    settings: Settings
    known: dict[str, float]
    start: FitResult | None = None
    law: str = "lugre"
    notes: tuple[str, ...] = ()

    def parameter_names(self) -> list[str]:
        """All parameters of the model with its effects."""
        from linid.physics.model import Model

        return [p.name for p in Model(self.kind, self.settings.effects, law=self.law).parameters]

    def free_names(self) -> list[str]:
        """The parameters that are searched (the mass may still turn out to be unidentifiable)."""
        held = set(self.known)
        if not self.settings.free_exponent and "stribeck_exponent" not in self.settings.bounds:
            held.add("stribeck_exponent")
        if not self.settings.stribeck:
            held |= {"static_force", "stribeck_velocity"}
        return [name for name in self.parameter_names() if name not in held]

    def restricted(self) -> FitTask:
        """The task without known values, bounds and profiles of other models (the motor's, in a friction fit)."""
        names = set(self.parameter_names())
        known = {k: v for k, v in self.known.items() if k in names}
        bounds = {k: v for k, v in self.settings.bounds.items() if k in names}
        profiles = tuple(name for name in self.settings.profiles if name in names)
        settings = self.settings.model_copy(update={"bounds": bounds, "profiles": profiles})
        return replace(self, known=known, settings=settings)


@dataclass(frozen=True)
class Stage:
    """One of the fits that make a fit. winding: star or separate, in the stage `windings`, whose task starts from the
    motor's result; after: whether a stage before it gives the task's start."""

    name: StageName
    task: FitTask
    winding: str = ""
    after: bool = False

    def result(self, jobs: int, hooks: Hooks) -> FitResult:
        """The fit itself, on so many threads. Raises what fits raise: UsageError or DataError."""
        from linid.identification.fit import fit
        from linid.identification.fit_windings import fit_windings

        task = self.task
        settings = fit_settings(task.settings, jobs)
        if self.winding:
            assert task.start is not None
            return fit_windings(
                task.start, task.recordings, self.winding, settings=settings, known=task.known, hooks=hooks
            )
        result = fit(
            task.kind,
            task.recordings,
            settings=settings,
            effects=task.settings.effects,
            known=task.known,
            start=task.start,
            hooks=hooks,
            law=task.law,
        )
        return replace(result, warnings=(*task.notes, *result.warnings))


class FitObserver(Protocol):
    """Who stands beside a fit: says how each stage is hooked to the world outside, and keeps what it finds."""

    def stage(self, stage: Stage, work: Callable[[Hooks], FitResult]) -> FitResult:
        """The result of a stage: `work(hooks)` with progress, saving and a state to resume from as the observer likes,
        or what an earlier run has found. `stage.task` decides every bit of it."""
        ...


def run_stages(stages: Sequence[Stage], jobs: int, observer: FitObserver) -> FitResult:
    """The result of the last stage; each that comes after another starts from what that found.

    jobs: threads, never changes a result. Raises what the stages raise.
    """
    result: FitResult | None = None
    for planned in stages:
        stage = replace(planned, task=replace(planned.task, start=result)) if planned.after else planned
        result = observer.stage(stage, partial(stage.result, jobs))
    assert result is not None
    return result


def stages_of(
    campaign: Campaign, settings: Settings, model: ModelKind, start: FitResult | None = None, winding: str = ""
) -> tuple[Stage, ...]:
    """The stages of a fit, checked.

    A motor's friction is fitted first where free wheels are to be fitted and no `start` takes its place. winding: star
    or separate to identify the windings too, after the motor by its currents.
    Raises UsageError for recordings that do not suit, and for known values and bounds that no model of the fit has.
    """
    law, notes = _law_of_fit(campaign, settings, start)
    if model == "friction":
        task = _friction_task(campaign, settings, law)
        _check_names(set(task.parameter_names()), settings, campaign.known if task.kind == "force" else {})
        return (Stage("friction", replace(task, start=start, notes=notes)),)
    return tuple(_motor_stages(campaign, settings, model, start, winding, law, notes))


def _law_of_fit(campaign: Campaign, settings: Settings, start: FitResult | None) -> tuple[str, tuple[str, ...]]:
    """The friction law's name, as asked for, of an earlier result, or preferred; and what there is to say of it."""
    from linid.physics.laws.registry import LUGRE

    if settings.law is None:
        return (LUGRE if start is None else start.law), ()
    if settings.law != ASKED_OF_THE_RECORDINGS:
        return settings.law, ()
    return preferred_law(campaign, settings, base_kind(campaign.recordings))


def _motor_stages(
    campaign: Campaign,
    settings: Settings,
    model: ModelKind,
    start: FitResult | None,
    winding: str,
    law: str,
    notes: tuple[str, ...],
) -> Iterator[Stage]:
    from linid.physics.electrical import PARAMETERS

    whole = FitTask(model, campaign.fitted, settings, settings.known_values(campaign.known), start, law, notes)
    _check_names(set(whole.parameter_names()) | {p.name for p in PARAMETERS[winding]}, settings, campaign.known)
    first = start is None and bool(campaign.select(split="fit", kind="free_wheel"))
    if first:
        yield Stage("friction", _before_motor(_friction_task(campaign, settings, law)))
    yield Stage("motor", whole.restricted() if winding else whole, after=first)
    if winding:
        yield Stage("windings", whole, winding, after=True)


def _before_motor(task: FitTask) -> FitTask:
    """The friction fit before a motor's: effects that need a motor come with it."""
    from linid.physics.effects.registry import find_effect

    able = tuple(name for name in task.settings.effects if task.kind in find_effect(name).kinds)
    return replace(task, settings=task.settings.model_copy(update={"effects": able})).restricted()


def _friction_task(campaign: Campaign, settings: Settings, law: str) -> FitTask:
    """The friction fit that the recordings allow: free wheels where there are any, else driven ones."""
    known = settings.known_values(campaign.known)
    kind: ModelKind = "friction"
    chosen = campaign.select(split="fit", kind="free_wheel")
    if not chosen:
        kind = "force"
        chosen = tuple(r for r in campaign.select(split="fit", kind="motor") if r.drive_input is not None)
    if not chosen:
        raise UsageError(
            "FILE",
            "found no free wheel and no driven recording with a q-current or command among those to fit",
            "Give free-wheel recordings (drive off), or map the q-current or command: "
            "channels: {current_q: ...} or {command: ...}.",
        )
    return FitTask(kind, chosen, settings, known, law=law).restricted()


def _check_names(names: set[str], settings: Settings, known: dict[str, float]) -> None:
    """Refuse known values and bounds of parameters that no model of this run has."""
    import difflib

    for option, given in (("--known", set(settings.known) | set(known)), ("--bound", set(settings.bounds))):
        for name in sorted(given - names):
            near = difflib.get_close_matches(name, sorted(names), n=1, cutoff=0.5)
            hint = f"Did you mean '{near[0]}'? " if near else ""
            raise UsageError(
                f"{option} {name}",
                "no model of this run has such a parameter",
                f"{hint}Known: {', '.join(sorted(names))}.",
            )


def fit_settings(settings: Settings, jobs: int) -> FitSettings:
    """The settings as the identification takes them; jobs: threads."""
    from linid.identification.settings import PLAIN, Ending, FitSettings, SearchSettings

    steps = settings.least_squares_steps
    if steps is None:
        steps = 0 if settings.method == PLAIN else Ending.steps
    search = SearchSettings(
        method=settings.method,
        population=settings.population,
        generations=settings.generations,
        patience=settings.patience,
        tolerance=settings.tolerance,
        selection=settings.selection,
        tournament=settings.tournament,
        crossover=settings.crossover,
        crossover_rate=settings.crossover_rate,
        mutation=settings.mutation,
        mutation_rate=settings.mutation_rate,
        elite=settings.elite,
        seed=settings.seed,
    )
    return FitSettings(
        search=search,
        objective=settings.objective,
        horizon=settings.horizon,
        substeps=settings.substeps,
        free_exponent=settings.free_exponent,
        stribeck=settings.stribeck,
        bounds=dict(settings.bounds),
        jobs=jobs,
        least_squares_steps=steps,
        profiles=settings.profiles,
        proportions=dict(settings.proportions),
        verify_search=settings.verify_search,
    )


def base_kind(recordings: Sequence[Recording]) -> ModelKind:
    """The motor model that recordings allow a diagnosis: sine with three phase currents, force with one input.

    Raises UsageError for recordings that allow none.
    """
    if any(r.phase_currents is not None and r.kind != "free_wheel" for r in recordings):
        return "sine"
    if any(r.drive_input is not None for r in recordings):
        return "force"
    if any(r.kind == "free_wheel" for r in recordings):
        return "friction"
    raise UsageError("FILE", "holds no free wheel and no driven recording with an input", "Map the inputs (channels:)")
