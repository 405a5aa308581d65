"""Fits: recordings in, FitResult out. Friction first, then the motor with friction identified again."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from linid.errors import DataError, UsageError
from linid.identification import seed as guess
from linid.identification.estimates import make_estimates
from linid.identification.genes import SearchSpace
from linid.identification.genetic import SearchSettings, SearchState, search
from linid.identification.identifiability import inseparable_pairs, without_effect
from linid.identification.motion import measure_motion
from linid.identification.parts import HORIZON, Acceleration, Ahead, FreeRun, Part
from linid.identification.polish import PolishResult, polish
from linid.identification.problem import Cost, Problem
from linid.identification.result import FitResult, Generation, ModelKind, Start
from linid.identification.space import build_space
from linid.identification.steps import choose_substeps, step_halving_error
from linid.identification.uncertainty import estimate_uncertainty
from linid.physics.model import Model
from linid.recording.recording import Recording

Array = NDArray[np.float64]
Objective = Literal["auto", "free_run", "ahead", "acceleration"]
Progress = Callable[[str, int, int, float], None]


@dataclass(frozen=True)
class FitSettings:
    """How to fit. objective auto: free_run for free wheels, ahead for driven runs; bounds, fixed: SI values
    by parameter name; free_exponent: search alpha too; stribeck: False ties F_S to F_C (Coulomb and viscous
    friction only); jobs: threads, never changes a result."""

    search: SearchSettings = field(default_factory=SearchSettings)
    objective: Objective = "auto"
    horizon: float = HORIZON
    substeps: int | None = None
    free_exponent: bool = False
    stribeck: bool = True
    bounds: dict[str, tuple[float, float]] = field(default_factory=dict)
    fixed: dict[str, float] = field(default_factory=dict)
    jobs: int = 1
    polish_rounds: int = 6

    def stored(self) -> dict[str, Any]:
        """The settings that decide the result, for the model file (no jobs)."""
        out = asdict(self)
        del out["jobs"]
        return out


@dataclass(frozen=True)
class Hooks:
    """Outside world of a fit: progress(stage, done, total, best), save(state) after each generation, and the
    state to resume from."""

    progress: Progress | None = None
    save: Callable[[SearchState], None] | None = None
    resume: SearchState | None = None


@dataclass(frozen=True)
class Look:
    """How closely to look: every `thin`-th window, start states taken out linearly."""

    thin: int = 1
    project: bool = False


FULL = Look()


def make_parts(
    model: Model, recordings: Sequence[Recording], settings: FitSettings, substeps: int, *, look: Look = FULL
) -> tuple[Part, ...]:
    """The objectives: free wheels and driven runs may follow different ones."""
    free = tuple(r for r in recordings if r.kind == "free_wheel")
    driven = tuple(r for r in recordings if r.kind != "free_wheel")
    chosen = settings.objective
    parts: list[Part] = []
    for group, automatic in ((free, "free_run"), (driven, "ahead")):
        if not group:
            continue
        objective = automatic if chosen == "auto" else chosen
        if objective == "free_run":
            # Coast-downs are so free of noise that a coarse step would bias them by more than their interval.
            steps = substeps if look.project else max(substeps, 4)
            parts.append(FreeRun(model, group, steps, settings.jobs, look.project))
        elif objective == "ahead":
            parts.append(Ahead(model, group, min(substeps, 2), settings.jobs, settings.horizon, look.thin))
        else:
            parts.append(Acceleration(model, group, settings.jobs))
    return tuple(parts)


def _without_rest(recording: Recording) -> Recording:
    """A free wheel cut 0.15 s after it came to rest: what follows costs time and tells nothing."""
    if recording.kind != "free_wheel":
        return recording
    moving = np.flatnonzero(~measure_motion([recording]).standstill)
    end = int(moving[-1]) + round(0.15 / recording.period) if moving.size else recording.t.size
    end = max(min(end, recording.t.size), min(50, recording.t.size))
    return replace(
        recording, t=recording.t[:end], y=recording.y[:end], v=None, phase_currents=None, drive_input=None
    )


def check_recordings(recordings: Sequence[Recording], model: Model) -> None:
    """Refuse recordings that the model cannot be fitted to; raises DataError or UsageError."""
    if not recordings:
        raise UsageError("FILE", "there is no recording to fit", "Give at least one recording, or a campaign with `split: fit`")
    for recording in recordings:
        if recording.t.size < 50:
            raise DataError(
                recording.name, f"has {recording.t.size} samples, at least 50 are needed for a fit",
                "Record longer or at a higher rate",
            )
    driven = [r for r in recordings if r.kind != "free_wheel"]
    if model.kind in ("sine", "theta"):
        if not driven:
            raise UsageError("--model", f"{model.kind} needs driven recordings, all are free wheels", "Add recordings with phase currents")
        for recording in driven:
            if recording.phase_currents is None:
                raise DataError(
                    recording.name, f"the {model.kind} model needs three phase currents, the recording has none",
                    "Map them with channels: current_u, current_v, current_w, or use --model force",
                )
    if model.kind == "force":
        for recording in driven:
            if recording.drive_input is None:
                raise DataError(
                    recording.name, "the force model needs a q-current or command, the recording has none",
                    "Map it with channels: current_q or command, or use --model sine",
                )


def _first_values(
    model: Model, recordings: Sequence[Recording], known: dict[str, float], start: FitResult | None
) -> tuple[dict[str, float], tuple[float, ...]]:
    """First guesses of all parameters, from the friction result where there is one, else by regression."""
    free = [r for r in recordings if r.kind == "free_wheel"]
    driven = [r for r in recordings if r.kind != "free_wheel"]
    values: dict[str, float] = {}
    densities: tuple[float, ...] = ()
    mass = known.get("mass")
    if start is not None:
        values = {e.name: e.value for e in start.estimates}
        mass = mass if mass is not None else values.get("mass")
    if free and start is None:
        values.update(guess.free_wheel_guess(free, mass))
        mass = values["mass"]
    if driven and model.kind == "force":
        values = {**guess.force_guess(driven, known.get("force_constant"), mass), **values}
    elif driven and model.kind in ("sine", "theta"):
        scale = 2.0 if model.kind == "theta" else 1.0
        given = known.get("guideway_density")
        motor, densities = guess.phase_guess(
            driven, mass if mass is not None else 1.0, 20.0, 1500.0, None if given is None else given * scale
        )
        if model.kind == "theta":
            motor = _as_theta(motor, known)
        densities = tuple(d / scale for d in densities)
        values = {**motor, **values, **{k: motor[k] for k in ("force_constant", "shift")}}
    return {**values, **known}, densities


def _as_theta(sine: dict[str, float], known: dict[str, float]) -> dict[str, float]:
    nome, length = known.get("nome", 0.5), known.get("winding_length", 0.25 * math.pi)
    out = dict(sine)
    for name in ("guideway_density", "winding_displacement", "shift"):
        out[name] = 0.5 * sine[name]
    out["force_constant"] = sine["force_constant"] / (8.0 * nome * math.sin(2.0 * length))
    out["nome"], out["winding_length"] = nome, length
    return out


def _mass_known(recordings: Sequence[Recording], known: dict[str, float], model: Model) -> tuple[bool, bool]:
    """Whether the mass is given, and whether it can be found from the data."""
    masses = {r.added_mass for r in recordings}
    free = {r.added_mass for r in recordings if r.kind == "free_wheel"}
    by_force = model.kind == "force" and "force_constant" in known
    return "mass" in known, len(free) > 1 or by_force or (len(masses) > 1 and model.kind != "friction")


def fit(
    kind: ModelKind, recordings: Sequence[Recording], *, settings: FitSettings | None = None,
    effects: tuple[str, ...] = (), known: dict[str, float] | None = None, start: FitResult | None = None,
    hooks: Hooks | None = None,
) -> FitResult:
    """Identify the parameters of a model from recordings (free wheels, driven runs or both).

    kind: friction, force, sine or theta; known: SI values that are not identified; start: an earlier
    (friction) result that gives first values and, where the data cannot tell it, the mass.
    Raises UsageError or DataError when the recordings do not fit the model.
    """
    settings = settings or FitSettings()
    hooks = hooks or Hooks()
    model = Model(kind, effects)
    check_recordings(recordings, model)
    fixed = {**(known or {}), **settings.fixed}
    warnings: list[str] = []
    given, findable = _mass_known(recordings, fixed, model)
    per_mass = False
    if not given and not findable:
        if start is not None and not start.per_mass:
            fixed["mass"] = start.value("mass")
            warnings.append("the mass is that of the friction result: these recordings cannot tell it")
        else:
            fixed["mass"], per_mass = 1.0, True
            warnings.append(
                "no mass is known and the recordings cannot tell it: all forces are per kilogram "
                "(give --mass, or record free wheels with a known added mass)"
            )
    first, densities = _first_values(model, recordings, fixed, start)
    space = build_space(model, recordings, first, fixed, settings.bounds, settings.free_exponent, densities, settings.stribeck)
    substeps = settings.substeps or choose_substeps(model, recordings, first)
    thin = 1 if sum(r.t.size for r in recordings) < 8000 else 4

    def problem_with(steps: int, look: Look) -> Problem:
        return Problem(space, make_parts(model, recordings, settings, steps, look=look))

    coarse_parts = make_parts(
        model, [_without_rest(r) for r in recordings], settings, min(substeps, 2), look=Look(thin, project=True)
    )
    coarse = Problem(space, coarse_parts)
    seeds = _seeds(space, model, recordings, first, densities, settings)
    state, reason, silent = _search(coarse, seeds, settings, hooks)
    stages = [problem_with(min(substeps, 2), Look(thin)), problem_with(substeps, FULL)]
    polished = _polish_in_stages(stages, state, settings, hooks)
    problem = stages[-1]
    if silent:
        warnings.append("no effect on these recordings: " + ", ".join(silent))
    return _assemble(problem, polished, state, reason, settings, substeps, warnings, per_mass, recordings)


def _seeds(
    space: SearchSpace, model: Model, recordings: Sequence[Recording], first: dict[str, float],
    densities: tuple[float, ...], settings: FitSettings,
) -> Array:
    """First candidates: the regression's guess, the same after a polish of the force balance, rival densities."""
    guess_row = space.encode(first)
    rows = [guess_row]
    driven = tuple(r for r in recordings if r.kind != "free_wheel")
    if driven:
        balance = Problem(space, (Acceleration(model, driven, settings.jobs, stride=10),))
        refined = polish(balance, Cost(balance), guess_row, rounds=2, max_evaluations=12)
        rows.insert(0, refined.genes)
    for density in densities[1:]:
        rows.append(space.encode({**first, "guideway_density": density}))
    return np.array(rows)


