"""How to fit, and the outside world of a fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from linid.identification.objectives.ahead import HORIZON
from linid.identification.optimise.genetic import SearchSettings, SearchState
from linid.identification.optimise.least_squares import POLISH_PRECISION, POLISH_STEPS

Objective = Literal["auto", "free_run", "ahead", "acceleration"]
Progress = Callable[[str, int, int, float], None]


@dataclass(frozen=True)
class FitSettings:
    """How to fit. objective auto: free_run for free wheels, ahead for driven runs; bounds, fixed: SI values
    by parameter name; free_exponent: search alpha too; stribeck: False ties F_S to F_C (Coulomb and viscous
    friction only); profiles: parameters whose profile likelihood is computed; polish_steps, polish_precision: when
    the polish ends (see `polish`); jobs: threads, never changes a result."""

    search: SearchSettings = field(default_factory=SearchSettings)
    objective: Objective = "auto"
    horizon: float = HORIZON
    substeps: int | None = None
    free_exponent: bool = False
    stribeck: bool = True
    bounds: dict[str, tuple[float, float]] = field(default_factory=dict)
    fixed: dict[str, float] = field(default_factory=dict)
    jobs: int = 1
    polish_steps: int = POLISH_STEPS
    polish_precision: float = POLISH_PRECISION
    profiles: tuple[str, ...] = ()

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
