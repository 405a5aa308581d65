"""One fit with its checkpoint: the step that fit-friction makes once and fit-motor twice."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.errors import UsageError
from linid.report.result_files import MODEL_FILE
from linid.workflow.run.checkpoint import Checkpoint
from linid.workflow.run.inputs import fingerprint
from linid.workflow.run.results import write_fit
from linid.workflow.run.run_folder import CHECKPOINT_FILE, identity_of

if TYPE_CHECKING:
    from linid.identification.result import FitResult, ModelKind
    from linid.identification.settings import FitSettings, Hooks
    from linid.recording import Recording
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.settings import Settings


@dataclass(frozen=True)
class FitTask:
    """A fit to be done: known in SI; start: an earlier result for first values."""

    kind: ModelKind
    recordings: tuple[Recording, ...]
    settings: Settings
    known: dict[str, float]
    start: FitResult | None = None

    def parameter_names(self) -> list[str]:
        """All parameters of the model with its effects."""
        from linid.physics.model import Model

        return [p.name for p in Model(self.kind, self.settings.effects).parameters]

    def free_names(self) -> list[str]:
        """The parameters that are searched (the mass may still turn out to be unidentifiable)."""
        held = set(self.known)
        if not self.settings.free_exponent and "stribeck_exponent" not in self.settings.bounds:
            held.add("stribeck_exponent")
        if not self.settings.stribeck:
            held |= {"static_force", "stribeck_velocity"}
        return [name for name in self.parameter_names() if name not in held]

    def identity(self) -> str:
        """Hash of all that decides the result."""
        from linid.identification.model_file import model_to_text

        start = None if self.start is None else model_to_text(self.start)
        return identity_of(self.kind, fingerprint(self.recordings), decisive(self.settings), self.known, start)

    def restricted(self) -> FitTask:
        """The task without known values, bounds and profiles of other models (the motor's, in a friction fit)."""
        names = set(self.parameter_names())
        known = {k: v for k, v in self.known.items() if k in names}
        bounds = {k: v for k, v in self.settings.bounds.items() if k in names}
        profiles = tuple(name for name in self.settings.profiles if name in names)
        settings = self.settings.model_copy(update={"bounds": bounds, "profiles": profiles})
        return replace(self, known=known, settings=settings)


def decisive(settings: Settings) -> dict[str, Any]:
    """The settings that decide a result; figures do not."""
    return settings.model_dump(mode="json", exclude={"figures", "figure_formats"})


def check_names(names: set[str], settings: Settings, known: dict[str, float]) -> None:
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


def run_stage(task: FitTask, folder: Path, reporter: Reporter, *, label: str, jobs: int, resume: bool) -> FitResult:
    """Fit, saving each generation to folder/checkpoint.json, and write the model files.

    resume: an already written model is read back, a checkpoint is gone on from. Raises what `fit` raises, and
    ConfigError when the checkpoint belongs to another problem.
    """
    from linid.identification.model_file import load_model
    from linid.identification.settings import Hooks

    if resume and (folder / MODEL_FILE).exists():
        reporter.detail(f"{label}: taken from {folder / MODEL_FILE}")
        return load_model(folder / MODEL_FILE)
    checkpoint = Checkpoint(folder / CHECKPOINT_FILE, task.identity())
    state = checkpoint.load() if resume else None
    if state is not None:
        reporter.say(f"{label}: going on from generation {state.generation}")
    hooks = Hooks(progress=_progress(reporter, label), save=checkpoint.save, resume=state)
    try:
        result = fitted(task, jobs, hooks)
    finally:
        checkpoint.flush()
    write_fit(result, folder)
    for warning in result.warnings:
        reporter.detail(f"{label}: {warning}")
    return result


def fitted(task: FitTask, jobs: int, hooks: Hooks) -> FitResult:
    """The fit itself. Raises what `linid.identification.fit.fit` raises."""
    from linid.identification.fit import fit

    return fit(
        task.kind,
        task.recordings,
        settings=fit_settings(task.settings, jobs),
        effects=task.settings.effects,
        known=task.known,
        start=task.start,
        hooks=hooks,
    )


def run_windings(
    result: FitResult, task: FitTask, winding: str, folder: Path, reporter: Reporter, *, jobs: int
) -> FitResult:
    """The windings of a motor fitted by its currents, everything identified together, and the model files.

    task: with the known values and bounds of the windings too.
    """
    from linid.identification.fit_windings import fit_windings
    from linid.identification.settings import Hooks

    found = fit_windings(
        result,
        task.recordings,
        winding,
        settings=fit_settings(task.settings, jobs),
        known=task.known,
        hooks=Hooks(progress=_progress(reporter, "windings")),
    )
    write_fit(found, folder)
    for warning in found.warnings:
        reporter.detail(f"windings: {warning}")
    return found


def fit_settings(settings: Settings, jobs: int) -> FitSettings:
    """The settings as the identification takes them."""
    from linid.identification.settings import FitSettings, SearchSettings

    search = SearchSettings(
        method=settings.method,
        population=settings.population,
        generations=settings.generations,
        patience=settings.patience,
        tolerance=settings.tolerance,
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
        least_squares_steps=settings.least_squares_steps,
        profiles=settings.profiles,
    )


def describe_task(task: FitTask, label: str) -> dict[str, Any]:
    """What a fit would do, for --dry-run."""
    settings = task.settings
    return {
        "stage": label,
        "model": task.kind,
        "effects": list(settings.effects),
        "recordings": [r.name for r in task.recordings],
        "samples": sum(r.t.size for r in task.recordings),
        "identified": task.free_names(),
        "known": task.known,
        "bounds": {k: list(v) for k, v in settings.bounds.items()},
        "objective": settings.objective,
        "method": settings.method,
        "population": settings.population,
        "generations": settings.generations,
        "largest_number_of_simulations": settings.population * (settings.generations + 1) * len(task.recordings),
        "seed": settings.seed,
    }


def _progress(reporter: Reporter, label: str) -> Any:
    def show(stage: str, done: int, total: int, best: float) -> None:
        reporter.step(f"{label}: {stage}", done, total, best)

    return show