def _search(
    problem: Problem, seeds: Array, settings: FitSettings, hooks: Hooks
) -> tuple[SearchState, str, tuple[str, ...]]:
    cost = Cost(problem)
    silent = without_effect(problem.space, cost, seeds[0])

    def watch(state: SearchState) -> None:
        if hooks.save is not None:
            hooks.save(state)
        if hooks.progress is not None:
            hooks.progress(state.method, state.generation, settings.search.generations, state.best_cost)

    state, reason = search(
        cost, seeds, len(problem.space.genes), settings.search, resume=hooks.resume, watch=watch
    )
    return state, reason, silent


def _polish_in_stages(
    stages: Sequence[Problem], state: SearchState, settings: FitSettings, hooks: Hooks
) -> PolishResult:
    """Polish the best candidate on the thinned problem first, then on all data."""
    genes = np.array(state.best)
    offsets = None
    total = settings.polish_rounds * len(stages)
    evaluations = state.evaluations
    history: tuple[Generation, ...] = ()
    for number, problem in enumerate(stages):
        cost = Cost(problem)
        cost.evaluations = evaluations

        def watch(done: int, value: float, before: int = number * settings.polish_rounds) -> None:
            if hooks.progress is not None:
                hooks.progress("polish", before + done, total, value)

        polished = polish(
            problem, cost, genes, offsets, rounds=settings.polish_rounds, watch=watch, final=number == len(stages) - 1
        )
        genes, offsets, evaluations = polished.genes, polished.offsets, polished.evaluations
        history += polished.history
    return replace(polished, history=history)


