"""By what means a diagnosis is computed; they never change what it finds, but for the seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from linid.diagnosis.balance import Memory
from linid.parallel_tasks import Workers

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Means:
    """jobs: threads; workers: who does the fits of a step and the measures instead of threads here; seed: of all that
    is drawn; memory: fits that an earlier run finished, and where new ones are kept; progress: called with the stage
    and how much of it is done; told: called with what is known before the rest is, a line."""

    jobs: int = 1
    workers: Workers | None = None
    seed: int = 1
    memory: Memory | None = None
    progress: Progress | None = None
    told: Callable[[str], None] | None = None

    def watch(self, stage: str, done: int, total: int) -> None:
        """Tell how far a stage is."""
        if self.progress is not None:
            self.progress(stage, done, total)

    def tell(self, line: str) -> None:
        """Say what is known so far."""
        if self.told is not None:
            self.told(line)
