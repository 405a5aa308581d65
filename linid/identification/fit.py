"""Fits: recordings in, FitResult out. Friction first, then the motor with friction identified again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from linid.arrays import Array
from linid.errors import UsageError
from linid.identification.assemble import Task, unchecked
from linid.identification.guess.first_values import first_values, guess_effects, mass_known, seed_candidates
from linid.identification.minima import Freed, best_minimum, freed_of_noise
from linid.identification.objectives.choose import FULL, Look, check_recordings, coarse_parts, make_parts, thinning
from linid.identification.objectives.problem import Problem
from linid.identification.optimise.least_squares import LeastSquaresFit
from linid.identification.optimise.search_state import SearchState
from linid.identification.optimise.stages import least_squares_in_stages, predicts, search_at_random, search_from
from linid.identification.optimise.time_step import choose_substeps
from linid.identification.result import FitResult, ModelKind
from linid.identification.settings import SCRATCH, FitSettings, Hooks
from linid.identification.space.bounds import build_space
from linid.identification.space.proportions import Proportions, proportions_of
from linid.identification.space.scratch import scratch_space
from linid.identification.space.search_space import SearchSpace
from linid.identification.uncertainty.covariance import box_alone
from linid.identification.uncertainty.profile import check_profile
from linid.identification.unit_mass import ADDED, on_unit_mass
from linid.identification.verify import verified
from linid.physics.effects.effect import Values
from linid.physics.laws.registry import LUGRE
from linid.physics.model import Model
from linid.recording.recording import Recording


def fit(
    kind: ModelKind,
    recordings: Sequence[Recording],
    *,
    settings: FitSettings | None = None,
    effects: tuple[str, ...] = (),
    known: dict[str, float] | None = None,
    start: FitResult | None = None,
    hooks: Hooks | None = None,
    law: str = LUGRE,
) -> FitResult:
    """Identify the parameters of a model from recordings (free wheels, driven runs or both).

    kind: friction, force, sine or theta; known: SI values that are not identified; start: an earlier
    (friction) result that gives first values and, where the data cannot tell it, the mass; law: of friction.
    Raises UsageError or DataError when the recordings do not fit the model.
    """
    settings = settings or FitSettings()
    hooks = hooks or Hooks()
    model = Model(kind, effects, law=law)
    check_recordings(recordings, model)
    fixed = {**(known or {}), **settings.fixed}
    told, per_mass, warnings = _mass(recordings, model, fixed, start)
    fixed |= told
    common = 0.0
    if per_mass:
        recordings, common = on_unit_mass(recordings)
    shape = proportions_of(model, settings.proportions, fixed)
    fixed |= shape.values
    boxed = replace(settings, bounds={**shape.bounds, **settings.bounds})
    if settings.search.method == SCRATCH:
        if model.effects:
            raise UsageError("--method scratch", "knows no effects", "Take --method genetic, or fit without them.")
        space = replace(scratch_space(model, recordings, fixed, boxed), ties=shape.ties)
        starts = None
    else:
        space, starts = _begun(model, recordings, fixed, shape, boxed, start)
    for name in settings.profiles:
        check_profile(space, name)
    coarse = Problem(space, coarse_parts(model, recordings, settings))
    first_look = Look(thinning(recordings), coarse=True)
    state, reason, silent = (
        search_at_random(coarse, recordings, settings, hooks)
        if starts is None
        else search_from(coarse, _thinned(space, recordings, settings, first_look, start), *starts, settings, hooks)
    )
    if silent:
        warnings.append("no effect on these recordings: " + ", ".join(silent))
    del coarse  # of long recordings, each problem holds hundreds of MB
    substeps = settings.substeps or choose_substeps(model, recordings, space.values(np.array(state.best)))
    looks = [(1, first_look), (substeps, FULL)]
    task = Task(recordings, settings, substeps, reason, tuple(warnings), per_mass)
    found = _refine(task, space, state, looks, hooks)
    if settings.verify_search:
        found = verified(found, space, recordings, boxed, hooks)
    return replace(found, settings=found.settings | {ADDED: common}) if common else found


def _begun(
    model: Model,
    recordings: Sequence[Recording],
    fixed: dict[str, float],
    shape: Proportions,
    settings: FitSettings,
    start: FitResult | None,
) -> tuple[SearchSpace, tuple[Array, Array]]:
    """The search box about first values, and the first candidates in it (`seed_candidates`)."""
    first, densities = first_values(model, recordings, fixed, start)
    rivals: list[Values] = []
    if model.effects:
        (first, *rivals), preset = guess_effects(
            model, recordings, first, {**fixed, **shape.leaders}, densities, settings
        )
        fixed = {**preset, **fixed}
    space = build_space(
        model, recordings, first, fixed, settings.bounds, settings.free_exponent, densities, settings.stribeck
    )
    space = replace(space, ties=shape.ties)
    return space, seed_candidates(space, model, recordings, first, densities, settings, rivals)


def _thinned(
    space: SearchSpace, recordings: Sequence[Recording], settings: FitSettings, look: Look, start: FitResult | None
) -> Problem | None:
    """The problem on which first candidates are refined, None: on that of the search.

    Free wheels whose friction is not known are far off at first: there start states are taken out linearly.
    """
    if start is None and any(r.kind == "free_wheel" for r in recordings):
        return None
    problem = Problem(space, make_parts(space.model, recordings, settings, 1, look=look))
    return problem if predicts(problem) else None


def _mass(
    recordings: Sequence[Recording], model: Model, fixed: dict[str, float], start: FitResult | None
) -> tuple[dict[str, float], bool, list[str]]:
    """The mass where it is neither known nor to be found: that of the friction result, else one and all per mass."""
    given, findable = mass_known(recordings, fixed, model)
    if given or findable:
        return {}, False, []
    if start is not None and not start.per_mass:
        return (
            {"mass": start.value("mass")},
            False,
            ["the mass is that of the friction result: these recordings cannot tell it"],
        )
    mass, scale = ("inertia", "per kg m^2") if recordings[0].axis == "rotary" else ("mass", "per kilogram")
    return (
        {"mass": 1.0},
        True,
        [
            f"no {mass} is known and the recordings cannot tell it: all forces are {scale} "
            f"(give --mass, or record free wheels with a known added {mass})"
        ],
    )


def refine(
    space: SearchSpace,
    point: Array,
    recordings: Sequence[Recording],
    *,
    settings: FitSettings | None = None,
    hooks: Hooks | None = None,
) -> FitResult:
    """Refine parameters that are nearly right, without a search. point: (p,) coordinates in the search space.

    Of many windows every fourth is looked at, so intervals are somewhat wider than those of `fit`.
    """
    task, state, look = _without_search(space, point, recordings, settings or FitSettings())
    return _refine(task, space, state, [look], hooks or Hooks())


@dataclass(frozen=True)
class Refined:
    """A refined model before its intervals are known, which take as long as a fifth of the rest.

    task: what it was fitted to, and how; problem: of plain least squares, with their solution; state: where they began;
    freed: the solution freed of what noise does to it.
    """

    task: Task
    problem: Problem
    state: SearchState
    solution: LeastSquaresFit
    freed: Freed

    @property
    def ended(self) -> bool:
        """Whether more steps would change nothing."""
        return self.freed.solution.ended

    @property
    def bare(self) -> FitResult:
        """The model as if nothing but the search box told the parameters: to predict with."""
        nothing = box_alone(len(self.problem.space.names))
        return unchecked(self.task, self.problem, self.state, self.freed.solution, nothing)

    def with_intervals(self) -> FitResult:
        """The model as a fit gives it."""
        return best_minimum(self.task, self.problem, self.state, self.solution, Hooks(), self.freed)


def refined_values(space: SearchSpace, point: Array, recordings: Sequence[Recording], settings: FitSettings) -> Refined:
    """`refine` as far as the values. point: (p,) coordinates in the search space."""
    task, state, look = _without_search(space, point, recordings, settings)
    problem, solution = _solved(task, space, state, [look], Hooks())
    return Refined(task, problem, state, solution, freed_of_noise(task, problem, solution))


def _without_search(
    space: SearchSpace, point: Array, recordings: Sequence[Recording], settings: FitSettings
) -> tuple[Task, SearchState, tuple[int, Look]]:
    """What is asked of a fit that begins at given coordinates (p,), and what its least squares look at."""
    substeps = settings.substeps or choose_substeps(space.model, recordings, space.values(point))
    state = SearchState("none", 0, [], [], [float(g) for g in point], float("nan"), 0, 0, None)
    task = Task(recordings, settings, substeps, "no search: started from given values")
    return task, state, (substeps, Look(thinning(recordings)))


def _refine(
    task: Task, space: SearchSpace, state: SearchState, looks: Sequence[tuple[int, Look]], hooks: Hooks
) -> FitResult:
    """Least squares from the best candidate, its uncertainty, and the result put together. looks: as of `_solved`."""
    problem, solution = _solved(task, space, state, looks, hooks)
    return best_minimum(task, problem, state, solution, hooks)


def _solved(
    task: Task, space: SearchSpace, state: SearchState, looks: Sequence[tuple[int, Look]], hooks: Hooks
) -> tuple[Problem, LeastSquaresFit]:
    """Least squares from the best candidate, on all data.

    looks: the stages of the least squares, each with its internal steps per sample; the last one gives the intervals.
    """
    settings = task.settings
    stages = [
        Problem(space, make_parts(space.model, task.recordings, settings, steps, look=look)) for steps, look in looks
    ]
    return stages[-1], least_squares_in_stages(stages, state, settings, hooks)