def _starts(problem: Problem, polished: PolishResult) -> dict[str, Start]:
    starts, at = {}, 0
    for part in problem.parts:
        if isinstance(part, FreeRun):
            rows = part.starts(polished.offsets[None, at : at + part.nuisances])[0]
            for recording, row in zip(part.recordings, rows, strict=True):
                starts[recording.name] = Start(float(recording.t[0]), float(row[0]), float(row[1]), float("nan"))
        at += part.nuisances
    return starts


def _assemble(
    problem: Problem, polished: PolishResult, state: SearchState, reason: str, settings: FitSettings, substeps: int,
    warnings: list[str], per_mass: bool, recordings: Sequence[Recording],
) -> FitResult:
    model = problem.space.model
    uncertainty = estimate_uncertainty(problem, polished)
    axis = recordings[0].axis
    unit = next((r.input_unit for r in recordings if r.drive_input is not None), "A")
    estimates, fitted, covariance, correlation = make_estimates(
        problem.space, polished.genes, uncertainty, axis, unit, per_mass
    )
    balanced = _balanced(recordings)
    rows = problem.residuals(polished.genes[None, :], polished.offsets[None, :])
    residual_rms = {}
    for part, row in zip(problem.parts, rows, strict=True):
        owner = part.group_recording[part.groups]
        for index, recording in enumerate(part.recordings):
            residual_rms[recording.name] = float(np.sqrt(np.mean(row[0][owner == index] ** 2)))
    history: tuple[Generation, ...] = state.generations() + polished.history
    vector = problem.space.vectors(polished.genes)
    step_error = step_halving_error(model, recordings, vector, substeps, settings.jobs)
    if step_error > 0.1 * float(np.median(list(residual_rms.values()))):
        warnings.append(
            f"halving the internal step moves the predictions by {step_error:.2g} RMS; give --substeps {2 * substeps}"
        )
    from linid.identification.meaning import derived_quantities

    result = FitResult(
        model=model.kind,  # type: ignore[arg-type]
        axis=axis, effects=model.effects, estimates=estimates, fitted=fitted, correlation=correlation,
        condition_number=uncertainty.condition_number, pairs=inseparable_pairs(fitted, correlation, balanced),
        starts=_starts(problem, polished),
        objectives={r.name: part.name for part in problem.parts for r in part.recordings},
        residual_rms=residual_rms, history=history, stop_reasons=(reason, polished.reason),
        converged=polished.converged, seed=settings.search.seed, evaluations=polished.evaluations, substeps=substeps,
        step_error=step_error, warnings=tuple(warnings), per_mass=per_mass, input_unit=unit, covariance=covariance,
        settings=settings.stored(),
    )
    return replace(result, derived=derived_quantities(result, recordings))


def _balanced(recordings: Sequence[Recording]) -> bool:
    """Whether the phase currents sum to (nearly) zero in all driven recordings."""
    total = each = 0.0
    for recording in recordings:
        if recording.phase_currents is not None and recording.kind != "free_wheel":
            total += float(np.sum(np.sum(recording.phase_currents, axis=0) ** 2))
            each += float(np.sum(recording.phase_currents**2))
    return each > 0.0 and total < 0.01 * each
