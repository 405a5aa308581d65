"""fit-friction: free wheels (or driven recordings with a q-current or command) -> friction parameters and mass."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from linid.interface.reading import file_record
from linid.threads import one_thread
from linid.workflow.run.fit_run import announce, begin, begin_ahead, complete, finished_before, plan_outcome, start_of
from linid.workflow.run.inputs import task_identity
from linid.workflow.run.model_path import model_path
from linid.workflow.run.run_folder import recorded
from linid.workflow.run.stage import StageFiles

if TYPE_CHECKING:
    from linid.workflow.run.outcome import Outcome
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request

COMMAND = "fit-friction"


def fit_friction(request: Request, reporter: Reporter, *, friction: Path | None = None) -> Outcome:
    """Identify friction from the `fit` recordings and measure the gap of all; see the command's help.

    friction: MODEL that gives first values and own terms, or the folder of a fit or diagnosis that holds it; or None.
    Raises LinidError for what the user can mend, Interrupted after Ctrl-C or SIGTERM (the state is saved).
    """
    from linid import api
    from linid.interface.own_terms import with_terms
    from linid.interface.stages import stages_of

    friction = None if friction is None else model_path(friction, "--friction")
    start = None if friction is None else api.load(friction)
    compiled = begin_ahead(COMMAND, request)
    campaign = api.read(*request.files, axis_of=start, **request.settings.given())
    announce(campaign, reporter)
    first = None if start is None else start_of(start, campaign, f"--friction {friction}")
    with one_thread():
        settings = with_terms(campaign, request.settings, "friction", first, request.jobs)
    stages = stages_of(campaign, settings, "friction", first)
    if request.dry_run:
        return plan_outcome(COMMAND, stages, campaign)
    more = [] if friction is None else [file_record(friction)]
    folder = begin(request, COMMAND, campaign, task_identity(stages[0].task), more)
    if folder.finished_before:
        reporter.say(f"{folder.path}: already finished, nothing to resume")
        return finished_before(folder)
    with recorded(folder), reporter:
        compiled(reporter)
        files = StageFiles(folder.path, stages, reporter, request.resume)
        found = api.fit(campaign, "friction", start=start, jobs=request.jobs, observer=files, **settings.given())
        return complete(folder, found, campaign, request, reporter)
