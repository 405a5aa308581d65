"""How to fit, and the outside world of a fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from linid.identification.optimise.search_state import SearchState

Objective = Literal["auto", "free_run", "ahead", "acceleration"]
Progress = Callable[[str, int, int, float], None]
HORIZON = 0.1  # s, how far the objective `ahead` looks
PLAIN = "plain"
SCRATCH = "scratch"


@dataclass(frozen=True)
class SearchSettings:
    """Budget and operators. method: genetic, cma, plain: a genetic algorithm from random candidates that uses all its
    generations, or scratch: from random candidates in stages; patience: generations without relative gain `tolerance`
    before the others stop; selection: tournament or roulette; crossover: simulated_binary, blend, two_point or uniform,
    of a share `crossover_rate` of the pairs; mutation: polynomial or gaussian, of each coordinate with probability
    `mutation_rate` (None: 1.5 of all)."""

    method: str = "genetic"
    population: int = 64
    generations: int = 120
    patience: int = 6
    tolerance: float = 1e-3
    selection: str = "tournament"
    tournament: int = 3
    crossover: str = "simulated_binary"
    crossover_rate: float = 0.9
    crossover_eta: float = 10.0
    mutation: str = "polynomial"
    mutation_rate: float | None = None
    mutation_eta: float = 20.0
    elite: int = 2
    seed: int = 1


@dataclass(frozen=True)
class Ending:
    """When least squares end. steps: at most; precision: when no step promises to lessen the weighted sum of squares by
    more (a parameter one standard deviation off its optimum weighs 1); valley_gain: when four steps have gained less,
    as along a valley in which the data hardly tell the parameters; cost: when it is no higher than this."""

    steps: int = 60
    precision: float = 1e-4  # 1 % of a standard deviation; at 10 % all fits end on one side, which coverage shows
    valley_gain: float = 0.0
    cost: float = 0.0


@dataclass(frozen=True)
class FitSettings:
    """How to fit. objective auto: free_run for free wheels, ahead for driven runs; bounds, fixed: SI values
    by parameter name; free_exponent: search alpha too; stribeck: False ties F_S to F_C (Coulomb and viscous
    friction only); profiles: parameters whose profile likelihood is computed; proportions: SI values of
    coefficients of own terms, whose ratios are kept; least_squares_steps,
    least_squares_precision: when the least squares ends (see `levenberg_marquardt`); verify_search: look for the
    minimum again by a search from scratch; jobs: threads, never changes a result."""

    search: SearchSettings = field(default_factory=SearchSettings)
    objective: Objective = "auto"
    horizon: float = HORIZON
    substeps: int | None = None
    free_exponent: bool = False
    stribeck: bool = True
    bounds: dict[str, tuple[float, float]] = field(default_factory=dict)
    fixed: dict[str, float] = field(default_factory=dict)
    jobs: int = 1
    least_squares_steps: int = Ending.steps
    least_squares_precision: float = Ending.precision
    profiles: tuple[str, ...] = ()
    proportions: dict[str, float] = field(default_factory=dict)
    verify_search: bool = False

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
