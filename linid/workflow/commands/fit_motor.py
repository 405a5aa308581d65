"""fit-motor: friction first (or from an earlier result), then motor and friction together."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from linid.errors import UsageError
from linid.interface.reading import file_record
from linid.threads import one_thread
from linid.workflow.run.fit_run import announce, begin, begin_ahead, complete, finished_before, plan_outcome, start_of
from linid.workflow.run.inputs import decisive, fingerprint
from linid.workflow.run.model_path import model_path
from linid.workflow.run.run_folder import identity_of, recorded
from linid.workflow.run.stage import StageFiles

if TYPE_CHECKING:
    from linid.identification.result import ModelKind
    from linid.workflow.run.outcome import Outcome
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request

COMMAND = "fit-motor"


def fit_motor(
    request: Request, reporter: Reporter, *, model: ModelKind, friction: Path | None = None, winding: str = ""
) -> Outcome:
    """Identify a motor model and the friction with it from the `fit` recordings; see the command's help.

    friction: MODEL of an earlier fit, or the folder of a fit or diagnosis that holds it; None: the free wheels among
    the recordings are fitted first; winding: star or separate to identify the windings too, from phase voltages.
    Raises LinidError for what the user can mend, such as UsageError for a friction result of another kind of axis;
    Interrupted after Ctrl-C or SIGTERM (the state is saved).
    """
    from linid import api
    from linid.identification.model_file import model_to_text
    from linid.interface.own_terms import with_terms
    from linid.interface.stages import stages_of
    from linid.physics.motors.registry import MOTORS

    settings = request.settings
    friction = None if friction is None else model_path(friction, "--friction")
    start = None if friction is None else api.load(friction)
    compiled = begin_ahead(COMMAND, request)
    campaign = api.read(*request.files, axis_of=start, **settings.given())
    announce(campaign, reporter)
    first = None if start is None else start_of(start, campaign, f"--friction {friction}")
    if winding and not MOTORS[model].periodic:
        raise UsageError("--input voltage", "needs a model of the phases", "Take --model sine or theta.")
    with one_thread():
        settings = with_terms(campaign, settings, model, first, request.jobs)
    stages = stages_of(campaign, settings, model, first, winding)
    if request.dry_run:
        return plan_outcome(COMMAND, stages, campaign)
    identity = identity_of(
        COMMAND,
        model,
        fingerprint(campaign.recordings),
        decisive(settings),
        settings.known_values(campaign.known),
        None if first is None else model_to_text(first),
        *([winding] if winding else []),
    )
    folder = begin(request, COMMAND, campaign, identity, [] if friction is None else [file_record(friction)])
    if folder.finished_before:
        reporter.say(f"{folder.path}: already finished, nothing to resume")
        return finished_before(folder)
    with recorded(folder), reporter:
        compiled(reporter)
        files = StageFiles(folder.path, stages, reporter, request.resume)
        found = api.fit(
            campaign, model, start=start, winding=winding, jobs=request.jobs, observer=files, **settings.given()
        )
        return complete(folder, found, campaign, request, reporter)
