"""The state of a global search, from which it goes on to the same result."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from linid.identification.result import Generation


@dataclass
class SearchState:
    """All that is needed to go on: population, costs, best so far, random state and history (JSON-able).

    starts: first candidates that lay in minima of their own, as least squares left them; start_offsets: those of each
    with which these ended, empty where they were taken out linearly.
    """

    method: str
    generation: int
    population: list[list[float]]
    costs: list[float]
    best: list[float]
    best_cost: float
    stalled: int
    evaluations: int
    random_state: Any
    extra: dict[str, Any] = field(default_factory=dict)
    history: list[list[float]] = field(default_factory=list)
    starts: list[list[float]] = field(default_factory=list)
    start_offsets: list[list[float]] = field(default_factory=list)

    def generations(self) -> tuple[Generation, ...]:
        """The convergence history."""
        return tuple(Generation(self.method, int(g), int(n), b, m) for g, n, b, m in self.history)
