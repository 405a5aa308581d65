"""What is kept of the stages of a fit: a checkpoint while each goes on, its files when it ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.report.result_files import MODEL_FILE
from linid.workflow.run.checkpoint import Checkpoint
from linid.workflow.run.inputs import task_identity
from linid.workflow.run.results import write_fit
from linid.workflow.run.run_folder import CHECKPOINT_FILE, CURRENTS_FOLDER, FRICTION_FOLDER

if TYPE_CHECKING:
    from linid.identification.result import FitResult
    from linid.identification.settings import Hooks
    from linid.interface.stages import Stage
    from linid.workflow.run.reporter import Reporter

_FOLDERS = {"friction": FRICTION_FOLDER, "motor": CURRENTS_FOLDER}  # of stages before the last


class StageFiles:
    """Observer of a fit: each generation goes to checkpoint.json, what is found to the model files, of the last stage
    in the run's folder, of others in one below.

    resume: an already written model is read back, a checkpoint is gone on from.
    """

    def __init__(self, folder: Path, stages: Sequence[Stage], reporter: Reporter, resume: bool) -> None:
        self.folder = folder
        self.last = stages[-1].name
        self.reporter = reporter
        self.resume = resume

    def stage(self, stage: Stage, work: Callable[[Hooks], FitResult]) -> FitResult:
        """Do a stage; raises what `work` raises, ConfigError when the checkpoint belongs to another problem."""
        label: str = stage.task.kind if stage.name == "motor" else stage.name
        folder = self.folder if stage.name == self.last else self.folder / _FOLDERS[stage.name]
        if stage.winding:  # no search, hence nothing to go on from
            result = self._windings(label, work)
        elif self.resume and (folder / MODEL_FILE).exists():
            return self._written_before(label, folder / MODEL_FILE)
        else:
            result = self._search(stage, label, folder, work)
        write_fit(result, folder)
        for warning in result.warnings:
            self.reporter.detail(f"{label}: {warning}")
        return result

    def _written_before(self, label: str, path: Path) -> FitResult:
        from linid.identification.model_file import load_model

        self.reporter.detail(f"{label}: taken from {path}")
        return load_model(path)

    def _search(self, stage: Stage, label: str, folder: Path, work: Callable[[Hooks], FitResult]) -> FitResult:
        from linid.identification.settings import Hooks

        checkpoint = Checkpoint(folder / CHECKPOINT_FILE, task_identity(stage.task))
        state = checkpoint.load() if self.resume else None
        if state is not None:
            self.reporter.say(f"{label}: going on from generation {state.generation}")
        try:
            return work(Hooks(progress=self._progress(label), save=checkpoint.save, resume=state))
        finally:
            checkpoint.flush()

    def _windings(self, label: str, work: Callable[[Hooks], FitResult]) -> FitResult:
        from linid.identification.settings import Hooks

        return work(Hooks(progress=self._progress(label)))

    def _progress(self, label: str) -> Callable[[str, int, int, float], None]:
        def show(stage: str, done: int, total: int, best: float) -> None:
            self.reporter.step(f"{label}: {stage}", done, total, best)

        return show


def describe_stage(stage: Stage) -> dict[str, Any]:
    """What a stage would do, for --dry-run."""
    task, settings = stage.task, stage.task.settings
    return {
        "stage": stage.name,
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
