"""How to fit, and the outside world of a fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from linid.identification.ahead import HORIZON
from linid.identification.genetic import SearchSettings, SearchState
from linid.identification.polish import POLISH_TOLERANCE

Objective = Literal["auto", "free_run", "ahead", "acceleration"]
Progress = Callable[[str, int, int, float], None]


@dataclass(frozen=True)
class FitSettings:
    """How to fit. objective auto: free_run for free wheels, ahead for driven runs; bounds, fixed: SI values
    by parameter name; free_exponent: search alpha too; stribeck: False ties F_S to F_C (Coulomb and viscous
    friction only); profiles: parameters whose profile likelihood is computed; polish_tolerance: relative change of
    cost or genes that ends a round of the polish; jobs: threads, never changes a result."""

    search: SearchSettings = field(default_factory=SearchSettings)
    objective: Objective = "auto"
    horizon: float = HORIZON
    substeps: int | None = None
    free_exponent: bool = False
    stribeck: bool = True
    bounds: dict[str, tuple[float, float]] = field(default_factory=dict)
    fixed: dict[str, float] = field(default_factory=dict)
    jobs: int = 1
    polish_rounds: int = 10
    polish_tolerance: float = POLISH_TOLERANCE
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
