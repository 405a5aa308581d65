"""The public Python interface: read, fit, simulate, validate, diagnose; the command line calls it and adds files.

All quantities are in SI units (rotary axes: rad, N m, kg m^2). Nothing here writes a file unless a path is given, and
the interpreter's random generators stay as they are; equal arguments give equal results, whatever `jobs` is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.errors import ConfigError, DataError, LinidError, UsageError
from linid.interface.campaign import Campaign
from linid.interface.compensation import compensated
from linid.interface.exports import surveyed
from linid.interface.measuring import (
    Progress,
    Watch,
    able_recordings,
    free_run,
    in_closed_loop,
    measure,
    run_by_voltage,
)
from linid.interface.own_terms import with_terms
from linid.interface.reading import read_files
from linid.interface.results import Diagnosed, Fit, Gaps
from linid.interface.settings import make_settings
from linid.interface.stages import FitObserver, Stage, base_kind, run_stages, stages_of
from linid.recording.recording import Recording
from linid.threads import one_thread

if TYPE_CHECKING:
    from linid.arrays import Array
    from linid.diagnosis.gap import Trace
    from linid.diagnosis.means import Means
    from linid.identification.refit_unit import UnitFit
    from linid.identification.result import FitResult, ModelKind
    from linid.identification.settings import Hooks
    from linid.simulation.closed_loop import ClosedLoop
    from linid.simulation.controller import Controller
    from linid.simulation.functional_unit import FunctionalUnit

__all__ = [
    "Campaign",
    "ConfigError",
    "DataError",
    "Diagnosed",
    "Fit",
    "Gaps",
    "LinidError",
    "Recording",
    "UsageError",
    "compensate",
    "diagnose",
    "fit",
    "follow",
    "load",
    "read",
    "refit_unit",
    "simulate",
    "simulated_by",
    "survey_exports",
    "validate",
]


def read(*files: str | Path, axis_of: Fit | None = None, unmeasured: bool = False, **settings: Any) -> Campaign:
    """Read scope exports or campaign files; free wheels that begin with a push are cut to their coast-down.

    files: paths of recordings, or of one campaign (YAML); axis_of: a fit whose kind of axis bare recordings have, where
    the settings name none (None: linear); unmeasured: bare files of phase voltages need no position, for `simulate` by
    voltage. settings: of bare recordings, as in `--config` (`channels`, `kind`, `axis`,
    `window` and `period` in s, `added_mass` in kg ...).
    Returns a Campaign in SI units. Raises UsageError, ConfigError or DataError, each with place, fact and remedy.
    """
    axis = None if axis_of is None else axis_of.result.axis
    return read_files([Path(file) for file in files], make_settings(settings), axis=axis, unmeasured=unmeasured)


def fit(
    campaign: Campaign,
    model: str = "theta",
    *,
    start: Fit | None = None,
    winding: str = "",
    jobs: int = 1,
    progress: Callable[[str, int, int, float], None] | None = None,
    observer: FitObserver | None = None,
    **settings: Any,
) -> Fit:
    """Identify a model on the recordings of a campaign that are to be fitted.

    model: friction (free wheels), force, sine (paper, 31 and 44), theta (39 and 45) or a motor of another package;
    start: an earlier fit for first values (None: the free wheels of the campaign are fitted first), whose own terms
    `effects` may call by their short names (`learned`: else the term that the recordings ask for); winding: star or
    separate to identify a motor's windings too, from phase voltages; jobs: threads, which never change a result;
    progress(stage, done, total, best cost): called as the search goes on; observer: does the stages of the fit in
    place of `progress`, to keep their states and results (see `FitObserver`); settings: as in `--config` (`effects`,
    `known` and `bounds` in SI by parameter name, `seed`, `objective`, `method`, `profiles` ...).
    Returns a Fit. Raises UsageError, ConfigError or DataError.
    """
    kind = _model_kind(model, winding)
    first = None if start is None else start.result
    with one_thread():
        chosen = with_terms(campaign, make_settings(settings), kind, first, jobs)
        stages = stages_of(campaign, chosen, kind, first, winding)
        return Fit(run_stages(stages, jobs, observer or _Alone(progress)))


def _model_kind(model: str, winding: str) -> ModelKind:
    from linid.physics.electrical import WINDING_CODES
    from linid.physics.motors.registry import MOTORS

    if model not in MOTORS:
        raise UsageError("model", f"there is no model {model!r}", f"Choose one of {', '.join(MOTORS)}.")
    if winding not in WINDING_CODES:
        raise UsageError("winding", f"there is no connection {winding!r}", "Choose star or separate.")
    if winding and not MOTORS[model].periodic:
        raise UsageError("winding", "needs a model of the phases", "Take the model sine or theta.")
    return model


class _Alone:
    """A fit that keeps nothing."""

    def __init__(self, progress: Callable[[str, int, int, float], None] | None) -> None:
        self.progress = progress

    def stage(self, stage: Stage, work: Callable[[Hooks], FitResult]) -> FitResult:
        from linid.identification.settings import Hooks

        return work(Hooks(progress=self.progress or (lambda stage, done, total, best: None)))


def load(path: str | Path) -> Fit:
    """The fit that `save` or the command line has written (MODEL.json); raises ConfigError."""
    from linid.identification.model_file import load_model

    return Fit(load_model(Path(path)))


def validate(
    fit: Fit,
    recordings: Campaign | Iterable[Recording],
    *,
    among: Campaign | Iterable[Recording] | None = None,
    jobs: int = 1,
    seed: int = 1,
    progress: Progress | None = None,
    unmeasured: Callable[[LinidError], None] | None = None,
) -> Gaps:
    """The gap between a model and recordings, each measure beside its noise floor.

    recordings: of which those are taken that the model can be asked for; among: where their repeats are looked for,
    which raise the floor (None: among all that are given); jobs: threads; seed: of the noise draws; progress(stage,
    done, total); unmeasured: told why a recording that cannot be measured is left out (None: that is raised).
    Returns Gaps. Raises DataError where none can be measured, DataError or UsageError for the first that cannot.
    """
    given = tuple(recordings)
    chosen = able_recordings(given, fit.result)
    lent = given if among is None else tuple(among)
    watch = Watch(progress, unmeasured)
    with one_thread():
        gaps, traces = measure(fit.result, chosen, jobs=jobs, seed=seed, among=lent, watch=watch)
    return Gaps(gaps, traces, fit.result.axis)


def simulate(
    fit: Fit,
    recording: Recording,
    *,
    position: float | None = None,
    speed: float | None = None,
    by_voltage: bool = False,
    jobs: int = 1,
) -> Trace:
    """The free run of a model under a recording's inputs.

    position, speed: of the start, m and m/s (None: as measured; of free wheels, the speed that fits best); by_voltage:
    the recorded phase voltages drive the motor, not its currents; jobs: threads.
    Returns a Trace: t in s, y_simulated and y_measured in m, velocity_simulated in m/s, (n,) each; by voltage its
    phase_currents, (3, n) in A, are simulated. Raises DataError where the recording lacks the channels that the model
    needs, UsageError by voltage for a model that knows no windings.
    """
    with one_thread():
        if by_voltage:
            return run_by_voltage(fit.result, recording, position=position, speed=speed)
        return free_run(fit.result, recording, position=position, speed=speed, jobs=jobs)


def follow(
    fit: Fit,
    recording: Recording,
    controller: Controller | str | Path,
    *,
    position: float | None = None,
    speed: float | None = None,
) -> ClosedLoop:
    """A model in the drive's cascade (position P, velocity PI, current limit) that follows a recording's reference.

    recording: its `reference`, else its `y`, is the commanded position in m; controller: or the path of its YAML;
    position, speed: of the start in m and m/s (None: where the reference begins, at rest). Returns a ClosedLoop: t in
    s, reference, y and following_error in m, v in m/s, current in A, (n,) each. Raises ConfigError for the controller,
    UsageError for a model without motor.
    """
    from linid.simulation.controller import Controller, load_controller

    loops = controller if isinstance(controller, Controller) else load_controller(controller)
    with one_thread():
        return in_closed_loop(fit.result, recording, loops, position=position, speed=speed)


def refit_unit(
    campaign: Campaign, unit: str | Path | FunctionalUnit, progress: Callable[[int, int], None] | None = None
) -> UnitFit:
    """An FMU with the free parameters that its YAML file names (`free: {mass: [0.5, 2.0]}`) identified on the campaign.

    unit: that file, or the unit that it describes; progress: called with the simulations done and the most there can
    be. Returns UnitFit: the unit for `simulated_by`, the values with their intervals. Raises UsageError where nothing
    is free, and as `simulated_by`.
    """
    from linid.identification.refit_unit import refit_unit as refit

    return refit(_unit_of(unit), campaign.recordings, progress)


def _unit_of(unit: str | Path | FunctionalUnit) -> FunctionalUnit:
    from linid.simulation.functional_unit import FunctionalUnit, load_unit

    return unit if isinstance(unit, FunctionalUnit) else load_unit(unit)


def simulated_by(
    campaign: Campaign, unit: str | Path | FunctionalUnit, done: Callable[[Recording, Array], None] | None = None
) -> Campaign:
    """The campaign with the motions that an FMU has of its recordings beside them, for `diagnose(simulated=True)`.

    unit: an FMU (co-simulation, FMI 2.0 or 3.0) with the variables of linid's exports, a YAML file that names them, or
    one that `refit_unit` returns;
    done: called with each recording and its simulated position (n,) in m (rotary: rad), as they come. It runs in a
    process of its own. Raises UsageError or ConfigError for the unit, DataError where it fails, crashes or diverges.
    """
    from linid.simulation.functional_unit import simulate_by_unit

    out = []
    for recording, y in simulate_by_unit(_unit_of(unit), campaign.recordings):
        out.append(replace(recording, simulated=y))
        if done is not None:
            done(recording, y)
    return replace(campaign, recordings=tuple(out))


def diagnose(
    campaign: Campaign,
    model: str | None = None,
    *,
    since: Fit | None = None,
    simulated: bool = False,
    jobs: int = 1,
    progress: Progress | None = None,
    means: Means | None = None,
    **settings: Any,
) -> Diagnosed:
    """Where the simulation differs from the machine, which effects are missing, how far the gap shrinks with them.

    model: of the base (None: what the recordings allow); since: an earlier fit that is the base as it stands, so that
    what has changed since is named too; simulated: whether the base is what stands for the simulation of your own that
    the recordings have beside them; jobs: threads; progress(stage, done, total); means: in place
    of these two and the seed, with a memory of finished steps and workers elsewhere; settings: as in `--config`, of
    which count `effects` that the base has already, `without` (effects of the library that are left out of
    consideration), `known` and `mass` in SI besides what the campaign knows, and `seed`. Held-out recordings judge.
    Returns Diagnosed. Raises UsageError without held-out recordings, DataError for unfit ones.
    """
    from linid.diagnosis.diagnose import diagnose as find_effects
    from linid.diagnosis.foreign import stand_in
    from linid.diagnosis.means import Means

    chosen = make_settings(settings)
    kind = since.model if since is not None else base_kind(campaign.recordings) if model is None else model
    means = means or Means(jobs=jobs, seed=chosen.seed, progress=progress)
    known = chosen.known_values(campaign.known)
    words: tuple[str, ...] = ()
    with one_thread():
        if simulated:
            own = stand_in(campaign.name, campaign.recordings, kind, known, means)
            since, words = Fit(own.model), own.words()
        found = find_effects(
            campaign.name,
            campaign.recordings,
            kind,
            effects=chosen.effects,
            without=chosen.without,
            known=known,
            since=None if since is None else since.result,
            means=means,
        )
    told = replace(found.diagnosis, assumptions=(*words, *found.diagnosis.assumptions))
    return Diagnosed(replace(found, diagnosis=told))


def compensate(
    diagnosed: Diagnosed, campaign: Campaign, controller: Controller | str | Path | None = None, *, jobs: int = 1
) -> Diagnosed:
    """A diagnosis with what its effects cost in following error, and what a feed-forward would save.

    campaign: that was diagnosed, whose logged references, or travel and speeds, are commanded; controller: the drive's
    loops, or the path of their YAML (None: linid's default, its velocity gain suited to the axis); jobs: threads, which
    never change a result. The feed-forward is that of `linid export --to twincat`. Returns Diagnosed with
    `found.diagnosis.compensation`, which says why where there is no figure. Raises ConfigError for the controller.
    """
    from linid.simulation.controller import Controller, load_controller

    loops = controller if controller is None or isinstance(controller, Controller) else load_controller(controller)
    with one_thread():
        return Diagnosed(compensated(diagnosed.found, campaign.recordings, loops, jobs))


def survey_exports(diagnosed: Diagnosed, campaign: Campaign, *, jobs: int = 1) -> Diagnosed:
    """A diagnosis with what each target of `linid export` would keep of the closed gap, on the held-out recordings.

    jobs: threads. Returns Diagnosed with `found.diagnosis.exports`, empty where no effect was named. Raises UsageError
    or DataError where a recording lacks what the model needs.
    """
    with one_thread():
        return Diagnosed(surveyed(diagnosed.found, campaign.recordings, jobs))
