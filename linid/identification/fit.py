"""Fits: recordings in, FitResult out. Friction first, then the motor with friction identified again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from linid.identification.derived_quantities import derived_quantities
from linid.identification.guess.first_values import first_values, guess_effects, mass_known, seed_candidates
from linid.identification.objectives.acceleration import Acceleration
from linid.identification.objectives.choose import FULL, Look, check_recordings, make_parts, window_steps, without_rest
from linid.identification.objectives.free_run import FreeRun
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.genetic import PLAIN, SearchState, search
from linid.identification.optimise.irls import polish_in_rounds
from linid.identification.optimise.least_squares import PolishResult, polish
from linid.identification.optimise.time_step import choose_substeps, step_halving_error
from linid.identification.result import FitResult, Generation, ModelKind, Profile, Start
from linid.identification.settings import FitSettings, Hooks
from linid.identification.space.bounds import build_space
from linid.identification.space.search_space import SearchSpace
from linid.identification.uncertainty import field_phase
from linid.identification.uncertainty.covariance import Uncertainty, estimate_uncertainty
from linid.identification.uncertainty.estimates import make_estimates
from linid.identification.uncertainty.identifiability import inseparable_pairs, without_effect
from linid.identification.uncertainty.profile import check_profile, profile_likelihood
from linid.identification.uncertainty.simex import without_noise_bias
from linid.identification.uncertainty.voltage_noise import without_voltage_noise
from linid.physics.effects.effect import Values
from linid.physics.model import Model
from linid.recording.recording import Recording

Array = NDArray[np.float64]


def fit(
    kind: ModelKind,
    recordings: Sequence[Recording],
    *,
    settings: FitSettings | None = None,
    effects: tuple[str, ...] = (),
    known: dict[str, float] | None = None,
    start: FitResult | None = None,
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
    given, findable = mass_known(recordings, fixed, model)
    per_mass = False
    if not given and not findable:
        if start is not None and not start.per_mass:
            fixed["mass"] = start.value("mass")
            warnings.append("the mass is that of the friction result: these recordings cannot tell it")
        else:
            fixed["mass"], per_mass = 1.0, True
            mass, scale = ("inertia", "per kg m^2") if recordings[0].axis == "rotary" else ("mass", "per kilogram")
            warnings.append(
                f"no {mass} is known and the recordings cannot tell it: all forces are {scale} "
                f"(give --mass, or record free wheels with a known added {mass})"
            )
    first, densities = first_values(model, recordings, fixed, start)
    rivals: list[Values] = []
    if model.effects:
        (first, *rivals), structural = guess_effects(model, recordings, first, fixed, densities, settings)
        fixed = {**structural, **fixed}
    space = build_space(
        model, recordings, first, fixed, settings.bounds, settings.free_exponent, densities, settings.stribeck
    )
    for name in settings.profiles:
        check_profile(space, name)
    substeps = settings.substeps or choose_substeps(model, recordings, first)
    coarse_parts = make_parts(
        model,
        [without_rest(r) for r in recordings],
        settings,
        1,
        look=Look(_thinning(recordings), project=True, coarse=True),
    )
    coarse = Problem(space, coarse_parts)
    seeds = seed_candidates(space, model, recordings, first, densities, settings, rivals)
    state, reason, silent = _search(coarse, *seeds, settings, hooks)
    if silent:
        warnings.append("no effect on these recordings: " + ", ".join(silent))
    del coarse, coarse_parts  # of long recordings, each problem holds hundreds of MB
    looks = [(1, Look(_thinning(recordings), coarse=True)), (substeps, FULL)]
    return _refine(space, state, reason, recordings, settings, substeps, warnings, per_mass, hooks, looks)


def refine(
    space: SearchSpace,
    genes: Array,
    recordings: Sequence[Recording],
    *,
    settings: FitSettings | None = None,
    hooks: Hooks | None = None,
) -> FitResult:
    """Polish parameters that are nearly right, without a search: genes (p,) of a search space -> FitResult.

    Of many windows every fourth is looked at, so intervals are somewhat wider than those of `fit`.
    """
    settings = settings or FitSettings()
    vector = space.vectors(genes)[0]
    first = {p.name: float(vector[space.model.slot(p.name)]) for p in space.model.parameters}
    substeps = settings.substeps or choose_substeps(space.model, recordings, first)
    state = SearchState("none", 0, [], [], [float(g) for g in genes], float("nan"), 0, 0, None)
    return _refine(
        space,
        state,
        "no search: started from given values",
        recordings,
        settings,
        substeps,
        [],
        False,
        hooks or Hooks(),
        [(substeps, Look(_thinning(recordings)))],
    )


_PART_PRECISION, _PART_CREEP_GAIN = 0.3, 1.2  # of the polish on a part of the data
_CREEP_GAIN = 0.15
# Minima are rivals if they lie so far apart in the search box, and cost at most so many times the best.
APART, ALIKE = 0.02, 1.1

# A phase error d costs 1 - cos d of the force: 0.5 % at this many rad.
_LOOSE_PHASE = 0.1
_ALIGNED = (
    "the currents keep with the field: a phase error d and a force constant larger by 1/cos d look the same, and both "
    "intervals hold that; to tell them apart, move the axis under a constant current or feed one phase alone"
)


def _thinning(recordings: Sequence[Recording]) -> int:
    return 1 if sum(r.t.size for r in recordings) < 8000 else 4


def _refine(
    space: SearchSpace,
    state: SearchState,
    reason: str,
    recordings: Sequence[Recording],
    settings: FitSettings,
    substeps: int,
    warnings: list[str],
    per_mass: bool,
    hooks: Hooks,
    looks: Sequence[tuple[int, Look]],
) -> FitResult:
    """Polish the best candidate, estimate the uncertainty and put the result together.

    looks: the stages of the polish, each with its internal steps per sample; the last one gives the intervals.
    """
    stages = [Problem(space, make_parts(space.model, recordings, settings, steps, look=look)) for steps, look in looks]
    problem = stages[-1]
    polished = _polish_in_stages(stages, state, settings, hooks)
    del stages
    polished = without_noise_bias(problem, polished, seed=settings.search.seed)
    polished = without_voltage_noise(problem, polished)
    uncertainty = estimate_uncertainty(problem, polished, seed=settings.search.seed)
    profiles = _profiles(problem, polished, uncertainty, settings, hooks)
    result = _assemble(
        problem, polished, uncertainty, state, reason, settings, substeps, warnings, per_mass, recordings
    )
    return replace(result, profiles=profiles)


def _profiles(
    problem: Problem, polished: PolishResult, uncertainty: Uncertainty, settings: FitSettings, hooks: Hooks
) -> tuple[Profile, ...]:
    """The profile likelihoods that the settings ask for."""
    out = []
    for name in settings.profiles:

        def watch(done: int, total: int, name: str = name) -> None:
            if hooks.progress is not None:
                hooks.progress(f"profile of {name}", done, total, polished.cost)

        out.append(profile_likelihood(problem, polished, uncertainty, name, watch=watch))
    return tuple(out)


def _search(
    problem: Problem, starts: Array, others: Array, settings: FitSettings, hooks: Hooks
) -> tuple[SearchState, str, tuple[str, ...]]:
    """starts (S, p) are polished first: what is left to the search is to look for other minima. The plain genetic
    algorithm knows none of them."""
    cost = Cost(problem)
    silent = without_effect(problem.space, cost, starts[0])
    seeds = np.vstack([starts, others])
    polished = None
    if settings.search.method == PLAIN:
        seeds = np.empty((0, seeds.shape[1]))
    elif hooks.resume is None:

        def told(done: int, value: float) -> None:
            if hooks.progress is not None:
                hooks.progress("first polish", done, starts.shape[0], value)

        polished = polish_starts_of_search(problem, cost, starts, told)
        seeds = np.vstack([polished, seeds])
        values = cost(polished)
        polished = polished[values <= ALIKE * np.min(values)]

    def watch(state: SearchState) -> None:
        if hooks.save is not None:
            hooks.save(state)
        if hooks.progress is not None:
            hooks.progress(state.method, state.generation, settings.search.generations, state.best_cost)

    state, reason = search(
        cost,
        seeds,
        len(problem.space.genes),
        settings.search,
        starts=polished,
        spent=cost.evaluations,
        resume=hooks.resume,
        watch=watch,
    )
    return state, reason, silent


def polish_starts_of_search(
    problem: Problem, cost: Cost, starts: Array, watch: Callable[[int, float], None] | None = None
) -> Array:
    """First candidates (S, p), each polished on the problem of the search; watch: called with number and cost."""
    rows = []
    for number, start in enumerate(starts):
        rows.append(
            polish(problem, cost, start, steps=20, precision=_PART_PRECISION, creep=_PART_CREEP_GAIN, final=False)
        )
        if watch is not None:
            watch(number + 1, rows[-1].cost)
    return np.array([row.genes for row in rows])


def _polish_in_stages(
    stages: Sequence[Problem], state: SearchState, settings: FitSettings, hooks: Hooks
) -> PolishResult:
    """Polish the best candidate on the thinned problem first, then on all data.

    Rivals that the coarse look could hardly tell apart are compared on the thinned problem.
    """
    genes = np.array(state.best)
    evaluations = state.evaluations
    if all(isinstance(part, Acceleration) for part in stages[-1].parts):
        cost = Cost(stages[-1])
        genes = polish_in_rounds(cost, genes, rounds=10, evaluations=15, tolerance=1e-6)
        evaluations += cost.evaluations
    offsets = None
    total = settings.polish_steps * len(stages)
    history: tuple[Generation, ...] = ()
    for number, problem in enumerate(stages):
        cost = Cost(problem)
        cost.evaluations = evaluations

        def watch(done: int, value: float, before: int = number * settings.polish_steps) -> None:
            if hooks.progress is not None:
                hooks.progress("polish", before + done, total, value)

        last = number == len(stages) - 1
        rivals = [genes]
        if number == 0 and not last:
            rivals += [x for x in map(np.array, state.starts) if np.max(np.abs(x - genes)) > APART]
        polished = min(
            (
                polish(
                    problem,
                    cost,
                    rival,
                    offsets,
                    steps=settings.polish_steps,
                    watch=watch,
                    final=last,
                    precision=settings.polish_precision if last else max(settings.polish_precision, _PART_PRECISION),
                    creep=_CREEP_GAIN if last else _PART_CREEP_GAIN,
                )
                for rival in rivals
            ),
            key=lambda result: result.cost,
        )
        evaluations = cost.evaluations
        genes, offsets = polished.genes, polished.offsets
        # The thinned problem has a cost of its own, which must not be read against the next.
        stage = "polish" if last else "polish of a part"
        history += tuple(replace(row, stage=stage) for row in polished.history)
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
    problem: Problem,
    polished: PolishResult,
    uncertainty: Uncertainty,
    state: SearchState,
    reason: str,
    settings: FitSettings,
    substeps: int,
    warnings: list[str],
    per_mass: bool,
    recordings: Sequence[Recording],
) -> FitResult:
    model = problem.space.model
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
            label = f"{recording.name}: currents" if part.name == "winding_currents" else recording.name
            residual_rms[label] = float(np.sqrt(np.mean(row[0][owner == index] ** 2)))
    history: tuple[Generation, ...] = state.generations() + polished.history
    vector = problem.space.vectors(polished.genes)
    steps = window_steps(settings, substeps)
    step_error = step_halving_error(replace(model, winding=""), recordings, vector, steps, settings.jobs)
    usual = float(np.median([x for label, x in residual_rms.items() if not label.endswith(": currents")]))
    if step_error > 0.1 * usual:
        command = "fit-friction" if model.kind == "friction" else "fit-motor"
        warnings.append(
            f"halving the internal step moves the predictions by {step_error:.2g} RMS; fit the model by "
            f"linid {command} --substeps {2 * steps}"
        )
    if uncertainty.aligned and _phase_is_loose(problem.space, uncertainty):
        warnings.append(_ALIGNED)
    result = FitResult(
        model=model.kind,  # type: ignore[arg-type]
        axis=axis,
        effects=model.effects,
        estimates=estimates,
        fitted=fitted,
        correlation=correlation,
        condition_number=uncertainty.condition_number,
        pairs=inseparable_pairs(estimates, fitted, correlation, balanced, axis, model.kind),
        starts=_starts(problem, polished),
        objectives={
            r.name: part.name for part in problem.parts if part.name != "winding_currents" for r in part.recordings
        },
        residual_rms=residual_rms,
        history=history,
        stop_reasons=(reason, polished.reason),
        converged=polished.converged,
        seed=settings.search.seed,
        evaluations=polished.evaluations,
        substeps=substeps,
        step_error=step_error,
        warnings=tuple(warnings),
        per_mass=per_mass,
        input_unit=unit,
        covariance=covariance,
        settings=settings.stored(),
        winding=model.winding,
    )
    return replace(result, derived=derived_quantities(result, recordings))


def _phase_is_loose(space: SearchSpace, uncertainty: Uncertainty) -> bool:
    """Whether the interval of the field's phase is wide enough to move the force constant."""
    pair = field_phase.columns(space)
    if pair is None or pair[1] not in uncertainty.intervals:
        return False
    gene = space.genes[pair[1]]
    low, high = uncertainty.intervals[pair[1]]
    return bool(space.model.turns * (high - low) * (gene.upper - gene.lower) > 2.0 * _LOOSE_PHASE)


def _balanced(recordings: Sequence[Recording]) -> bool:
    """Whether the phase currents sum to (nearly) zero in all driven recordings."""
    total = each = 0.0
    for recording in recordings:
        if recording.phase_currents is not None and recording.kind != "free_wheel":
            total += float(np.sum(np.sum(recording.phase_currents, axis=0) ** 2))
            each += float(np.sum(recording.phase_currents**2))
    return each > 0.0 and total < 0.01 * each
