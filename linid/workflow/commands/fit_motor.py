"""fit-motor: friction first (or from an earlier result), then motor and friction together."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from linid.errors import UsageError
from linid.workflow.commands.fit_friction import friction_task
from linid.workflow.run.fit_run import announce, begin, complete, finished_before, plan_outcome
from linid.workflow.run.inputs import fingerprint, read_inputs
from linid.workflow.run.run_folder import CURRENTS_FOLDER, FRICTION_FOLDER, file_record, identity_of, recorded
from linid.workflow.run.stage import FitTask, check_names, decisive, run_stage, run_windings

if TYPE_CHECKING:
    from linid.identification.result import FitResult, ModelKind
    from linid.workflow.run.inputs import Inputs
    from linid.workflow.run.outcome import Outcome
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request
    from linid.workflow.run.settings import Settings

COMMAND = "fit-motor"


def fit_motor(
    request: Request, reporter: Reporter, *, model: ModelKind, friction: Path | None = None, winding: str = ""
) -> Outcome:
    """Identify a motor model and the friction with it from the `fit` recordings; see the command's help.

    friction: MODEL of an earlier friction fit; None: the free wheels among the recordings are fitted first; winding:
    star or separate to identify the windings too, from phase voltages.
    Raises LinidError for what the user can mend, Interrupted after Ctrl-C or SIGTERM (the state is saved).
    """
    from linid.identification.model_file import load_model, model_to_text

    start = None if friction is None else load_model(friction)
    inputs = read_inputs(request.files, request.settings, axis=None if start is None else start.axis)
    announce(inputs, reporter)
    if start is not None and start.axis != inputs.axis:
        raise UsageError(
            f"--friction {friction}",
            f"is of a {start.axis} axis, the recordings of a {inputs.axis} one",
            "Use the axis's own friction result.",
        )
    settings = request.settings
    known = settings.known_values(inputs.known)
    if winding and model == "force":
        raise UsageError("--input voltage", "needs a model of the phases", "Take --model sine or theta.")
    first, whole = motor_tasks(inputs, settings, model, start, winding)
    task = whole.restricted() if winding else whole
    stages = [("motor", task)]
    if first is not None:
        stages.insert(0, ("friction", first))
    if request.dry_run:
        return plan_outcome(COMMAND, stages, inputs)
    identity = identity_of(
        COMMAND,
        model,
        fingerprint(inputs.recordings),
        decisive(settings),
        known,
        None if start is None else model_to_text(start),
        *([winding] if winding else []),
    )
    folder = begin(request, COMMAND, inputs, identity, [] if friction is None else [file_record(friction)])
    if folder.finished_before:
        reporter.say(f"{folder.path}: already finished, nothing to resume")
        return finished_before(folder)
    with recorded(folder), reporter:
        start = _friction_stage(first, folder.path, reporter, request) if first is not None else start
        task = replace(task, start=start)
        place = folder.path / CURRENTS_FOLDER if winding else folder.path
        result = run_stage(task, place, reporter, label=model, jobs=request.jobs, resume=request.resume)
        if winding:
            result = run_windings(result, whole, winding, folder.path, reporter, jobs=request.jobs)
        return complete(folder, result, inputs, request, reporter)


def motor_tasks(
    inputs: Inputs, settings: Settings, model: ModelKind, start: FitResult | None = None, winding: str = ""
) -> tuple[FitTask | None, FitTask]:
    """The friction fit that comes first (None: `start` or no free wheels take its place), and the motor's own.

    Raises UsageError for known values and bounds of parameters that the model does not have.
    """
    from linid.physics.electrical import PARAMETERS

    whole = FitTask(model, inputs.of(split="fit"), settings, settings.known_values(inputs.known), start)
    check_names(set(whole.parameter_names()) | {p.name for p in PARAMETERS[winding]}, settings, inputs.known)
    free = start is None and inputs.of(split="fit", kind="free_wheel")
    return (friction_task(inputs, settings) if free else None), whole


def _friction_stage(task: FitTask, folder: Path, reporter: Reporter, request: Request) -> FitResult:
    return run_stage(
        task, folder / FRICTION_FOLDER, reporter, label="friction", jobs=request.jobs, resume=request.resume
    )
