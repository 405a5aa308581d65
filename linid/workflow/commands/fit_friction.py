"""fit-friction: free wheels (or driven recordings with a q-current or command) -> friction parameters and mass."""

from __future__ import annotations

from typing import TYPE_CHECKING

from linid.workflow.run.fit_run import announce, begin, complete, finished_before, plan_outcome
from linid.workflow.run.inputs import task_identity
from linid.workflow.run.run_folder import recorded
from linid.workflow.run.stage import StageFiles

if TYPE_CHECKING:
    from linid.workflow.run.outcome import Outcome
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request

COMMAND = "fit-friction"


def fit_friction(request: Request, reporter: Reporter) -> Outcome:
    """Identify friction from the `fit` recordings and measure the gap of all; see the command's help.

    Raises LinidError for what the user can mend, Interrupted after Ctrl-C or SIGTERM (the state is saved).
    """
    from linid import api
    from linid.interface.stages import stages_of

    settings = request.settings
    campaign = api.read(*request.files, **settings.given())
    announce(campaign, reporter)
    stages = stages_of(campaign, settings, "friction")
    if request.dry_run:
        return plan_outcome(COMMAND, stages, campaign)
    folder = begin(request, COMMAND, campaign, task_identity(stages[0].task))
    if folder.finished_before:
        reporter.say(f"{folder.path}: already finished, nothing to resume")
        return finished_before(folder)
    with recorded(folder), reporter:
        files = StageFiles(folder.path, stages, reporter, request.resume)
        found = api.fit(campaign, "friction", jobs=request.jobs, observer=files, **settings.given())
        return complete(folder, found, campaign, request, reporter)
