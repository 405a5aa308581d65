"""A finished fit as a FitResult: estimates, residuals, what warns, and how the search went."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from linid.identification.derived_quantities import derived_quantities
from linid.identification.objectives.choose import window_steps
from linid.identification.objectives.free_run import FreeRun
from linid.identification.objectives.problem import Problem
from linid.identification.optimise.least_squares import LeastSquaresFit
from linid.identification.optimise.search_state import SearchState
from linid.identification.optimise.time_step import step_halving_error
from linid.identification.result import FitResult, Start
from linid.identification.settings import FitSettings
from linid.identification.space.search_space import SearchSpace
from linid.identification.uncertainty import field_phase
from linid.identification.uncertainty.covariance import Uncertainty
from linid.identification.uncertainty.estimates import make_estimates
from linid.identification.uncertainty.identifiability import inseparable_pairs
from linid.recording.recording import Recording

_CURRENTS = ": currents"  # after a recording's name: the residual of its winding currents
_LARGEST_STEP_ERROR = 0.1  # of the residuals' RMS: their squares then grow by 1 % at most
# A phase error d costs 1 - cos d of the force: 0.5 % at this many rad.
_LOOSE_PHASE = 0.1
_ALIGNED = (
    "the currents keep with the field: a phase error d and a force constant larger by 1/cos d look the same, and both "
    "intervals hold that; to tell them apart, move the axis under a constant current or feed one phase alone"
)


# Half a wave of the thrust over position, the least that shows its length: a shorter piece fits waves of any.
_LEAST_TRAVEL = 1.0  # pole pitches


@dataclass(frozen=True)
class Task:
    """What is fitted to, and how. substeps: internal steps per sample; reason: why the global search ended; warnings:
    so far; per_mass: no mass is known, forces are per unit of it."""

    recordings: Sequence[Recording]
    settings: FitSettings
    substeps: int
    reason: str
    warnings: tuple[str, ...] = ()
    per_mass: bool = False


def _starts(problem: Problem, solution: LeastSquaresFit) -> dict[str, Start]:
    starts, at = {}, 0
    for part in problem.parts:
        if isinstance(part, FreeRun):
            rows = part.starts(solution.offsets[None, at : at + part.nuisances])[0]
            for recording, row in zip(part.recordings, rows, strict=True):
                starts[recording.name] = Start(float(recording.t[0]), float(row[0]), float(row[1]), float("nan"))
        at += part.nuisances
    return starts


def assemble(
    task: Task, problem: Problem, searched: SearchState, solution: LeastSquaresFit, uncertainty: Uncertainty
) -> FitResult:
    """The result of a fit. searched: the last state of the global search; solution: of the least squares from there."""
    result = unchecked(task, problem, searched, solution, uncertainty)
    residual_rms = _residual_rms(problem, solution)
    step_error, complaint = _step_error(task, problem, solution, residual_rms)
    warnings = (*result.warnings, *complaint)
    return replace(result, residual_rms=residual_rms, step_error=step_error, warnings=warnings)


def unchecked(
    task: Task, problem: Problem, searched: SearchState, solution: LeastSquaresFit, uncertainty: Uncertainty
) -> FitResult:
    """As `assemble`, without what takes more simulations: residuals and the error of the internal step."""
    model = problem.space.model
    recordings = task.recordings
    axis = recordings[0].axis
    unit = next((r.input_unit for r in recordings if r.drive_input is not None), "A")
    estimates, fitted, covariance, correlation = make_estimates(
        problem.space, solution.point, uncertainty, axis, unit, task.per_mass
    )
    loose = uncertainty.aligned and _phase_is_loose(problem.space, uncertainty)
    result = FitResult(
        model=model.kind,  # type: ignore[arg-type]
        axis=axis,
        effects=model.effects,
        estimates=estimates,
        fitted=fitted,
        correlation=correlation,
        condition_number=uncertainty.condition_number,
        pairs=inseparable_pairs(estimates, fitted, correlation, _balanced(recordings), axis, model.kind),
        starts=_starts(problem, solution),
        objectives={
            r.name: part.name for part in problem.parts if part.name != "winding_currents" for r in part.recordings
        },
        residual_rms={},
        history=searched.generations() + solution.history,
        stop_reasons=(task.reason, solution.reason),
        converged=solution.converged,
        seed=task.settings.search.seed,
        evaluations=solution.evaluations,
        substeps=task.substeps,
        step_error=math.nan,
        warnings=(
            *task.warnings,
            *((_ALIGNED,) if loose else ()),
            *little_travel(recordings, {e.name: e.value for e in estimates if e.status != "fixed"}),
        ),
        per_mass=task.per_mass,
        input_unit=unit,
        covariance=covariance,
        settings=task.settings.stored(),
        winding=model.winding,
        law=model.law,
    )
    return replace(result, derived=derived_quantities(result, recordings))


def _residual_rms(problem: Problem, solution: LeastSquaresFit) -> dict[str, float]:
    """RMS of the residuals of each recording, currents of windings apart."""
    out = {}
    rows = problem.residuals(solution.point[None, :], solution.offsets[None, :])
    for part, row in zip(problem.parts, rows, strict=True):
        owner = part.group_recording[part.groups]
        for index, recording in enumerate(part.recordings):
            label = recording.name + (_CURRENTS if part.name == "winding_currents" else "")
            out[label] = float(np.sqrt(np.mean(row[0][owner == index] ** 2)))
    return out


def _step_error(
    task: Task, problem: Problem, solution: LeastSquaresFit, residual_rms: Mapping[str, float]
) -> tuple[float, tuple[str, ...]]:
    """What halving the internal step changes, RMS, and a warning where that is no trifle beside the residuals."""
    model, vector = problem.space.model, problem.space.vectors(solution.point)
    steps = window_steps(task.settings, task.substeps)
    error = step_halving_error(replace(model, winding=""), task.recordings, vector, steps, task.settings.jobs)
    usual = float(np.median([x for label, x in residual_rms.items() if not label.endswith(_CURRENTS)]))
    if error <= _LARGEST_STEP_ERROR * usual:
        return error, ()
    command = "fit-friction" if model.kind == "friction" else "fit-motor"
    return error, (
        f"halving the internal step moves the predictions by {error:.2g} RMS; fit the model by "
        f"linid {command} --substeps {2 * steps}",
    )


def little_travel(recordings: Sequence[Recording], fitted: Mapping[str, float]) -> tuple[str, ...]:
    """A warning where the driven recordings travel too little of the motor's field to tell its period.

    fitted: identified parameters in SI by name; of motors with a field the wavenumber in rad/m is among them, unless it
    was given.
    """
    wavenumber = fitted.get("electrical_wavenumber")
    driven = [r for r in recordings if r.phase_currents is not None]
    if wavenumber is None or not driven:
        return ()
    reach = max(float(r.y.max()) for r in driven) - min(float(r.y.min()) for r in driven)
    travelled = abs(wavenumber) * reach / np.pi
    if travelled >= _LEAST_TRAVEL:
        return ()
    return (
        f"the driven recordings travel {travelled:.2f} pole pitches of the fitted field: motors with other pitches "
        "and force constants may move the axis likewise; record moves over two pole pitches or more, or hold "
        "what is known (--known electrical_wavenumber=VALUE)",
    )


def _phase_is_loose(space: SearchSpace, uncertainty: Uncertainty) -> bool:
    """Whether the interval of the field's phase is wide enough to move the force constant."""
    pair = field_phase.columns(space)
    if pair is None or pair[1] not in uncertainty.intervals:
        return False
    searched = space.parameters[pair[1]]
    low, high = uncertainty.intervals[pair[1]]
    return bool(space.model.turns * (high - low) * (searched.upper - searched.lower) > 2.0 * _LOOSE_PHASE)


def _balanced(recordings: Sequence[Recording]) -> bool:
    """Whether the phase currents sum to (nearly) zero in all driven recordings."""
    total = each = 0.0
    for recording in recordings:
        if recording.phase_currents is not None and recording.kind != "free_wheel":
            total += float(np.sum(np.sum(recording.phase_currents, axis=0) ** 2))
            each += float(np.sum(recording.phase_currents**2))
    return each > 0.0 and total < 0.01 * each
