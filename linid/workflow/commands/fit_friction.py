"""fit-friction: free wheels (or driven recordings with a q-current or command) -> friction parameters and mass."""

from __future__ import annotations

from typing import TYPE_CHECKING

from linid.errors import UsageError
from linid.workflow.run.fit_run import announce, begin, complete, finished_before, plan_outcome
from linid.workflow.run.inputs import read_inputs
from linid.workflow.run.run_folder import recorded
from linid.workflow.run.stage import FitTask, check_names, run_stage

if TYPE_CHECKING:
    from linid.identification.result import ModelKind
    from linid.workflow.run.inputs import Inputs
    from linid.workflow.run.outcome import Outcome
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request
    from linid.workflow.run.settings import Settings

COMMAND = "fit-friction"


def fit_friction(request: Request, reporter: Reporter) -> Outcome:
    """Identify friction from the `fit` recordings and measure the gap of all; see the command's help.

    Raises LinidError for what the user can mend, Interrupted after Ctrl-C or SIGTERM (the state is saved).
    """
    inputs = read_inputs(request.files, request.settings)
    announce(inputs, reporter)
    task = checked_friction_task(inputs, request.settings)
    if request.dry_run:
        return plan_outcome(COMMAND, [("friction", task)], inputs)
    folder = begin(request, COMMAND, inputs, task.identity())
    if folder.finished_before:
        reporter.say(f"{folder.path}: already finished, nothing to resume")
        return finished_before(folder)
    with recorded(folder), reporter:
        result = run_stage(task, folder.path, reporter, label="friction", jobs=request.jobs, resume=request.resume)
        return complete(folder, result, inputs, request, reporter)


def checked_friction_task(inputs: Inputs, settings: Settings) -> FitTask:
    """`friction_task` as the only one of a run; raises UsageError for known values and bounds that it does not have."""
    task = friction_task(inputs, settings)
    check_names(set(task.parameter_names()), settings, inputs.known if task.kind == "force" else {})
    return task


def friction_task(inputs: Inputs, settings: Settings) -> FitTask:
    """The friction fit that the recordings allow: free wheels where there are any, else driven ones."""
    known = settings.known_values(inputs.known)
    free = inputs.of(split="fit", kind="free_wheel")
    kind: ModelKind = "friction"
    chosen = free
    if not free:
        kind = "force"
        chosen = tuple(r for r in inputs.of(split="fit", kind="motor") if r.drive_input is not None)
    if not chosen:
        raise UsageError(
            "FILE",
            "found no free wheel and no driven recording with a q-current or command among those to fit",
            "Give free-wheel recordings (drive off), or map the q-current or command: "
            "channels: {current_q: ...} or {command: ...}.",
        )
    return FitTask(kind, chosen, settings, known).restricted()
